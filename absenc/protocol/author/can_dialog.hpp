// SPDX-License-Identifier: Apache-2.0
// Host side of a procedure on a CAN bus. A protocol on CAN must have these members:
//
//   struct Protocol {
//     using Item = CanFrame;
//     using Format, Request = CanFrame;
//     static CanHostTimes host_times(const Format&);
//     static ByteBuffer<N> encode(const Format&, const CanFrame&);   // the text of a frame, as in vectors
//     static Manner manner(const Format&, const CanFrame&);          // only `pulse` is used, which must be 0
//   };
#pragma once

#include <concepts>
#include <coroutine>
#include <optional>
#include <span>

#include "absenc/protocol/author/can_engine.hpp"
#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// The conversation through which a procedure of a CAN protocol sends and receives frames.
template <class P>
requires std::same_as<typename P::Item, CanFrame>
class DialogOf<P> : public CanEngine, public Routine {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }

  /// Sets the frame to send next, at least `pause` after the answer that `keep` stored for the last request or, if it
  /// stored none, after that request.
  void ask(const CanFrame& frame, Time pause = {}) { CanEngine::ask(frame, P::host_times(format_), pause); }
  using CanEngine::ask_for;
  using CanEngine::configure;
  using CanEngine::listen;
  using CanEngine::overhear;

  /// Returns an awaitable that gives the next received frame, or nothing when a time limit has passed.
  [[nodiscard]] auto heard() {
    struct Hear {
      DialogOf& dialog;
      [[nodiscard]] bool await_ready() const { return false; }
      void await_suspend(std::coroutine_handle<>) {}
      std::optional<CanFrame> await_resume() const { return dialog.frame_; }
    };
    return Hear{*this};
  }
  /// Returns the time at which the last awaited frame was complete.
  [[nodiscard]] Time heard_at() const { return heard_at_; }
  /// Returns whether the last awaited frame was complete before the request was sent or listening began; see
  /// `overhear`.
  using CanEngine::came_early;
  [[nodiscard]] ChangeSent change_sent() const final { return change(); }
  [[nodiscard]] std::string_view change_note() const final { return noted(); }
  /// Stores the last awaited frame as the answer to the request, for `exchange`.
  void keep() { CanEngine::keep(*frame_, heard_at_); }

 protected:
  /// Constructs the conversation; the coroutine frames of its procedure are in `arena`.
  DialogOf(const Format& format, std::span<std::byte> arena) : Routine(arena), format_(format) {}
  ~DialogOf() = default;

 private:
  void heard(const CanFrame& frame, Time at) final {
    frame_ = frame;
    heard_at_ = at;
    resume();
  }
  void over() final {
    frame_.reset();
    resume();
  }
  void ended(const Outcome& outcome) final { finish(outcome); }

  Format format_;
  std::optional<CanFrame> frame_;
  Time heard_at_{};
};

}  // namespace absenc::author
