// SPDX-License-Identifier: Apache-2.0
// BiSS Safety: a control position word and a safety position word of the same shaft in one frame, each with its own
// check. README.md draws the frame. Source: BiSS Safety concept.
#pragma once

#include <algorithm>

#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// Format of one of several words in a frame.
struct Channel {
  WordFormat word = "position:19 error:1! warning:1!"_word;  ///< Fields of the position word.
  Check check{};                                             ///< Checksum of the word.
};

/// Returns the number of data bits.
[[nodiscard]] constexpr unsigned data_bits(const Channel& channel) {
  return channel.word.bits() + channel.check.bits();
}

/// Content of a channel.
struct ChannelData {
  Word word{};                    ///< The position word.
  std::uint8_t life_counter = 0;  ///< Life counter, if the check has one.
  std::uint16_t crc = 0;          ///< CRC as sent
};

/// Format of BiSS Safety: two position words of one encoder.
struct SafetyFormat {
  Channel cpw{.word = "position:24 error:1! warning:1!"_word};                  ///< The control position word.
  Channel spw{.word = "position:16 error:1! warning:1!"_word, .check = crc16};  ///< The safety position word.
  std::uint8_t compare_bits = 13;          ///< upper bits of the position in which both words must agree (ACC_MIN)
  std::int8_t previous_life_counter = -1;  ///< life counter of the frame before; -1: unknown
  // ---- The following members mean the same as in Format.
  std::uint32_t ma_khz = 1000;  ///< Clock MA in kHz.
  Time latency = 10us;          ///< Time that the encoder takes before its start bit.
  Time ready{};                 ///< Time that a virtual encoder needs for a position; 0: as `latency`, at most 10 us.
  std::uint32_t line_delay_ns = 0;      ///< Delay of the line in nanoseconds.
  std::uint16_t register_delay_us = 0;  ///< Time until a virtual encoder has a requested register ready, in us.
  bool start_sequence = false;          ///< Whether SLO of a virtual encoder stays idle until the start sequence.
  Timeout timeout{};                    ///< Timeout of the encoder.
  StopBit stop_bit = StopBit::next;     ///< The bit P that a virtual encoder sends after each register.
  std::uint8_t slave = 0;               ///< Slave whose registers are accessed: 0 safety word, 1 control word.
  RegisterOrder register_order = RegisterOrder::big;  ///< Order of the bytes of registers.

  /// Returns the period of the clock.
  [[nodiscard]] constexpr Time period() const { return Time((1'000'000 + ma_khz / 2) / ma_khz); }
};

/// Returns the number of data bits.
[[nodiscard]] constexpr unsigned data_bits(const SafetyFormat& format) {
  return data_bits(format.cpw) + data_bits(format.spw);
}

/// A reply of BiSS Safety.
struct SafetyReply {
  unsigned ack_bits = 1;    ///< Number of ACK bits: zeros between the idle samples and the start bit.
  ChannelData cpw{};        ///< The control position word.
  ChannelData spw{};        ///< The safety position word.
  unsigned delay_bits = 0;  ///< Extra idle samples: the delay of the line in clocks.
  bool cds = false;         ///< Bit of control data that the encoder sent.
};

namespace detail {

// SLO is low after the last word of a frame. Zeros are therefore not a word, although a CRC that is not inverted would
// be valid for them; as a word, they would be position zero with nE and nW both active.
constexpr Error take_channel(const Channel& channel, BitView samples, std::size_t first, ChannelData& data) {
  const std::size_t end = first + data_bits(channel);
  if (channel.check.width != 0 && !samples[first] && samples.end_of_run(first) >= end) return Error::line_stuck;
  return take_data(Given<Channel>{channel, channel.word}, samples, first, data);
}

// Returns the upper bits of the position, with the turns above them if both words have turns: near zero, one count
// changes the turns.
constexpr std::uint64_t compared_bits(const Channel& channel, const Word& word, unsigned bits, unsigned turns) {
  const std::uint64_t position = word.position >> (channel.word.bits_of(Meaning::position) - bits);
  return ((word.multiturn & low_mask(turns)) << bits | position) & low_mask(turns + bits);
}

}  // namespace detail

