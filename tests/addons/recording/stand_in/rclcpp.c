/* A stand-in for librclcpp and the programs on it: asks rcl for what a script says, one order a line.
 *
 *   node NAME [NAMESPACE]      begin a node; what follows belongs to it, with rclcpp's own services before
 *   lifecycle NAME             the same, as a lifecycle node; "state 1" and "state 2" make it inactive and active
 *   end                        end the node
 *   KIND NAME TYPE             one endpoint; NAME may hold %n for the node's final name, %1 for a word of the
 *                              command line
 *   many COUNT THREADS         that many publishers, made in parallel
 *   fork                       a child makes what follows, the parent only waits for it
 *   full | free                open files until there are no more, and close one again
 *   say TEXT                   on standard error
 *   abort | kill | wait        end by a signal, or stay until one comes
 *
 * A refused endpoint ends the program (134, as an exception that nobody catches), unless STAND_IN_CATCHES is set.
 */
#define _GNU_SOURCE
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

typedef int rcl_ret_t;
rcl_ret_t rcl_init(int, char const * const *, const void *, void *);
rcl_ret_t rcl_node_init(void *, const char *, const char *, void *, const void *);
rcl_ret_t rcl_node_fini(void *);
const char * rcl_node_get_fully_qualified_name(const void *);
rcl_ret_t rcl_publisher_init(void *, const void *, const void *, const char *, const void *);
rcl_ret_t rcl_subscription_init(void *, const void *, const void *, const char *, const void *);
rcl_ret_t rcl_service_init(void *, const void *, const void *, const char *, const void *);
rcl_ret_t rcl_client_init(void *, const void *, const void *, const char *, const void *);
rcl_ret_t rcl_action_server_init(void *, void *, void *, const void *, const char *, const void *);
rcl_ret_t rcl_action_client_init(void *, void *, const void *, const char *, const void *);
rcl_ret_t rcl_lifecycle_state_machine_init(
  void *, void *, void *, void *, void *, void *, void *, void *, void *);
rcl_ret_t rcl_lifecycle_trigger_transition_by_id(void *, uint8_t, bool);
const void * stand_in_support(const char * type, int place);
const char * stand_in_error(void);

static int quality[8] = {1, 0, 10, 0, 1, 2};
static const char * const parameter_services[] = {"describe_parameters", "get_parameter_types", "get_parameters",
  "list_parameters", "set_parameters", "set_parameters_atomically"};

static void check(rcl_ret_t result, const char * what)
{
  if (result == 0)
    return;
  fprintf(stderr, "could not create %s\n", what);
  if (!getenv("STAND_IN_CATCHES"))
    abort();
}

static rcl_ret_t make(void * node, const char * kind, const char * name, const char * type)
{
  char thing[64];
  if (!strcmp(kind, "publisher"))
    return rcl_publisher_init(thing, node, stand_in_support(type, 4), name, quality);
  if (!strcmp(kind, "subscription"))
    return rcl_subscription_init(thing, node, stand_in_support(type, 4), name, quality);
  if (!strcmp(kind, "service_server"))
    return rcl_service_init(thing, node, stand_in_support(type, 9), name, NULL);
  if (!strcmp(kind, "service_client"))
    return rcl_client_init(thing, node, stand_in_support(type, 9), name, NULL);
  if (!strcmp(kind, "action_server"))
    return rcl_action_server_init(thing, node, NULL, stand_in_support(type, 6), name, NULL);
  return rcl_action_client_init(thing, node, stand_in_support(type, 6), name, NULL);
}

static const char * final_name(const void * node) { return strrchr(rcl_node_get_fully_qualified_name(node), '/') + 1; }

