// SPDX-License-Identifier: Apache-2.0
// BiSS-C frames of one encoder as samples of SLO, one for each clock of MA: encode, decode, every check a frame allows,
// and its times. README.md draws the frame. Sources: RLS "E201-9S Decoding the BiSS information"; BiSS C rev D2.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/biss/check.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc::biss {

using namespace std::chrono_literals;

inline constexpr unsigned idle_bits = 2;  // SLO goes low on the second rising edge of MA

inline constexpr LineSettings line_settings{.rate = 1'000'000, .spi_mode = 3};
inline constexpr Time shortest_period = 100ns;  // of MA: 10 MHz
inline constexpr Time timeout_maximum = 40us;   // SLO stays low for 12.5 to 40 us after the last clock
inline constexpr unsigned start_pulses = 2;     // of MA after power on, with 40 us before and behind them

/// The time for which SLO stays low behind the last clock: fixed, or one and a half periods of MA (adaptive), in one
/// byte.
class Timeout {
 public:
  constexpr Timeout() = default;  // not known
  /// 12.5 us to 40 us, in halves of a microsecond.
  static constexpr Timeout fixed(Time length) { return Timeout(static_cast<std::uint8_t>(length / 500ns)); }
  static constexpr Timeout adaptive() { return Timeout(is_adaptive); }

  /// The time that the host leaves. An encoder that measures the period may be three of its own samples late (iC-PVS,
  /// table 50): 1 us is more than that of any known.
  [[nodiscard]] constexpr Time of_host(Time period) const {
    if (code_ == is_adaptive) return Time(static_cast<std::int32_t>(one_and_a_half(period) + 1000));
    return Time(static_cast<std::int32_t>((code_ != 0 ? code_ : 80u) * 500u));
  }
  /// The time that the virtual encoder takes.
  [[nodiscard]] constexpr Time of_encoder(Time period) const {
    if (code_ == is_adaptive) return Time(one_and_a_half(period));
    return Time((code_ != 0 ? code_ : 40u) * 500u);
  }
  friend constexpr bool operator==(const Timeout&, const Timeout&) = default;

 private:
  static constexpr std::uint8_t is_adaptive = 1;
  // 32 bits: the longest period is 100 us.
  static constexpr std::uint32_t one_and_a_half(Time period) {
    const auto clock = static_cast<std::uint32_t>(period.count());
    return clock + clock / 2;
  }
  explicit constexpr Timeout(std::uint8_t code) : code_(code) {}

  std::uint8_t code_ = 0;  // halves of a microsecond
};

/// The bit P that the virtual encoder answers behind each register.
enum class StopBit : std::uint8_t { next, zero, one };
inline constexpr std::array<std::string_view, 3> stop_bit_choices{"next", "zero", "one"};

/// Of registers that are one number.
enum class RegisterOrder : std::uint8_t { big, little };
inline constexpr std::array<std::string_view, 2> register_order_choices{"big", "little"};

struct Format {
  WordFormat word = "position:19 error:1! warning:1!"_word;
  Check check{};
  Scale scale{};
  std::uint16_t ma_khz = 1000;  // 10 to 10 000
  // Of registers and the start, in no more memory than a reader of positions has without them.
  std::uint8_t slave = 0;  // whose are meant: 0 to 7, counted from the end of the chain
  RegisterOrder register_order = RegisterOrder::big;
  std::uint16_t register_delay_us = 0;  // of the virtual encoder: until a register that was asked for is there
  bool start_sequence = false;          // of the virtual encoder: it shows nothing before it
  Timeout timeout{};
  Time latency = 10us;  // the longest that the encoder needs, up to 1 ms: makes the number of clocks
  // Of the virtual encoder.
  StopBit stop_bit = StopBit::next;
  std::uint32_t line_delay_ns = 0;
  Time ready{};  // what it needs itself; 0: as `latency`, but at most 10 us

  /// Of MA.
  [[nodiscard]] constexpr Time period() const { return Time((1'000'000u + ma_khz / 2u) / ma_khz); }
};

