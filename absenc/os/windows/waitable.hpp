// SPDX-License-Identifier: Apache-2.0
// Objects behind the numbers of descriptors (os/descriptor.hpp) that a wait can watch: ports, connections, standard
// input, Ctrl-C. The numbers of files are those of the C library.
#pragma once

#include <windows.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// A handle that closes itself.
class Handle {
 public:
  Handle() = default;
  /// Takes ownership of `handle`; null and INVALID_HANDLE_VALUE mean none.
  explicit Handle(HANDLE handle) : handle_(handle == INVALID_HANDLE_VALUE ? nullptr : handle) {}
  Handle(Handle&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Handle() {
    if (handle_ != nullptr) ::CloseHandle(handle_);
  }

  [[nodiscard]] HANDLE get() const { return handle_; }
  [[nodiscard]] HANDLE release() { return std::exchange(handle_, nullptr); }
  [[nodiscard]] explicit operator bool() const { return handle_ != nullptr; }

 private:
  HANDLE handle_ = nullptr;
};

/// Returns a new event that stays set until it is reset. Throws Failure.
[[nodiscard]] Handle make_event(bool set = false);

/// An object that a wait can watch.
class Waitable {
 public:
  Waitable() = default;
  virtual ~Waitable() = default;
  Waitable(const Waitable&) = delete;
  Waitable& operator=(const Waitable&) = delete;

  /// Returns an event that is set while `read` would not return EAGAIN.
  [[nodiscard]] virtual HANDLE readable() = 0;
  /// Returns an event that is set while `write` would not return EAGAIN; null: always.
  [[nodiscard]] virtual HANDLE writable() { return nullptr; }
  /// Reads like read(2) from a descriptor that does not block: returns the number of bytes, 0 at the end, -1 with
  /// errno.
  [[nodiscard]] virtual std::ptrdiff_t read(MutableBytes into);
  /// Writes all of `bytes` or nothing, like write(2) to a descriptor that does not block.
  [[nodiscard]] virtual std::ptrdiff_t write(Bytes bytes);
};

/// Returns a descriptor of `object`, which Descriptor::close destroys.
[[nodiscard]] Descriptor descriptor_of(std::unique_ptr<Waitable> object);

/// Returns the object with this number, or null if the number is that of a file or of none. 0 is standard input.
[[nodiscard]] Waitable* waitable_of(int number);

/// Waits until one of `events` is set and returns its index, or nothing at `deadline`. Throws Interrupted, Ended and
/// Failure.
[[nodiscard]] std::optional<std::size_t> wait_any(std::span<const HANDLE> events, Time deadline);

/// Returns whether `event` is set.
[[nodiscard]] inline bool is_set(HANDLE event) { return ::WaitForSingleObject(event, 0) == WAIT_OBJECT_0; }

}  // namespace absenc::os
