// What the stand-in for rcl asks Fast DDS: may a process with this enclave join, may it have this endpoint.
#include "participant.hpp"

namespace {
probe::Participant* participant;  // until the process ends
}

extern "C" bool stand_in_join(const char* folder, unsigned domain) {
  participant = new probe::Participant("stand_in", folder, domain);
  return participant->allowed();
}

extern "C" bool stand_in_endpoint(const char* topic, bool writes) {
  return writes ? participant->publish(topic) : participant->subscribe(topic);
}
