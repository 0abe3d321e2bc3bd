// SPDX-License-Identifier: Apache-2.0
// Procedures as coroutines without a heap: each reads like its paragraph of the document. Their frames lie in storage
// that the caller gives, one above the other.
#pragma once

#include <coroutine>
#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"
#include "absenc/protocol/conversation.hpp"

// Without optimisation g++ 12 takes the frame's own operators for a pair that does not match, in every coroutine.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

namespace absenc::author {

/// How a procedure ends.
struct Outcome {
  Error error = Error::none;  ///< Why it ended; `Error::none`: well.
  std::string_view detail{};  ///< which step failed, what was found
  std::string_view advice{};  ///< what to do, in place of the error's own advice
  Time hold{};                ///< so long after what was last sent or heard the encoder must not be disturbed
  bool alone = false;         ///< these texts say all: what the document says of the last reply is not added
};

/// `co_return done;`
inline constexpr Outcome done{};

/// `co_return only(Error::timeout, "...")`: these words and no others.
[[nodiscard]] constexpr Outcome only(Error error, std::string_view detail, std::string_view advice = {}) {
  return {.error = error, .detail = detail, .advice = advice, .alone = true};
}

/// Runs one procedure and its parts; whoever carries it says what is awaited. Not to be copied: frames point to it.
class Routine {
 public:
  Routine(const Routine&) = delete;
  Routine& operator=(const Routine&) = delete;

  /// For the coroutines themselves: storage of a frame, null when it does not fit.
  [[nodiscard]] void* take(std::size_t size) {
    const std::size_t needed = (size + alignment - 1) / alignment * alignment;
    if (needed > arena_.size() - used_) return nullptr;
    void* const frame = arena_.data() + used_;
    used_ += needed;
    if (used_ > most_used_) most_used_ = used_;
    return frame;
  }
  /// Releases the frame of the coroutine that ended last.
  void give_back(void* frame) { used_ = static_cast<std::size_t>(static_cast<std::byte*>(frame) - arena_.data()); }
  /// For the coroutines themselves: `next` goes on when the present one suspends.
  void go_on_with(std::coroutine_handle<> next) { next_ = next; }
  /// Ends the procedure with this outcome.
  void end_with(const Outcome& outcome) {
    next_ = nullptr;
    current_ = nullptr;
    ended(outcome);
  }
  /// Bytes of storage that its frames took at the most.
  [[nodiscard]] std::size_t frames_size() const { return most_used_; }

  /// Marks that requests from here on may change the encoder.
  void changes() { change_ = ChangeSent::yes; }
  /// The encoder is as it was before `changes`: it said so, or reading back shows it.
  void refused() { change_ = ChangeSent::refused; }
  /// Returns whether a request that changes the encoder was sent.
  [[nodiscard]] ChangeSent change() const { return change_; }

  /// Ends the procedure from any depth: `co_await dialog.stop({Error::busy, "..."})`.
  [[nodiscard]] auto stop(const Outcome& outcome) {
    struct Stop {
      Routine& routine;
      Outcome outcome;
      [[nodiscard]] bool await_ready() const { return false; }
      void await_suspend(std::coroutine_handle<>) { routine.end_with(outcome); }
      void await_resume() const {}
    };
    return Stop{*this, outcome};
  }

 protected:
  /// `arena`: aligned for any type, must outlive this.
  explicit Routine(std::span<std::byte> arena) : arena_(arena) {}
  ~Routine() = default;

  /// The procedure, or the part of it that is running, has ended as a whole.
  virtual void ended(const Outcome& outcome) = 0;

  /// What was awaited is there. Parts are resumed one after the other, not from within each other.
  void resume() {
    next_ = current_;
    while (next_) {
      current_ = std::exchange(next_, nullptr);
      current_.resume();
    }
  }
  /// Begins with the first coroutine.
  void begin(std::coroutine_handle<> first) {
    current_ = first;
    if (!first) return ended({.error = Error::buffer_too_small, .detail = "the storage is too small for this command"});
    resume();
  }

 private:
  static constexpr std::size_t alignment = alignof(std::max_align_t);

