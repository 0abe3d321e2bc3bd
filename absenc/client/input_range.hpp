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
  /// Type of the items.
  using value_type = typename Range::value_type;
  /// Type that iterators require; there is no distance between two of these.
  using difference_type = std::ptrdiff_t;

  /// Stands at the current item of `range`.
  explicit InputIterator(Range& range) : range_(&range) {}
  /// Returns the current item.
  const value_type& operator*() const { return *range_->current(); }
  /// Returns the current item.
  const value_type* operator->() const { return range_->current(); }
  /// Goes to the next item.
  InputIterator& operator++() {
    range_->advance();
    return *this;
  }
  /// Goes to the next item.
  void operator++(int) { range_->advance(); }
  /// Returns whether the range has ended.
  bool operator==(End) const { return range_->current() == nullptr; }

 private:
  Range* range_;
};

}  // namespace absenc::client
