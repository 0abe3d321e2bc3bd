// SPDX-License-Identifier: Apache-2.0
// Test replacement for the kernel behind a CAN port, with one interface.
#pragma once

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absenc/os/linux/testing.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/socketcan.hpp"

namespace absenc::os::testing {

class FakeCan final : public CanKernel {
 public:
  int open() override {
    if (open_error != 0) return refuse(open_error);
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) < 0) return -1;
    other_end_ = Descriptor(ends[1]);
    return ends[0];
  }
  int control(int, unsigned long request, void* argument) override {
    auto& wanted = *static_cast<ifreq*>(argument);
    if (std::string(wanted.ifr_name) != interface) return refuse(ENODEV);
    if (request == SIOCGIFINDEX) wanted.ifr_ifindex = 7;
    if (request == SIOCGIFHWADDR) wanted.ifr_hwaddr.sa_family = type;
    if (request == SIOCGIFFLAGS) wanted.ifr_flags = flags;
    return 0;
  }
  int set(int, int level, int name, const void* value, std::size_t) override {
    std::uint32_t number = 0;
    std::memcpy(&number, value, sizeof number);
    options[{level, name}] = number;
    return 0;
  }
  int bind(int, int index) override {
    bound = index;
    return bind_error == 0 ? 0 : refuse(bind_error);
  }
  std::ptrdiff_t write(int, const can_frame& frame) override {
    if (!write_errors.empty()) {
      const int error = write_errors.front();
      if (write_errors.size() > 1 || !keep_last_error) write_errors.pop_front();
      return refuse(error);
    }
    written.push_back(frame);
    written_at = now();
    return sizeof frame;
  }
  std::ptrdiff_t read(int descriptor, can_frame& frame, std::optional<Time>& stamp) override {
    if (read_error != 0) return refuse(read_error);
    const std::ptrdiff_t size = ::recv(descriptor, &frame, sizeof frame, 0);
    stamp.reset();
    if (has_stamps) stamp = now() - age + lead;
    lead += std::exchange(clock_step, Time{});
    return size;
  }
  ClockPair clocks() override {
    ClockPair clocks{.before = now()};
    clocks.after = now();
    clocks.calendar = clocks.after + lead;
    return clocks;
  }

  /// Puts a frame on the bus.
  void put(const can_frame& frame) const { ::send(other_end_.get(), &frame, sizeof frame, 0); }

  std::string interface = "can0";
  int open_error = 0;
  int bind_error = 0;
  int read_error = 0;
  unsigned short type = ARPHRD_CAN;
  short flags = IFF_UP;
  std::deque<int> write_errors;
  bool keep_last_error = false;
  Time age{};  // time between the kernel's stamp of a frame and the read of the frame
  bool has_stamps = true;
  Time lead = std::chrono::hours(500'000);  // how far the calendar clock is ahead of os::now
  Time clock_step{};                        // step by which the calendar clock is set after the next read
  int bound = 0;
  std::map<std::pair<int, int>, std::uint32_t> options;
  std::vector<can_frame> written;
  Time written_at{};

 private:
  static int refuse(int error) {
    errno = error;
    return -1;
  }
  Descriptor other_end_;
};

}  // namespace absenc::os::testing
