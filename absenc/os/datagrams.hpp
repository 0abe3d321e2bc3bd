// SPDX-License-Identifier: Apache-2.0
// UDP to one place, which is told and never waited for.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/os/descriptor.hpp"

namespace absenc::os {

class Datagrams {
 public:
  /// `host`: a name, which is looked up now, or an address. Throws Failure: `not_found`, `system`.
  Datagrams(const std::string& host, std::uint16_t port);

  /// False when there was no room for it, or nobody is there: it is lost.
  [[nodiscard]] bool send(std::string_view text);

 private:
  Descriptor socket_;
};

/// Of this computer; "" when it has none.
[[nodiscard]] std::string host_name();

}  // namespace absenc::os
