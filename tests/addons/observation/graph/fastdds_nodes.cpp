// Nodes on Fast DDS as rmw makes them, by command; see nodes.py for the commands.
//
//   fastdds_nodes DOMAIN ENCLAVE GID_SIZE

#include <algorithm>
#include <cstring>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <unistd.h>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

using Bytes = std::vector<unsigned char>;

// A type of which only the name matters; what is written are bytes with their own header.
class Opaque : public fast::TopicDataType {
 public:
  explicit Opaque(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1 << 16;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<Bytes*>(data);
    payload->encapsulation = CDR_LE;
    payload->length = static_cast<uint32_t>(bytes.size());
    std::memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return true; }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

Bytes guid_bytes(const rtps::GUID_t& guid) {
  Bytes bytes(guid.guidPrefix.value, guid.guidPrefix.value + 12);
  bytes.insert(bytes.end(), guid.entityId.value, guid.entityId.value + 4);
  return bytes;
}

struct Node {
  std::string fqn;
  std::vector<Bytes> entities[2];  // readers, writers
};

// ParticipantEntitiesInfo in CDR, little endian.
class Message {
 public:
  explicit Message(size_t gid_size) : gid_size_(gid_size), data_{0, 1, 0, 0} {}
  void gid(const Bytes& guid) {
    data_.insert(data_.end(), guid.begin(), guid.end());
    data_.resize(data_.size() + gid_size_ - guid.size());
  }
  void number(uint32_t value) {
    while (data_.size() % 4) data_.push_back(0);
    for (int i = 0; i < 4; ++i) data_.push_back(value >> 8 * i & 0xff);
  }
  void text(const std::string& text) {
    number(static_cast<uint32_t>(text.size() + 1));
    data_.insert(data_.end(), text.begin(), text.end());
    data_.push_back(0);
  }
  Bytes data() const { return data_; }

 private:
  size_t gid_size_;
  Bytes data_;
};

Bytes list_of(const Bytes& participant, const std::vector<Node>& nodes, size_t gid_size) {
  Message message(gid_size);
  message.gid(participant);
  message.number(static_cast<uint32_t>(nodes.size()));
  for (const auto& node : nodes) {
    const auto slash = node.fqn.rfind('/');
    message.text(slash ? node.fqn.substr(0, slash) : "/");
    message.text(node.fqn.substr(slash + 1));
    for (const auto& entities : node.entities) {
      message.number(static_cast<uint32_t>(entities.size()));
      for (const auto& each : entities) message.gid(each);
    }
  }
  return message.data();
}

fast::DomainParticipantQos on_loopback(const std::string& enclave) {
  fast::DomainParticipantQos qos;
  qos.name(enclave);
  const std::string user_data = "enclave=" + enclave + ";";
  qos.user_data().assign(user_data.begin(), user_data.end());
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.push_back("127.0.0.1");
  udp->maxInitialPeersRange = 120;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  rtps::Locator_t loopback;
  rtps::IPLocator::setIPv4(loopback, 127, 0, 0, 1);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.metatrafficUnicastLocatorList.push_back(loopback);
  builtin.initialPeersList.push_back(loopback);
  builtin.discovery_config.leaseDuration_announcementperiod = eprosima::fastrtps::Duration_t(1, 0);
  // What rmw_fastrtps asks for, so that peers learn the process.
  auto& properties = qos.properties().properties();
  properties.emplace_back("fastdds.physical_data.host", "");
  properties.emplace_back("fastdds.physical_data.user", "");
  properties.emplace_back("fastdds.physical_data.process", "");
  return qos;
}

class Program {
 public:
  Program(uint32_t domain, const std::string& enclave, size_t gid_size) : gid_size_(gid_size) {
    participant_ =
        fast::DomainParticipantFactory::get_instance()->create_participant(domain, on_loopback(enclave));
    publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    auto qos = fast::DATAWRITER_QOS_DEFAULT;
    qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
    lists_ = publisher_->create_datawriter(
        topic("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"), qos);
  }

  ~Program() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  // False at the end.
  bool obey(const std::string& line) {
    std::istringstream words(line);
    std::string verb, name, type, quality;
    words >> verb >> name >> type;
    std::getline(words, quality);
    if (verb == "node") nodes_.push_back({name, {}});
    if (verb == "writer" || verb == "reader") make(verb, name, type, quality);
    if (verb == "remove") remove(name, type);
    if (verb == "list" && gid_size_) {
      auto bytes = list_of(guid_bytes(participant_->guid()), nodes_, gid_size_);
      lists_->write(&bytes);
    }
    return verb != "end";
  }

  std::string guid() const {
    std::ostringstream text;
    text << std::hex;
    for (unsigned char byte : guid_bytes(participant_->guid())) text << byte / 16 << byte % 16;
    return text.str();
  }

 private:
  fast::Topic* topic(const std::string& name, const std::string& type) {
    auto*& known = topics_[name];
    if (known == nullptr) {
      fast::TypeSupport(new Opaque(type)).register_type(participant_);
      known = participant_->create_topic(name, type, fast::TOPIC_QOS_DEFAULT);
    }
    return known;
  }

  template <typename Qos>
  void set(Qos& qos, const std::string& words) {
    const bool best_effort = words.find("best_effort") != std::string::npos;
    qos.reliability().kind =
        best_effort ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
    const bool latched = words.find("transient_local") != std::string::npos;
    qos.durability().kind =
        latched ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  }

  void make(const std::string& verb, const std::string& name, const std::string& type,
            const std::string& quality) {
    Bytes guid;
    if (verb == "writer") {
      auto qos = fast::DATAWRITER_QOS_DEFAULT;
      set(qos, quality);
      writers_[name] = publisher_->create_datawriter(topic(name, type), qos);
      guid = guid_bytes(writers_[name]->guid());
    } else {
      auto qos = fast::DATAREADER_QOS_DEFAULT;
      set(qos, quality);
      readers_[name] = subscriber_->create_datareader(topic(name, type), qos);
      guid = guid_bytes(readers_[name]->guid());
    }
    if (!nodes_.empty()) nodes_.back().entities[verb == "writer"].push_back(guid);
  }

  void remove(const std::string& verb, const std::string& name) {
    const bool writes = verb == "writer";
    const Bytes guid = guid_bytes(writes ? writers_[name]->guid() : readers_[name]->guid());
    for (auto& node : nodes_) {
      auto& entities = node.entities[writes];
      entities.erase(std::remove(entities.begin(), entities.end(), guid), entities.end());
    }
    if (writes) {
      publisher_->delete_datawriter(writers_[name]);
    } else {
      subscriber_->delete_datareader(readers_[name]);
    }
  }

  size_t gid_size_;
  fast::DomainParticipant* participant_;
  fast::Publisher* publisher_;
  fast::Subscriber* subscriber_;
  fast::DataWriter* lists_;
  std::map<std::string, fast::Topic*> topics_;
  std::map<std::string, fast::DataWriter*> writers_;
  std::map<std::string, fast::DataReader*> readers_;
  std::vector<Node> nodes_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  // The log goes to standard output, too: answers need one for themselves.
  const int answers = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  Program program(static_cast<uint32_t>(std::stoul(argv[1])), argv[2], std::stoul(argv[3]));
  for (std::string line; std::getline(std::cin, line) && program.obey(line);) {
    const std::string answer = "ok " + program.guid() + "\n";
    if (write(answers, answer.data(), answer.size()) < 0) return 1;
  }
  return 0;
}
