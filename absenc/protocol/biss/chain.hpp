// SPDX-License-Identifier: Apache-2.0
// Several BiSS encoders in one frame, which README.md draws. Source: BiSS C Protocol Description rev D2.
#pragma once

#include <array>

#include "absenc/protocol/biss/safety.hpp"

namespace absenc::biss {

/// Format of the frames of a chain of encoders. Channel i belongs to slave `count - 1 - i`.
struct ChainFormat {
  static constexpr unsigned most = 8;    ///< Greatest number of data channels of a frame.
  std::array<Channel, most> channels{};  ///< Word format and check of each channel, in the order of the line.
  std::uint8_t count = 2;                ///< Number of used entries of `channels`.
  /// Slave whose position a reading shows and whose registers are accessed.
  std::uint8_t slave = 0;
  RegisterOrder register_order = RegisterOrder::big;  ///< Byte order of a number that several registers hold.
  std::uint16_t register_delay_us = 0;  ///< Time until a virtual encoder has a requested register ready, in us.
  /// Whether SLO of a virtual encoder stays idle after power on until the host has sent the start sequence (two pulses
  /// of MA between pauses of 40 us).
  bool start_sequence = false;
  Timeout timeout{};  ///< BiSS timeout: how long the encoder holds SLO low after the last clock.
  /// How a virtual encoder sets the bit P after each register (1: the next register is refused).
  StopBit stop_bit = StopBit::next;
  // ---- The following members mean the same as in Format.
  std::uint32_t ma_khz = 1000;  ///< Clock MA in kHz.
  /// Longest time from the second rising edge of MA until the positions are ready, including the delay of the
  /// line; the number of clocks depends on it.
  Time latency = 10us;
  Time ready{};  ///< Time that a virtual encoder needs for a position; 0: as `latency`, at most 10 us.
  std::uint32_t line_delay_ns = 0;  ///< Delay of a virtual encoder's line, there and back, in nanoseconds.
  Scale scale{};                    ///< Whether the encoders are linear, and the length of a count.

  /// Returns the period of MA.
  [[nodiscard]] constexpr Time period() const { return Time((1'000'000 + ma_khz / 2) / ma_khz); }
  /// Returns the index of the channel of `slave`; 0 if the chain has no such slave.
  [[nodiscard]] constexpr unsigned shown() const { return slave < count ? count - 1u - slave : 0u; }
};

/// Returns whether the numbers of encoders and of the selected slave are valid, and each word has a position and a
/// check that `is_usable` accepts.
[[nodiscard]] constexpr bool is_usable(const ChainFormat& format) {
  if (format.count > ChainFormat::most || format.slave >= format.count) return false;
  for (unsigned i = 0; i < format.count; ++i) {
    const Channel& channel = format.channels[i];
    if (channel.word.bits_of(Meaning::position) == 0 || !is_usable(channel.check)) return false;
  }
  return true;
}

/// Returns the number of bits after the CDS bit: all words with their checks.
[[nodiscard]] constexpr unsigned data_bits(const ChainFormat& format) {
  unsigned bits = 0;
  for (unsigned i = 0; i < format.count; ++i) bits += data_bits(format.channels[i]);
  return bits;
}

/// Returns the number of clocks by which the other slaves of the chain delay the start bit.
[[nodiscard]] constexpr unsigned relay_bits(const ChainFormat& format) { return format.count - 1u; }

/// A decoded frame of several encoders in a chain.
struct ChainReply {
  unsigned ack_bits = 1;  ///< Number of ACK bits: zeros between the idle samples and the start bit.
  std::array<ChannelData, ChainFormat::most> channels{};  ///< Word, life counter and CRC of each channel.
  unsigned delay_bits = 0;                                ///< Extra idle samples: the delay of the line in clocks.
  bool cds = false;                                       ///< CDS: the encoders' bit of control communication.
};

/// Decodes a frame of a chain. Errors: those of a frame with one word, and invalid_argument.
[[nodiscard]] constexpr Result<ChainReply> decode(const ChainFormat& format, BitView samples, Cds cds = Cds::zero) {
  if (!is_usable(format)) return Error::invalid_argument;
  ChainReply reply;
  std::size_t first = 0;
  Error error = detail::take_head(samples, data_bits(format), cds, reply, first);
  for (unsigned i = 0; i < format.count && error == Error::none; ++i) {
    error = detail::take_channel(format.channels[i], samples, first, reply.channels[i]);
    first += data_bits(format.channels[i]);
  }
  return error == Error::none ? Result(reply) : error;
}

/// Appends the frame of `reply` to `out`, but not the words of the slaves in the mask `silent` (bit n is slave n).
/// Returns false if `out` is too small.
template <std::size_t Capacity>
constexpr bool encode(const ChainFormat& format, const ChainReply& reply, BitBuffer<Capacity>& out,
                      std::uint8_t silent = 0) {
  if (!detail::append_head(reply, data_bits(format), out)) return false;
  for (unsigned i = 0; i < format.count; ++i) {
    const bool is_silent = (silent >> (format.count - 1u - i) & 1) != 0;
    if (!is_silent) detail::append_data(format.channels[i], reply.channels[i], out);
  }
  return true;
}

/// Fills `reply` with the words of a chain whose encoders are all on one shaft.
constexpr void show(const ChainFormat& format, const ShaftState& state, std::uint32_t alarms, std::uint8_t life_counter,
                    ChainReply& reply) {
  for (unsigned i = 0; i < format.count; ++i) {
    reply.channels[i] = {.word = word_of(format.channels[i].word, state, alarms), .life_counter = life_counter};
  }
}

/// Returns the life counter of the selected slave, or -1 if its check has none.
[[nodiscard]] constexpr int life_counter_of(const ChainFormat& format, const ChainReply& reply) {
  const unsigned shown = format.shown();
  return format.channels[shown].check.life_counter ? reply.channels[shown].life_counter : -1;
}

/// Converts the word of the slave that the format selects to a reading.
[[nodiscard]] constexpr Reading reading_of(const ChainFormat& format, const ChainReply& reply) {
  const unsigned shown = format.shown();
  return to_reading(format.channels[shown].word, reply.channels[shown].word, format.scale);
}

}  // namespace absenc::biss
