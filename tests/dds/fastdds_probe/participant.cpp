#include "participant.hpp"

#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "string_type.hpp"

namespace probe {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

constexpr uint32_t kPeersLookedFor = 60;  // participants on one host that can find each other

// An IPv4 address of the environment, for networks that a test made; else loopback.
std::string address(const char* variable) {
  const char* given = std::getenv(variable);
  return given ? given : "127.0.0.1";
}

rtps::Locator_t locator_of(const std::string& ip) {
  rtps::Locator_t locator;
  rtps::IPLocator::setIPv4(locator, ip);
  return locator;
}

// Traffic stays in one network: UDP only, no multicast, peers are looked for at one address.
void stay_in_one_network(dds::DomainParticipantQos& qos) {
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.push_back(address("PROBE_ADDRESS"));
  udp->maxInitialPeersRange = kPeersLookedFor;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.metatrafficUnicastLocatorList.push_back(locator_of(address("PROBE_ADDRESS")));
  builtin.initialPeersList.push_back(locator_of(address("PROBE_PEER")));
  // Finds peers that start a moment later without waiting for the default 3 s.
  builtin.discovery_config.leaseDuration_announcementperiod = eprosima::fastrtps::Duration_t(1, 0);
}

// The ``pkcs11:`` URI of key.p11, which rmw_fastrtps takes before key.pem (rmw_dds_common/src/security.cpp).
std::optional<std::string> token_key(const std::string& directory) {
  std::ifstream file(directory + "/key.p11");
  std::string uri;
  return file >> uri ? std::optional(uri) : std::nullopt;
}

// A discovery server without security, at the address and with the prefix of server 0 that ROS_DISCOVERY_SERVER means.
void serve_discovery(dds::DomainParticipantQos& qos, const std::string& port) {
  auto& builtin = qos.wire_protocol().builtin;
  builtin.discovery_config.discoveryProtocol = rtps::DiscoveryProtocol_t::SERVER;
  std::istringstream("44.53.00.5f.45.50.52.4f.53.49.4d.41") >> qos.wire_protocol().prefix;
  rtps::Locator_t locator = locator_of("127.0.0.1");
  locator.port = static_cast<uint32_t>(std::stoi(port));
  builtin.metatrafficUnicastLocatorList.clear();
  builtin.metatrafficUnicastLocatorList.push_back(locator);
}

// The security log, as rmw_fastrtps switches it on (rmw_fastrtps_shared_cpp/src/utils.cpp).
void log_security(dds::DomainParticipantQos& qos, const std::string& file) {
  auto& properties = qos.properties().properties();
  const std::string log = "dds.sec.log.builtin.DDS_LogTopic.";
  properties.emplace_back("dds.sec.log.plugin", "builtin.DDS_LogTopic");
  properties.emplace_back(log + "log_file", file);
  const char* level = std::getenv("ROS_SECURITY_LOG_VERBOSITY");
  properties.emplace_back(log + "logging_level", level ? std::string(level) + "_LEVEL" : "ERROR_LEVEL");
}

bool exists(const std::string& path) { return std::ifstream(path).good(); }

// The properties of rmw_fastrtps (rmw_fastrtps_shared_cpp/src/participant.cpp).
void secure(dds::DomainParticipantQos& qos, const std::string& directory) {
  auto& properties = qos.properties().properties();
  auto set = [&](const std::string& key, const std::string& value) {
    properties.emplace_back(key, value);
  };
  auto file = [&](const std::string& name) { return "file://" + directory + "/" + name; };
  const std::string authentication = "dds.sec.auth.builtin.PKI-DH.";
  const std::string access = "dds.sec.access.builtin.Access-Permissions.";
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  set(authentication + "identity_ca", file("identity_ca.cert.pem"));
  set(authentication + "identity_certificate", file("cert.pem"));
  set(authentication + "private_key", token_key(directory).value_or(file("key.pem")));
  if (exists(directory + "/crl.pem")) set(authentication + "identity_crl", file("crl.pem"));
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  set(access + "permissions_ca", file("permissions_ca.cert.pem"));
  set(access + "governance", file("governance.p7s"));
  set(access + "permissions", file("permissions.p7s"));
}

}  // namespace

Participant::Participant(std::string label, const std::string& directory, uint32_t domain)
    : label_(std::move(label)) {
  dds::DomainParticipantQos qos;
  qos.name(label_);
  stay_in_one_network(qos);
  if (directory != "-") secure(qos, directory);
  const char* log = std::getenv("ROS_SECURITY_LOG_FILE");
  if (directory != "-" && log != nullptr) log_security(qos, log);
  if (const char* port = std::getenv("PROBE_SERVER_PORT")) serve_discovery(qos, port);
  auto* factory = dds::DomainParticipantFactory::get_instance();
  participant_ = factory->create_participant(domain, qos);
  if (participant_ == nullptr) return;
  dds::TypeSupport(new StringType).register_type(participant_);
  publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
}

Participant::~Participant() {
  if (participant_ == nullptr) return;
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

dds::Topic* Participant::topic(const std::string& name) {
  auto*& known = topics_[name];
  if (known == nullptr) {
    known = participant_->create_topic(name, StringType().getName(), dds::TOPIC_QOS_DEFAULT);
  }
  return known;
}

bool Participant::publish(const std::string& name) {
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  auto* writer = publisher_->create_datawriter(topic(name), qos);
  if (writer != nullptr) writers_.push_back(writer);
  return writer != nullptr;
}

bool Participant::subscribe(const std::string& name) {
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  auto* reader = subscriber_->create_datareader(topic(name), qos);
  if (reader != nullptr) readers_.push_back(reader);
  return reader != nullptr;
}

void Participant::talk() {
  String message{label_};
  for (auto* writer : writers_) writer->write(&message);
}

std::vector<std::pair<std::string, std::string>> Participant::listen() {
  std::vector<std::pair<std::string, std::string>> fresh;
  String message;
  dds::SampleInfo info;
  for (auto* reader : readers_) {
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      std::pair<std::string, std::string> entry{reader->get_topicdescription()->get_name(), message.data};
      if (heard_.insert(entry).second) fresh.push_back(entry);
    }
  }
  return fresh;
}

}  // namespace probe
