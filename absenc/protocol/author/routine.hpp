// SPDX-License-Identifier: Apache-2.0
// Procedures as coroutines without a heap: each reads like its paragraph of the document. Coroutine frames are in
// storage of the caller, one after the other.
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

// Without optimisation g++ 12 warns in every coroutine that the frame's own operators do not match.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

namespace absenc::author {

/// Result of a procedure.
struct Outcome {
  Error error = Error::none;  ///< Why it ended; `Error::none`: well.
  std::string_view detail{};  ///< which step failed, and the evidence
  std::string_view advice{};  ///< what to try, instead of the error's own advice
  Time hold{};                ///< how long the encoder must not be disturbed after the last sent or received character
  bool alone = false;         ///< these texts replace all others: the explanation of the last reply is not added
};

/// `co_return done;` ends a procedure without an error.
inline constexpr Outcome done{};

/// `co_return only(Error::timeout, "...")` ends a procedure with these texts and no others.
[[nodiscard]] constexpr Outcome only(Error error, std::string_view detail, std::string_view advice = {}) {
  return {.error = error, .detail = detail, .advice = advice, .alone = true};
}

/// Runs one procedure and its parts; the subclass resumes it when an awaited result is there. Not copyable, because
/// coroutine frames point to it.
class Routine {
 public:
  Routine(const Routine&) = delete;
  Routine& operator=(const Routine&) = delete;

  /// For coroutines: returns storage of a frame, null if it does not fit.
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
  /// For coroutines: resumes `next` when the present one suspends.
  void go_on_with(std::coroutine_handle<> next) { next_ = next; }
  /// Ends the procedure with this outcome.
  void end_with(const Outcome& outcome) {
    next_ = nullptr;
    current_ = nullptr;
    ended(outcome);
  }
  /// Returns the most bytes of storage that coroutine frames have taken.
  [[nodiscard]] std::size_t frames_size() const { return most_used_; }

  /// Marks that requests from now on may change the encoder.
  void changes() { change_ = ChangeSent::yes; }
  /// Marks that the encoder is as it was before `changes`: it refused the request, or reading back shows it.
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

  /// Handles the end of the whole procedure, also if a part of it ended it.
  virtual void ended(const Outcome& outcome) = 0;

  /// Resumes the coroutine whose awaited result is there. Parts are resumed one after the other, not from within each
  /// other.
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

/// Base of the coroutine frames of procedures and parts. The first parameter of the coroutine is the Routine.
struct FrameInRoutine {
  /// Allocates the frame in the arena of the routine; null: the arena is full.
  template <class... Parameters>
  static void* operator new(std::size_t size, Routine& routine, const Parameters&...) noexcept {
    return routine.take(size);
  }
  /// The caller owns the storage: a part returns its own, and that of the procedure ends with its owner.
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

/// Return type of a coroutine that is a whole command: `Procedure name(Dialog& dialog, Found& found, ...)`. It ends by
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

/// Return type of a part of a procedure, with a result: `const Reply reply = co_await look(dialog);`. At most one part
/// of a procedure runs.
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
  /// Begins the part; its caller continues when the part has ended.
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
  /// Returned by value: a reference would point into the frame, which is released here.
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
