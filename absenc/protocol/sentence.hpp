// SPDX-License-Identifier: Apache-2.0
// Builds an error text for people from parts, without a heap.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace absenc {

/// A text of up to 400 characters that is put together from parts, without a heap.
class Sentence {
 public:
  /// Appends `text`. A text that does not fit completely is left out.
  Sentence& add(std::string_view text) {
    if (text.size() <= text_.size() - size_) {
      std::copy(text.begin(), text.end(), text_.begin() + size_);
      size_ += text.size();
    }
    return *this;
  }
  /// Appends a number in decimal.
  Sentence& add_number(std::uint32_t number) {
    std::array<char, 10> digits{};
    std::size_t first = digits.size();
    do {
      digits[--first] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number != 0);
    return add({digits.data() + first, digits.size() - first});
  }
  /// Appends `part`, separated by "; " from the text before it. An empty part changes nothing.
  Sentence& add_part(std::string_view part) {
    if (!part.empty() && !empty()) add("; ");
    return add(part);
  }
  /// Removes all text.
  void clear() { size_ = 0; }
  /// Returns whether the sentence has no text.
  [[nodiscard]] bool empty() const { return size_ == 0; }
  /// Returns the text, which is valid until the sentence changes.
  [[nodiscard]] std::string_view view() const { return {text_.data(), size_}; }

 private:
  // not initialized, to save time: each conversation of the class Reported has a Sentence, but few use it
  std::array<char, 400> text_;
  std::size_t size_ = 0;
};

}  // namespace absenc
