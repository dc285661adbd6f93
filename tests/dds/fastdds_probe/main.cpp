// The Fast DDS half of the probe; the job and its answers are described in tests/dds/probe.py.
//
//   fastdds_probe JOBFILE

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/log/Log.hpp>

#include "participant.hpp"

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using Words = std::vector<std::string>;

// One participant and what it shall try.
struct Job {
  std::string label;
  std::string directory;
  std::vector<Words> environment;
  std::vector<Words> attempts;
};

// Fast DDS logs to the standard output, from threads of its own and in pieces: answers need an output for themselves.
int answers = STDOUT_FILENO;

void leave_standard_output_to_the_log() {
  answers = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
}

// One write per line: the processes of a probe share their output.
void answer(const std::string& label, const std::string& what, const std::string& detail,
            const std::string& result) {
  const std::string line = label + '\t' + what + '\t' + detail + '\t' + result + '\n';
  if (write(answers, line.data(), line.size()) != static_cast<ssize_t>(line.size())) std::abort();
}

std::string verdict(bool allowed) { return allowed ? "allowed" : "refused"; }

void run(probe::Participant& participant, double seconds) {
  const auto start = Clock::now();
  while (Seconds(Clock::now() - start).count() < seconds) {
    participant.talk();
    for (auto& [topic, text] : participant.listen()) {
      answer(participant.label(), "heard", topic, text);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

// In a process of its own.
void carry_out(const Job& job, uint32_t domain) {
  for (auto& entry : job.environment) setenv(entry.at(1).c_str(), entry.at(2).c_str(), 1);
  probe::Participant participant(job.label, job.directory, domain);
  answer(job.label, "participant", "-", verdict(participant.allowed()));
  if (!participant.allowed()) return;
  const auto attempt = [&](const Words& words) {
    const std::string& topic = words.at(1);
    return words.at(0) == "publish" ? participant.publish(topic) : participant.subscribe(topic);
  };
  const auto tell = [&](const Words& words, bool allowed) {
    answer(job.label, words.at(0), words.at(1), verdict(allowed));
  };
  for (auto& words : job.attempts) {
    if (words.at(0) == "run") {
      run(participant, std::stod(words.at(1)));
    } else {
      tell(words, attempt(words));
    }
  }
}

Words split(const std::string& line) {
  Words words;
  std::istringstream stream(line);
  for (std::string word; std::getline(stream, word, '\t');) words.push_back(word);
  return words;
}

// The jobs of a file; `run` is for all participants.
std::vector<Job> read_jobs(std::istream& lines, uint32_t& domain) {
  std::vector<Job> jobs;
  std::vector<Words> environment;
  for (std::string line; std::getline(lines, line);) {
    const Words words = split(line);
    if (words.empty()) continue;
    if (words[0] == "domain") {
      domain = static_cast<uint32_t>(std::stoul(words.at(1)));
    } else if (words[0] == "environment") {
      environment.push_back(words);
    } else if (words[0] == "participant") {
      jobs.push_back({words.at(1), words.at(2), environment, {}});
      environment.clear();
    } else if (words[0] == "run") {
      for (auto& job : jobs) job.attempts.push_back(words);
    } else {
      jobs.back().attempts.push_back(words);
    }
  }
  return jobs;
}

}  // namespace

int main(int argc, char** argv) {
  leave_standard_output_to_the_log();
  if (argc != 2) {
    std::cerr << "usage: fastdds_probe JOBFILE" << std::endl;
    return 2;
  }
  uint32_t domain = 0;
  std::ifstream file(argv[1]);
  std::vector<pid_t> children;
  for (auto& job : read_jobs(file, domain)) {
    children.push_back(fork());
    if (children.back() == 0) {
      carry_out(job, domain);
      eprosima::fastdds::dds::Log::Flush();
      std::exit(0);
    }
  }
  int worst = 0;
  for (pid_t child : children) {
    int status = 0;
    waitpid(child, &status, 0);
    worst = std::max(worst, WIFEXITED(status) ? WEXITSTATUS(status) : 1);
  }
  return worst;
}
