// SPDX-License-Identifier: Apache-2.0
// An iterator for ranges that are read once, one value at a time.
#pragma once

#include <cstddef>

namespace absenc::client {

/// Input iterator of `Range`, which has a `value_type`, `current()`, which returns a pointer to the value or null at
/// the end, and `advance()`.
template <class Range>
class InputIterator {
 public:
  struct End {};
  /// Type of the items.
  using value_type = typename Range::value_type;
  /// Type that iterators must have; no function returns a distance.
  using difference_type = std::ptrdiff_t;

  /// Points to the current item of `range`.
  explicit InputIterator(Range& range) : range_(&range) {}
  /// Returns the current item.
  const value_type& operator*() const { return *range_->current(); }
  /// Returns the current item.
  const value_type* operator->() const { return range_->current(); }
  /// Advances to the next item.
  InputIterator& operator++() {
    range_->advance();
    return *this;
  }
  /// Advances to the next item.
  void operator++(int) { range_->advance(); }
  /// Returns whether the range has ended.
  bool operator==(End) const { return range_->current() == nullptr; }

 private:
  Range* range_;
};

}  // namespace absenc::client
