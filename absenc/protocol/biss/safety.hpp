// SPDX-License-Identifier: Apache-2.0
// BiSS Safety frames: a control word and a safety word of the same shaft. README.md draws them. Source: BiSS Safety
// concept.
#pragma once

#include <algorithm>

#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// Format of one of several position words in a frame.
struct Channel {
  WordFormat word = "position:19 error:1! warning:1!"_word;  ///< Layout of the position word.
  Check check{};                                             ///< Life counter and CRC that follow the position word.
};

/// Returns the number of bits of the word and its check.
[[nodiscard]] constexpr unsigned data_bits(const Channel& channel) {
  return channel.word.bits() + channel.check.bits();
}

/// Decoded content of one of several words in a frame.
struct ChannelData {
  Word word{};                    ///< Decoded fields of the position word.
  std::uint8_t life_counter = 0;  ///< Life counter, 0 to 63; 0 if the check has none.
  std::uint16_t crc = 0;          ///< CRC as the encoder sent it.
};

class CompiledSafetyFormat;

/// Format of BiSS Safety: two position words of one encoder in a frame.
struct SafetyFormat {
  using Compiled = CompiledSafetyFormat;  ///< The format compiled (compiled_format.hpp), to decode many frames.
  /// Format of the control position word (CPW), which is sent first.
  Channel cpw{.word = "position:24 error:1! warning:1!"_word};
  /// Format of the safety position word (SPW).
  Channel spw{.word = "position:16 error:1! warning:1!"_word, .check = crc16};
  /// Number of upper position bits that must be equal in both words, within one count (ACC_MIN).
  std::uint8_t compare_bits = 13;
  std::int8_t previous_life_counter = -1;  ///< Life counter of the previous frame; -1: unknown.
  // ---- The following members mean the same as in Format.
  std::uint32_t ma_khz = 1000;  ///< Clock MA in kHz.
  /// Longest time from the second rising edge of MA until the position is ready, including the delay of the
  /// line; the number of clocks depends on it.
  Time latency = 10us;
  Time ready{};  ///< Time that a virtual encoder needs for a position; 0: as `latency`, at most 10 us.
  std::uint32_t line_delay_ns = 0;      ///< Delay of a virtual encoder's line, there and back, in nanoseconds.
  std::uint16_t register_delay_us = 0;  ///< Time until a virtual encoder has a requested register ready, in us.
  /// Whether SLO of a virtual encoder stays idle after power on until the host has sent the start sequence (two pulses
  /// of MA between pauses of 40 us).
  bool start_sequence = false;
  Timeout timeout{};  ///< BiSS timeout: how long the encoder holds SLO low after the last clock.
  /// How a virtual encoder sets the bit P after each register (1: the next register is refused).
  StopBit stop_bit = StopBit::next;
  std::uint8_t slave = 0;  ///< Slave whose registers are accessed: 0 safety word, 1 control word.
  RegisterOrder register_order = RegisterOrder::big;  ///< Byte order of a number that several registers hold.

  /// Returns the period of MA.
  [[nodiscard]] constexpr Time period() const { return Time((1'000'000 + ma_khz / 2) / ma_khz); }
};

/// Returns the number of bits after the CDS bit: both words with their checks.
[[nodiscard]] constexpr unsigned data_bits(const SafetyFormat& format) {
  return data_bits(format.cpw) + data_bits(format.spw);
}

/// A decoded frame of BiSS Safety.
struct SafetyReply {
  unsigned ack_bits = 1;    ///< Number of ACK bits: zeros between the idle samples and the start bit.
  ChannelData cpw{};        ///< Content of the control position word.
  ChannelData spw{};        ///< Content of the safety position word.
  unsigned delay_bits = 0;  ///< Extra idle samples, which show the delay of the line in clocks.
  bool cds = false;         ///< CDS: the encoder's bit of control communication.
};

namespace detail {

// Decodes one word and its check. If the word has a CRC, zeros alone are no word, even if the CRC fits them, because
// SLO is low after a frame.
constexpr Error take_channel(const Channel& channel, BitView samples, std::size_t first, ChannelData& data) {
  const std::size_t end = first + data_bits(channel);
  if (channel.check.width != 0 && !samples[first] && samples.end_of_run(first) >= end) return Error::line_stuck;
  return take_data(Given<Channel>{channel, channel.word}, samples, first, data);
}

// Returns the upper `bits` bits of the position, with the turns above them: near position 0 a difference of one count
// also changes the turns.
template <std::size_t size>
constexpr std::uint64_t compared_bits(const Channel& channel, const WordWith<size>& word, unsigned bits,
                                      unsigned turns) {
  const std::uint64_t position = word.position >> (channel.word.bits_of(Meaning::position) - bits);
  return ((word.multiturn & low_mask(turns)) << bits | position) & low_mask(turns + bits);
}

}  // namespace detail

