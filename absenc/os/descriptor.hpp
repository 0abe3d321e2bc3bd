// SPDX-License-Identifier: Apache-2.0
// An open file descriptor that closes itself.
#pragma once

#include <utility>

namespace absenc::os {

class Descriptor {
 public:
  Descriptor() = default;
  /// Takes ownership of `number`; a negative number means no descriptor.
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() { close(); }

  void close();

  /// Gives up ownership and returns the number of the descriptor, which the caller must close.
  [[nodiscard]] int release() { return std::exchange(number_, -1); }

  [[nodiscard]] int get() const { return number_; }
  [[nodiscard]] explicit operator bool() const { return number_ >= 0; }

 private:
  int number_ = -1;
};

}  // namespace absenc::os
