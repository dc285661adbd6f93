// What of rclcpp the random programs use. It writes each node and interface to standard output under its final name with
// the calls that led to it, takes parameters from the scenario, and calls callbacks in an order that the seed decides.
#pragma once
#include <execinfo.h>
#include <sys/wait.h>
#include <unistd.h>
#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>
using namespace std::chrono_literals;

namespace std_msgs::msg { struct String { using SharedPtr = std::shared_ptr<String>; std::string data; }; }
namespace std_srvs::srv {
struct Empty {
  struct Request { using SharedPtr = std::shared_ptr<Request>; };
  struct Response { using SharedPtr = std::shared_ptr<Response>; };
};
}
namespace rcl_interfaces::msg { struct SetParametersResult { bool successful = true; std::string reason; }; }

namespace rclcpp {
using Value = std::string;  // of a parameter, as text
inline std::map<std::string, Value> & given() { static std::map<std::string, Value> all; return all; }
using Callback = std::shared_ptr<std::function<void()>>;  // shared: a closure keeps what it changed of itself
inline std::string text_of(const std::string & value) { return value; }
inline std::string text_of(int value) { return std::to_string(value); }
inline std::string text_of(bool value) { return value ? "true" : "false"; }
inline void set(std::string & to, const Value & value) { to = value; }
inline void set(int & to, const Value & value) { to = std::stoi(value); }
inline void set(bool & to, const Value & value) { to = value == "true"; }

class Parameter {
public:
  Parameter() = default;
  Parameter(std::string name, Value value) : name_(std::move(name)), value_(std::move(value)) {}
  std::string get_name() const { return name_; }
  std::string as_string() const { return value_; }
  int as_int() const { return std::stoi(value_); }
  bool as_bool() const { return value_ == "true"; }
private:
  std::string name_;
  Value value_;
};
using Calls = std::vector<void *>;  // return addresses
inline Calls & registered() { static Calls calls; return calls; }  // those that led to the callback that runs
inline Calls calls_until_here() {
  Calls calls(100);
  calls.resize(backtrace(calls.data(), calls.size()));
  calls.insert(calls.end(), registered().begin(), registered().end());
  return calls;
}
inline void write(const std::string & kind, const std::string & name) {
  std::cout << kind << " " << name;
  for (void * address : calls_until_here()) std::cout << " " << address;
  std::cout << "\n";
}
template <typename T> struct Made { using SharedPtr = std::shared_ptr<Made>; void publish(const T &) {} };
template <typename T> using Publisher = Made<T>;
template <typename T> using Subscription = Made<T>;
template <typename T> using Service = Made<T>;
template <typename T> using Client = Made<T>;
struct TimerBase { using SharedPtr = std::shared_ptr<TimerBase>; };

class Node : public std::enable_shared_from_this<Node> {
public:
  using SharedPtr = std::shared_ptr<Node>;
  explicit Node(const std::string & name, const std::string & space = "") : name_(name), space_(space) {
    write("node", space_ + "/" + name_);
  }
  Node(const Node &) = delete;
  virtual ~Node() = default;
  template <typename T> std::shared_ptr<Made<T>> create_publisher(const std::string & name, int) {
    return made<T>("publisher", name);
  }
  template <typename T, typename F> std::shared_ptr<Made<T>> create_subscription(const std::string & name, int, F call) {
    call_later([call]() mutable {
      static const char * texts[] = {"left", "right", "m"};
      auto message = std::make_shared<T>();
      message->data = texts[std::rand() % 3];
      call(message);
    });
    return made<T>("subscription", name);
  }
  template <typename T, typename F> std::shared_ptr<Made<T>> create_service(const std::string & name, F call) {
    call_later([call]() mutable {
      call(std::make_shared<typename T::Request>(), std::make_shared<typename T::Response>());
    });
    return made<T>("service_server", name);
  }
  template <typename T> std::shared_ptr<Made<T>> create_client(const std::string & name) {
    return made<T>("service_client", name);
  }
  template <typename D, typename F> TimerBase::SharedPtr create_wall_timer(D, F call) {
    call_later([call]() mutable { call(); });
    return std::make_shared<TimerBase>();
  }
  template <typename F> std::shared_ptr<int> add_on_set_parameters_callback(F call) {
    call_later([this, call]() mutable {
      std::vector<Parameter> changed;
      for (auto & each : parameters_) changed.emplace_back(each.first, std::rand() % 2 ? "true" : "7");
      call(changed);
    });
    return std::make_shared<int>();
  }
  template <typename T> T declare_parameter(const std::string & name, const T & fallback) {
    if (parameters_.count(name)) throw std::runtime_error("declared twice");
    parameters_[name] = given().count(name) ? given()[name] : text_of(fallback);
    T value;
    set(value, parameters_[name]);
    return value;
  }
  std::string declare_parameter(const std::string & name, const char * fallback) {
    return declare_parameter<std::string>(name, fallback);
  }
  Parameter get_parameter(const std::string & name) const { return Parameter(name, parameters_.at(name)); }
  template <typename T> bool get_parameter(const std::string & name, T & to) const {
    if (!parameters_.count(name)) return false;
    set(to, parameters_.at(name));
    return true;
  }
  std::string get_name() const { return name_; }
  std::vector<Callback> callbacks;
private:
  template <typename F> void call_later(F call) {
    callbacks.push_back(std::make_shared<std::function<void()>>([call, led = calls_until_here()]() mutable {
      registered() = led;
      call();
      registered().clear();
    }));
  }
  template <typename T> std::shared_ptr<Made<T>> made(const char * kind, const std::string & name) {
    const std::string full = name[0] == '/' ? name : name[0] == '~' ? space_ + "/" + name_ + name.substr(1) : space_ + "/" + name;
    write(kind, full);
    return std::make_shared<Made<T>>();
  }
  std::string name_, space_;
  std::map<std::string, Value> parameters_;
};

inline void init(int, char **) {}
inline void shutdown() {}
// Some callbacks in any order, then each once; those that callbacks register have their turn too.
inline void spin(const std::vector<std::shared_ptr<Node>> & nodes) {
  auto call = [&](std::size_t number) {
    for (auto & node : nodes) {
      if (number < node->callbacks.size()) {
        Callback callback = node->callbacks[number];
        (*callback)();
        return true;
      }
      number -= node->callbacks.size();
    }
    return false;
  };
  auto count = [&]() {
    std::size_t all = 0;
    for (auto & node : nodes) all += node->callbacks.size();
    return all;
  };
  for (std::size_t left = count() * (std::rand() % 3); left > 0 && count() < 60; --left) call(std::rand() % count());
  for (std::size_t number = 0; number < 60 && call(number); ++number) {}
}
inline void spin(std::shared_ptr<Node> node) { spin(std::vector<std::shared_ptr<Node>>{node}); }
namespace executors {
class SingleThreadedExecutor {
public:
  void add_node(std::shared_ptr<Node> node) { nodes_.push_back(node); }
  void spin() { rclcpp::spin(nodes_); }
private:
  std::vector<std::shared_ptr<Node>> nodes_;
};
}
}  // namespace rclcpp

// A run of one program in a process of its own: RUN program seed, what it made, and how it ended.
inline void in_a_process(const char * program, int (*run)(int, char **), int seed, const char * parameters) {
  std::cout << "RUN " << program << " " << seed << std::endl;
  const pid_t child = fork();
  if (child == 0) {
    alarm(2);
    std::srand(seed);
    std::istringstream words(parameters);
    for (std::string word; words >> word;) {
      rclcpp::given()[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
    }
    int status = 0;
    try { run(0, nullptr); } catch (const std::exception &) { status = 1; }
    std::cout << std::flush;
    _exit(status);
  }
  int status = 0;
  waitpid(child, &status, 0);
  std::cout << "END " << (WIFEXITED(status) ? WEXITSTATUS(status) : 2) << std::endl;
}
