// SPDX-License-Identifier: Apache-2.0
// A sentence put together from fixed texts, where there is no heap.
#pragma once

#include <cstddef>
#include <string_view>

#include "absenc/core/bytes.hpp"

namespace absenc {

class Sentence {
 public:
  /// What does not fit is left out.
  Sentence& add(std::string_view text) {
    static_cast<void>(text_.append({text.data(), text.size()}));
    return *this;
  }
  /// Behind what is there already, parted from it by "; ".
  Sentence& add_part(std::string_view part) {
    if (!part.empty() && !empty()) add("; ");
    return add(part);
  }
  void clear() { text_.clear(); }
  [[nodiscard]] bool empty() const { return text_.empty(); }
  [[nodiscard]] std::string_view view() const { return {text_.view().data(), text_.size()}; }

 private:
  Buffer<char, 400> text_;
};

}  // namespace absenc
