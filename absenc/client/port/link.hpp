// SPDX-License-Identifier: Apache-2.0
// Opens the port of an address and owns the open port.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/link/port.hpp"

namespace absenc::client {

struct Link {
  std::unique_ptr<VirtualDevice> device;  // virtual encoder of sim:, null for other ports; must outlive the port
  std::shared_ptr<void> owner;
  // the open port if the link carries bytes; exactly one of `bytes` and `frames` is not null
  Port<std::uint8_t>* bytes = nullptr;
  Port<CanFrame>* frames = nullptr;
  Time latency{};     // delay that the connection between this computer and the line adds to a reply
  int realtime = 0;   // real-time priority, 1 to 99, of threads that use the port; 0: none
  Time character{};   // duration of a character on the line; 0: unknown, or bytes take no time
  std::string place;  // port in words, "/dev/ttyUSB0 at 2500000 baud"
  // looks whether something drives the data pin while the encoder is not clocked; null if the port cannot look
  std::function<bool()> is_data_driven{};
  // returns the clock rate in Hz of the last transfer; null if the port makes no clock
  std::function<std::uint32_t()> clock_rate{};
  // sentences for the user about the port, for example about a driver setting that slows it down
  std::vector<std::string> notes;
};

/// Opens the port of the address and returns it; the setting `realtime` makes the calling thread a real-time thread
/// first. Throws os::Failure, UsageError, Failure.
[[nodiscard]] Link open_link(const EncoderAddress& uri);
/// Opens a port for receiving only. The calling thread stays as it is: the one that receives calls `require_realtime`.
/// Throws os::Failure, UsageError.
[[nodiscard]] Link open_receiving(const EncoderAddress& uri);
/// Type of open_link, and of functions that tests use instead.
using OpenLink = std::function<Link(const EncoderAddress&)>;

}  // namespace absenc::client
