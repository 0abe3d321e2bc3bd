// SPDX-License-Identifier: Apache-2.0
// A raw TCP connection to a serial server or to a virtual encoder.
#pragma once

#include <cstdint>
#include <string>

#include "absenc/os/stream_port.hpp"

namespace absenc::os {

/// A port for bytes on a TCP connection. Its default latency is 200 ms. The server configures the line: configure and
/// pulse steps throw `unsupported`.
class TcpPort final : public DescriptorPort {
 public:
  /// Connects to `host`: a name, an IPv4 address, or an IPv6 address with or without brackets. Tries the addresses of a
  /// name one after the other, for 3 s in total. Throws Failure: `not_found`, `lost` (no connection in time), `system`;
  /// throws Interrupted and Ended as `wait_for` does.
  TcpPort(const std::string& host, std::uint16_t port);

 private:
  ssize_t write_some(Bytes bytes) override;
};

}  // namespace absenc::os
