// SPDX-License-Identifier: Apache-2.0
// Runs procedures (commands of several requests) as coroutines, without a heap.
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

// Without optimisation g++ 12 warns in coroutines that operators new and delete do not match.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

namespace absenc::author {

/// How a procedure ended: its error, with texts for people.
struct Outcome {
  Error error = Error::none;  ///< Why the procedure failed; `Error::none`: it succeeded.
  std::string_view detail{};  ///< text for people: the step of the procedure that failed, and the evidence
  std::string_view advice{};  ///< text for people: what to try, instead of the error's own advice
  /// time after the last sent or received character in which nothing may disturb the encoder
  Time hold{};
  /// True: the explanation of the last reply is not added to `detail` and `advice`.
  bool alone = false;
};

/// Outcome of a procedure that succeeded: `co_return done;`.
inline constexpr Outcome done{};

/// Returns an outcome without the explanation of the last reply: `co_return only(Error::timeout, "...")`.
[[nodiscard]] constexpr Outcome only(Error error, std::string_view detail, std::string_view advice = {}) {
  return {.error = error, .detail = detail, .advice = advice, .alone = true};
}

/// Runs one procedure and its parts; not copyable, because coroutine frames point to it.
class Routine {
 public:
  Routine(const Routine&) = delete;
  Routine& operator=(const Routine&) = delete;

  /// Returns storage for a coroutine frame of `size` bytes; null if there is no room.
  [[nodiscard]] void* take(std::size_t size) {
    const std::size_t needed = (size + alignment - 1) / alignment * alignment;
    if (needed > arena_.size() - used_) return nullptr;
    void* const frame = arena_.data() + used_;
    used_ += needed;
    if (used_ > most_used_) most_used_ = used_;
    return frame;
  }
  /// Releases the storage of `frame`, the frame of the coroutine that was begun last.
  void give_back(void* frame) { used_ = static_cast<std::size_t>(static_cast<std::byte*>(frame) - arena_.data()); }
  /// Sets the coroutine that runs when the present one suspends.
  void go_on_with(std::coroutine_handle<> next) { next_ = next; }
  /// Ends the procedure with this outcome: its coroutines are not resumed again.
  void end_with(const Outcome& outcome) {
    next_ = nullptr;
    current_ = nullptr;
    ended(outcome);
  }
  /// Returns the greatest number of bytes that coroutine frames have occupied at once.
  [[nodiscard]] std::size_t frames_size() const { return most_used_; }

  /// Notes that requests from now on may change the encoder.
  void changes() {
    change_ = ChangeSent::yes;
    change_note_ = {};
  }
  /// Notes that the request after the call of `changes` has not changed the encoder.
  void refused() { change_ = ChangeSent::refused; }
  /// Notes that reading back would give the same if the encoder had ignored the request after the call of `changes`.
  /// `why`: a text for people.
  void unproven(std::string_view why) {
    change_ = ChangeSent::unproven;
    change_note_ = why;
  }
  /// Notes what the request after the call of `changes` changed besides; a text for people.
  void note_change(std::string_view note) { change_note_ = note; }
  /// Returns what `changes`, `refused` or `unproven` noted last; `no` if none was called.
  [[nodiscard]] ChangeSent change() const { return change_; }
  /// Returns the text that `unproven` or `note_change` noted last; empty: none.
  [[nodiscard]] std::string_view noted() const { return change_note_; }

  /// Returns an awaitable that ends the procedure: `co_await dialog.stop({Error::busy, "..."})`.
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
  /// Constructs a routine. `arena` is aligned for any type, and outlives the routine.
  explicit Routine(std::span<std::byte> arena) : arena_(arena) {}
  ~Routine() = default;

  /// Handles the end of the whole procedure, whether the procedure itself or one of its parts ended it.
  virtual void ended(const Outcome& outcome) = 0;

