// SPDX-License-Identifier: Apache-2.0
// BiSS-C frames of one encoder as samples of SLO, one for each clock of MA. README.md draws them. Sources: RLS "E201-9S
// Decoding the BiSS information"; BiSS C rev D2.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/biss/check.hpp"
#include "absenc/protocol/biss/compiled_channel.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc::biss {

using namespace std::chrono_literals;

/// Number of idle samples before the ACK: SLO goes low on the second rising edge of MA.
inline constexpr unsigned idle_bits = 2;

/// Settings of a BiSS line: 1 MHz, and MA idles high.
inline constexpr LineSettings line_settings{.rate = 1'000'000, .spi_mode = 3};
/// Shortest period of MA that the document allows: 10 MHz.
inline constexpr Time shortest_period = 100ns;
/// Longest fixed BiSS timeout: after the last clock, SLO stays low for 12.5 to 40 us.
inline constexpr Time timeout_maximum = 40us;
/// Number of pulses of MA in the start sequence after power on.
inline constexpr unsigned start_pulses = 2;

/// BiSS timeout, for which SLO stays low after the last clock: fixed, adaptive or unknown.
class Timeout {
 public:
  constexpr Timeout() = default;  // An unknown timeout: the host waits 40 us, the virtual encoder takes 20 us.
  /// Returns a timeout of fixed length, 12.5 to 40 us in steps of 0.5 us.
  static constexpr Timeout fixed(Time length) { return Timeout(static_cast<std::uint8_t>(length / 500ns)); }
  /// Returns the timeout that adapts to the clock: one and a half periods of MA.
  static constexpr Timeout adaptive() { return Timeout(is_adaptive); }

  /// Returns the host's pause between frames; an adaptive timeout gets 1 us more (iC-PVS, table 50).
  [[nodiscard]] constexpr Time of_host(Time period) const {
    if (code_ == is_adaptive) return Time(static_cast<std::int32_t>(one_and_a_half(period) + 1000));
    return Time(static_cast<std::int32_t>((code_ != 0 ? code_ : 80u) * 500u));
  }
  /// Returns the timeout that the virtual encoder uses with this period of MA.
  [[nodiscard]] constexpr Time of_encoder(Time period) const {
    if (code_ == is_adaptive) return Time(one_and_a_half(period));
    return Time((code_ != 0 ? code_ : 40u) * 500u);
  }
  /// Returns whether two timeouts are equal.
  friend constexpr bool operator==(const Timeout&, const Timeout&) = default;

 private:
  static constexpr std::uint8_t is_adaptive = 1;
  // 32 bits are enough for one and a half periods, because the longest period of MA, at the lowest `ma_khz`, is 100 us.
  static constexpr std::uint32_t one_and_a_half(Time period) {
    const auto clock = static_cast<std::uint32_t>(period.count());
    return clock + clock / 2;
  }
  explicit constexpr Timeout(std::uint8_t code) : code_(code) {}

  std::uint8_t code_ = 0;  // timeout in units of 0.5 us; 0: unknown, 1: adaptive
};

/// Bit P of the virtual encoder after a register: 1 if the next one is refused, always 0, or always 1.
enum class StopBit : std::uint8_t { next, zero, one };
/// Values of the option `stop_bit`, in the order of StopBit.
inline constexpr std::array<std::string_view, 3> stop_bit_choices{"next", "zero", "one"};

/// Byte order of a number that several registers hold.
enum class RegisterOrder : std::uint8_t { big, little };
/// Values of the option `register_byte_order`, in the order of RegisterOrder.
inline constexpr std::array<std::string_view, 2> register_order_choices{"big", "little"};

class CompiledFormat;

/// Frame layout and settings of one encoder, as the unit's options select them.
struct Format {
  using Compiled = CompiledFormat;  ///< The format compiled (compiled_format.hpp), to decode many frames.
  WordFormat word = "position:19 error:1! warning:1!"_word;  ///< Layout of the position word.
  Check check{};                                             ///< Life counter and CRC that follow the position word.
  /// Whether the encoder is linear, and the length of a count.
  Scale scale{};
  std::uint16_t ma_khz = 1000;  ///< Clock MA in kHz, 10 to 10 000.
  // The members from here to `start_sequence` fit into padding bytes, so that they do not enlarge the format.
  std::uint8_t slave = 0;  ///< Slave whose registers are accessed: 0 to 7, counted from the end of the chain.
  RegisterOrder register_order = RegisterOrder::big;  ///< Byte order of a number that several registers hold.
  std::uint16_t register_delay_us = 0;  ///< Virtual encoder: time in us until a requested register is ready.
  /// Virtual encoder: whether SLO stays idle after power on until the start sequence.
  bool start_sequence = false;
  Timeout timeout{};  ///< BiSS timeout: how long the encoder holds SLO low after the last clock.
  /// Longest time from the second rising edge of MA until the position is ready, including the delay of the line; up
  /// to 1 ms.
  Time latency = 10us;
  // ---- Members for the virtual encoder
  /// How the virtual encoder sets the bit P after each register (1: the next register is refused).
  StopBit stop_bit = StopBit::next;
  std::uint32_t line_delay_ns = 0;  ///< Virtual encoder: delay of the line there and back, in nanoseconds.
  Time ready{};  ///< Virtual encoder: time that it needs for a position; 0: as `latency`, but at most 10 us.

