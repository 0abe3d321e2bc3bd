// SPDX-License-Identifier: Apache-2.0
// EnDat as the classes of author/ use it: times of the host, requests and replies.
#pragma once

#include <algorithm>

#include "absenc/protocol/author/bit_host.hpp"
#include "absenc/protocol/endat/reading.hpp"

namespace absenc::endat {

/// Returns the rate of the clock for a command: the lowest one for parameters, so that the clocks that an access may
/// take are few.
[[nodiscard]] constexpr std::uint32_t rate_of(const Format& format, ModeCommand code) {
  return has_parameters(code) ? memory_rate : std::uint32_t{format.clock_khz} * 1000;
}
/// Returns the number of clocks of this rate that begin within `time`.
[[nodiscard]] constexpr std::size_t clocks_in(Time time, std::uint32_t rate) {
  return static_cast<std::size_t>((time.count() * (rate / 1000) + 999'999) / 1'000'000);
}
/// Returns the number of clocks by which the line delays the encoder's bits: the host samples half a period behind the
/// edge at which a bit begins.
[[nodiscard]] constexpr std::size_t delay_clocks(std::uint32_t delay_ns, std::uint32_t rate) {
  const std::uint64_t half_periods = std::uint64_t{delay_ns} * (rate / 1000) * 2 / 1'000'000;
  return static_cast<std::size_t>((half_periods + 1) / 2);
}
/// Returns the number of clocks from the first one to the start bit, if the position is calculated in `latency`.
[[nodiscard]] constexpr std::size_t clocks_to_start(Time latency, std::uint32_t rate) {
  return std::max(command_bits + turn_bits, clocks_in(latency, rate));
}

/// EnDat as the classes of author/ use it.
struct Protocol {
  /// Format of the encoder: the values of its options.
  using Format = endat::Format;
  /// C++ type of the requests to the encoder.
  using Request = endat::Request;
  /// C++ type of the encoder's replies.
  using Reply = endat::Reply;
  /// Greatest number of bits of a reply: an access to a parameter may take 12 ms.
  static constexpr std::size_t longest_reply_bits =
      turn_bits + clocks_in(memory_access_time, memory_rate) + 1 + parameter_bits + crc_bits;

  /// Returns the pause of a host after each exchange.
  static constexpr author::HostTimes host_times(const Format&) { return {.pause = long_recovery}; }
  /// Returns how a request is repeated: those that only read are, twice.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    const ModeCommand code = request.code;
    const bool reads = code == ModeCommand::position || code == ModeCommand::position_22 || code == ModeCommand::read ||
                       code == ModeCommand::select || code == ModeCommand::test_values;
    return {.repeats = reads ? 2u : 0u, .hold = has_parameters(code) ? memory_access_time : Time{}};
  }
  /// Returns the bits of a request, and how its reply is clocked.
  static constexpr author::BitRequest encode(const Format& format, const Request& request) {
    const ModeCommand code = request.code;
    const std::uint32_t rate = rate_of(format, code);
    author::BitRequest encoded{
        .bits = encode_request(request),
        .supplement = encode_supplement(request),
        .rate = rate,
        .rest = is_22(code) && format.recovery == Recovery::short_time ? short_recovery : long_recovery,
        .hold = !is_22(code) && format.version == CommandSet::v22 ? long_recovery : Time{}};
    const std::size_t reply = 1 + reply_size(format, code);
    const std::size_t longest_start = clocks_to_start(format.latency, rate) + delay_clocks(format.line_delay_ns, rate);
    if (has_parameters(code)) {
      encoded.clocks = turn_bits + clocks_in(memory_access_time, rate) + reply;
    } else if (has_supplement(code)) {
      encoded.clocks = turn_bits + reply;
      encoded.late_clocks = longest_start - command_bits - turn_bits;
    } else {
      encoded.clocks =
          longest_start + reply - command_bits + (request.seeks_infos ? (2 - format.infos()) * info_bits : 0);
    }
    return encoded;
  }
  /// Decodes the bits of a request, with those of its supplement.
  static constexpr Result<Request> decode_request(const Format&, const BitView& bits) {
    return endat::decode_request(bits);
  }
  /// Returns how many bits a reply still needs to be complete.
  static constexpr std::size_t missing(const Format& format, const Request& request, const BitView& bits) {
    return missing_bits(format, request.code, bits);
  }
  /// Returns the decoded reply, or the error of a failed check.
  static constexpr Result<Reply> decode(const Format& format, const Request& request, const BitView& bits) {
    return decode_reply(format, request, bits);
  }
  /// Returns the reading of a valid reply; an empty one if the reply has no position.
  static constexpr Reading reading(const Format& format, const Request& request, const Reply& reply) {
    return reading_of(format, request.code, reply);
  }
};

}  // namespace absenc::endat
