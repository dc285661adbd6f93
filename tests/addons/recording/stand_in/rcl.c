/* A stand-in for librcl, librcl_action, librcl_lifecycle and librcutils: the same symbols and the same calls between
 * them, for tests of the recorder where ROS is not installed. It expands and remaps names, enforces the permissions
 * of its enclave as DDS would (or lets a real DDS do it, by the library in STAND_IN_DDS), and says what rcl of jazzy on Cyclone DDS says when an endpoint is refused.
 *
 * Built four times: PART 1 librcutils, 2 librcl, 3 librcl_action, 4 librcl_lifecycle.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fnmatch.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef int rcl_ret_t;
typedef struct { void * functions[5]; } allocator_t;
typedef struct { char name[256], space[256], fqn[520]; } node_t;

void rcutils_set_error_state(const char *, const char *, size_t);
rcl_ret_t rcl_publisher_init(void *, const node_t *, const void *, const char *, const void *);
rcl_ret_t rcl_subscription_init(void *, const node_t *, const void *, const char *, const void *);
rcl_ret_t rcl_service_init(void *, const node_t *, const void *, const char *, const void *);
rcl_ret_t rcl_client_init(void *, const node_t *, const void *, const char *, const void *);
const void * stand_in_support(const char * type, int place);

#define FAIL(...) do { char text_[1024]; snprintf(text_, sizeof text_, __VA_ARGS__); \
  rcutils_set_error_state(text_, __FILE__, __LINE__); } while (0)

#if PART == 1
static __thread char state[1024];
void rcutils_set_error_state(const char * text, const char * file, size_t line)
{ (void)file; (void)line; snprintf(state, sizeof state, "%s", text); }
typedef struct { char str[1024]; } error_string_t;
error_string_t rcutils_get_error_string(void) { error_string_t s; memcpy(s.str, state, 1024); return s; }
void rcutils_reset_error(void) { state[0] = 0; }
static void * allocate(size_t n, void * s) { (void)s; return malloc(n); }
static void deallocate(void * p, void * s) { (void)s; free(p); }
allocator_t rcutils_get_default_allocator(void)
{ return (allocator_t){{(void *)allocate, (void *)deallocate, NULL, NULL, NULL}}; }
/* its presence says that type supports describe their types */
int rosidl_parse_type_hash_string(const char * s, void * o) { (void)s; (void)o; return 0; }

struct described { const char * data; size_t size, capacity; };
struct support { void * places[10]; struct described type; };
static const void * describe(const void * support) { return &((const struct support *)support)->type; }
const void * stand_in_support(const char * type, int place)
{
  struct support * s = calloc(1, sizeof *s); /* lives as long as the process, as a type support does */
  s->places[place] = (void *)describe;
  s->type = (struct described){strdup(type), strlen(type), strlen(type) + 1};
  return s;
}
#endif

#if PART == 2
static char rules[64][2][256], parameters[64][256], enclave[256] = "/";
static int rule_count;

static void read_arguments(int argc, char const * const * argv)
{
  rule_count = 0;
  for (int i = 1; i < argc; i++) {
    const char * rule = argv[i], * split = strstr(rule, ":=");
    if (!strcmp(argv[i - 1], "-r") && split && rule_count < 64) {
      snprintf(rules[rule_count][0], 256, "%.*s", (int)(split - rule), rule);
      snprintf(rules[rule_count++][1], 256, "%s", split + 2);
    }
    if (!strcmp(argv[i - 1], "--enclave"))
      snprintf(enclave, sizeof enclave, "%s", rule);
  }
}

static const char * rule_for(const char * match)
{
  for (int i = 0; i < rule_count; i++)
    if (!strcmp(rules[i][0], match))
      return rules[i][1];
  return NULL;
}

static void expand(const node_t * node, const char * name, char * out)
{
  const char * space = strcmp(node->space, "/") ? node->space : "";
  if (name[0] == '/')
    snprintf(out, 520, "%s", name);
  else if (name[0] == '~')
    snprintf(out, 520, "%s%s", node->fqn, name + 1);
  else
    snprintf(out, 520, "%s/%s", space, name);
}

static void resolve(const node_t * node, const char * name, char * out)
{
  char full[520];
  expand(node, name, out);
  for (int i = 0; i < rule_count; i++) {
    if (rules[i][0][0] == '_')
      continue;
    expand(node, rules[i][0], full);
    if (!strcmp(full, out)) {
      expand(node, rules[i][1], out);
      return;
    }
  }
}

static bool (*dds_join)(const char * folder, unsigned domain);
static bool (*dds_endpoint)(const char * topic, bool writes);

