// SPDX-License-Identifier: Apache-2.0
// A CAN interface of Linux (SocketCAN), real (can0) or virtual (vcan0).
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/frame_port.hpp"
#include "absenc/os/poller.hpp"
#include "absenc/os/stamp_clock.hpp"

struct can_frame;

namespace absenc::os {

/// The system calls of SocketCan, which tests override. A call that fails returns a negative number and sets errno.
struct CanKernel {
  virtual ~CanKernel() = default;
  /// Calls socket(PF_CAN, SOCK_RAW, CAN_RAW), non-blocking.
  virtual int open();
  virtual int control(int descriptor, unsigned long request, void* argument);
  /// Sets a socket option with setsockopt(2).
  virtual int set(int descriptor, int level, int name, const void* value, std::size_t size);
  /// Binds the socket to the interface with this index.
  virtual int bind(int descriptor, int index);
  virtual std::ptrdiff_t write(int descriptor, const can_frame& frame);
  /// Reads a frame. `stamp`: calendar time of the kernel's stamp; empty if there is none.
  virtual std::ptrdiff_t read(int descriptor, can_frame& frame, std::optional<Time>& stamp);
  virtual ClockPair clocks();
};
[[nodiscard]] CanKernel& system_can_kernel();

/// A port on a CAN interface. It does not set the bit rate. A received frame has the time of the kernel's stamp, or
/// of the read if the stamp is missing or doubtful; how long the adapter held the frame back before the stamp is
/// unknown.
class SocketCan final : public FramePort {
 public:
  /// Opens the CAN interface `interface`. Throws Failure. `kernel` must outlive the port.
  explicit SocketCan(const std::string& interface, const LineSettings& settings,
                     CanKernel& kernel = system_can_kernel());

 private:
  void collect(Time deadline) override;
  void send(const CanFrame& frame) override;
  void apply(const LineSettings& settings) override;

  [[nodiscard]] int find_interface();
  void set_options();
  void take(const can_frame& frame, const StampedTime& at);
  void take_error(const can_frame& frame, const StampedTime& at);
  // Returns whether the interface is virtual: it has no bit rate and accepts every one.
  [[nodiscard]] bool is_virtual() const { return interface_.starts_with("vcan") || interface_.starts_with("vxcan"); }
  [[nodiscard]] std::string up_command(std::uint32_t rate) const;
  [[noreturn]] void fail(const std::string& what, int error) const;

  std::string interface_;
  LineSettings settings_;
  CanKernel* kernel_;
  Descriptor socket_;
  StampClock stamps_;
  Poller poller_;
};

/// Returns the names of all CAN interfaces, "can0", "vcan0" and so on, sorted.
[[nodiscard]] std::vector<std::string> can_interfaces(const std::filesystem::path& sys = "/sys/class/net");

}  // namespace absenc::os
