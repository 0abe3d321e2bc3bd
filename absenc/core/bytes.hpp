// SPDX-License-Identifier: Apache-2.0
// Views of bytes, and a buffer of fixed capacity that needs no heap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace absenc {

/// A view of bytes that belong to another object; read only.
using Bytes = std::span<const std::uint8_t>;
/// A view of bytes that belong to another object and may be written.
using MutableBytes = std::span<std::uint8_t>;

/// A buffer for up to Capacity items, which are stored inside the object.
template <class Item, std::size_t Capacity>
class Buffer {
 public:
  constexpr Buffer() = default;

  /// Appends `item`. Returns false, and stores nothing, if the buffer is full.
  constexpr bool push_back(const Item& item) {
    if (size_ == Capacity) return false;
    items_[size_++] = item;
    return true;
  }

  /// Appends `items`. Returns false, and stores nothing, if they do not all fit.
  constexpr bool append(std::span<const Item> items) {
    if (items.size() > Capacity - size_) return false;
    // The size is counted in a local copy, because the compiler must assume that a stored byte overlaps `size_`.
    std::size_t size = size_;
    for (const Item& item : items) items_[size++] = item;
    size_ = size;
    return true;
  }

  /// Removes all items from the buffer.
  constexpr void clear() { size_ = 0; }

  /// Returns the number of stored items.
  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  /// Returns whether no items are stored.
  [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
  /// Returns the greatest number of items that the buffer can store.
  [[nodiscard]] static constexpr std::size_t capacity() { return Capacity; }

  /// Returns the stored item at `index`, which is less than `size()`.
  constexpr Item& operator[](std::size_t index) { return items_[index]; }
  /// Returns the stored item at `index`, which is less than `size()`.
  constexpr const Item& operator[](std::size_t index) const { return items_[index]; }
  /// Returns a view of the stored items; valid while this buffer exists and is not cleared.
  [[nodiscard]] constexpr std::span<const Item> view() const { return {items_.data(), size_}; }
  /// Converts to a view of the stored items, like `view`.
  constexpr operator std::span<const Item>() const { return view(); }

 private:
  std::array<Item, Capacity> items_{};
  std::size_t size_ = 0;
};

/// A buffer for at most `Capacity` bytes.
template <std::size_t Capacity>
using ByteBuffer = Buffer<std::uint8_t, Capacity>;

}  // namespace absenc