  std::span<std::byte> arena_;
  std::size_t used_ = 0;
  std::size_t most_used_ = 0;
  ChangeSent change_ = ChangeSent::no;
  std::coroutine_handle<> current_{};
  std::coroutine_handle<> next_{};
};

/// What frames of procedures and parts have in common. The first parameter of the coroutine is what carries it.
struct FrameInRoutine {
  /// Allocates the frame in the arena of the routine; null: there is no room.
  template <class... Parameters>
  static void* operator new(std::size_t size, Routine& routine, const Parameters&...) noexcept {
    return routine.take(size);
  }
  /// The storage is the caller's: a part gives its own back, that of the procedure goes with its owner.
  static void operator delete(void*, std::size_t) {}

  /// Belongs to this routine.
  template <class... Parameters>
  explicit FrameInRoutine(Routine& carrier, const Parameters&...) : routine(carrier) {}

  /// Waits until the routine resumes it.
  [[nodiscard]] std::suspend_always initial_suspend() const noexcept { return {}; }
  /// Is never called: the layer has no exceptions.
  void unhandled_exception() const noexcept {}

  Routine& routine;  ///< The routine that runs this coroutine.
};

/// The result of a coroutine that is a whole command: `Procedure name(Dialog& dialog, Found& found, ...)`. Ends by
/// `co_return done;` or `co_return {Error::..., "..."};`.
struct Procedure {
  /// The interface that the compiler requires of a coroutine.
  struct promise_type : FrameInRoutine {
    using FrameInRoutine::FrameInRoutine;
    /// Returns the procedure to its caller.
    [[nodiscard]] Procedure get_return_object() { return {std::coroutine_handle<promise_type>::from_promise(*this)}; }
    /// Returns a procedure without a coroutine: there was no room.
    [[nodiscard]] static Procedure get_return_object_on_allocation_failure() { return {}; }
    /// Stays suspended at its end.
    [[nodiscard]] std::suspend_always final_suspend() const noexcept { return {}; }
    /// Ends the procedure.
    void return_value(const Outcome& outcome) { routine.end_with(outcome); }
  };
  std::coroutine_handle<> handle{};  ///< The coroutine; null: there was no room.
};

/// A part of a procedure, with a result: `const Reply reply = co_await look(dialog);`. At most one of a procedure runs.
template <class T>
struct [[nodiscard]] Part {
  /// The interface that the compiler requires of a coroutine.
  struct promise_type : FrameInRoutine {
    using FrameInRoutine::FrameInRoutine;
    /// Returns the part to its caller.
    [[nodiscard]] Part get_return_object() { return {std::coroutine_handle<promise_type>::from_promise(*this)}; }
    /// Returns a part without a coroutine: there was no room.
    [[nodiscard]] static Part get_return_object_on_allocation_failure() { return {}; }
    /// Continues with the caller.
    [[nodiscard]] auto final_suspend() const noexcept {
      struct Back {
        [[nodiscard]] bool await_ready() const noexcept { return false; }
        void await_suspend(std::coroutine_handle<promise_type> part) const noexcept {
          part.promise().routine.go_on_with(part.promise().caller);
        }
        void await_resume() const noexcept {}
      };
      return Back{};
    }
    /// Keeps the result.
    void return_value(const T& value) { result.emplace(value); }

    std::coroutine_handle<> caller{};  ///< The coroutine that awaits the part.
    std::optional<T> result{};         ///< The result, when the part has ended.
  };

  /// Returns false: the part always runs.
  [[nodiscard]] bool await_ready() const { return false; }
  /// Begins the part; its caller goes on when it has ended.
  template <class Caller>
  void await_suspend(std::coroutine_handle<Caller> caller) {
    Routine& routine = caller.promise().routine;
    if (!handle) {
      return routine.end_with(
          {.error = Error::buffer_too_small, .detail = "the storage is too small for this command"});
    }
    handle.promise().caller = caller;
    routine.go_on_with(handle);
  }
  /// By value: a reference would point into the frame, which is given back here.
  T await_resume() {
    const T result = *handle.promise().result;
    Routine& routine = handle.promise().routine;
    void* const frame = handle.address();
    handle.destroy();
    routine.give_back(frame);
    return result;
  }

  std::coroutine_handle<promise_type> handle{};  ///< The coroutine; null: there was no room.
};

}  // namespace absenc::author
