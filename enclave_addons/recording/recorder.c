/* Notes what a process asks of librcl: a library for LD_PRELOAD, one C file, no ROS headers.
 *
 * It defines the functions through which every ROS node, publisher, subscription, service and action is made
 * (rcl and rcl_action of humble to rolling), calls the real ones and then appends one line of JSON to the file
 * named in ENCLAVE_LAUNCH_RECORD. The reader and the meaning of each field: enclave_addons/recording/record/lines.py.
 *
 * It must never disturb the process: no lock, nothing allocated, errno kept, the file opened for each line
 * (a kept descriptor could be closed, and its number used again, by a program that closes all it does not know).
 * Lines are numbered for each process: a reader sees what could not be written. A line is noted after the call,
 * with its result.
 *
 * Build: cc -shared -fPIC -O2 recorder.c -o librecorder.so -ldl
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

typedef int rcl_ret_t;

enum { OK = 0, ERROR = 1 }; /* RCL_RET_OK, RCL_RET_ERROR; the others say that an argument is not valid */
enum { LONGEST_NAME = 260, LONGEST_TEXT = 320, KEPT_TEXTS = 6, NODES = 4096 };

#define EXPORT __attribute__((visibility("default")))
#define CALLER __builtin_return_address(0)

/* ---- one line ---------------------------------------------------------------------------------- */

struct line {
  char text[6144];
  size_t length;
  bool cut; /* a field was longer than it may be */
};

static char record_path[4096];
static atomic_uint lines_written;
static atomic_int process_id;
static atomic_bool last_write_failed;

static void add_raw(struct line * line, const char * text)
{
  size_t length = strlen(text);
  if (line->length + length + 64 > sizeof line->text) {
    line->cut = true;
    return;
  }
  memcpy(line->text + line->length, text, length);
  line->length += length;
}

static void add_number(struct line * line, const char * key, long long value)
{
  char text[64];
  snprintf(text, sizeof text, ",\"%s\":%lld", key, value);
  add_raw(line, text);
}

static void add_quoted(struct line * line, const char * value, size_t longest)
{
  char text[2 * 4096 + 3];
  size_t used = 0;
  text[used++] = '"';
  for (size_t i = 0; value[i] != '\0'; i++) {
    unsigned char c = (unsigned char)value[i];
    if (i == longest) {
      line->cut = true;
      break;
    }
    if (c == '"' || c == '\\')
      text[used++] = '\\';
    text[used++] = c < 0x20 || c == 0x7f ? ' ' : (char)c;
  }
  text[used++] = '"';
  text[used] = '\0';
  add_raw(line, text);
}

static void add_text(struct line * line, const char * key, const char * value, size_t longest)
{
  if (value == NULL)
    return;
  add_raw(line, ",\"");
  add_raw(line, key);
  add_raw(line, "\":");
  add_quoted(line, value, longest);
}

static void begin(struct line * line, const char * what)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  line->length = 0;
  line->cut = false;
  add_raw(line, "{\"what\":\"");
  add_raw(line, what);
  add_raw(line, "\"");
  add_number(line, "pid", getpid());
  add_number(line, "thread", syscall(SYS_gettid));
  add_number(line, "at", (long long)now.tv_sec * 1000000000LL + now.tv_nsec);
}

