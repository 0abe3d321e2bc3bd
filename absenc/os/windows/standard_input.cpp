// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/windows/standard_input.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

class StandardInput final : public Waitable {
 public:
  StandardInput() : readable_(make_event()), input_(::GetStdHandle(STD_INPUT_HANDLE)) {
    DWORD mode = 0;
    is_console_ = ::GetConsoleMode(input_, &mode) != 0;
    // The thread may wait for input forever, so it ends only together with the process.
    std::thread([this] { fill(); }).detach();
  }

  HANDLE readable() override { return readable_.get(); }

  std::ptrdiff_t read(MutableBytes into) override {
    const std::lock_guard lock(mutex_);
    const std::size_t size = std::min(into.size(), bytes_.size());
    if (size == 0 && !ended_) {
      errno = EAGAIN;
      return -1;
    }
    if (size == 0 && error_ != 0) {
      errno = error_;
      return -1;
    }
    std::copy_n(bytes_.begin(), size, into.begin());
    bytes_.erase(0, size);
    if (bytes_.empty() && !ended_) ::ResetEvent(readable_.get());
    room_.notify_one();
    return static_cast<std::ptrdiff_t>(size);
  }

 private:
  static constexpr std::size_t most = 1 << 16;  // number of bytes that wait for `read` at most

  void fill() {
    for (;;) {
      DWORD error = 0;
      const std::string piece = is_console_ ? read_console(error) : read_bytes(error);
      std::unique_lock lock(mutex_);
      bytes_ += piece;
      const bool is_end = piece.empty() && error != ERROR_OPERATION_ABORTED;  // that one: Ctrl-C was pressed
      if (is_end) {
        ended_ = true;
        error_ = error == 0 || errno_of(error) == EPIPE
                     ? 0
                     : errno_of(error);  // the other end of a pipe was closed: the end of the input
      }
      if (ended_ || !bytes_.empty()) ::SetEvent(readable_.get());
      if (ended_) return;
      room_.wait(lock, [this] { return bytes_.size() < most; });
    }
  }

  std::string read_bytes(DWORD& error) const {
    std::array<char, 4096> piece;
    DWORD size = 0;
    if (::ReadFile(input_, piece.data(), static_cast<DWORD>(piece.size()), &size, nullptr) == 0) {
      error = ::GetLastError();
    }
    return {piece.data(), size};
  }

  // Returns one line. Ctrl-Z at its beginning is the end of the input.
  std::string read_console(DWORD& error) const {
    constexpr wchar_t control_z = 0x1A;
    std::array<wchar_t, 2048> piece;
    DWORD size = 0;
    ::SetLastError(0);
    if (::ReadConsoleW(input_, piece.data(), static_cast<DWORD>(piece.size()), &size, nullptr) == 0 || size == 0) {
      error = ::GetLastError();
    }
    return size > 0 && piece[0] == control_z ? std::string() : utf8({piece.data(), size});
  }

  Handle readable_;
  HANDLE input_;
  bool is_console_ = false;
  std::mutex mutex_;
  std::condition_variable room_;
  std::string bytes_;
  bool ended_ = false;
  int error_ = 0;  // value of errno that ended the input; 0: its end
};

}  // namespace

Waitable& standard_input() {
  static auto* const input = new StandardInput;  // its thread uses it until the process ends
  return *input;
}

}  // namespace absenc::os
