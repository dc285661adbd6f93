/* What the stand-in for rcl asks Cyclone DDS: may a process with this enclave join, may it have this endpoint.
 * As rmw_cyclonedds_cpp sets a participant up; traffic stays on loopback. PLUGINS: the folder of the security plugins. */
#include <dds/dds.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

static const char loopback[] = "<CycloneDDS><Domain Id='any'><General><Interfaces><NetworkInterface name='lo'/>"
  "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
  "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex></Discovery></Domain></CycloneDDS>";

struct text { char * data; };
static const uint32_t ops[] = {DDS_OP_ADR | DDS_OP_TYPE_STR, offsetof(struct text, data), DDS_OP_RTS};
static const dds_topic_descriptor_t any_type = {
  .m_size = sizeof(struct text), .m_align = sizeof(char *), .m_typename = "stand_in::msg::dds_::Any_", .m_nops = 2,
  .m_ops = ops, .m_meta = ""};
static dds_entity_t participant;

static void set_file(dds_qos_t * qos, const char * key, const char * folder, const char * name)
{
  char value[1200];
  snprintf(value, sizeof value, "file:%s/%s", folder, name);
  dds_qset_prop(qos, key, value);
}

static void set_plugin(dds_qos_t * qos, const char * kind, const char * library, const char * what)
{
  char key[100], value[100];
  snprintf(key, sizeof key, "dds.sec.%s.library.path", kind);
  dds_qset_prop(qos, key, library);
  snprintf(key, sizeof key, "dds.sec.%s.library.init", kind);
  snprintf(value, sizeof value, "init_%s", what);
  dds_qset_prop(qos, key, value);
  snprintf(key, sizeof key, "dds.sec.%s.library.finalize", kind);
  snprintf(value, sizeof value, "finalize_%s", what);
  dds_qset_prop(qos, key, value);
}

bool stand_in_join(const char * folder, unsigned domain)
{
  dds_qos_t * qos = dds_create_qos();
  set_file(qos, "dds.sec.auth.identity_ca", folder, "identity_ca.cert.pem");
  set_file(qos, "dds.sec.auth.identity_certificate", folder, "cert.pem");
  set_file(qos, "dds.sec.auth.private_key", folder, "key.pem");
  set_file(qos, "dds.sec.access.permissions_ca", folder, "permissions_ca.cert.pem");
  set_file(qos, "dds.sec.access.governance", folder, "governance.p7s");
  set_file(qos, "dds.sec.access.permissions", folder, "permissions.p7s");
  set_plugin(qos, "auth", PLUGINS "/libdds_security_auth.so", "authentication");
  set_plugin(qos, "crypto", PLUGINS "/libdds_security_crypto.so", "crypto");
  set_plugin(qos, "access", PLUGINS "/libdds_security_ac.so", "access_control");
  dds_create_domain(domain, loopback);
  participant = dds_create_participant(domain, qos, NULL);
  dds_delete_qos(qos);
  return participant > 0;
}

bool stand_in_endpoint(const char * name, bool writes)
{
  dds_entity_t topic = dds_create_topic(participant, &any_type, name, NULL, NULL);
  if (topic < 0)
    return false;
  return (writes ? dds_create_writer : dds_create_reader)(participant, topic, NULL, NULL) > 0;
}