/// Turns and position, nError, nWarning.
[[nodiscard]] constexpr WordFormat word_with_status(const PositionBits& bits) {
  WordFormat word = word_format(bits);
  word.add({"error", Meaning::error, 1, true});
  word.add({"warning", Meaning::warning, 1, true});
  return word;
}

/// Word, life counter and CRC: what follows the CDS bit.
[[nodiscard]] constexpr unsigned data_bits(const Format& format) { return format.word.bits() + format.check.bits(); }

/// ACK bits of an encoder that needs `latency` from the second rising edge of MA until its position is ready. Both up
/// to a second: a small processor divides 32 bits.
[[nodiscard]] constexpr unsigned ack_bits(Time latency, Time period) {
  const auto needed = static_cast<std::uint32_t>(latency.count());
  const auto clock = static_cast<std::uint32_t>(period.count());
  return std::max(1u, static_cast<unsigned>((needed + clock - 1) / clock));
}

/// Clocks that the slaves between an encoder and the host add to the ACK: each passes it on one clock later.
template <class AnyFormat>
[[nodiscard]] constexpr unsigned passing_bits(const AnyFormat&) {
  return 0;
}

/// Clocks before the start bit, behind those of the idle line.
template <class AnyFormat>
[[nodiscard]] constexpr unsigned head_bits(const AnyFormat& format, Time latency, Time period) {
  return ack_bits(latency, period) + passing_bits(format);
}

/// Clocks that a whole frame needs.
template <class AnyFormat>
[[nodiscard]] constexpr unsigned clocks(const AnyFormat& format, Time latency, Time period) {
  return idle_bits + head_bits(format, latency, period) + 2 + data_bits(format);
}

template <class WordType>
struct ReplyWith {
  unsigned ack_bits = 1;
  WordType word{};
  std::uint8_t life_counter = 0;  // of a check that has one
  bool cds = false;               // the encoder's bit of control communication
  std::uint16_t crc = 0;          // as sent
  unsigned delay_bits = 0;        // idle samples more than those of an encoder at hand: the line's delay, in clocks
};
using Reply = ReplyWith<Word>;
template <const Format& format>
using ReplyTo = ReplyWith<typename Known<format>::Word>;

/// Whether a CDS of 1 is right: only while registers are read and written.
enum class Cds : std::uint8_t { zero, any };