  /// Returns the period of MA.
  [[nodiscard]] constexpr Time period() const { return Time((1'000'000u + ma_khz / 2u) / ma_khz); }
};

/// Returns the format of a word with position, turns, nError and nWarning.
[[nodiscard]] constexpr WordFormat word_with_status(const PositionBits& bits) {
  WordFormat word = word_format(bits);
  word.add({"error", Meaning::error, 1, true});
  word.add({"warning", Meaning::warning, 1, true});
  return word;
}

/// Returns the number of bits after the CDS bit: word, life counter and CRC.
[[nodiscard]] constexpr unsigned data_bits(const Format& format) { return format.word.bits() + format.check.bits(); }

/// Returns the number of ACK bits, at least 1, that an encoder sends which needs the time `latency` for its position,
/// at the clock period `period`. Both times are at most a second.
[[nodiscard]] constexpr unsigned ack_bits(Time latency, Time period) {
  const auto needed = static_cast<std::uint32_t>(latency.count());
  const auto clock = static_cast<std::uint32_t>(period.count());
  return std::max(1u, static_cast<unsigned>((needed + clock - 1) / clock));
}

/// Returns 0: in frames other than those of a chain, no slave delays the start bit.
template <class AnyFormat>
[[nodiscard]] constexpr unsigned relay_bits(const AnyFormat&) {
  return 0;
}

/// Returns the number of clocks between the idle samples and the start bit.
template <class AnyFormat>
[[nodiscard]] constexpr unsigned head_bits(const AnyFormat& format, Time latency, Time period) {
  return ack_bits(latency, period) + relay_bits(format);
}

/// Returns the number of clocks that a whole frame needs, from the idle samples to the CRC.
template <class AnyFormat>
[[nodiscard]] constexpr unsigned clocks(const AnyFormat& format, Time latency, Time period) {
  return idle_bits + head_bits(format, latency, period) + 2 + data_bits(format);
}

/// A decoded frame: position word, life counter, CRC and the bits before them.
template <class WordType>
struct ReplyWith {
  unsigned ack_bits = 1;          ///< Number of ACK bits: zeros between the idle samples and the start bit.
  WordType word{};                ///< Decoded fields of the position word.
  std::uint8_t life_counter = 0;  ///< Life counter, 0 to 63; 0 if the check has none.
  bool cds = false;               ///< CDS: the encoder's bit of control communication.
  std::uint16_t crc = 0;          ///< CRC as the encoder sent it.
  unsigned delay_bits = 0;        ///< Extra idle samples: the delay of the line in clocks.
};
/// A decoded frame whose word format is known at run time.
using Reply = ReplyWith<Word>;
/// A decoded frame whose format is known at compile time.
template <const Format& format>
using ReplyTo = ReplyWith<typename Known<format>::Word>;

/// Values of CDS that decoding accepts: a CDS of 1 is valid only during control communication.
enum class Cds : std::uint8_t { zero, any };

