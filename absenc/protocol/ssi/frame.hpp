// SPDX-License-Identifier: Apache-2.0
// SSI words, MSB first: encoding, decoding and times. README.md draws the frame.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/word.hpp"

namespace absenc::ssi {

using namespace std::chrono_literals;

/// Settings of an SSI line: 200 kHz, and the clock idles high.
inline constexpr LineSettings line_settings{.rate = 200'000, .spi_mode = 3, .idle_clocks = 1};
inline constexpr Time pause_margin = 10us;  ///< Time that the host adds to the pause between two words.

/// Bits that the encoder sends if the clock continues after the word.
enum class AfterWord : std::uint8_t {
  repeat,
  zero,
  one,
  separated,  ///< The encoder sends a zero, then the word again.
};

class CompiledFormat;

/// Frame layout and settings of one encoder, as the unit's options select them.
struct Format {
  using Compiled = CompiledFormat;           ///< The format compiled (compiled_format.hpp), to decode many words.
  WordFormat word = "position:12"_word;      ///< Layout of the position word: its fields in the order of the line.
  AfterWord after_word = AfterWord::repeat;  ///< Bits that the encoder sends if the host clocks on after the word.
  /// Number of clocks after the word, whose bits are compared with `after_word`.
  unsigned extra_clocks = 0;
  Scale scale{};  ///< Whether the encoder is linear, and the length of a count.
  /// Whether the last bit is a parity bit that the encoder inverts if its position is wrong.
  bool error_parity = false;
  bool padded = false;  ///< Whether skipped bits of the word must be zero.
  /// Highest speed of the shaft, in rpm, at which a second word confirms the first; 0: the host reads only one word.
  std::uint32_t confirm_rpm = 0;
  // ---- Values that vary by product (RAA38S6 3.5, note)
  /// Longest pause of the clock after which the old word may still continue (monoflop time Tm).
  Time pause = 50us;
  std::uint32_t clock_khz = 200;  ///< Clock rate in kHz.
  /// Monoflop time Tm of the virtual encoder, at most `pause`; 0: equal to `pause`.
  Time monoflop = 20us;
  std::uint32_t slowest_khz = 100;  ///< Slowest clock in kHz that the virtual encoder accepts from a host.
  /// Fastest clock that the virtual encoder allows, in kHz; its period is the document's Tcs.
  std::uint32_t fastest_khz = 250;
};

inline constexpr std::size_t frame_capacity = 2 * WordFormat::maximum_bits;  ///< Greatest number of bits of a frame.

/// Returns the number of clocks of one reading: the word and the extra clocks.
[[nodiscard]] constexpr unsigned clocks(const Format& format) { return format.word.bits() + format.extra_clocks; }

/// Returns bit number `index`, from 0, of the bits that an encoder sends if the clock never stops: its word, then the
/// bits that follow the word. The word begins at bit `first` of `word`.
[[nodiscard]] constexpr bool bit_after_word(const Format& format, BitView word, std::size_t index,
                                            std::size_t first = 0) {
  const std::size_t bits = format.word.bits();
  if (index < bits || format.after_word == AfterWord::repeat) return word[first + index % bits];
  if (format.after_word == AfterWord::separated) {
    const std::size_t place = index % (bits + 1);
    return place < bits && word[first + place];
  }
  return format.after_word == AfterWord::one;
}

namespace detail {

[[nodiscard]] constexpr Error check_length(const Format& format, BitView bits) {
  const std::size_t word = format.word.bits();
  const std::size_t both = 2 * word + (format.after_word == AfterWord::separated ? 1 : 0);
  const bool twice = format.extra_clocks == 0 && bits.size == both;
  if (bits.size == clocks(format) || twice) return Error::none;
  // The bits before the last `word` bits are the high bits of the number that was read. If one of them is 1, the number
  // is greater than any position word.
  for (std::size_t i = 0; i + word < bits.size; ++i) {
    if (bits[i]) return Error::out_of_range;
  }
  return Error::wrong_length;
}

template <class Source>
constexpr bool is_padding_zero(const Source& source, BitView bits, std::size_t first) {
  return source.each(
      [&](auto field) { return field.meaning != Meaning::skip || bits.load(first + field.first, field.bits) == 0; });
}

template <class Source>
constexpr Result<typename Source::Word> decode_clocked_on(const Source& source, BitView bits, std::size_t first) {
  typename Source::Word word;
  Error error = Error::none;
  if constexpr (Source::is_known) {
    error = absenc::detail::take_word(source, bits, first, word);
  } else {
    error = absenc::detail::take_word(source, absenc::detail::SomeBits(bits, first, source.word.bits()), 0, word);
  }
  if (source.format.error_parity && error == Error::bad_checksum) {
    word.error = true;
    error = Error::none;
  }
  if (source.format.padded && error == Error::none && !is_padding_zero(source, bits, first)) {
    error = Error::out_of_range;
  }
  bool matches = true;
  for (std::size_t i = source.word.bits(); first + i < bits.size; ++i) {
    matches = matches && bits[first + i] == bit_after_word(source.format, bits, i, first);
  }
  if (!matches && bits.end_of_run(first) == bits.size) return Error::line_stuck;
  if (error != Error::none) return error;
  if (!matches) return Error::cross_check_failed;
  return word;
}

template <class Source>
constexpr Result<typename Source::Word> decode_by(const Source& source, BitView bits) {
  const Error error = check_length(source.format, bits);
  if (error != Error::none) return error;
  return decode_clocked_on(source, bits, 0);
}

}  // namespace detail

/// Decodes the word in `bits` from `first` on, and checks the bits after it. Errors: wrong_length, line_stuck,
/// bad_checksum, out_of_range, cross_check_failed.
[[nodiscard]] constexpr Result<Word> decode_clocked_on(const Format& format, BitView bits, std::size_t first = 0) {
  return detail::decode_clocked_on(Given<Format>{format, format.word}, bits, first);
}

/// Decodes a reading: the word and `extra_clocks` bits or, without extra clocks, possibly the word twice. Errors: those
/// of decode_clocked_on.
[[nodiscard]] constexpr Result<Word> decode(const Format& format, BitView bits) {
  return detail::decode_by(Given<Format>{format, format.word}, bits);
}

/// Decodes a word whose format is known at compile time.
template <const Format& format>
[[nodiscard]] constexpr Result<typename Known<format>::Word> decode(BitView bits) {
  return detail::decode_by(Known<format>{}, bits);
}

/// Appends the encoded `word` to `out`, which must be empty. Returns false if `out` is too small.
template <std::size_t Capacity>
constexpr bool encode_whole(const Format& format, const Word& word, BitBuffer<Capacity>& out) {
  BitBuffer<Capacity> right;
  if (!encode_word(format.word, word, right)) return false;
  const bool inverted = format.error_parity && word.error;
  for (std::size_t i = 0; i < right.size(); ++i) {
    out.append((right.view()[i] != (inverted && i + 1 == right.size())) ? 1 : 0, 1);
  }
  return true;
}

/// Appends the first `count` bits that an encoder sends: the word, then the bits after it. Returns false if `out` is
/// too small.
template <std::size_t Capacity>
constexpr bool encode(const Format& format, const Word& word, std::size_t count, BitBuffer<Capacity>& out) {
  BitBuffer<WordFormat::maximum_bits> coded;
  if (!encode_whole(format, word, coded) || out.capacity() - out.size() < count) return false;
  for (std::size_t i = 0; i < count; ++i) out.append(bit_after_word(format, coded.view(), i) ? 1 : 0, 1);
  return true;
}

/// Whether a word has an error bit, and the level of the bit that reports an error.
enum class ErrorBit : std::uint8_t { none, active_high, active_low };

/// Returns the tree format: turns in `turns` bits, then the position in `steps` bits, both filled up with zeros.
/// Returns an empty format if the encoder's turns have more than `turns` bits, or its position more than `steps` bits.
[[nodiscard]] constexpr WordFormat tree_format(const PositionBits& bits, unsigned turns, unsigned steps) {
  WordFormat word;
  const auto fill = [&word](unsigned count) {
    if (count > 0 && count < 64) word.add({"skip", Meaning::skip, static_cast<std::uint8_t>(count)});
  };
  if (bits.multiturn > turns || bits.position > steps) return word;
  fill(turns - bits.multiturn);
  if (bits.multiturn > 0) word.add({"multiturn", Meaning::multiturn, static_cast<std::uint8_t>(bits.multiturn)});
  word.add({"position", Meaning::position, static_cast<std::uint8_t>(bits.position)});
  fill(steps - bits.position);
  return word;
}

/// Returns the format `word` with the chosen error bit and parity bit. `gray`: Gray-coded counts.
[[nodiscard]] constexpr WordFormat word_with(WordFormat word, bool gray, ErrorBit error, Parity parity) {
  if (gray) word.set_gray();
  if (error != ErrorBit::none) word.add({"error", Meaning::error, 1, error == ErrorBit::active_low});
  if (parity != Parity::none) word.add({"parity", Meaning::parity, 1, parity == Parity::odd});
  return word;
}
/// Returns the format of a word with turns and position of `bits`, and the chosen error bit and parity bit.
[[nodiscard]] constexpr WordFormat word_with(const PositionBits& bits, bool gray, ErrorBit error, Parity parity) {
  return word_with(word_format(bits), gray, error, parity);
}

}  // namespace absenc::ssi
