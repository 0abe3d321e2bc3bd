// SPDX-License-Identifier: Apache-2.0
// What was said on a line: a request with its reply, or one of them alone, decoded by the protocol's unit.
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

/// What of an exchange its frames do not tell.
enum class Remark : std::uint8_t {
  none,
  unanswered,    // nothing came behind the request
  unsolicited,   // nothing was asked before the reply
  repeated,      // the reply came once more
  echo,          // the request came back before the reply
  late,          // the reply came after every host has given up
  damaged,       // a character had a wrong parity or stop bit
  undocumented,  // no document says what the reply to this request is
  cut,           // by the beginning or the end of the capture
};

/// A sentence without its end; "" for none.
[[nodiscard]] std::string_view text_of(Remark remark);

/// What a good frame says.
struct Contents {
  std::span<const FieldValue> fields{};  // in the order in which the unit puts them
  const Reading* reading = nullptr;      // the position, when it carries one
};

struct Annotation {
  enum class Kind : std::uint8_t {
    exchange,  // a request and its reply
    request,   // alone
    reply,     // alone
    noise,     // neither; its bytes stand in `reply`
  };

  Kind kind = Kind::noise;
  Remark remark = Remark::none;
  Error error = Error::none;  // of the whole; with one, nothing of it is to be used
  bool composed = false;      // several exchanges carried a byte of it each
  Tick begin = 0;
  Tick end = 0;
  // These are valid during the call only.
  Frame request{};
  Frame reply{};
  Contents contents{};               // of what is good and was decoded
  std::optional<Tick> turnaround{};  // from the end of the request to the begin of its reply
};

/// Receives annotations in the order in which they ended.
struct AnnotationSink {
  virtual void put(const Annotation& annotation) = 0;

 protected:
  ~AnnotationSink() = default;
};

}  // namespace absenc::capture
