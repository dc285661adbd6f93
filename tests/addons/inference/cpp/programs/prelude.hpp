#include <rclcpp/rclcpp.hpp>
#include <rclcpp_action/rclcpp_action.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>
#include <example_interfaces/action/fibonacci.hpp>
#include <std_msgs/msg/string.hpp>
#include <std_srvs/srv/empty.hpp>
#include <algorithm>
#include <any>
#include <bitset>
#include <concepts>
#include <iomanip>
#include <numeric>
#include <optional>
#include <queue>
#include <ranges>
#include <stack>
#include <variant>
using S = std_msgs::msg::String;
using Empty = std_srvs::srv::Empty;
using Fibonacci = example_interfaces::action::Fibonacci;
using namespace std::chrono_literals;
class Maker : public rclcpp::Node {
public:
  using rclcpp::Node::Node;
  void pub(const std::string & topic) { kept.push_back(create_publisher<S>(topic, 1)); }
  std::vector<rclcpp::PublisherBase::SharedPtr> kept;
};
