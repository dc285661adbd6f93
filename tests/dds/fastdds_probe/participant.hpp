// One DDS participant on loopback with the security files of an enclave directory, as rmw_fastrtps sets them up.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>

namespace probe {

class Participant {
 public:
  // `directory` is "-" for no security. Check `allowed()` before anything else.
  Participant(std::string label, const std::string& directory, uint32_t domain);
  ~Participant();

  bool allowed() const { return participant_ != nullptr; }
  const std::string& label() const { return label_; }

  // False when DDS refuses the endpoint.
  bool publish(const std::string& topic);
  bool subscribe(const std::string& topic);

  // Every publisher says who it is.
  void talk();
  // (topic, text) of what was heard for the first time.
  std::vector<std::pair<std::string, std::string>> listen();

 private:
  eprosima::fastdds::dds::Topic* topic(const std::string& name);

  std::string label_;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  std::map<std::string, eprosima::fastdds::dds::Topic*> topics_;
  std::vector<eprosima::fastdds::dds::DataWriter*> writers_;
  std::vector<eprosima::fastdds::dds::DataReader*> readers_;
  std::set<std::pair<std::string, std::string>> heard_;
};

}  // namespace probe
