// SPDX-License-Identifier: Apache-2.0
// The line of a virtual encoder: a pseudo-terminal and, if asked, TCP, for any program to connect to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/process.hpp"
#include "absenc/os/stream_port.hpp"

namespace absenc::os {

/// All ends are one line: the device hears what comes from any of them, and each gets what the device sends. Like a
/// wire, the line keeps nothing: what nobody reads is lost. Latency is 2 ms at first: a pause that long is a gap, and
/// one of 0.2 ms where the device waits for nothing more.
///
/// A device that configures the line hears a terminal only at its own rate. A terminal that nobody has set (the
/// kernel's 38400 baud) and TCP have none: they are heard at every rate. So a change of the rate that went wrong shows
/// without hardware. Devices that share the line (sim::Bus) do not feel it.
class EmulatorPort final : public StreamPort {
 public:
  /// `link`: path of a symbolic link to the pseudo-terminal, removed at the end; empty: none. It replaces a link to a
  /// pseudo-terminal that no other EmulatorPort has, and nothing else. `tcp_port`: listens there on 127.0.0.1; 0: on a
  /// free one. Throws Failure: `in_use` for either, `system`.
  explicit EmulatorPort(std::string link = {}, std::optional<std::uint16_t> tcp_port = {});
  ~EmulatorPort() override;

  /// What to open: the link if there is one, otherwise the pseudo-terminal.
  [[nodiscard]] const std::string& path() const { return link_.empty() ? terminal_ : link_; }
  /// 0 when it does not listen.
  [[nodiscard]] std::uint16_t tcp_port() const { return tcp_port_; }
  /// Bytes that an end did not take because it did not read.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  std::size_t read_some(MutableBytes into, std::span<const int> ready) override;
  Time lateness() override;
  void write_all(Bytes bytes) override;
  void drive(ExtraWire, bool) override {}
  void change_rate(std::uint32_t rate) override { device_rate_ = rate; }

  void open_terminal();
  void listen_on(std::uint16_t port);
  void make_link();
  void users_changed();
  [[nodiscard]] bool understands_terminal() const;
  void accept_client();
  void drop_client(int descriptor);
  void write_terminal(Bytes bytes);

  Descriptor master_;
  Descriptor slave_;  // kept open: without it the master fails whenever no program has the slave open
  Descriptor name_;   // says to others that the link is served
  Descriptor watch_;  // inotify: programs that open or close the slave
  Descriptor listener_;
  std::vector<Descriptor> clients_;
  std::string terminal_;
  std::string link_;
  std::uint16_t tcp_port_ = 0;
  RunDelay delay_;
  Time looked_{};  // when it was asked
  Time late_{};
  Time late_until_{};
  std::uint64_t dropped_ = 0;
  std::uint32_t device_rate_ = 0;  // 0: the device did not say
};

}  // namespace absenc::os
