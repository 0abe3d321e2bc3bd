// SPDX-License-Identifier: Apache-2.0
// A raw TCP connection to a serial server or to a virtual encoder.
#pragma once

#include <cstdint>
#include <string>

#include "absenc/os/stream_port.hpp"

namespace absenc::os {

/// A port on a TCP connection, which carries bytes only: steps that configure the line or send a pulse throw
/// `unsupported`. Its default latency is 200 ms.
class TcpPort final : public DescriptorPort {
 public:
  /// Connects to `host`: a name or an address, an IPv6 address also in brackets. Throws Failure, and as `wait_for`
  /// does.
  TcpPort(const std::string& host, std::uint16_t port);

 private:
  std::ptrdiff_t write_some(Bytes bytes) override;
};

}  // namespace absenc::os
