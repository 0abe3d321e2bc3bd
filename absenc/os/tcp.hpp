// SPDX-License-Identifier: Apache-2.0
// A raw TCP connection to a serial server or to a virtual encoder.
#pragma once

#include <cstdint>
#include <string>

#include "absenc/os/stream_port.hpp"

namespace absenc::os {

/// Latency is 200 ms at first. The server sets the line up: configure and pulse steps throw `unsupported`.
class TcpPort final : public DescriptorPort {
 public:
  /// `host`: a name, an IPv4 or an IPv6 address, that one also in brackets. Tries every address of a name, for 3 s in
  /// all. Throws Failure: `not_found`, `lost` (no answer in time), `system`.
  TcpPort(const std::string& host, std::uint16_t port);

 private:
  ssize_t write_some(Bytes bytes) override;
};

}  // namespace absenc::os