  /// Resumes the coroutine that waits for a result which is now available.
  void resume() {
    next_ = current_;
    while (next_) {
      current_ = std::exchange(next_, nullptr);
      current_.resume();
    }
  }
  /// Begins the procedure `first`; if it is null, the procedure ends with buffer_too_small.
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
  std::string_view change_note_{};
  std::coroutine_handle<> current_{};
  std::coroutine_handle<> next_{};
};

/// Base of the coroutine frames of procedures and parts, whose first parameter is the Routine.
struct FrameInRoutine {
  /// Allocates a coroutine frame in the arena of `routine`; returns null if the arena is full.
  template <class... Parameters>
  static void* operator new(std::size_t size, Routine& routine, const Parameters&...) noexcept {
    return routine.take(size);
  }
  /// Does nothing: Part::await_resume gives the storage of a part back.
  static void operator delete(void*, std::size_t) {}

  /// Constructs the frame of a coroutine that the routine `carrier` runs.
  template <class... Parameters>
  explicit FrameInRoutine(Routine& carrier, const Parameters&...) : routine(carrier) {}

  /// Suspends a new coroutine until the routine resumes it.
  [[nodiscard]] std::suspend_always initial_suspend() const noexcept { return {}; }
  /// Is never called, because procedures throw no exceptions.
  void unhandled_exception() const noexcept {}

  Routine& routine;  ///< The routine that runs this coroutine.
};

/// Return type of a coroutine that executes a whole command and returns an Outcome.
struct Procedure {
  /// Functions that the compiler calls for a coroutine that returns a Procedure.
  struct promise_type : FrameInRoutine {
    using FrameInRoutine::FrameInRoutine;
    /// Returns the procedure object of the new coroutine.
    [[nodiscard]] Procedure get_return_object() { return {std::coroutine_handle<promise_type>::from_promise(*this)}; }
    /// Returns a procedure without a coroutine, if there was no room for its frame.
    [[nodiscard]] static Procedure get_return_object_on_allocation_failure() { return {}; }
    /// Keeps the coroutine suspended at its end.
    [[nodiscard]] std::suspend_always final_suspend() const noexcept { return {}; }
    /// Ends the procedure with `outcome`.
    void return_value(const Outcome& outcome) { routine.end_with(outcome); }
  };
  std::coroutine_handle<> handle{};  ///< The coroutine; null: there was no room for its frame.
};

/// Return type of a coroutine that is a part of a procedure and has a result.
template <class T>
struct [[nodiscard]] Part {
  /// Functions that the compiler calls for a coroutine that returns a Part.
  struct promise_type : FrameInRoutine {
    using FrameInRoutine::FrameInRoutine;
    /// Returns the part object of the new coroutine.
    [[nodiscard]] Part get_return_object() { return {std::coroutine_handle<promise_type>::from_promise(*this)}; }
    /// Returns a part without a coroutine, if there was no room for its frame.
    [[nodiscard]] static Part get_return_object_on_allocation_failure() { return {}; }
    /// Returns an awaitable that continues with the coroutine that awaits the part.
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
    /// Stores the result of the part.
    void return_value(const T& value) { result.emplace(value); }

    std::coroutine_handle<> caller{};  ///< The coroutine that awaits the part.
    std::optional<T> result{};         ///< Result of the part; nothing until the part has ended.
  };

  /// Returns false: awaiting a part always runs it first.
  [[nodiscard]] bool await_ready() const { return false; }
  /// Begins the part; without a frame the procedure ends with buffer_too_small.
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
  /// Returns the result by value, because the frame that has it is released here.
  T await_resume() {
    const T result = *handle.promise().result;
    Routine& routine = handle.promise().routine;
    void* const frame = handle.address();
    handle.destroy();
    routine.give_back(frame);
    return result;
  }

  std::coroutine_handle<promise_type> handle{};  ///< The coroutine; null: there was no room for its frame.
};

}  // namespace absenc::author
