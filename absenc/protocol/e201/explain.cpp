// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/e201/explain.hpp"

namespace absenc::e201 {

namespace {

constexpr std::string_view check_biss = "check what is connected, or select a lower MA clock (set-clock)";
constexpr std::string_view check_clock = "select another MA clock (set-clock; clock-sweep finds one)";

// Which of the checks of decode_position it was.
Explanation explain_framing(const Format& format, Bytes reply) {
  const Result<std::uint64_t> samples = decode_samples(reply);
  if (!samples) return {"the interface answers with hexadecimal digits", "check that it is an E201-9S"};
  if (format.carries == Carries::ssi) return {"the line is not idle before the word", "check what is connected"};
  if (*samples >> 61 != 0b110) return {"the samples do not begin with 110", check_biss};
  if (*samples << 3 == 0) return {"no start bit follows the ACK", check_biss};
  return {"the CDS bit is 1", check_biss};
}

Explanation explain_samples(const Format& format, Error error, Bytes reply) {
  const bool is_biss = format.carries == Carries::biss;
  switch (error) {
    case Error::invalid_argument:
      return {"the interface samples 64 bits, and the word does not fit", "give it fewer bits"};
    case Error::line_stuck:
      return {{}, "check that an encoder is connected and supplied: supply-on switches its supply on"};
    case Error::bad_framing:
      return explain_framing(format, reply);
    case Error::truncated:
      return {"the ACK is too long for the 64 samples", "select a lower MA clock (set-clock; clock-sweep finds one)"};
    case Error::bad_checksum:
      if (!is_biss) return {"the parity of the word is wrong", check_clock};
      return {"the interface does not compensate the delay of the line", check_clock};
    case Error::cross_check_failed:
      return {"the bits behind the word are not what after_word says", "check the number of bits"};
    case Error::wrong_length:
      return {"the interface answers with 16 hexadecimal digits and CR", check_stream};
    default:
      return {};
  }
}

}  // namespace

Explanation explain(const Format& format, Error error, Bytes request, Bytes reply) {
  if (request.empty() || request[0] == letter::samples) return explain_samples(format, error, reply);
  switch (error) {
    case Error::timeout:
      return {"the interface is silent", "check that it is an E201-9S"};
    case Error::wrong_length:
      return {"the interface answers with a line that ends with CR", check_stream};
    case Error::bad_framing:
      return {"this is no answer to that command", "check that it is an E201-9S"};
    default:
      return {};
  }
}

}  // namespace absenc::e201
