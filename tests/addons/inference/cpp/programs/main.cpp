int main(int argc, char ** argv) {
  rclcpp::init(argc, argv);
  auto node = std::make_shared<Demo>();
  rclcpp::spin(node->get_node_base_interface());
}