/* With a real DDS: one participant for the process, as rmw has it. */
static bool joins(void)
{
  const char * library = getenv("STAND_IN_DDS"), * other = getenv("STAND_IN_FOLDER"), * domain = getenv("STAND_IN_DOMAIN");
  char folder[1024];
  if (library == NULL || dds_join != NULL)
    return true;
  void * loaded = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  if (loaded == NULL) {
    fprintf(stderr, "%s\n", dlerror());
    abort();
  }
  dds_join = (bool (*)(const char *, unsigned))dlsym(loaded, "stand_in_join");
  dds_endpoint = (bool (*)(const char *, bool))dlsym(loaded, "stand_in_endpoint");
  snprintf(folder, sizeof folder, "%s/enclaves%s", getenv("ROS_SECURITY_KEYSTORE"), enclave);
  return dds_join(other ? other : folder, atoi(domain ? domain : getenv("ROS_DOMAIN_ID")));
}

/* Whether the permissions of our enclave have a rule of this element that fits the topic. */
static bool granted(const char * element, const char * topic)
{
  const char * keystore = getenv("ROS_SECURITY_KEYSTORE"), * on = getenv("ROS_SECURITY_ENABLE");
  const char * rmw = getenv("RMW_IMPLEMENTATION");
  if (rmw != NULL && !strcmp(rmw, "rmw_zenoh_cpp"))
    return true;  /* who refuses is the router, and it says nothing */
  char path[1024], open_tag[32], close_tag[32];
  static char text[1 << 20];
  if (keystore == NULL || on == NULL || strcmp(on, "true"))
    return true;
  if (dds_endpoint != NULL)
    return dds_endpoint(topic, !strcmp(element, "publish"));
  snprintf(path, sizeof path, "%s/enclaves%s/permissions.xml", keystore, enclave);
  FILE * file = fopen(path, "r");
  if (file == NULL)
    return false;
  text[fread(text, 1, sizeof text - 1, file)] = 0;
  fclose(file);
  snprintf(open_tag, sizeof open_tag, "<%s>", element);
  snprintf(close_tag, sizeof close_tag, "</%s>", element);
  for (char * at = strstr(text, open_tag); at; at = strstr(at + 1, open_tag)) {
    char * end = strstr(at, close_tag);
    for (char * t = strstr(at, "<topic>"); t && t < end; t = strstr(t + 1, "<topic>")) {
      char pattern[512];
      snprintf(pattern, sizeof pattern, "%.*s", (int)(strstr(t, "</topic>") - t - 7), t + 7);
      if (!fnmatch(pattern, topic, 0))
        return true;
    }
  }
  return false;
}

rcl_ret_t rcl_init(int argc, char const * const * argv, const void * options, void * context)
{
  (void)options; (void)context;
  read_arguments(argc, argv);
  if (getenv("STAND_IN_INIT_FAILS")) {
    FAIL("SECURITY ERROR: directory '%s' does not exist.", getenv("STAND_IN_INIT_FAILS"));
    return 1;
  }
  return 0;
}
const char * rmw_get_implementation_identifier(void) { return "rmw_stand_in"; }
const char * rcl_node_get_fully_qualified_name(const node_t * node) { return node->fqn; }

rcl_ret_t rcl_node_resolve_name(
  const node_t * node, const char * name, allocator_t allocator, bool service, bool expand_only, char ** out)
{
  char full[520];
  (void)allocator; (void)service; (void)expand_only;
  resolve(node, name, full);
  *out = strdup(full);
  return 0;
}

rcl_ret_t rcl_node_init(node_t * node, const char * name, const char * space, void * context, const void * options)
{
  (void)context; (void)options;
  if (getenv("STAND_IN_NODE_FAILS")) {
    fprintf(stderr, "1795291119.263579 [7] x: %s\n", getenv("STAND_IN_NODE_FAILS"));
    return 1;
  }
  if (!joins())
    return 1; /* jazzy: without a text; DDS has printed its own */
  const char * given = rule_for("__node"), * pushed = rule_for("__ns");
  snprintf(node->name, sizeof node->name, "%s", given ? given : name);
  snprintf(node->space, sizeof node->space, "%s%s", space[0] == '/' || pushed ? "" : "/", pushed ? pushed : space);
  snprintf(node->fqn, sizeof node->fqn, "%s/%s", strcmp(node->space, "/") ? node->space : "", node->name);
  int quality[8] = {1, 0, 10, 0, 1, 1};
  rcl_ret_t result = rcl_publisher_init(NULL, node, stand_in_support("rcl_interfaces/msg/Log", 4), "/rosout", quality);
  if (result == 0) {
    char own[600];
    snprintf(own, sizeof own, "%s/get_type_description", node->fqn);
    const void * support = stand_in_support("type_description_interfaces/srv/GetTypeDescription", 9);
    result = rcl_service_init(NULL, node, support, own, NULL);
  }
  return result;
}
rcl_ret_t rcl_node_fini(node_t * node) { node->fqn[0] = 0; return 0; }

