// SPDX-License-Identifier: Apache-2.0
// Measures streams of 10 000 frames per second each, on 1, 4 and 16 pseudo-terminals at once.
#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include <sys/wait.h>

#include "absenc/host/session.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/raa38/serial/frame.hpp"
#include "absenc/protocol/raa38/unit.hpp"

namespace {

using namespace absenc;
using namespace absenc::raa38;
using namespace std::chrono_literals;

constexpr std::array<std::size_t, 3> counts{1, 4, 16};
constexpr std::uint32_t frames_each = 20'000;  // number of frames that are sent on each port, which takes two seconds
constexpr std::uint32_t together = 10;         // number of frames that are sent at once, every millisecond
constexpr int rounds = 3;

[[noreturn]] void fail(const char* what) {
  std::perror(what);
  std::exit(1);
}

struct Terminal {
  Terminal() : master(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0) fail("pseudo-terminal");
    path = ::ptsname(master);
  }
  ~Terminal() { ::close(master); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  int master;
  std::string path;
};

// Sends the frames. Their position is the number of the frame, so that a missing frame is detected.
void transmit(const std::vector<Terminal>& terminals) {
  const serial::Format format{.bits = 16};
  std::vector<std::vector<std::uint8_t>> unsent(terminals.size());
  Time due = os::now();
  for (std::uint32_t frame = 0;; due += 1ms) {
    os::sleep_until(due);
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t i = 0; i < together; ++i) {
      const serial::FrameBytes one = serial::encode_position(format, {frame++ & 0xFFFF});
      bytes.insert(bytes.end(), one.view().begin(), one.view().end());
    }
    for (std::size_t i = 0; i < terminals.size(); ++i) {
      std::vector<std::uint8_t>& rest = unsent[i];
      rest.insert(rest.end(), bytes.begin(), bytes.end());
      const ssize_t size = ::write(terminals[i].master, rest.data(), rest.size());
      if (size > 0) rest.erase(rest.begin(), rest.begin() + size);
    }
  }
}

struct Reader {
  std::uint64_t missing = 0;
  std::uint64_t failed = 0;
};

Reader read_stream(const std::string& path, std::atomic<std::size_t>& ready, std::size_t all) {
  Options options;
  const std::array<OptionText, 1> settings{{{"bits", "16"}}};
  if (resolve_options(serial_unit, {}, settings, options).kind != OptionError::Kind::none) std::exit(1);
  os::SerialPort port(path, {.rate = 1'000'000});
  std::vector<std::byte> storage(serial_unit.host_storage);
  host::Session<std::uint8_t> session(serial_unit, options, port, storage, host::EchoMode::automatic, 1);
  const Command& command = *find_command(serial_unit, Verb::read);
  ++ready;
  while (ready < all) std::this_thread::yield();
  Reader reader;
  std::uint64_t last = session.read(command, host::Take::every)->reading()->singleturn;
  for (std::uint32_t i = 0; i < frames_each; ++i) {
    const auto* conversation = session.read(command, host::Take::every);
    if (conversation->error() != Error::none) {
      ++reader.failed;
      continue;
    }
    reader.missing += (conversation->reading()->singleturn - last - 1) & 0xFFFF;
    last = conversation->reading()->singleturn;
  }
  return reader;
}

/// Measures streams on `ports` ports. Returns the processor time of this process per received frame, in microseconds.
double measure(std::size_t ports) {
  const std::vector<Terminal> terminals(ports);
  const pid_t child = ::fork();
  if (child < 0) fail("fork");
  if (child == 0) transmit(terminals);
  std::atomic<std::size_t> ready = 0;
  std::vector<Reader> readers(ports);
  const Time before = os::processor_time();
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < ports; ++i) {
      threads.emplace_back([&, i] { readers[i] = read_stream(terminals[i].path, ready, ports); });
    }
  }
  const Time used = os::processor_time() - before;
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  for (const Reader& reader : readers) {
    if (reader.missing == 0 && reader.failed == 0) continue;
    std::printf("%zu ports: %llu frames missing, %llu failed\n", ports, static_cast<unsigned long long>(reader.missing),
                static_cast<unsigned long long>(reader.failed));
    std::exit(1);
  }
  return static_cast<double>(used.count()) / 1e3 / static_cast<double>(ports * frames_each);
}

}  // namespace

int main() {
  std::array<std::vector<double>, counts.size()> all;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < counts.size(); ++i) all[i].push_back(measure(counts[i]));
  }
  double first = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    std::nth_element(all[i].begin(), all[i].begin() + rounds / 2, all[i].end());
    const double median = all[i][rounds / 2];
    if (i == 0) first = median;
    std::printf("%2zu ports with 10000 frames a second each: no frame lost, %.3f us of processor time a frame (%.2f)\n",
                counts[i], median, median / first);
  }
}
