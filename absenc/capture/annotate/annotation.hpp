// SPDX-License-Identifier: Apache-2.0
// An annotation: a request with its reply, a request or a reply alone, or noise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "absenc/capture/signal.hpp"
#include "absenc/core/angle.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::capture {

/// Remarks on an exchange: information that its frames do not contain.
enum class Remark : std::uint8_t {
  none,
  unanswered,    // no reply followed the request
  unsolicited,   // the reply was sent without a request
  repeated,      // the reply was sent a second time
  echo,          // the request's echo was received between the request and the reply
  late,          // the reply arrived after the time in which a host expects it
  damaged,       // a character had a wrong parity or stop bit, or the CAN bus had an error
  undocumented,  // no document states the reply to this request
  cut,           // the capture begins or ends here, so the frame or its exchange may be incomplete
};

/// Returns the remark as a clause without a full stop; "" for Remark::none.
[[nodiscard]] std::string_view text_of(Remark remark);

/// Decoded content of a good frame.
struct Contents {
  std::span<const FieldValue> fields{};  // decoded fields, in the order in which the unit reports them
  const Reading* reading = nullptr;      // position that the frame contains; null if it contains none
};

struct Annotation {
  enum class Kind : std::uint8_t {
    exchange,  // a request and its reply
    request,   // a request without its reply
    reply,     // a reply without its request
    noise,     // bytes that are neither request nor reply, stored in the member `reply`
  };

  Kind kind = Kind::noise;
  Remark remark = Remark::none;
  // error of the whole exchange; unless it is Error::none, no value in `contents` may be used
  Error error = Error::none;
  bool composed = false;  // the frame was composed of several exchanges that carried one byte of it each
  Tick begin = 0;
  Tick end = 0;
  // `request`, `reply` and `contents` refer to data that is valid only during the call of AnnotationSink::put.
  Frame request{};
  Frame reply{};
  Contents contents{};  // decoded content of request and reply; empty for bad frames
  // ticks from the end of the request to the begin of the reply; CAN: between the times of both frames
  std::optional<Tick> turnaround{};
};

/// Receives annotations, not always in the order of their times.
struct AnnotationSink {
  virtual void put(const Annotation& annotation) = 0;

 protected:
  ~AnnotationSink() = default;
};

}  // namespace absenc::capture
