// SPDX-License-Identifier: Apache-2.0
// Opens the way to an encoder and owns it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/link/port.hpp"

namespace absenc::client {

struct Link {
  std::unique_ptr<VirtualDevice> device;  // sim; outlives the port
  std::shared_ptr<void> owner;
  Port<std::uint8_t>* bytes = nullptr;  // exactly one is set
  Port<CanFrame>* frames = nullptr;
  Time latency{};                  // of the way to the line
  Time character{};                // of a character on the line; 0: not known, or it takes no time
  std::string place;               // "/dev/ttyUSB0 at 2500000 baud"
  std::vector<std::string> notes;  // what could be better about it
};

/// Throws os::Failure, UsageError.
[[nodiscard]] Link open_link(const EncoderAddress& uri);
/// Opens a serial port without writing, or a TCP connection to which nothing is written: exactly `bytes` is set. Throws
/// os::Failure, UsageError.
[[nodiscard]] Link open_receiving(const EncoderAddress& uri);
/// In its place, a test has its own.
using OpenLink = std::function<Link(const EncoderAddress&)>;

}  // namespace absenc::client