namespace detail {

// Decodes a word and its check from index `first` of `bits` on. Returns the first error.
template <class Source, class Bits, class Data>
constexpr Error take_data(const Source& source, const Bits& bits, std::size_t first, Data& data) {
  const Check& check = source.format.check;
  std::size_t end = first + source.word.bits();
  if (check.life_counter) {
    data.life_counter = static_cast<std::uint8_t>(bits.load(end, life_counter_bits));
    end += life_counter_bits;
  }
  if (check.width != 0) {
    data.crc = static_cast<std::uint16_t>(bits.load(end, check.width));
    if (data.crc != crc_as_sent(source, bits, first, end - first)) return Error::bad_checksum;
  }
  return absenc::detail::take_word(source, bits, first, data.word);
}

// Decodes idle bits, ACK, start bit and CDS, which precede the data, and checks that `size` bits of data follow.
template <class ReplyType>
constexpr Error take_head(const BitView& samples, std::size_t size, Cds cds, ReplyType& head, std::size_t& first) {
  if (samples.size == 0) return Error::wrong_length;
  const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
  if (idle == samples.size) return Error::line_stuck;
  const std::size_t start = samples.end_of_run(idle);
  if (start == samples.size) return idle == 0 ? Error::line_stuck : Error::bad_framing;  // the frame has no start bit
  first = start + 2;
  if (first > samples.size) return Error::truncated;
  head.cds = samples[first - 1];
  if (head.cds && cds == Cds::zero) return Error::bad_framing;
  if (size > samples.size - first) return Error::truncated;
  head.delay_bits = idle > idle_bits ? static_cast<unsigned>(idle - idle_bits) : 0;
  head.ack_bits = static_cast<unsigned>(start - idle);
  return Error::none;
}

template <class Source, class ReplyType>
constexpr Error take_frame(const Source& source, const BitView& samples, Cds cds, ReplyType& reply) {
  const unsigned size = data_bits(source.format);
  std::size_t first = 0;
  const Error error = take_head(samples, size, cds, reply, first);
  if (error != Error::none) return error;
  if constexpr (!Source::is_known) {
    return take_data(source, absenc::detail::SomeBits(samples, first, size), 0, reply);
  } else {
    if (size > 64) return take_data(source, samples, first, reply);
    return take_data(source, BitNumber{samples.load(first, size), size}, 0, reply);
  }
}

template <class Source>
constexpr auto decode_by(const Source& source, const BitView& samples, Cds cds) {
  Result result = ReplyWith<typename Source::Word>{};
  const Error error = take_frame(source, samples, cds, *result);
  if (error != Error::none) result = error;
  return result;
}

// The numbers of samples before the data of a frame that has no error.
struct Head {
  unsigned idle = 0;      // number of samples before the ACK
  unsigned ack_bits = 0;  // number of zeros between the idle samples and the start bit
  bool cds = false;

  [[nodiscard]] constexpr std::size_t first() const { return std::size_t{idle} + ack_bits + 2; }
  [[nodiscard]] constexpr unsigned delay_bits() const { return idle > idle_bits ? idle - idle_bits : 0; }
};

// Finds where the `size` bits of data begin. Returns false for a frame that `decode_compiled` cannot decode: it is cut
// off, its bits before the data do not fit into one register, or its CDS is 1 where it must be 0.
[[nodiscard, gnu::always_inline]] constexpr bool find_data(const BitView& samples, std::size_t size, Cds cds,
                                                           Head& head) {
  if (samples.bytes.size() < sizeof(std::size_t)) return false;
  const std::size_t window = samples.window(0);
  head.idle = static_cast<unsigned>(std::countl_one(window));
  if (head.idle == BitView::register_bits) return false;
  const std::size_t from_ack = window << head.idle;
  if (from_ack == 0) return false;
  head.ack_bits = static_cast<unsigned>(std::countl_zero(from_ack));
  if (head.first() > BitView::register_bits || head.first() + size > samples.size) return false;
  head.cds = (from_ack << head.ack_bits << 1 >> (BitView::register_bits - 1)) != 0;
  return !head.cds || cds == Cds::any;
}

// Decodes a frame that has no error and whose bits before the data fit into one register; calls `otherwise` for any
// other frame.
template <class Values, class Channel, class Otherwise>
[[nodiscard, gnu::always_inline]] constexpr Result<ReplyWith<Values>> decode_compiled(const Channel& channel,
                                                                                      const BitView& samples, Cds cds,
                                                                                      Otherwise otherwise) {
  Head head;
  if (!find_data(samples, channel.bits(), cds, head)) return otherwise();
  const typename Channel::Bits sent = channel.load(samples, head.first());
  if (!channel.is_right(sent)) return otherwise();
  return Result<ReplyWith<Values>>([&] {
    return ReplyWith<Values>{.ack_bits = head.ack_bits,
                             .word = channel.template values_of<Values>(sent),
                             .life_counter = channel.life_counter_of(sent),
                             .cds = head.cds,
                             .crc = sent.crc,
                             .delay_bits = head.delay_bits()};
  });
}

// The compiled word and check of a format that is known at compile time.
template <const Format& format>
inline constexpr CompiledChannel<std::conditional_t<(format.check.width > 8), std::uint16_t, std::uint8_t>,
                                 (format.word.bits() + life_counter_bits + 3) / 4>
    known_channel{format};

template <const Format& format>
[[nodiscard, gnu::noinline]] constexpr Result<ReplyTo<format>> decode_known(const BitView& samples, Cds cds) {
  return decode_by(Known<format>{}, samples, cds);
}

// Appends word, life counter and CRC to `out`.
template <class Format, class Data, std::size_t Capacity>
constexpr void append_data(const Format& format, const Data& data, BitBuffer<Capacity>& out) {
  const std::size_t first = out.size();
  encode_word(format.word, data.word, out);
  if (format.check.life_counter) out.append(data.life_counter, life_counter_bits);
  if (format.check.width == 0) return;
  const Given<Format> source{format, format.word};
  out.append(crc_as_sent(source, out.view(), first, out.size() - first), format.check.width);
}

// Appends idle bits, ACK, start bit and CDS. Returns false if `size` more bits would not fit.
template <class ReplyType, std::size_t Capacity>
constexpr bool append_head(const ReplyType& head, std::size_t size, BitBuffer<Capacity>& out) {
  if (out.capacity() - out.size() < idle_bits + head.delay_bits + head.ack_bits + 2 + size) return false;
  for (unsigned i = 0; i < idle_bits + head.delay_bits; ++i) out.append(1, 1);
  for (unsigned i = 0; i < head.ack_bits; ++i) out.append(0, 1);
  out.append(head.cds ? 0b11 : 0b10, 2);
  return true;
}

}  // namespace detail