namespace detail {

// A word and what checks it, in `bits` from `first` on.
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

// Where what follows the CDS bit begins: `size` bits. What is before it goes to `ack_bits`, `delay_bits` and `cds`.
template <class ReplyType>
constexpr Error take_head(BitView samples, std::size_t size, Cds cds, ReplyType& head, std::size_t& first) {
  if (samples.size == 0) return Error::wrong_length;
  const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
  if (idle == samples.size) return Error::line_stuck;
  const std::size_t start = samples.end_of_run(idle);
  if (start == samples.size) return idle == 0 ? Error::line_stuck : Error::bad_framing;  // no start bit
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
constexpr Error take_frame(const Source& source, BitView samples, Cds cds, ReplyType& reply) {
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
constexpr auto decode_by(const Source& source, BitView samples, Cds cds) {
  Result result = ReplyWith<typename Source::Word>{};
  const Error error = take_frame(source, samples, cds, *result);
  if (error != Error::none) result = error;
  return result;
}

// Word, life counter and CRC.
template <class Format, class Data, std::size_t Capacity>
constexpr void append_data(const Format& format, const Data& data, BitBuffer<Capacity>& out) {
  const std::size_t first = out.size();
  encode_word(format.word, data.word, out);
  if (format.check.life_counter) out.append(data.life_counter, life_counter_bits);
  if (format.check.width == 0) return;
  const Given<Format> source{format, format.word};
  out.append(crc_as_sent(source, out.view(), first, out.size() - first), format.check.width);
}

// Idle bits, ACK, start and CDS. False when `size` bits more do not fit.
template <class ReplyType, std::size_t Capacity>
constexpr bool append_head(const ReplyType& head, std::size_t size, BitBuffer<Capacity>& out) {
  if (out.capacity() - out.size() < idle_bits + head.delay_bits + head.ack_bits + 2 + size) return false;
  for (unsigned i = 0; i < idle_bits + head.delay_bits; ++i) out.append(1, 1);
  for (unsigned i = 0; i < head.ack_bits; ++i) out.append(0, 1);
  out.append(head.cds ? 0b11 : 0b10, 2);
  return true;
}

}  // namespace detail

/// The frame in samples of any length that begin while SLO is idle (1) or in the ACK (0). What follows the CRC is
/// ignored. Errors: wrong_length (no samples), line_stuck (all alike), bad_framing (no start bit, or CDS is 1 where it
/// must not), truncated (the frame goes on behind the samples), bad_checksum (CRC, or the parity of the word).
[[nodiscard]] constexpr Result<Reply> decode(const Format& format, BitView samples, Cds cds = Cds::zero) {
  return detail::decode_by(Given<Format>{format, format.word}, samples, cds);
}

/// The same of a format that is known when the program is written, at the cost of what a hand would write for it. The
/// word has `values` only where the format has some.
template <const Format& format>
[[nodiscard]] constexpr Result<ReplyTo<format>> decode(BitView samples, Cds cds = Cds::zero) {
  return detail::decode_by(Known<format>{}, samples, cds);
}

/// Appends idle bits, ACK, start, CDS, word and check; `reply.crc` is not used. `silent`: a bit for each slave whose
/// process data are switched off. False when `out` is too small.
template <std::size_t Capacity>
constexpr bool encode(const Format& format, const Reply& reply, BitBuffer<Capacity>& out, std::uint8_t silent = 0) {
  if (!detail::append_head(reply, data_bits(format), out)) return false;
  if ((silent & 1) == 0) detail::append_data(format, reply, out);
  return true;
}

/// What a virtual encoder says.
constexpr void show(const Format& format, const ShaftState& state, std::uint32_t alarms, std::uint8_t life_counter,
                    Reply& reply) {
  reply.word = word_of(format.word, state, alarms);
  reply.life_counter = life_counter;
}

[[nodiscard]] constexpr Reading reading_of(const Format& format, const Reply& reply) {
  return to_reading(format.word, reply.word, format.scale);
}

/// A format that is known when the program is written, where a host takes any format: what it asks of one.
template <const Format& known>
struct KnownFormat {
  static constexpr std::uint16_t ma_khz = known.ma_khz;
  static constexpr Time latency = known.latency;
  static constexpr Timeout timeout = known.timeout;
  [[nodiscard]] static constexpr Time period() { return known.period(); }
};
template <const Format& format>
[[nodiscard]] constexpr unsigned data_bits(const KnownFormat<format>&) {
  constexpr unsigned bits = data_bits(format);
  return bits;
}
template <const Format& format>
[[nodiscard]] constexpr Result<ReplyTo<format>> decode(const KnownFormat<format>&, BitView samples, Cds cds) {
  return decode<format>(samples, cds);
}
template <const Format& format>
[[nodiscard]] constexpr Reading reading_of(const KnownFormat<format>&, const ReplyTo<format>& reply) {
  constexpr WordContents contents = contents_of(format.word);
  return to_reading(contents, reply.word, format.scale);
}

/// Whether zeros alone follow the CDS: process data are switched off. `head` gets what is before them.
template <class ReplyType>
[[nodiscard]] constexpr bool is_empty_frame(BitView samples, ReplyType& head) {
  std::size_t first = 0;
  if (detail::take_head(samples, 0, Cds::any, head, first) != Error::none) return false;
  return first < samples.size && !samples[first] && samples.end_of_run(first) == samples.size;
}

/// Whether these samples end before a frame does, whose encoder or line may need longer than was thought.
[[nodiscard]] constexpr bool needs_more(Error error, BitView samples) {
  if (error == Error::truncated) return true;
  return error == Error::bad_framing && samples.end_of_run(samples.end_of_run(0)) == samples.size;
}

}  // namespace absenc::biss