/* A write beyond the process's limit for files would end it with SIGXFSZ. */
static bool fits(int file, size_t length)
{
  struct rlimit limit;
  struct stat status;
  if (getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return true;
  return fstat(file, &status) == 0 && (rlim_t)status.st_size + length + 1 <= limit.rlim_cur;
}

/* Number the line, close it and append it in one write. A line that could not be written whole is followed by a
 * line end, so that it spoils no other. */
static void finish(struct line * line)
{
  add_number(line, "n", atomic_fetch_add(&lines_written, 1) + 1);
  if (line->cut)
    add_raw(line, ",\"cut\":true");
  add_raw(line, "}\n");
  int file = open(record_path, O_WRONLY | O_APPEND | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
  if (file < 0)
    return;
  if (!fits(file, line->length)) {
    close(file);
    return;
  }
  if (atomic_exchange(&last_write_failed, false))
    (void)!write(file, "\n", 1);
  ssize_t written;
  do
    written = write(file, line->text, line->length);
  while (written < 0 && errno == EINTR);
  if (written != (ssize_t)line->length)
    atomic_store(&last_write_failed, true);
  close(file);
}

/* ---- this process ------------------------------------------------------------------------------ */

static void note_loaded(bool forked)
{
  struct line line;
  char program[1024];
  ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
  program[length > 0 ? length : 0] = '\0';
  begin(&line, "loaded");
  add_number(&line, "parent", getppid());
  add_number(&line, "session", getsid(0));
  add_text(&line, "program", program, sizeof program);
  if (forked)
    add_raw(&line, ",\"forked\":true");
  finish(&line);
}

/* A child that was forked without exec numbers its own lines. */
static bool recording(void)
{
  int mine = getpid(), known = atomic_load(&process_id);
  if (known == 0)
    return false;
  if (known != mine && atomic_compare_exchange_strong(&process_id, &known, mine)) {
    atomic_store(&lines_written, 0);
    note_loaded(true);
  }
  return true;
}

__attribute__((constructor)) static void on_load(void)
{
  int kept = errno;
  const char * path = getenv("ENCLAVE_LAUNCH_RECORD");
  if (path != NULL && strlen(path) < sizeof record_path) {
    strcpy(record_path, path);
    atomic_store(&process_id, getpid());
    note_loaded(false);
  }
  errno = kept;
}

__attribute__((destructor)) static void on_end(void)
{
  int kept = errno;
  struct line line;
  if (atomic_load(&process_id) == getpid()) {
    begin(&line, "ended");
    finish(&line);
  }
  errno = kept;
}

/* ---- the real functions ------------------------------------------------------------------------ */

static void * function_of(void * library, const char * name)
{
  void * found = library == NULL ? NULL : dlsym(library, name);
  if (library != NULL)
    dlclose(library); /* RTLD_NOLOAD only counted one user more */
  return found;
}

/* RTLD_NEXT finds libraries of the global scope. Python loads its extensions with RTLD_LOCAL: theirs are found by
 * name, and a library with an rcl of its own by the address of the caller. */
static void * real(_Atomic(void *) * known, const char * library, const char * name, void * caller)
{
  void * found = atomic_load(known);
  Dl_info info;
  if (found != NULL)
    return found;
  found = dlsym(RTLD_NEXT, name);
  if (found == NULL)
    found = function_of(dlopen(library, RTLD_LAZY | RTLD_NOLOAD), name);
  if (found == NULL && caller != NULL && dladdr(caller, &info) != 0)
    found = function_of(dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD), name);
  atomic_store(known, found);
  return found;
}

#define REAL(name, library, type) \
  static _Atomic(void *) known_##name; \
  type real_function = (type)real(&known_##name, library, #name, CALLER)

static const char * base_name(const char * path)
{
  const char * slash = strrchr(path, '/');
  return slash == NULL ? path : slash + 1;
}

static void add_caller(struct line * line, void * caller)
{
  Dl_info info;
  if (dladdr(caller, &info) != 0 && info.dli_fname != NULL)
    add_text(line, "by", base_name(info.dli_fname), 120);
}

/* ---- texts of errors --------------------------------------------------------------------------- */

/* All texts that pass while one of our functions is under way: rcl's last one often hides the reason. */
static __thread int depth;
static __thread int texts_kept;
static __thread char texts[KEPT_TEXTS][LONGEST_TEXT + 1];

EXPORT void rcutils_set_error_state(const char * text, const char * file, size_t line_number)
{
  typedef void (*function)(const char *, const char *, size_t);
  REAL(rcutils_set_error_state, "librcutils.so", function);
  if (depth > 0 && text != NULL && texts_kept < KEPT_TEXTS) {
    strncpy(texts[texts_kept], text, LONGEST_TEXT);
    texts[texts_kept++][LONGEST_TEXT] = '\0';
  }
  if (real_function != NULL)
    real_function(text, file, line_number);
}

static int enter(void)
{
  depth++;
  return texts_kept;
}

static void leave(void)
{
  if (--depth == 0)
    texts_kept = 0;
}

static void add_result(struct line * line, rcl_ret_t result, int first_text)
{
  add_number(line, "rc", result);
  if (result == OK || texts_kept <= first_text)
    return;
  add_raw(line, ",\"error\":[");
  for (int i = first_text; i < texts_kept; i++) {
    if (i > first_text)
      add_raw(line, ",");
    add_quoted(line, texts[i], LONGEST_TEXT);
  }
  add_raw(line, "]");
}

/* ---- nodes ------------------------------------------------------------------------------------- */

/* Handles come back once a node has ended, numbers do not. */
static struct {
  _Atomic(const void *) handle;
  atomic_int number;
} nodes[NODES];
static atomic_int nodes_made;
static atomic_int nodes_used; /* slots that were ever used */

static int number_node(const void * handle)
{
  int number = atomic_fetch_add(&nodes_made, 1) + 1;
  for (int i = 0; i < NODES; i++) {
    const void * free_slot = NULL;
    if (atomic_load(&nodes[i].handle) == handle ||
      atomic_compare_exchange_strong(&nodes[i].handle, &free_slot, handle))
    {
      atomic_store(&nodes[i].number, number);
      int used = atomic_load(&nodes_used);
      while (used <= i && !atomic_compare_exchange_weak(&nodes_used, &used, i + 1)) {}
      break;
    }
  }
  return number;
}

static int number_of(const void * handle)
{
  for (int i = 0; i < atomic_load(&nodes_used); i++)
    if (atomic_load(&nodes[i].handle) == handle)
      return atomic_load(&nodes[i].number);
  return 0; /* made before we were there, or more nodes than slots */
}

static void forget_node(const void * handle)
{
  for (int i = 0; i < atomic_load(&nodes_used); i++)
    if (atomic_load(&nodes[i].handle) == handle)
      atomic_store(&nodes[i].handle, NULL);
}

static void add_full_node_name(struct line * line, const void * node)
{
  typedef const char * (*function)(const void *);
  REAL(rcl_node_get_fully_qualified_name, "librcl.so", function);
  add_text(line, "fqn", real_function == NULL ? NULL : real_function(node), LONGEST_NAME * 2);
}

/* rcutils_allocator_t: by value, as rcl_node_resolve_name takes it */
struct allocator {
  void * (*allocate)(size_t, void *);
  void (*deallocate)(void *, void *);
  void * (*reallocate)(void *, size_t, void *);
  void * (*zero_allocate)(size_t, size_t, void *);
  void * state;
};

/* Only for names that rcl accepted: a failing look-up would leave an error text that is not the caller's. */
static void add_final_name(struct line * line, const void * node, const char * name, bool is_service)
{
  typedef struct allocator (*get_allocator)(void);
  typedef rcl_ret_t (*function)(const void *, const char *, struct allocator, bool, bool, char **);
  static _Atomic(void *) known_allocator;
  REAL(rcl_node_resolve_name, "librcl.so", function);
  get_allocator get =
    (get_allocator)real(&known_allocator, "librcutils.so", "rcutils_get_default_allocator", NULL);
  char * found = NULL;
  if (real_function == NULL || get == NULL)
    return;
  struct allocator allocator = get();
  if (real_function(node, name, allocator, is_service, false, &found) == OK && found != NULL) {
    add_text(line, "final", found, LONGEST_NAME);
    allocator.deallocate(found, allocator.state);
  }
}

/* ---- types ------------------------------------------------------------------------------------- */

/* Since iron a type support holds a function that describes its type; the description begins with the type's name.
 * Where it stands, counted in pointers (rosidl_runtime_c, *_type_support_struct.h): */
enum type_support { MESSAGE = 4, SERVICE = 9, ACTION = 6 };

static bool describes_types(void)
{
  static _Atomic(void *) known;
  return real(&known, "librosidl_runtime_c.so", "rosidl_parse_type_hash_string", NULL) != NULL;
}

static void add_type(struct line * line, const void * support, enum type_support place)
{
  typedef const struct { const char * data; size_t size; size_t capacity; } * (*describe)(const void *);
  if (support == NULL || !describes_types())
    return;
  describe function = ((const describe *)support)[place];
  if (function == NULL)
    return;
  const char * const * description = (const char * const *)(const void *)function(support);
  if (description != NULL)
    add_text(line, "type", description[0], LONGEST_NAME);
}

/* The options of publishers and subscriptions begin with rmw_qos_profile_t: history, depth, reliability, durability */
static void add_quality(struct line * line, const void * options)
{
  const struct { int history; size_t depth; int reliability; int durability; } * quality = options;
  char text[128];
  if (options == NULL)
    return;
  snprintf(text, sizeof text, ",\"qos\":[%d,%zu,%d,%d]",
    quality->history, quality->depth, quality->reliability, quality->durability);
  add_raw(line, text);
}

/* ---- parameters -------------------------------------------------------------------------------- */

/* A node says on /parameter_events which parameters it declares, with their values: the only place where rcl sees
 * defaults. What was published is serialised once more and noted as it is (CDR, in hexadecimal). */
static struct {
  _Atomic(const void *) publisher;
  _Atomic(const void *) support;
  atomic_int node;
} events[NODES];
static atomic_int events_used;
static atomic_int parameter_lines;
enum { MOST_PARAMETER_LINES = 8192, LONGEST_EVENT = 2048 };

/* Handles come back: one that is no publisher of parameter events any more is forgotten. */
static void remember_parameter_events(const void * publisher, const void * node, const void * support, bool is_one)
{
  int used = atomic_load(&events_used);
  for (int i = 0; i < used; i++)
    if (atomic_load(&events[i].publisher) == publisher)
      atomic_store(&events[i].publisher, NULL);
  for (int i = 0; is_one && i < NODES; i++) {
    const void * free_slot = NULL;
    if (atomic_compare_exchange_strong(&events[i].publisher, &free_slot, publisher)) {
      atomic_store(&events[i].support, support);
      atomic_store(&events[i].node, number_of(node));
      while (used <= i && !atomic_compare_exchange_weak(&events_used, &used, i + 1)) {}
      break;
    }
  }
}

struct serialized { uint8_t * buffer; size_t length; size_t capacity; struct allocator allocator; };

static bool serialize(const void * message, const void * support, struct serialized * into)
{
  typedef struct allocator (*get_allocator)(void);
  typedef int (*function)(const void *, const void *, struct serialized *);
  typedef void (*reset)(void);
  static _Atomic(void *) known_allocator, known_serialize, known_reset;
  get_allocator get =
    (get_allocator)real(&known_allocator, "librcutils.so", "rcutils_get_default_allocator", NULL);
  function write = (function)real(&known_serialize, "librcl.so", "rmw_serialize", NULL);
  reset forget = (reset)real(&known_reset, "librcutils.so", "rcutils_reset_error", NULL);
  if (get == NULL || write == NULL)
    return false;
  into->allocator = get();
  if (write(message, support, into) == OK)
    return true;
  if (forget != NULL)
    forget(); /* nothing of ours is left for the program to find */
  return false;
}

static uint32_t number_at(const uint8_t * data, size_t place, bool little)
{
  const uint8_t * at = data + place;
  return little ? at[0] | at[1] << 8 | at[2] << 16 | (uint32_t)at[3] << 24
                : at[3] | at[2] << 8 | at[1] << 16 | (uint32_t)at[0] << 24;
}

/* How many parameters rcl_interfaces/msg/ParameterEvent declares: behind the time and the node's name. */
static uint32_t parameters_declared(const uint8_t * data, size_t length)
{
  if (length < 20 || data[0] != 0 || data[1] > 1)
    return 0;
  bool little = data[1] == 1;
  size_t name = number_at(data, 12, little);
  size_t place = name > length ? length : 4 + ((12 + name + 3) & ~(size_t)3);
  return place + 4 <= length ? number_at(data, place, little) : 0;
}

static void note_event(int node, const uint8_t * data, size_t length, uint32_t declared)
{
  static const char digits[] = "0123456789abcdef";
  char text[2 * LONGEST_EVENT + 1];
  struct line line;
  size_t kept = length < LONGEST_EVENT ? length : LONGEST_EVENT;
  for (size_t i = 0; i < kept; i++) {
    text[2 * i] = digits[data[i] >> 4];
    text[2 * i + 1] = digits[data[i] & 15];
  }
  text[2 * kept] = '\0';
  begin(&line, "parameters");
  add_number(&line, "node", node);
  add_text(&line, "cdr", text, sizeof text);
  line.cut = line.cut || (kept < length && declared > 1); /* a value that long is no name */
  finish(&line);
}

static void note_parameters(const void * publisher, const void * message)
{
  int kept = errno;
  struct serialized event = {0};
  for (int i = 0; i < atomic_load(&events_used); i++) {
    if (atomic_load(&events[i].publisher) != publisher || !recording())
      continue;
    if (serialize(message, atomic_load(&events[i].support), &event)) {
      uint32_t declared = parameters_declared(event.buffer, event.length);
      if (declared > 0 && atomic_fetch_add(&parameter_lines, 1) < MOST_PARAMETER_LINES)
        note_event(atomic_load(&events[i].node), event.buffer, event.length, declared);
    }
    if (event.buffer != NULL)
      event.allocator.deallocate(event.buffer, event.allocator.state);
    break;
  }
  errno = kept;
}

/* ---- endpoints --------------------------------------------------------------------------------- */

struct endpoint {
  const char * what;
  const void * node;
  const char * name;
  const void * support;
  enum type_support place;
  bool is_service;
  const void * quality; /* NULL where there is none */
};

static void note_endpoint(const struct endpoint * endpoint, rcl_ret_t result, int first_text, void * caller)
{
  int kept = errno;
  struct line line;
  if (recording()) {
    begin(&line, endpoint->what);
    if (endpoint->node != NULL)
      add_number(&line, "node", number_of(endpoint->node));
    add_text(&line, "name", endpoint->name, LONGEST_NAME);
    if (result == OK || result == ERROR) {
      add_full_node_name(&line, endpoint->node);
      add_final_name(&line, endpoint->node, endpoint->name, endpoint->is_service);
      add_type(&line, endpoint->support, endpoint->place);
      add_quality(&line, endpoint->quality);
    }
    add_caller(&line, caller);
    add_result(&line, result, first_text);
    finish(&line);
  }
  leave();
  errno = kept;
}

EXPORT rcl_ret_t rcl_publisher_init(
  void * publisher, const void * node, const void * support, const char * topic, const void * options)
{
  typedef rcl_ret_t (*function)(void *, const void *, const void *, const char *, const void *);
  REAL(rcl_publisher_init, "librcl.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(publisher, node, support, topic, options);
  struct endpoint endpoint = {"publisher", node, topic, support, MESSAGE, false, options};
  remember_parameter_events(publisher, node, support, result == OK && topic != NULL && !strcmp(topic, "/parameter_events"));
  note_endpoint(&endpoint, result, first_text, CALLER);
  return result;
}

EXPORT rcl_ret_t rcl_publish(const void * publisher, const void * message, void * allocation)
{
  typedef rcl_ret_t (*function)(const void *, const void *, void *);
  REAL(rcl_publish, "librcl.so", function);
  rcl_ret_t result = real_function(publisher, message, allocation);
  if (result == OK && atomic_load_explicit(&events_used, memory_order_relaxed) > 0)
    note_parameters(publisher, message);
  return result;
}

EXPORT rcl_ret_t rcl_subscription_init(
  void * subscription, const void * node, const void * support, const char * topic, const void * options)
{
  typedef rcl_ret_t (*function)(void *, const void *, const void *, const char *, const void *);
  REAL(rcl_subscription_init, "librcl.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(subscription, node, support, topic, options);
  struct endpoint endpoint = {"subscription", node, topic, support, MESSAGE, false, options};
  note_endpoint(&endpoint, result, first_text, CALLER);
  return result;
}

EXPORT rcl_ret_t rcl_service_init(
  void * service, const void * node, const void * support, const char * name, const void * options)
{
  typedef rcl_ret_t (*function)(void *, const void *, const void *, const char *, const void *);
  REAL(rcl_service_init, "librcl.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(service, node, support, name, options);
  struct endpoint endpoint = {"service_server", node, name, support, SERVICE, true, NULL};
  note_endpoint(&endpoint, result, first_text, CALLER);
  return result;
}

EXPORT rcl_ret_t rcl_client_init(
  void * client, const void * node, const void * support, const char * name, const void * options)
{
  typedef rcl_ret_t (*function)(void *, const void *, const void *, const char *, const void *);
  REAL(rcl_client_init, "librcl.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(client, node, support, name, options);
  struct endpoint endpoint = {"service_client", node, name, support, SERVICE, true, NULL};
  note_endpoint(&endpoint, result, first_text, CALLER);
  return result;
}

EXPORT rcl_ret_t rcl_action_server_init(
  void * server, void * node, void * clock, const void * support, const char * name, const void * options)
{
  typedef rcl_ret_t (*function)(void *, void *, void *, const void *, const char *, const void *);
  REAL(rcl_action_server_init, "librcl_action.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(server, node, clock, support, name, options);
  struct endpoint endpoint = {"action_server", node, name, support, ACTION, false, NULL};
  note_endpoint(&endpoint, result, first_text, CALLER);
  return result;
}

/* kilted and later: with more arguments, which are passed on unseen. Its own library calls it too. */
EXPORT rcl_ret_t rcl_action_server_init2(
  void * server, void * node, void * clock, const void * support, const char * name, const void * options,
  void * more, void * most)
{
  typedef rcl_ret_t (*function)(
    void *, void *, void *, const void *, const char *, const void *, void *, void *);
  REAL(rcl_action_server_init2, "librcl_action.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(server, node, clock, support, name, options, more, most);
  struct endpoint endpoint = {"action_server", node, name, support, ACTION, false, NULL};
  note_endpoint(&endpoint, result, first_text, CALLER);
  return result;
}

EXPORT rcl_ret_t rcl_action_client_init(
  void * client, void * node, const void * support, const char * name, const void * options)
{
  typedef rcl_ret_t (*function)(void *, void *, const void *, const char *, const void *);
  REAL(rcl_action_client_init, "librcl_action.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(client, node, support, name, options);
  struct endpoint endpoint = {"action_client", node, name, support, ACTION, false, NULL};
  note_endpoint(&endpoint, result, first_text, CALLER);
  return result;
}

/* ---- contexts, nodes, states ------------------------------------------------------------------- */

static const char * middleware(void)
{
  typedef const char * (*function)(void);
  REAL(rmw_get_implementation_identifier, "librcl.so", function);
  return real_function == NULL ? NULL : real_function();
}

EXPORT rcl_ret_t rcl_init(int argc, char const * const * argv, const void * options, void * context)
{
  typedef rcl_ret_t (*function)(int, char const * const *, const void *, void *);
  REAL(rcl_init, "librcl.so", function);
  int first_text = enter();
  rcl_ret_t result = real_function(argc, argv, options, context);
  int kept = errno;
  struct line line;
  if (recording()) {
    begin(&line, "init");
    if (result == OK)
      add_text(&line, "middleware", middleware(), LONGEST_NAME);
    add_caller(&line, CALLER);
    add_result(&line, result, first_text);
    finish(&line);
  }
  leave();
  errno = kept;
  return result;
}

EXPORT rcl_ret_t rcl_node_init(
  void * node, const char * name, const char * name_space, void * context, const void * options)
{
  typedef rcl_ret_t (*function)(void *, const char *, const char *, void *, const void *);
  REAL(rcl_node_init, "librcl.so", function);
  int first_text = enter();
  int number = number_node(node); /* before the call: rcl makes endpoints of the node inside */
  rcl_ret_t result = real_function(node, name, name_space, context, options);
  int kept = errno;
  struct line line;
  if (recording()) {
    begin(&line, "node");
    add_number(&line, "node", number);
    add_text(&line, "name", name, LONGEST_NAME);
    add_text(&line, "namespace", name_space, LONGEST_NAME);
    if (result == OK)
      add_full_node_name(&line, node);
    add_caller(&line, CALLER);
    add_result(&line, result, first_text);
    finish(&line);
  }
  if (result != OK)
    forget_node(node);
  leave();
  errno = kept;
  return result;
}

EXPORT rcl_ret_t rcl_node_fini(void * node)
{
  typedef rcl_ret_t (*function)(void *);
  REAL(rcl_node_fini, "librcl.so", function);
  int number = number_of(node);
  rcl_ret_t result = real_function(node);
  int kept = errno;
  struct line line;
  if (number != 0 && recording()) {
    begin(&line, "node_end");
    add_number(&line, "node", number);
    finish(&line);
    forget_node(node);
  }
  errno = kept;
  return result;
}

/* Lifecycle nodes make endpoints when they are configured and activated: a record must tell whether they were.
 * rcl_lifecycle_state_machine_t begins with a pointer to the current state, which begins with its label. */
static struct {
  _Atomic(const void *) machine;
  atomic_int node;
} machines[NODES];

static int node_of_machine(const void * machine)
{
  for (int i = 0; i < NODES && atomic_load(&machines[i].machine) != NULL; i++)
    if (atomic_load(&machines[i].machine) == machine)
      return atomic_load(&machines[i].node);
  return 0;
}

EXPORT rcl_ret_t rcl_lifecycle_state_machine_init(
  void * machine, void * node, void * a, void * b, void * c, void * d, void * e, void * f, void * options)
{
  typedef rcl_ret_t (*function)(void *, void *, void *, void *, void *, void *, void *, void *, void *);
  REAL(rcl_lifecycle_state_machine_init, "librcl_lifecycle.so", function);
  for (int i = 0; i < NODES; i++) {
    const void * free_slot = NULL;
    if (atomic_load(&machines[i].machine) == machine ||
      atomic_compare_exchange_strong(&machines[i].machine, &free_slot, machine))
    {
      atomic_store(&machines[i].node, number_of(node));
      break;
    }
  }
  return real_function(machine, node, a, b, c, d, e, f, options);
}

static void note_state(const void * machine, rcl_ret_t result)
{
  int kept = errno;
  struct line line;
  const char * const * state = machine == NULL ? NULL : *(const char * const * const *)machine;
  if (result == OK && state != NULL && recording()) {
    begin(&line, "state");
    add_number(&line, "node", node_of_machine(machine));
    add_text(&line, "state", *state, LONGEST_NAME);
    finish(&line);
  }
  errno = kept;
}

EXPORT rcl_ret_t rcl_lifecycle_trigger_transition_by_id(void * machine, uint8_t transition, bool publish)
{
  typedef rcl_ret_t (*function)(void *, uint8_t, bool);
  REAL(rcl_lifecycle_trigger_transition_by_id, "librcl_lifecycle.so", function);
  rcl_ret_t result = real_function(machine, transition, publish);
  note_state(machine, result);
  return result;
}

EXPORT rcl_ret_t rcl_lifecycle_trigger_transition_by_label(void * machine, const char * label, bool publish)
{
  typedef rcl_ret_t (*function)(void *, const char *, bool);
  REAL(rcl_lifecycle_trigger_transition_by_label, "librcl_lifecycle.so", function);
  rcl_ret_t result = real_function(machine, label, publish);
  note_state(machine, result);
  return result;
}
