// SPDX-License-Identifier: Apache-2.0
// An annotation: a request with its reply, or one of them alone, decoded by the protocol's unit.
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

/// Information about an exchange that its frames do not contain.
enum class Remark : std::uint8_t {
  none,
  unanswered,    // no reply followed the request
  unsolicited,   // the reply had no request
  repeated,      // the previous reply was sent once more
  echo,          // the request was received again before the reply
  late,          // the reply arrived after the timeout of every host
  damaged,       // a character had a wrong parity or stop bit
  undocumented,  // no document states the reply to this request
  cut,           // incomplete, because the capture begins or ends here
};

/// Returns the remark as a clause without a full stop; "" for none.
[[nodiscard]] std::string_view text_of(Remark remark);

/// Decoded content of a good frame.
struct Contents {
  std::span<const FieldValue> fields{};  // decoded fields, in the order of the unit
  const Reading* reading = nullptr;      // the position, if the frame carries one
};

struct Annotation {
  enum class Kind : std::uint8_t {
    exchange,  // a request and its reply
    request,   // a request without its reply
    reply,     // a reply without its request
    noise,     // neither; its bytes are in `reply`
  };

  Kind kind = Kind::noise;
  Remark remark = Remark::none;
  Error error = Error::none;  // error of the whole annotation; with an error no value in it may be used
  bool composed = false;      // a frame of which several exchanges carried one byte each
  Tick begin = 0;
  Tick end = 0;
  // The members below are valid during the call only.
  Frame request{};
  Frame reply{};
  Contents contents{};               // decoded content of good frames
  std::optional<Tick> turnaround{};  // time from the end of the request to the beginning of its reply
};

/// Receives annotations in the order of their end times.
struct AnnotationSink {
  virtual void put(const Annotation& annotation) = 0;

 protected:
  ~AnnotationSink() = default;
};

}  // namespace absenc::capture
