// SPDX-License-Identifier: Apache-2.0
// The line of a virtual encoder: a pseudo-terminal, and optionally a TCP port. On Windows only TCP.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/process.hpp"
#include "absenc/os/stream_port.hpp"
#include "absenc/os/terminal_pair.hpp"

namespace absenc::os {

/// A pseudo-terminal and TCP clients as one line of a device.
class EmulatorPort final : public StreamPort {
 public:
  /// `link`: path of a symbolic link to create to the pseudo-terminal; empty: no link. `tcp_port`: port to listen on
  /// at 127.0.0.1, 0 for any free port; empty: no TCP. Throws Failure.
  explicit EmulatorPort(std::string link = {}, std::optional<std::uint16_t> tcp_port = {});
  ~EmulatorPort() override;

  /// Returns the path for other programs to open: the link if there is one, else the terminal; "" without a terminal.
  [[nodiscard]] const std::string& path() const { return link_.empty() ? terminal_.path : link_; }
  /// Returns the TCP port, or 0 when the port does not listen.
  [[nodiscard]] std::uint16_t tcp_port() const { return tcp_port_; }
  /// Returns the number of bytes of the device that a terminal or a TCP client did not accept in time.
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
  [[nodiscard]] bool rate_matches_terminal() const;
  void accept_client();
  void drop_client(int descriptor);
  void write_terminal(Bytes bytes);

  TerminalPair terminal_;     // the slave stays open: reading the master fails while no program has the slave open
  Descriptor in_use_marker_;  // socket whose name marks the link as in use; empty without a link or after an error
  Descriptor watch_;          // inotify descriptor: reports programs that open or close the slave
  Descriptor listener_;
  std::vector<Descriptor> clients_;
  std::string link_;
  std::uint16_t tcp_port_ = 0;
  RunDelay delay_;
  Time delay_read_at_{};
  Time lateness_{};
  Time lateness_until_{};
  std::uint64_t dropped_ = 0;
  std::uint32_t device_rate_ = 0;  // bit rate that the device has set; 0: it has set none
};

}  // namespace absenc::os
