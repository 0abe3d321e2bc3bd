// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/socketcan.hpp"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

using Kind = Failure::Kind;

namespace {

// Time to wait for room in the kernel's send queue: longer than a working bus needs to empty it.
constexpr Time queue_patience = 500ms;
constexpr Time queue_pause = 500us;
constexpr std::size_t most_at_once = 256;

constexpr std::string_view check_bus =
    "check that another node is switched on, CANH and CANL, 120 ohms at both ends, and the bit rate";

ifreq request_for(const std::string& interface) {
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  return request;
}

Failure no_interface(const std::string& interface) {
  std::string there;
  for (const std::string& name : can_interfaces()) there += (there.empty() ? "" : ", ") + name;
  const std::string what = "there is no CAN interface " + interface;
  if (!there.empty()) return {Kind::not_found, what + ": this machine has " + there};
  return {Kind::not_found, what +
                               ", nor any other: is the adapter plugged in, and its driver loaded (`ip -details link "
                               "show type can`)? For one on a serial port write slcan:/dev/ttyACM0"};
}

}  // namespace

// ---- System calls

int CanKernel::open() { return ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW); }

int CanKernel::control(int descriptor, unsigned long request, void* argument) {
  return ::ioctl(descriptor, request, argument);
}

int CanKernel::set(int descriptor, int level, int name, const void* value, std::size_t size) {
  return ::setsockopt(descriptor, level, name, value, static_cast<socklen_t>(size));
}

int CanKernel::bind(int descriptor, int index) {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  return ::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

std::ptrdiff_t CanKernel::write(int descriptor, const can_frame& frame) {
  return ::write(descriptor, &frame, sizeof frame);
}

std::ptrdiff_t CanKernel::read(int descriptor, can_frame& frame, std::optional<Time>& stamp) {
  iovec part{&frame, sizeof frame};
  alignas(cmsghdr) std::array<char, 128> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const std::ptrdiff_t size = ::recvmsg(descriptor, &message, 0);
  if (size < 0) return size;
  stamp.reset();
  for (cmsghdr* part_of = CMSG_FIRSTHDR(&message); part_of != nullptr; part_of = CMSG_NXTHDR(&message, part_of)) {
    if (part_of->cmsg_level != SOL_SOCKET || part_of->cmsg_type != SO_TIMESTAMPNS) continue;
    timespec time{};
    std::memcpy(&time, CMSG_DATA(part_of), sizeof time);
    stamp = std::chrono::seconds(time.tv_sec) + Time(time.tv_nsec);
  }
  return size;
}

ClockPair CanKernel::clocks() { return read_clocks(); }

CanKernel& system_can_kernel() {
  static CanKernel kernel;
  return kernel;
}

std::vector<std::string> can_interfaces(const std::filesystem::path& sys) {
  std::vector<std::string> interfaces;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(sys, ignored)) {
    int type = 0;
    if (std::ifstream(entry.path() / "type") >> type && type == ARPHRD_CAN) {
      interfaces.push_back(entry.path().filename().string());
    }
  }
  std::sort(interfaces.begin(), interfaces.end());
  return interfaces;
}

// ---- SocketCan

SocketCan::SocketCan(const std::string& interface, const LineSettings& settings, CanKernel& kernel)
    : interface_(interface), settings_(settings), kernel_(&kernel), socket_(kernel.open()), stamps_(kernel.clocks()) {
  if (!socket_) {
    if (errno == EPERM || errno == EACCES) throw Failure(Kind::no_permission, "no permission to open a CAN socket");
    throw Failure(Kind::unsupported, "this kernel has no CAN (" + std::generic_category().message(errno) +
                                         "): try `sudo modprobe can_raw`, or an adapter on a serial port: "
                                         "slcan:/dev/ttyACM0");
  }
  const int index = find_interface();
  set_options();
  if (kernel_->bind(socket_.get(), index) < 0) fail("binding to " + interface_, errno);
  poller_.add(socket_.get());
}

std::string SocketCan::up_command(std::uint32_t rate) const {
  const std::string type = is_virtual() ? "" : " type can bitrate " + std::to_string(rate);
  return "`sudo ip link set " + interface_ + " up" + type + "`";
}

int SocketCan::find_interface() {
  if (interface_.empty() || interface_.size() >= IFNAMSIZ) throw no_interface(interface_);
  ifreq request = request_for(interface_);
  if (kernel_->control(socket_.get(), SIOCGIFINDEX, &request) < 0) {
    if (errno == ENODEV || errno == ENXIO) throw no_interface(interface_);
    fail("looking for " + interface_, errno);
  }
  const int index = request.ifr_ifindex;
  request = request_for(interface_);
  if (kernel_->control(socket_.get(), SIOCGIFHWADDR, &request) < 0) fail("looking at " + interface_, errno);
  if (request.ifr_hwaddr.sa_family != ARPHRD_CAN) {
    throw Failure(Kind::unsupported, interface_ +
                                         " is a network interface, but none of a CAN bus: `ip link show type "
                                         "can` lists those");
  }
  request = request_for(interface_);
  if (kernel_->control(socket_.get(), SIOCGIFFLAGS, &request) < 0) fail("looking at " + interface_, errno);
  if ((request.ifr_flags & IFF_UP) == 0) {
    throw Failure(Kind::system, interface_ + " is down: " + up_command(settings_.rate) + " brings it up");
  }
  return index;
}

