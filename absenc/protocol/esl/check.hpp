// SPDX-License-Identifier: Apache-2.0
// Everything that can be wrong with an ESL reply, in the order in which it is looked at, and what to say about it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/core/result.hpp"

namespace absenc::esl {

/// The first check that failed. `passed` comes first, then the checks of a frame, then those of a safe position.
enum class Check : std::uint8_t {
  passed,
  // of every frame
  length,
  channel_2_missing,
  ch1_checksum,
  ch2_checksum,
  both_checksums,
  channels_swapped,
  other_address,
  other_command,
  ch2_other_request,
  other_memory_address,
  parity_reported,
  stop_reported,
  ch1_channel_bit,
  ch2_channel_bit,
  unused_bits,
  busy_with_data,
  other_value,
  sequences_differ,
  redundant_position,
  encoder_ids_differ,
  // of a safe position
  not_a_safety_reply,
  ch1_not_ready,
  ch2_not_ready,
  forced_test_missing,
  safety_error,
  alarm,
  sequence_unknown,
  sequence_still,
  sequence_jumped,
  // of a probe
  request_not_accepted,
};

struct CheckText {
  Error error;
  std::string_view sentence;
};

/// Indexed by the enumerator.
inline constexpr std::array<CheckText, 31> check_texts{{
    {Error::none, ""},
    {Error::wrong_length, "the number of bytes is not that of this reply"},
    {Error::wrong_length, "channel 2 is missing: the reply ends after channel 1"},
    {Error::bad_checksum, "the CRC of channel 1 is wrong, channel 2 is good: nothing of the reply is used"},
    {Error::bad_checksum, "the CRC of channel 2 is wrong, channel 1 is good: nothing of the reply is used"},
    {Error::bad_checksum, "the CRC of the reply is wrong"},
    {Error::bad_checksum, "the channels are swapped: channel 2 came first"},
    {Error::unexpected_reply, "the control field carries the address of another encoder"},
    {Error::unexpected_reply, "the control field is that of another request"},
    {Error::unexpected_reply, "the control field of channel 2 is not that of the request"},
    {Error::unexpected_reply, "the reply is for another memory address"},
    {Error::request_rejected, "the encoder saw a wrong parity bit in the request and did not execute it"},
    {Error::request_rejected, "the encoder saw a wrong stop bit in the request and did not execute it"},
    {Error::unexpected_reply, "channel 1 says that it is channel 2"},
    {Error::unexpected_reply, "channel 2 says that it is channel 1"},
    {Error::out_of_range, "a bit that is always 0 is set"},
    {Error::unexpected_reply, "the encoder is busy but sends data (Table 10: 00)"},
    {Error::unexpected_reply, "the encoder accepted another value than was sent"},
    {Error::sequence_mismatch, "the sequence counters of the two channels differ"},
    {Error::cross_check_failed, "the redundant position of channel 2 does not agree with channel 1"},
    {Error::cross_check_failed, "the two channels send different encoder ids"},
    {Error::unsupported, "only replies to IDs 1 and 2 can make a safe position"},
    {Error::busy, "channel 1 is not ready"},
    {Error::busy, "channel 2 is not ready"},
    {Error::request_rejected, "the forced test has not passed in both channels"},
    {Error::request_rejected, "a channel reports a safety error"},
    {Error::request_rejected, "a channel raises an alarm that makes the position unsafe"},
    {Error::sequence_mismatch, "no earlier reply to another ID is known, so the sequence counter proves nothing yet"},
    {Error::sequence_mismatch, "the sequence counter stands still: this reply was seen before"},
    {Error::sequence_mismatch, "the sequence counter did not move as it should: a reply was repeated, lost or delayed"},
    {Error::unexpected_reply, "an encoder of this profile would not have answered the request as it did"},
}};
static_assert(check_texts.size() == static_cast<std::size_t>(Check::request_not_accepted) + 1);

/// The errors alone, so that firmware does not link the sentences.
inline constexpr std::array<Error, check_texts.size()> check_errors = [] {
  std::array<Error, check_texts.size()> errors{};
  for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = check_texts[i].error;
  return errors;
}();

[[nodiscard]] constexpr const CheckText& text_of(Check check) { return check_texts[static_cast<std::size_t>(check)]; }
[[nodiscard]] constexpr Error error_of(Check check) { return check_errors[static_cast<std::size_t>(check)]; }

}  // namespace absenc::esl
