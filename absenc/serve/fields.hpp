// SPDX-License-Identifier: Apache-2.0
// Serializes numbers and texts into a sequence of bytes, and reads them back; in the byte order of this computer.
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

/// A reader of serialized fields; a truncated field throws client::Failure.
class FieldReader {
 public:
  explicit FieldReader(std::string bytes) : bytes_(std::move(bytes)) {}

  [[nodiscard]] std::uint32_t number();
  [[nodiscard]] std::uint64_t long_number();
  [[nodiscard]] std::string text();
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }
  /// Throws client::Failure if bytes follow the last field that was read.
  void end() const;

 private:
  void take(void* number, std::size_t size);

  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace absenc::serve