/// Returns whether `is_usable` accepts the checks of both words, and `compare_bits` is 1 to the number of position bits
/// of each word.
[[nodiscard]] constexpr bool is_usable(const SafetyFormat& format) {
  if (!is_usable(format.cpw.check) || !is_usable(format.spw.check)) return false;
  return format.compare_bits >= 1 && format.compare_bits <= format.cpw.word.bits_of(Meaning::position) &&
         format.compare_bits <= format.spw.word.bits_of(Meaning::position);
}

/// Returns whether the upper `compare_bits` bits of both positions, with the turns if both words have them, differ by
/// at most one count, with wrap-around.
template <std::size_t size>
[[nodiscard]] constexpr bool positions_agree(const SafetyFormat& format, const WordWith<size>& cpw,
                                             const WordWith<size>& spw) {
  const unsigned turns = std::min({format.cpw.word.bits_of(Meaning::multiturn),
                                   format.spw.word.bits_of(Meaning::multiturn), 64u - format.compare_bits});
  const unsigned bits = format.compare_bits;
  const std::uint64_t difference =
      (detail::compared_bits(format.cpw, cpw, bits, turns) - detail::compared_bits(format.spw, spw, bits, turns) + 1) &
      low_mask(turns + bits);
  return difference <= 2;
}

/// Returns whether the life counter follows the previous one; true if either is unknown.
[[nodiscard]] constexpr bool life_counter_follows(const SafetyFormat& format, unsigned life_counter) {
  if (!format.spw.check.life_counter || format.previous_life_counter < 0) return true;
  return life_counter == (static_cast<unsigned>(format.previous_life_counter + 1) & low_mask(life_counter_bits));
}

/// Decodes a frame of BiSS Safety. Errors: those of a frame with one word, invalid_argument, sequence_mismatch,
/// cross_check_failed.
[[nodiscard]] constexpr Result<SafetyReply> decode(const SafetyFormat& format, BitView samples, Cds cds = Cds::zero) {
  if (!is_usable(format)) return Error::invalid_argument;
  SafetyReply reply;
  std::size_t first = 0;
  Error error = detail::take_head(samples, data_bits(format), cds, reply, first);
  if (error == Error::none) error = detail::take_channel(format.cpw, samples, first, reply.cpw);
  if (error == Error::none) error = detail::take_channel(format.spw, samples, first + data_bits(format.cpw), reply.spw);
  if (error != Error::none) return error;
  if (!life_counter_follows(format, reply.spw.life_counter)) return Error::sequence_mismatch;
  if (!positions_agree(format, reply.cpw.word, reply.spw.word)) return Error::cross_check_failed;
  return reply;
}

/// Appends the frame of `reply`. If bit 0 of `silent` is set, the SPW is left out; if bit 1 is set, the CPW. Returns
/// false if `out` is too small.
template <std::size_t Capacity>
constexpr bool encode(const SafetyFormat& format, const SafetyReply& reply, BitBuffer<Capacity>& out,
                      std::uint8_t silent = 0) {
  if (!detail::append_head(reply, data_bits(format), out)) return false;
  if ((silent & 2) == 0) detail::append_data(format.cpw, reply.cpw, out);
  if ((silent & 1) == 0) detail::append_data(format.spw, reply.spw, out);
  return true;
}

/// Sets both words of a virtual encoder's reply from the state of its shaft and its alarms.
constexpr void show(const SafetyFormat& format, const ShaftState& state, std::uint32_t alarms,
                    std::uint8_t life_counter, SafetyReply& reply) {
  reply.cpw = {.word = word_of(format.cpw.word, state, alarms), .life_counter = life_counter};
  reply.spw = {.word = word_of(format.spw.word, state, alarms), .life_counter = life_counter};
}

/// Returns the life counter of the safety word, or -1 if its check has none.
[[nodiscard]] constexpr int life_counter_of(const SafetyFormat& format, const SafetyReply& reply) {
  return format.spw.check.life_counter ? reply.spw.life_counter : -1;
}

/// Converts the control word to a reading, with the errors and warnings of both words.
[[nodiscard]] constexpr Reading reading_of(const SafetyFormat& format, const SafetyReply& reply) {
  Word word = reply.cpw.word;
  word.error = word.error || reply.spw.word.error;
  word.warning = word.warning || reply.spw.word.warning;
  WordContents contents = contents_of(format.cpw.word);
  contents.reported |= contents_of(format.spw.word).reported;
  return to_reading(contents, word, {});
}

}  // namespace absenc::biss
