// SPDX-License-Identifier: Apache-2.0
// The headers of a request, and what becomes of them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/serve/http.hpp"

namespace absenc::serve {

/// In the order in which they came. Names are compared without their case.
class Headers {
 public:
  void add(std::string name, std::string value) { all_.emplace_back(std::move(name), std::move(value)); }

  [[nodiscard]] std::size_t count(std::string_view name) const;
  /// "": there is none.
  [[nodiscard]] std::string first(std::string_view name) const;

  /// Why a proxy before us could read this request otherwise, and take a part of it for another one (RFC 9112, 3.2 and
  /// 6.3); "" when it could not. `version`: "HTTP/1.1".
  [[nodiscard]] std::string_view ambiguity(std::string_view version) const;
  /// Bytes of the body; 0 where no header says.
  [[nodiscard]] std::uint64_t announced_length() const;
  /// To those who decide what the request may.
  void hand_on(Request& request) const;

 private:
  std::vector<std::pair<std::string, std::string>> all_;
};

}  // namespace absenc::serve
