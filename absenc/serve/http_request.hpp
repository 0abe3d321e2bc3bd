// SPDX-License-Identifier: Apache-2.0
// Headers of an HTTP request, and checks whether they are ambiguous.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/serve/http.hpp"

namespace absenc::serve {

/// The headers of a request in their order. Names are compared without case.
class Headers {
 public:
  void add(std::string name, std::string value) { all_.emplace_back(std::move(name), std::move(value)); }

  [[nodiscard]] std::size_t count(std::string_view name) const;
  /// Returns the first value of the header `name`; "" if the request has none.
  [[nodiscard]] std::string first(std::string_view name) const;

  /// Returns why a proxy could interpret this request differently (RFC 9112, 3.2 and 6.3); "" if no reason is known.
  [[nodiscard]] std::string_view ambiguity(std::string_view version) const;
  /// Returns the length of the request body in bytes, as announced; 0 without Content-Length.
  [[nodiscard]] std::uint64_t announced_length() const;
  /// Copies into `request` those headers that access control needs.
  void copy_to(Request& request) const;

 private:
  std::vector<std::pair<std::string, std::string>> all_;
};

}  // namespace absenc::serve
