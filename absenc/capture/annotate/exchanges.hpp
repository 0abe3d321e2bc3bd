// SPDX-License-Identifier: Apache-2.0
// Outstanding requests, and the annotations that they form together with their replies.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/annotate/judge.hpp"

namespace absenc::capture {

/// Times of a line, in ticks of its capture.
struct LineTicks {
  static constexpr Tick never = UINT64_MAX / 4;  // small enough that times can be added without overflow

  Tick pause = 1;       // a silence of this length ends a frame
  Tick character = 1;   // no silence within a character is that long
  Tick turnaround = 0;  // longest turnaround by the document; 0: not known
  Tick limit = never;   // after this time no host expects a reply
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
    static constexpr std::size_t capacity = 272;  // longer requests are cut: they are bad in any case
    std::array<std::uint8_t, capacity> storage{};
    std::size_t size = 0;
    Tick begin = 0;
    Tick end = 0;
    Error error = Error::none;
    Remark remark = Remark::none;
    bool is_request = true;  // false: bytes on a line with both directions that are no frame

    [[nodiscard]] Bytes bytes() const { return {storage.data(), size}; }
  };

  /// `judge` is a separate one: another judge holds the contents of the reply.
  Exchanges(Judge judge, const LineTicks& ticks, AnnotationSink& sink)
      : judge_(std::move(judge)), ticks_(ticks), sink_(sink) {}

  [[nodiscard]] std::span<const PendingRequest> waiting() const { return {pending_.data(), count_}; }
  /// Returns whether a good request was found so far.
  [[nodiscard]] bool has_request() const { return has_request_; }
  /// Returns whether the request has had no reply for so long that none will follow.
  [[nodiscard]] bool overdue(const PendingRequest& pending, Tick now) const { return now > pending.end + ticks_.limit; }

  /// Adds a request. If the list is full, the oldest is reported as unanswered.
  void add_request(const Piece& request, Error error, Remark remark, bool is_request);
  /// Reports the reply to `waiting()[which]`, and the requests before it as unanswered. `contents` must be empty with
  /// an error. A damaged reply counts as a reply. A reply after the limit is paired too, but with the error timeout: no
  /// host would accept it.
  void report_reply(std::size_t which, const Piece& reply, Error error, Remark remark, const Contents& contents);
  /// Reports the first `count` requests as unanswered.
  void report_unanswered(std::size_t count);
  /// Reports bytes that belong to no request.
  void report_unpaired(Annotation::Kind kind, const Piece& piece, Error error, Remark remark,
                       const Contents& contents = {});
  /// Ends the capture: outstanding requests may have been answered after it.
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