void SocketCan::set_options() {
  const int on = 1;
  const int off = 0;
  const can_err_mask_t errors = CAN_ERR_TX_TIMEOUT | CAN_ERR_PROT | CAN_ERR_ACK | CAN_ERR_BUSOFF | CAN_ERR_BUSERROR;
  const int descriptor = socket_.get();
  const bool set = kernel_->set(descriptor, SOL_CAN_RAW, CAN_RAW_LOOPBACK, &on, sizeof on) >= 0 &&
                   kernel_->set(descriptor, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &off, sizeof off) >= 0 &&
                   kernel_->set(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) >= 0 &&
                   kernel_->set(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) >= 0;
  if (!set) fail("setting up the socket for " + interface_, errno);
}

void SocketCan::collect(Time deadline) {
  // If the deadline is past, only frames that have already arrived are read; the socket does not block.
  if (deadline > os::now() && poller_.wait(deadline).empty()) return;
  ClockPair before = kernel_->clocks();
  for (std::size_t i = 0; i < most_at_once; ++i) {
    can_frame frame{};
    std::optional<Time> stamp;
    const std::ptrdiff_t size = kernel_->read(socket_.get(), frame, stamp);
    if (size < 0 && errno == EINTR) return;
    if (size < 0 && errno == EAGAIN) return stamps_.found_empty(before);
    if (size < 0) fail("reading from " + interface_, errno);
    const ClockPair after = kernel_->clocks();
    const StampedTime at = stamps_.convert(stamp, std::exchange(before, after), after);
    // a frame of this size is a CAN FD frame, which is not enabled
    if (size != static_cast<std::ptrdiff_t>(sizeof frame)) continue;
    if ((frame.can_id & CAN_ERR_FLAG) != 0) {
      take_error(frame, at);
    } else {
      take(frame, at);
    }
  }
}

void SocketCan::take(const can_frame& from, const StampedTime& at) {
  CanFrame frame;
  frame.extended = (from.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = (from.can_id & CAN_RTR_FLAG) != 0;
  frame.id = from.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.size = std::min<std::uint8_t>(from.can_dlc, CAN_MAX_DLEN);
  if (!frame.remote) std::copy_n(from.data, frame.size, frame.data.begin());
  push(frame, at.at, at.late);
}

void SocketCan::take_error(const can_frame& frame, const StampedTime& at) {
  if ((frame.can_id & CAN_ERR_BUSOFF) != 0) {
    throw Failure(Kind::lost,
                  interface_ +
                      " is bus-off: too many of its frames were destroyed. Check the bit rate, CANH "
                      "and CANL, 120 ohms at both ends and that no two nodes have one number; then "
                      "`sudo ip link set " +
                      interface_ + " down` and " + up_command(settings_.rate) + " (`restart-ms 100` does it by itself)",
                  Failure::Bus::off);
  }
  push_error(at.at, at.late);
}

void SocketCan::send(const CanFrame& from) {
  can_frame frame{};
  frame.can_id = from.id | (from.extended ? CAN_EFF_FLAG : 0) | (from.remote ? CAN_RTR_FLAG : 0);
  frame.can_dlc = from.size;
  std::copy_n(from.data.begin(), from.size, frame.data);
  const Time limit = os::now() + queue_patience;
  for (;;) {
    if (kernel_->write(socket_.get(), frame) == static_cast<std::ptrdiff_t>(sizeof frame)) return;
    // The write is repeated, because poll(2) does not report when a full queue (ENOBUFS) has room again.
    const bool full = errno == ENOBUFS || errno == EAGAIN;
    if (!full && errno != EINTR) fail("sending on " + interface_, errno);
    if (os::now() >= limit) {
      throw Failure(Kind::lost,
                    interface_ + " sends nothing, its queue is full: no other node acknowledges. " +
                        std::string("Try: ") + std::string(check_bus),
                    Failure::Bus::not_acknowledged);
    }
    sleep_until(std::min(os::now() + queue_pause, end()));
    if (os::now() >= end()) throw Ended{};
  }
}

void SocketCan::apply(const LineSettings& settings) {
  if (settings.rate == settings_.rate || is_virtual()) return;
  throw Failure(Kind::unsupported,
                interface_ + " cannot be brought to " + std::to_string(settings.rate) +
                    " bit/s from here, only by `ip link`. If the encoder is to follow there: `sudo ip link set " +
                    interface_ + " down`, " + up_command(settings.rate) +
                    ", then bitrate=" + std::to_string(settings.rate));
}

void SocketCan::fail(const std::string& what, int error) const {
  switch (error) {
    case ENETDOWN:
      throw Failure(Kind::lost, interface_ + " went down: `ip -details link show " + interface_ + "` says why, " +
                                    up_command(settings_.rate) + " brings it up");
    case ENODEV:
    case ENXIO:
      throw Failure(Kind::lost, interface_ + " went away: was the adapter unplugged?");
    default:
      throw system_failure(what, error);
  }
}

}  // namespace absenc::os
