// SPDX-License-Identifier: Apache-2.0
// Measures readings per second over a pseudo-terminal, compared with bare calls of ppoll, read and write.
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absenc/host/drive.hpp"
#include "absenc/host/session.hpp"
#include "absenc/os/emulator_port.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/motion.hpp"

namespace {

using namespace absenc;

constexpr std::array<std::uint8_t, 11> reply{0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A};

[[noreturn]] void fail(const char* what) {
  std::perror(what);
  std::exit(1);
}

void wait_readable(int descriptor) {
  pollfd source{descriptor, POLLIN, 0};
  if (ppoll(&source, 1, nullptr, nullptr) < 0) fail("ppoll");
}

int open_raw(const char* path) {
  const int descriptor = path == nullptr ? posix_openpt(O_RDWR | O_NOCTTY) : open(path, O_RDWR | O_NOCTTY);
  if (descriptor < 0) fail("open");
  termios settings{};
  if (tcgetattr(descriptor, &settings) != 0) fail("tcgetattr");
  cfmakeraw(&settings);
  if (tcsetattr(descriptor, TCSANOW, &settings) != 0) fail("tcsetattr");
  return descriptor;
}

/// A child process. `end` returns its user CPU time in seconds.
class Child {
 public:
  explicit Child(const std::function<void()>& body) : pid_(fork()) {
    if (pid_ < 0) fail("fork");
    if (pid_ == 0) {
      body();
      _exit(0);
    }
  }
  ~Child() { end(); }
  double end() {
    if (pid_ <= 0) return 0;
    rusage usage{};
    kill(pid_, SIGKILL);
    if (wait4(std::exchange(pid_, 0), nullptr, 0, &usage) < 0) fail("wait4");
    return static_cast<double>(usage.ru_utime.tv_sec) + static_cast<double>(usage.ru_utime.tv_usec) * 1e-6;
  }

 private:
  pid_t pid_;
};

/// Exchanges requests and replies by bare system calls. A child process is the encoder.
class BareLoop {
 public:
  BareLoop() : master_(open_raw(nullptr)), child_([this] { answer(); }) {
    if (grantpt(master_) != 0 || unlockpt(master_) != 0) fail("unlockpt");
    slave_ = open_raw(ptsname(master_));
  }
  void exchange() const {
    const std::uint8_t request = 0x1A;
    if (write(slave_, &request, 1) != 1) fail("write");
    std::array<std::uint8_t, 64> buffer{};
    for (std::size_t size = 0; size < reply.size();) {
      wait_readable(slave_);
      const ssize_t count = read(slave_, buffer.data() + size, buffer.size() - size);
      if (count <= 0) fail("read");
      size += static_cast<std::size_t>(count);
    }
    if (std::memcmp(buffer.data(), reply.data(), reply.size()) != 0) fail("compare");
  }
  double end() { return child_.end(); }

 private:
  void answer() const {
    for (;;) {
      wait_readable(master_);
      std::array<std::uint8_t, 64> buffer{};
      const ssize_t count = read(master_, buffer.data(), buffer.size());
      // While the host's end of the pseudo-terminal is not yet open, `read` fails and is tried again.
      if (count > 0 && write(master_, reply.data(), reply.size()) < 0) _exit(1);
    }
  }
  int master_;
  int slave_ = -1;
  Child child_;
};

/// Reads positions through the whole library. A child process is the encoder.
class Stack {
 public:
  explicit Stack(std::string link)
      : link_(std::move(link)), child_([this] { emulate(); }), storage_(unit_.host_storage) {
    if (resolve_options(unit_, {}, {}, options_).kind != OptionError::Kind::none) std::exit(1);
    while (access(link_.c_str(), F_OK) != 0) sched_yield();
    port_.emplace(link_, unit_.line);
    session_.emplace(unit_, options_, *port_, storage_, host::EchoMode::automatic);
  }
  void exchange() {
    if (session_->read(*find_command(unit_, Verb::read))->error() != Error::none) ++failed;
  }
  double end() {
    const double used = child_.end();
    unlink(link_.c_str());
    return used;
  }

  int failed = 0;

 private:
  void emulate() {
    const sim::Motion shaft = sim::Motion::still(0x1234'2345'0000);
    std::vector<std::byte> storage(unit_.device_storage);
    Options options;
    if (resolve_options(unit_, {}, {}, options).kind != OptionError::Kind::none) _exit(1);
    auto* device = unit_.device(options, shaft, storage).bytes;
    os::EmulatorPort port(link_);
    port.set_send_slack(std::chrono::microseconds(50));
    device->power_on(port.now(), Device<std::uint8_t>::PowerOn::skip);
    host::drive(*device, port, [] { return true; });
  }

  const Unit& unit_ = *find_unit("tformat");
  std::string link_;
  Options options_;
  Child child_;
  std::vector<std::byte> storage_;
  std::optional<os::SerialPort> port_;
  std::optional<host::Session<std::uint8_t>> session_;
};

double user_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) + static_cast<double>(usage.ru_utime.tv_usec) * 1e-6;
}

struct Block {
  double rate;
  double user;
};

template <class Side>
Block run(Side& side, int exchanges) {
  const double user = user_seconds();
  const Time start = os::now();
  for (int i = 0; i < exchanges; ++i) side.exchange();
  return {exchanges / std::chrono::duration<double>(os::now() - start).count(), user_seconds() - user};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return (values[values.size() / 2] + values[(values.size() - 1) / 2]) / 2;
}

}  // namespace

int main(int argc, char** argv) {
  const bool quick = argc > 1;  // a benchmark that is started with any argument makes only a short run
  static_cast<void>(argv);
  constexpr int blocks = 40;
  const int exchanges = quick ? 500 : 3000;
  BareLoop bare;
  Stack stack("/tmp/absenc-pty-bench-" + std::to_string(getpid()));
  run(bare, 200);
  run(stack, 200);

  std::vector<double> bare_rates;
  std::vector<double> stack_rates;
  std::vector<double> ratios;
  std::vector<double> noise;
  double bare_user = 0;
  double stack_user = 0;
  for (int i = 0; i < blocks; ++i) {
    // Each run of the library is between two bare runs. One bare run is the reference, the other one shows the noise;
    // in every round they swap these roles.
    const Block first = run(bare, exchanges);
    const Block measured = run(stack, exchanges);
    const Block second = run(bare, exchanges);
    const Block& before = i % 2 == 0 ? first : second;
    const Block& after = i % 2 == 0 ? second : first;
    bare_rates.push_back(before.rate);
    stack_rates.push_back(measured.rate);
    ratios.push_back(measured.rate / before.rate);
    noise.push_back(after.rate / before.rate);
    bare_user += first.user + second.user;
    stack_user += measured.user;
  }
  bare_user += bare.end();
  stack_user += stack.end();
  std::printf("%d blocks of %d exchanges of 1 + 11 bytes over a pseudo-terminal, medians:\n", blocks, exchanges);
  std::printf("  bare ppoll, read, write  %9.0f a second  %6.2f us of user CPU an exchange, both sides\n",
              median(bare_rates), bare_user / (2.0 * blocks * exchanges) * 1e6);
  std::printf("  whole stack              %9.0f a second  %6.2f us\n", median(stack_rates),
              stack_user / (1.0 * blocks * exchanges) * 1e6);
  if (stack.failed != 0) std::printf("  %d readings failed: the machine was too busy\n", stack.failed);
  std::printf("ratio stack / bare: %.3f (bare / bare, the noise: %.3f)\n", median(ratios), median(noise));
}