static void begin_node(void * node, const char * name, const char * space)
{
  char text[600];
  check(rcl_node_init(node, name, space, NULL, NULL), "node");
  if (rcl_node_get_fully_qualified_name(node)[0] == 0)
    exit(1);
  for (int i = 0; i < 6; i++) {
    snprintf(text, sizeof text, "%s/%s", final_name(node), parameter_services[i]);
    check(make(node, "service_server", text, "rcl_interfaces/srv/X"), text);
  }
  check(make(node, "publisher", "/parameter_events", "rcl_interfaces/msg/ParameterEvent"), "/parameter_events");
  check(make(node, "subscription", "/parameter_events", "rcl_interfaces/msg/ParameterEvent"), "/parameter_events");
}

struct batch { void * node; int first, count; };
static void * make_batch(void * argument)
{
  struct batch * batch = argument;
  for (int i = 0; i < batch->count; i++) {
    char name[64];
    snprintf(name, sizeof name, "topic_%d", batch->first + i);
    make(batch->node, "publisher", name, "std_msgs/msg/String");
  }
  return NULL;
}

static void make_many(void * node, int count, int threads)
{
  pthread_t ids[64];
  struct batch batches[64];
  for (int i = 0; i < threads; i++) {
    batches[i] = (struct batch){node, i * (count / threads), count / threads};
    pthread_create(&ids[i], NULL, make_batch, &batches[i]);
  }
  for (int i = 0; i < threads; i++)
    pthread_join(ids[i], NULL);
}

/* %n and %1 in a name */
static void fill(const char * name, const void * node, char ** argv, char * out)
{
  const char * at = strchr(name, '%');
  if (at == NULL)
    strcpy(out, name);
  else
    sprintf(out, "%.*s%s%s", (int)(at - name), name, at[1] == 'n' ? final_name(node) : argv[at[1] - '0'], at + 2);
}

int stand_in_run(int argc, char ** argv, const char * script)
{
  static char nodes[16][4096], machine[256];
  int current = -1, last, opened = -1;
  char line[1024], words[3][512], name[1024];
  FILE * file = fopen(script, "r");
  if (file == NULL)
    return 2;
  check(rcl_init(argc, (char const * const *)argv, NULL, NULL), "context");
  while (fgets(line, sizeof line, file)) {
    words[0][0] = words[1][0] = words[2][0] = 0;
    if (sscanf(line, "%511s %511s %511s", words[0], words[1], words[2]) < 1 || words[0][0] == '#')
      continue;
    void * node = current < 0 ? NULL : nodes[current];
    if (!strcmp(words[0], "node") || !strcmp(words[0], "lifecycle")) {
      current = (current + 1) % 16;
      begin_node(nodes[current], words[1], words[2]);
      if (words[0][0] == 'l')
        check(rcl_lifecycle_state_machine_init(
          machine, nodes[current], NULL, NULL, NULL, NULL, NULL, NULL, NULL), "lifecycle node");
    } else if (!strcmp(words[0], "state")) {
      rcl_lifecycle_trigger_transition_by_id(machine, (uint8_t)atoi(words[1]), true);
    } else if (!strcmp(words[0], "end")) {
      rcl_node_fini(node);
      current--;
    } else if (!strcmp(words[0], "many")) {
      make_many(node, atoi(words[1]), atoi(words[2]));
    } else if (!strcmp(words[0], "fork")) {
      pid_t child = fork();
      if (child > 0) {
        waitpid(child, NULL, 0);
        return 0;
      }
    } else if (!strcmp(words[0], "full")) {
      while ((last = dup(2)) >= 0)
        opened = last;
    } else if (!strcmp(words[0], "free")) {
      close(opened);
    } else if (!strcmp(words[0], "say")) {
      fprintf(stderr, "%s", line + 4);
    } else if (!strcmp(words[0], "abort")) {
      abort();
    } else if (!strcmp(words[0], "kill")) {
      raise(SIGKILL);
    } else if (!strcmp(words[0], "wait")) {
      pause();
    } else {
      fill(words[1], node, argv, name);
      check(make(node, words[0], name, words[2]), name);
    }
  }
  return 0;
}
