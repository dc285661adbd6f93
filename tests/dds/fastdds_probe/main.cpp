// The Fast DDS half of the probe; the job and its answers are described in tests/dds/probe.py.
//
//   fastdds_probe JOBFILE

#include <chrono>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include "participant.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using Participants = std::vector<std::unique_ptr<probe::Participant>>;

void answer(const std::string& label, const std::string& what, const std::string& detail,
            const std::string& result) {
  std::cout << label << '\t' << what << '\t' << detail << '\t' << result << std::endl;
}

std::string verdict(bool allowed) { return allowed ? "allowed" : "refused"; }

// Everybody talks and listens for `longest` seconds, or until nothing new was heard for `quiet` (0: never).
void run(Participants& participants, double longest, double quiet) {
  const auto start = Clock::now();
  auto last_news = start;
  bool any_news = false;
  while (Seconds(Clock::now() - start).count() < longest) {
    for (auto& participant : participants) {
      participant->talk();
      for (auto& [topic, text] : participant->listen()) {
        answer(participant->label(), "heard", topic, text);
        last_news = Clock::now();
        any_news = true;
      }
    }
    if (quiet > 0 && any_news && Seconds(Clock::now() - last_news).count() > quiet) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

// One line of the job. Lines about a participant that was refused are skipped: there is nobody to try them.
void carry_out(const std::vector<std::string>& words, uint32_t& domain, Participants& participants) {
  const std::string& verb = words.at(0);
  if (verb == "domain") {
    domain = static_cast<uint32_t>(std::stoul(words.at(1)));
  } else if (verb == "participant") {
    participants.push_back(std::make_unique<probe::Participant>(words.at(1), words.at(2), domain));
    answer(words.at(1), "participant", "-", verdict(participants.back()->allowed()));
  } else if (verb == "run") {
    for (auto it = participants.begin(); it != participants.end();) {
      it = (*it)->allowed() ? it + 1 : participants.erase(it);
    }
    answer("-", "ready", "-", "-");
    run(participants, std::stod(words.at(1)), std::stod(words.at(2)));
  } else if (participants.back()->allowed()) {
    auto& participant = *participants.back();
    const bool allowed =
        verb == "publish" ? participant.publish(words.at(1)) : participant.subscribe(words.at(1));
    answer(participant.label(), verb, words.at(1), verdict(allowed));
  }
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream stream(line);
  for (std::string word; std::getline(stream, word, '\t');) words.push_back(word);
  return words;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: fastdds_probe JOBFILE" << std::endl;
    return 2;
  }
  // Participants of one process talk over the (secured) network like everybody else.
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);

  uint32_t domain = 0;
  Participants participants;
  std::ifstream job(argv[1]);
  for (std::string line; std::getline(job, line);) {
    if (!line.empty()) carry_out(split(line), domain, participants);
  }
  participants.clear();
  eprosima::fastdds::dds::Log::Flush();
  return 0;
}