/// Returns whether both words have a valid check and the compared bits.
[[nodiscard]] constexpr bool is_usable(const SafetyFormat& format) {
  if (!is_usable(format.cpw.check) || !is_usable(format.spw.check)) return false;
  return format.compare_bits >= 1 && format.compare_bits <= format.cpw.word.bits_of(Meaning::position) &&
         format.compare_bits <= format.spw.word.bits_of(Meaning::position);
}

/// Returns whether both words have the same position, within one count of the compared bits.
[[nodiscard]] constexpr bool positions_agree(const SafetyFormat& format, const SafetyReply& reply) {
  const unsigned turns = std::min({format.cpw.word.bits_of(Meaning::multiturn),
                                   format.spw.word.bits_of(Meaning::multiturn), 64u - format.compare_bits});
  const unsigned bits = format.compare_bits;
  const std::uint64_t difference = (detail::compared_bits(format.cpw, reply.cpw.word, bits, turns) -
                                    detail::compared_bits(format.spw, reply.spw.word, bits, turns) + 1) &
                                   low_mask(turns + bits);
  return difference <= 2;
}

/// Decodes a frame of BiSS Safety; see decode of one word. Errors also: sequence_mismatch (the life counter does not
/// follow `previous_life_counter`), cross_check_failed (the words differ by more than one count of the compared bits).
[[nodiscard]] constexpr Result<SafetyReply> decode(const SafetyFormat& format, BitView samples, Cds cds = Cds::zero) {
  if (!is_usable(format)) return Error::invalid_argument;
  SafetyReply reply;
  std::size_t first = 0;
  Error error = detail::take_head(samples, data_bits(format), cds, reply, first);
  if (error == Error::none) error = detail::take_channel(format.cpw, samples, first, reply.cpw);
  if (error == Error::none) error = detail::take_channel(format.spw, samples, first + data_bits(format.cpw), reply.spw);
  if (error != Error::none) return error;
  const bool counts = format.spw.check.life_counter && format.previous_life_counter >= 0;
  const unsigned follows = static_cast<unsigned>(format.previous_life_counter + 1) & low_mask(life_counter_bits);
  if (counts && reply.spw.life_counter != follows) return Error::sequence_mismatch;
  if (!positions_agree(format, reply)) return Error::cross_check_failed;
  return reply;
}

/// Writes the frame that carries a reply; returns whether it has room.
template <std::size_t Capacity>
constexpr bool encode(const SafetyFormat& format, const SafetyReply& reply, BitBuffer<Capacity>& out,
                      std::uint8_t silent = 0) {
  if (!detail::append_head(reply, data_bits(format), out)) return false;
  if ((silent & 2) == 0) detail::append_data(format.cpw, reply.cpw, out);
  if ((silent & 1) == 0) detail::append_data(format.spw, reply.spw, out);
  return true;
}

/// Puts position and alarms into a reply.
constexpr void show(const SafetyFormat& format, const ShaftState& state, std::uint32_t alarms,
                    std::uint8_t life_counter, SafetyReply& reply) {
  reply.cpw = {.word = word_of(format.cpw.word, state, alarms), .life_counter = life_counter};
  reply.spw = {.word = word_of(format.spw.word, state, alarms), .life_counter = life_counter};
}

/// Returns the life counter of a reply, or -1 if it has none.
[[nodiscard]] constexpr int life_counter_of(const SafetyFormat& format, const SafetyReply& reply) {
  return format.spw.check.life_counter ? reply.spw.life_counter : -1;
}

/// Returns the position of the control word, with the errors and warnings of both words.
[[nodiscard]] constexpr Reading reading_of(const SafetyFormat& format, const SafetyReply& reply) {
  Word word = reply.cpw.word;
  word.error = word.error || reply.spw.word.error;
  word.warning = word.warning || reply.spw.word.warning;
  WordContents contents = contents_of(format.cpw.word);
  contents.reported |= contents_of(format.spw.word).reported;
  return to_reading(contents, word, {});
}

}  // namespace absenc::biss
