// SPDX-License-Identifier: Apache-2.0
// Outstanding requests of a capture, and annotations made of them and their replies.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/annotate/judge.hpp"

namespace absenc::capture {

/// Time limits of a line, in ticks of the capture.
struct LineTicks {
  static constexpr Tick never = UINT64_MAX / 4;  // a time that is never reached; adding times to it cannot overflow

  Tick pause = 1;        // shortest silence between two characters that can be a pause between frames, in ticks
  Tick frame_pause = 0;  // a silence shorter than this is a pause only behind a complete request, in ticks; 0: unused
  Tick character = 1;    // duration of a character; a silence between the edges of one character is shorter
  Tick turnaround = 0;   // turnaround time that the unit's document states; 0: not known
  Tick limit = never;    // longest time from request to reply; after it no host expects the reply
};

/// Bytes and the time during which they were on the line.
struct Piece {
  Bytes bytes{};
  Tick begin = 0;
  Tick end = 0;
};

class Exchanges {
 public:
  /// A request whose reply has not been found yet.
  struct PendingRequest {
    // number of bytes of a request that are stored; a longer request is cut, because it cannot be good
    static constexpr std::size_t capacity = 272;
    std::array<std::uint8_t, capacity> storage{};
    std::size_t size = 0;
    Tick begin = 0;
    Tick end = 0;
    Error error = Error::none;
    Remark remark = Remark::none;
    // true: the stored bytes are a request; false: they are no frame, but a reply may follow them, because the line
    // carries both directions
    bool is_request = true;

    [[nodiscard]] Bytes bytes() const { return {storage.data(), size}; }
  };

  /// Makes a list without requests. `sink` must outlive this object.
  Exchanges(Judge judge, const LineTicks& ticks, AnnotationSink& sink)
      : judge_(std::move(judge)), ticks_(ticks), sink_(sink) {}

  [[nodiscard]] std::span<const PendingRequest> waiting() const { return {pending_.data(), count_}; }
  /// Returns whether a good request was added so far.
  [[nodiscard]] bool has_request() const { return has_request_; }
  /// Returns whether, at the time `now`, no host expects a reply to `pending` any more.
  [[nodiscard]] bool overdue(const PendingRequest& pending, Tick now) const { return now > pending.end + ticks_.limit; }

  /// Adds an outstanding request. If four requests are stored already, reports the oldest of them as unanswered.
  void add_request(const Piece& request, Error error, Remark remark, bool is_request);
  /// Reports `reply` as the reply to `waiting()[which]`, and reports all older requests. `contents` must be empty if
  /// `error` is not none.
  void report_reply(std::size_t which, const Piece& reply, Error error, Remark remark, const Contents& contents);
  /// Reports the `count` oldest outstanding requests as unanswered.
  void report_unanswered(std::size_t count);
  /// Reports bytes that belong to no outstanding request.
  void report_unpaired(Annotation::Kind kind, const Piece& piece, Error error, Remark remark,
                       const Contents& contents = {});
  /// Ends the capture at `end` and reports the outstanding requests.
  void finish(Tick end);

 private:
  static constexpr std::size_t capacity = 4;

  void report_request(const PendingRequest& pending, bool cut);
  void remove(std::size_t count);

  Judge judge_;
  LineTicks ticks_;
  AnnotationSink& sink_;
  std::array<PendingRequest, capacity> pending_{};
  std::size_t count_ = 0;
  bool has_request_ = false;
};

}  // namespace absenc::capture
