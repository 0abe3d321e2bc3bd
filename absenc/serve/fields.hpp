// SPDX-License-Identifier: Apache-2.0
// Numbers and texts one behind the other, as bytes for this computer alone: numbers are in its order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace absenc::serve {

class FieldWriter {
 public:
  FieldWriter& add(std::uint32_t number);
  FieldWriter& add_long(std::uint64_t number);
  FieldWriter& add(std::string_view text);

  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Checks as if a stranger had written them: a field that is cut throws client::Failure.
class FieldReader {
 public:
  explicit FieldReader(std::string bytes) : bytes_(std::move(bytes)) {}

  [[nodiscard]] std::uint32_t number();
  [[nodiscard]] std::uint64_t long_number();
  [[nodiscard]] std::string text();
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }
  /// Nothing may follow. Throws client::Failure.
  void end() const;

 private:
  void take(void* number, std::size_t size);

  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace absenc::serve