static rcl_ret_t topic(const node_t * node, const char * name, bool write)
{
  char full[520], dds[600];
  if (strstr(name, "//") || name[0] == 0) {
    FAIL("topic name is invalid");
    return 103;
  }
  resolve(node, name, full);
  snprintf(dds, sizeof dds, "rt%s", full);
  if (granted(write ? "publish" : "subscribe", dds))
    return 0;
  if (write && granted("subscribe", dds))
    FAIL("failed to create writer");
  else
    FAIL("failed to create topic [%s] for unknown reasons", dds);
  if (!write)
    FAIL("invalid allocator"); /* jazzy: a second error hides the first */
  return 1;
}
rcl_ret_t rcl_publisher_init(void * p, const node_t * node, const void * s, const char * name, const void * o)
{ (void)p; (void)s; (void)o; return topic(node, name, true); }
rcl_ret_t rcl_subscription_init(void * p, const node_t * node, const void * s, const char * name, const void * o)
{ (void)p; (void)s; (void)o; return topic(node, name, false); }

static rcl_ret_t service(const node_t * node, const char * name, bool server)
{
  char full[520], request[600], reply[600];
  resolve(node, name, full);
  snprintf(request, sizeof request, "rq%sRequest", full);
  snprintf(reply, sizeof reply, "rr%sReply", full);
  if (granted(server ? "subscribe" : "publish", request) && granted(server ? "publish" : "subscribe", reply))
    return 0;
  FAIL("failed to create topic [%s] for unknown reasons", server ? reply : request);
  return 1;
}
rcl_ret_t rcl_service_init(void * p, const node_t * node, const void * s, const char * name, const void * o)
{ (void)p; (void)s; (void)o; return service(node, name, true); }
rcl_ret_t rcl_client_init(void * p, const node_t * node, const void * s, const char * name, const void * o)
{ (void)p; (void)s; (void)o; return service(node, name, false); }
#endif

#if PART == 3
static rcl_ret_t parts(node_t * node, const char * action, bool server)
{
  static const char * const services[] = {"send_goal", "cancel_goal", "get_result"};
  static const char * const topics[] = {"feedback", "status"};
  int quality[8] = {1, 0, 10, 0, 1, 2};
  char name[600];
  for (int i = 0; i < 3; i++) {
    snprintf(name, sizeof name, "%s/_action/%s", action, services[i]);
    const void * support = stand_in_support("test_msgs/action/Part", 9);
    rcl_ret_t result = (server ? rcl_service_init : rcl_client_init)(NULL, node, support, name, NULL);
    if (result != 0)
      return result;
  }
  for (int i = 0; i < 2; i++) {
    snprintf(name, sizeof name, "%s/_action/%s", action, topics[i]);
    const void * support = stand_in_support("test_msgs/msg/Part", 4);
    rcl_ret_t result = (server ? rcl_publisher_init : rcl_subscription_init)(NULL, node, support, name, quality);
    if (result != 0)
      return result;
  }
  return 0;
}
rcl_ret_t rcl_action_server_init(void * a, node_t * node, void * c, const void * s, const char * name, const void * o)
{ (void)a; (void)c; (void)s; (void)o; return parts(node, name, true); }
rcl_ret_t rcl_action_client_init(void * a, node_t * node, const void * s, const char * name, const void * o)
{ (void)a; (void)s; (void)o; return parts(node, name, false); }
#endif

#if PART == 4
typedef struct { const char * label; unsigned id; } state_t;
typedef struct { const state_t * current; node_t * node; } machine_t;
static const state_t states[] = {{"unconfigured", 1}, {"inactive", 2}, {"active", 3}};
rcl_ret_t rcl_lifecycle_state_machine_init(
  machine_t * m, node_t * node, void * a, void * b, void * c, void * d, void * e, void * f, void * o)
{
  static const char * const services[] = {
    "change_state", "get_state", "get_available_states", "get_available_transitions", "get_transition_graph"};
  (void)a; (void)b; (void)c; (void)d; (void)e; (void)f; (void)o;
  int quality[8] = {1, 0, 10, 0, 1, 2};
  const void * event = stand_in_support("lifecycle_msgs/msg/TransitionEvent", 4);
  rcl_ret_t result = rcl_publisher_init(NULL, node, event, "~/transition_event", quality);
  for (int i = 0; i < 5 && result == 0; i++) {
    char name[64];
    snprintf(name, sizeof name, "~/%s", services[i]);
    result = rcl_service_init(NULL, node, stand_in_support("lifecycle_msgs/srv/X", 9), name, NULL);
  }
  *m = (machine_t){&states[0], node};
  return result;
}
rcl_ret_t rcl_lifecycle_trigger_transition_by_id(machine_t * m, uint8_t id, bool publish)
{ (void)publish; m->current = &states[id]; return 0; }
#endif
