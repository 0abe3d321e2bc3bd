// SPDX-License-Identifier: Apache-2.0
// Iterator for ranges that can be read only once, one value at a time.
#pragma once

#include <cstddef>

namespace absenc::client {

/// Input iterator of `Range`, which has `value_type`, `current()` and `advance()`.
template <class Range>
class InputIterator {
 public:
  struct End {};
  /// Type of the values that the iterator points to.
  using value_type = typename Range::value_type;
  /// Type that every iterator must declare; no function of this iterator returns a distance.
  using difference_type = std::ptrdiff_t;

  /// Makes an iterator that points to the current value of `range`, which must outlive it.
  explicit InputIterator(Range& range) : range_(&range) {}
  /// Returns a reference to the current value.
  const value_type& operator*() const { return *range_->current(); }
  /// Returns a pointer to the current value.
  const value_type* operator->() const { return range_->current(); }
  /// Moves the range to its next value.
  InputIterator& operator++() {
    range_->advance();
    return *this;
  }
  /// Moves the range to its next value. Returns nothing, because the range can be read only once.
  void operator++(int) { range_->advance(); }
  /// Returns whether the range has no further value.
  bool operator==(End) const { return range_->current() == nullptr; }

 private:
  Range* range_;
};

}  // namespace absenc::client
