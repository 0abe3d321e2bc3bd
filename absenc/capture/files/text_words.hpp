// SPDX-License-Identifier: Apache-2.0
// Reads a text file word by word; words are separated by any blanks and line ends.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

#include "absenc/capture/files/source.hpp"

namespace absenc::capture {

class TextWords {
 public:
  explicit TextWords(Source& source)
      : source_(source), buffer_(static_cast<std::size_t>(std::min<std::uint64_t>(source.size(), capacity))) {}

  /// Returns the next word, valid until the next call; "" at the end or if a word is too long.
  [[nodiscard]] std::string_view next() {
    while (begin_ != end_ && is_blank(buffer_[begin_])) ++begin_;
    std::size_t end = begin_;
    for (;;) {
      end = skip_word(end);
      if (end != end_) break;
      const std::size_t size = end - begin_;
      const bool more = size <= longest && refill();
      if (size == 0) {
        while (begin_ != end_ && is_blank(buffer_[begin_])) ++begin_;
      }
      end = begin_ + size;
      if (!more) break;
    }
    offset_ = base_ + begin_;
    const std::string_view word(reinterpret_cast<const char*>(buffer_.data()) + begin_, end - begin_);
    begin_ = end;
    too_long_ = word.size() > longest;
    return too_long_ ? std::string_view{} : word;
  }

  /// Returns the offset in the file of the word that `next` returned last.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  [[nodiscard]] bool too_long() const { return too_long_; }

 private:
  static constexpr std::size_t capacity = 1 << 18;
  static constexpr std::size_t longest = 1 << 16;

  static bool is_blank(std::uint8_t c) { return c <= ' ' && (c == ' ' || (c >= '\t' && c <= '\r')); }

  // Returns the index of the first blank from index `at` of the buffer on; without a blank, the index of the end.
  [[nodiscard]] std::size_t skip_word(std::size_t at) const {
    constexpr std::uint64_t each = 0x0101010101010101;
    while (std::endian::native == std::endian::little && end_ - at >= 8) {
      std::uint64_t bytes = 0;
      std::memcpy(&bytes, &buffer_[at], sizeof(bytes));
      const std::uint64_t small = (bytes - each * (' ' + 1)) & ~bytes & each * 0x80;
      at += small == 0 ? 8 : static_cast<std::size_t>(std::countr_zero(small)) / 8;
      if (small != 0) break;
    }
    while (at != end_ && !is_blank(buffer_[at])) ++at;
    return at;
  }

  bool refill() {
    if (begin_ != 0) std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    base_ += begin_;
    end_ -= begin_;
    begin_ = 0;
    const std::size_t got = source_.read(base_ + end_, std::span(buffer_).subspan(end_));
    end_ += got;
    return got != 0;
  }

  Source& source_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::uint64_t base_ = 0;
  std::uint64_t offset_ = 0;
  bool too_long_ = false;
};

}  // namespace absenc::capture
