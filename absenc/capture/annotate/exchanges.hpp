// SPDX-License-Identifier: Apache-2.0
// Requests that wait for their replies, and the annotations they become together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/annotate/judge.hpp"

namespace absenc::capture {

/// The times of a line, in ticks of its capture.
struct LineTicks {
  static constexpr Tick never = UINT64_MAX / 4;  // leaves room to add to

  Tick pause = 1;       // a line silent for so long has ended the frame
  Tick character = 1;   // no character has its line silent for so long
  Tick turnaround = 0;  // as the document has it; 0: not known
  Tick limit = never;   // later, no host expects a reply
};

/// Bytes with the time in which they were on the line.
struct Piece {
  Bytes bytes{};
  Tick begin = 0;
  Tick end = 0;
};

class Exchanges {
 public:
  /// A request without its reply so far.
  struct Asked {
    static constexpr std::size_t capacity = 272;  // longer ones are cut: they are bad anyhow
    std::array<std::uint8_t, capacity> storage{};
    std::size_t size = 0;
    Tick begin = 0;
    Tick end = 0;
    Error error = Error::none;
    Remark remark = Remark::none;
    bool is_request = true;  // false: what came alone on a line of both directions and is no frame

    [[nodiscard]] Bytes bytes() const { return {storage.data(), size}; }
  };

  /// `judge` is its own: another keeps what the reply says.
  Exchanges(Judge judge, const LineTicks& ticks, AnnotationSink& sink)
      : judge_(std::move(judge)), ticks_(ticks), sink_(sink) {}

  [[nodiscard]] std::span<const Asked> waiting() const { return {asked_.data(), waiting_}; }
  /// Whether there was a good request so far.
  [[nodiscard]] bool has_asked() const { return has_asked_; }
  /// Whether this request had no reply for so long that none will come.
  [[nodiscard]] bool overdue(const Asked& asked, Tick now) const { return now > asked.end + ticks_.limit; }

  /// The oldest gives up when there is no more room.
  void ask(const Piece& request, Error error, Remark remark, bool is_request);
  /// The reply to `waiting()[which]`; those before it had none. `contents` only without an error. A damaged reply has
  /// answered, too. Behind the limit it is paired all the same, but as a timeout: no host would have taken it.
  void answer(std::size_t which, const Piece& reply, Error error, Remark remark, const Contents& contents);
  /// The first `count` had no reply.
  void give_up(std::size_t count);
  /// What belongs to no request.
  void alone(Annotation::Kind kind, const Piece& piece, Error error, Remark remark, const Contents& contents = {});
  /// The capture ends here: what still waits may have been answered behind.
  void finish(Tick end);

 private:
  static constexpr std::size_t capacity = 4;

  void tell_unanswered(const Asked& asked, bool cut);
  void forget(std::size_t count);

  Judge judge_;
  LineTicks ticks_;
  AnnotationSink& sink_;
  std::array<Asked, capacity> asked_{};
  std::size_t waiting_ = 0;
  bool has_asked_ = false;
};

}  // namespace absenc::capture