/// Decodes a frame from samples that begin while SLO is idle (1) or in the ACK (0). Errors: wrong_length, line_stuck,
/// bad_framing, truncated, bad_checksum.
[[nodiscard]] constexpr Result<Reply> decode(const Format& format, const BitView& samples, Cds cds = Cds::zero) {
  return detail::decode_by(Given<Format>{format, format.word}, samples, cds);
}

/// Decodes a frame whose format is known at compile time; the errors are those of a format known at run time.
template <const Format& format>
[[nodiscard]] constexpr Result<ReplyTo<format>> decode(const BitView& samples, Cds cds = Cds::zero) {
  // To save memory, a program for a processor without registers of 64 bits has only `decode_by`.
  if constexpr (BitView::register_bits >= 64 && detail::known_channel<format>.is_possible()) {
    return detail::decode_compiled<typename Known<format>::Word>(
        detail::known_channel<format>, samples, cds, [&] { return detail::decode_known<format>(samples, cds); });
  } else {
    return detail::decode_by(Known<format>{}, samples, cds);
  }
}

/// Appends the frame of `reply`, with a computed CRC. If bit 0 of `silent` is set, the frame has no word and no check.
/// Returns false if `out` is too small.
template <std::size_t Capacity>
constexpr bool encode(const Format& format, const Reply& reply, BitBuffer<Capacity>& out, std::uint8_t silent = 0) {
  if (!detail::append_head(reply, data_bits(format), out)) return false;
  if ((silent & 1) == 0) detail::append_data(format, reply, out);
  return true;
}

/// Sets word and life counter of a virtual encoder's reply.
constexpr void show(const Format& format, const ShaftState& state, std::uint32_t alarms, std::uint8_t life_counter,
                    Reply& reply) {
  reply.word = word_of(format.word, state, alarms);
  reply.life_counter = life_counter;
}

/// Converts a reply to a reading.
[[nodiscard]] constexpr Reading reading_of(const Format& format, const Reply& reply) {
  return to_reading(format.word, reply.word, format.scale);
}

/// The format `known` as a type with the members that hosts of any format use.
template <const Format& known>
struct KnownFormat {
  static constexpr std::uint16_t ma_khz = known.ma_khz;  ///< Clock MA in kHz.
  /// Longest time from the second rising edge of MA until a position is ready, including the delay of the line.
  static constexpr Time latency = known.latency;
  static constexpr Timeout timeout = known.timeout;  ///< BiSS timeout after the last clock.
  /// Returns the period of MA.
  [[nodiscard]] static constexpr Time period() { return known.period(); }
};
/// Returns the number of bits after the CDS bit: word, life counter and CRC.
template <const Format& format>
[[nodiscard]] constexpr unsigned data_bits(const KnownFormat<format>&) {
  constexpr unsigned bits = data_bits(format);
  return bits;
}
/// Decodes a frame whose format is known at compile time; the errors are those of a format known at run time.
template <const Format& format>
[[nodiscard]] constexpr Result<ReplyTo<format>> decode(const KnownFormat<format>&, BitView samples, Cds cds) {
  return decode<format>(samples, cds);
}
/// Converts a reply to a reading.
template <const Format& format>
[[nodiscard]] constexpr Reading reading_of(const KnownFormat<format>&, const ReplyTo<format>& reply) {
  constexpr WordContents contents = contents_of(format.word);
  return to_reading(contents, reply.word, format.scale);
}

/// Returns whether only zeros follow the CDS bit, as in a frame of an encoder whose process data are switched off.
/// Stores the bits before the zeros in `head`.
template <class ReplyType>
[[nodiscard]] constexpr bool is_empty_frame(BitView samples, ReplyType& head) {
  std::size_t first = 0;
  if (detail::take_head(samples, 0, Cds::any, head, first) != Error::none) return false;
  return first < samples.size && !samples[first] && samples.end_of_run(first) == samples.size;
}

/// Returns whether the samples end within the frame.
[[nodiscard]] constexpr bool ended_early(Error error, BitView samples) {
  if (error == Error::truncated) return true;
  return error == Error::bad_framing && samples.end_of_run(samples.end_of_run(0)) == samples.size;
}

}  // namespace absenc::biss
