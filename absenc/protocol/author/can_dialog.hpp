// SPDX-License-Identifier: Apache-2.0
// Host side of a procedure on a CAN bus: it sends a frame, or listens, and then awaits one received frame after the
// other.
//
//   struct Protocol {
//     using Item = CanFrame;
//     using Format, Request = CanFrame;
//     static CanHostTimes host_times(const Format&);
//     static ByteBuffer<N> encode(const Format&, const CanFrame&);   // the text of a frame, as in vectors
//   };
#pragma once

#include <concepts>
#include <coroutine>
#include <optional>
#include <span>

#include "absenc/protocol/author/can_engine.hpp"
#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// The dialog of a protocol on CAN.
template <class P>
requires std::same_as<typename P::Item, CanFrame>
class DialogOf<P> : public CanEngine, public Routine {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }

  /// Sends a frame, or only listens. One of these calls must precede the first await of a received frame.
  void ask(const CanFrame& frame, Time pause = {}) { CanEngine::ask(frame, P::host_times(format_), pause); }
  using CanEngine::ask_for;
  using CanEngine::configure;
  using CanEngine::listen;
  using CanEngine::overhear;

  /// Awaits the next frame on the bus, from any node; nothing when the time is over: `const std::optional<CanFrame>
  /// frame = co_await dialog.heard()`.
  [[nodiscard]] auto heard() {
    struct Hear {
      DialogOf& dialog;
      [[nodiscard]] bool await_ready() const { return false; }
      void await_suspend(std::coroutine_handle<>) {}
      std::optional<CanFrame> await_resume() const { return dialog.frame_; }
    };
    return Hear{*this};
  }
  /// Returns when the awaited frame was complete.
  [[nodiscard]] Time heard_at() const { return heard_at_; }
  /// Returns whether the frame was received before the request was sent: see `overhear`.
  using CanEngine::came_early;
  [[nodiscard]] ChangeSent change_sent() const final { return change(); }
  /// Stores the awaited frame as the answer.
  void keep() { CanEngine::keep(*frame_, heard_at_); }

 protected:
  /// Talks to an encoder of this format; coroutines live in `arena`.
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
