// SPDX-License-Identifier: Apache-2.0
// For ranges that are gone through once, one value at a time.
#pragma once

#include <cstddef>

namespace absenc::client {

/// `Range` has `value_type`, `current()`, a pointer to the value that is null at the end, and `advance()`.
template <class Range>
class InputIterator {
 public:
  struct End {};
  using value_type = typename Range::value_type;
  using difference_type = std::ptrdiff_t;

  explicit InputIterator(Range& range) : range_(&range) {}
  const value_type& operator*() const { return *range_->current(); }
  const value_type* operator->() const { return range_->current(); }
  InputIterator& operator++() {
    range_->advance();
    return *this;
  }
  void operator++(int) { range_->advance(); }
  bool operator==(End) const { return range_->current() == nullptr; }

 private:
  Range* range_;
};

}  // namespace absenc::client
