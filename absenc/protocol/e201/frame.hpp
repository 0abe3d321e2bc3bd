// SPDX-License-Identifier: Apache-2.0
// Commands of the RLS E201-9S USB interface and its ASCII replies. README.md lists them with their sources.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/hex.hpp"
#include "absenc/core/text.hpp"
#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/biss/frame.hpp"
#include "absenc/protocol/e201/text.hpp"
#include "absenc/protocol/ssi/frame.hpp"
#include "absenc/protocol/word_options.hpp"

namespace absenc::e201 {

using namespace std::chrono_literals;

namespace letter {
inline constexpr std::uint8_t samples = '4';  ///< Command that reads the 64 bits of one transfer.
inline constexpr std::uint8_t version = 'v';  ///< Command that reads the firmware version.
/// Command that reads the serial number of the interface.
inline constexpr std::uint8_t serial = 's';
/// Command that reads the state of the encoder's supply.
inline constexpr std::uint8_t supply = 'e';
inline constexpr std::uint8_t supply_on = 'n';   ///< Command that switches the encoder's supply on.
inline constexpr std::uint8_t supply_off = 'f';  ///< Command that switches the encoder's supply off.
/// Command that reads the position as a decimal number.
inline constexpr std::uint8_t decimal = '?';
inline constexpr std::uint8_t zero = 'z';        ///< Command that sets the zero of positions.
inline constexpr std::uint8_t clear_zero = 'a';  ///< Command that removes the zero of positions.
/// Command that reads the position as a hexadecimal number.
inline constexpr std::uint8_t hexadecimal = '>';
inline constexpr std::uint8_t stream_on = '1';   ///< Command that starts the stream of positions.
inline constexpr std::uint8_t stream_off = '0';  ///< Command that ends the stream of positions.
/// Command that sets the MA clock; the number of the clock, 1 to 8, follows it.
inline constexpr std::uint8_t set_clock = 'M';
inline constexpr std::uint8_t clock = 'm';  ///< Command that reads the number of the MA clock.
/// Command that reads the width of the position in bits.
inline constexpr std::uint8_t width = 'b';
/// Command that sets the width of the position in bits.
inline constexpr std::uint8_t set_width = 'B';
inline constexpr std::string_view all = "4vse?>mbnfza01MB";  ///< Letters of all commands.
/// Letters of the commands whose reply is one line of text; the hexadecimal reply to `4` is no such line.
inline constexpr std::string_view answered_by_a_line = "vse?>mb";

/// Returns whether `letters` contains the letter `one`.
[[nodiscard]] constexpr bool is_in(std::string_view letters, std::uint8_t one) {
  return index_of(letters, static_cast<char>(one)) < letters.size();
}
}  // namespace letter

inline constexpr std::size_t sample_bits = 64;  ///< Number of samples that the interface takes in one transfer.
/// Length of the reply to `4` in bytes: 16 hexadecimal digits and CR.
inline constexpr std::size_t samples_length = 17;

// ---- Times. No document gives any.

/// Settings of the virtual COM port; its baud rate has no effect on the interface.
inline constexpr LineSettings line_settings{.rate = 115'200};

inline constexpr Time answer_limit = 50ms;  ///< Timeout of a reply; the 64 clocks of a transfer at 35 kHz take 1.8 ms.
inline constexpr Time gap_limit = 20ms;     ///< Timeout between two characters of a reply.
inline constexpr Time reply_limit = 100ms;  ///< Longest duration of a reply, even if characters still arrive.
inline constexpr Time silent_limit = 10ms;  ///< Timeout of a command that may have no reply.
/// Assumed time from switching the encoder's supply until the state of the supply is right.
inline constexpr Time supply_time = 200ms;

/// Returns the period of MA at clock number 1 to 8.
[[nodiscard]] constexpr Time clock_period(unsigned clock) {
  return LineSettings{.rate = clocks_khz[clock - 1] * 1000u}.bits(1);
}

// ---- Content of the samples

/// Protocol of the encoder behind the interface.
enum class Carries : std::uint8_t { biss, ssi };

/// Kinds of encoders: the maker recommends certain clocks of this interface for some.
enum class Kind : std::uint8_t { other, resolute };
inline constexpr unsigned resolute_slowest = 4;  ///< Slowest clock number recommended for a Renishaw Resolute: 280 kHz.
inline constexpr unsigned resolute_fastest = 5;  ///< Fastest clock number recommended for a Renishaw Resolute: 560 kHz.

/// Layout of the encoder's frames and properties of the interface.
struct Format {
  WordFormat word = biss::Format{}.word;               ///< Layout of the position word.
  Scale scale{};                                       ///< Whether the encoder is linear, and the length of a count.
  Carries carries = Carries::biss;                     ///< Protocol of the encoder behind the interface.
  ssi::AfterWord after_word = ssi::AfterWord::repeat;  ///< Bits that an SSI encoder sends after its word.
  /// Kind of the encoder behind the interface, for recommended clocks.
  Kind kind = Kind::other;
  // ---- Members for the virtual interface and its encoder
  Version firmware{1, 16};  ///< Firmware version of the virtual interface.
  Time latency = 10us;      ///< Time that the virtual encoder needs for a position.
  Time line_delay{};        ///< Delay of the virtual encoder's line, there and back.

  /// Returns the frame format of a BiSS encoder behind the interface.
  [[nodiscard]] constexpr biss::Format biss() const { return {.word = word, .scale = scale}; }
  /// Returns the word format of an SSI encoder behind the interface.
  [[nodiscard]] constexpr ssi::Format ssi() const { return {.word = word, .after_word = after_word, .scale = scale}; }
};

/// Returns whether the word has a position, its position and turns have at most 64 bits together, and the shortest
/// frame fits into 64 samples.
[[nodiscard]] constexpr bool fits(const Format& format) {
  const bool is_biss = format.carries == Carries::biss;
  return is_usable(format.word) &&
         (is_biss ? biss::idle_bits + 3 + biss::data_bits(format.biss()) : 1 + format.word.bits()) <= sample_bits;
}

/// A position that was decoded from the 64 samples.
struct Position {
  unsigned ack_bits = 0;  ///< BiSS: number of ACK bits, the clocks until the encoder was ready.
  std::uint16_t crc = 0;  ///< BiSS: CRC as the encoder sent it.
  Word word{};            ///< Decoded fields of the position word.
};

/// Decodes a position from the 64 samples, or returns the error of a failed check.
[[nodiscard]] constexpr Result<Position> decode_position(const Format& format, std::uint64_t samples) {
  if (!fits(format)) return Error::invalid_argument;
  if (samples == 0 || samples == ~std::uint64_t{0}) return Error::line_stuck;
  std::array<std::uint8_t, 8> bytes{};
  store_big_endian(bytes, samples);
  const BitView bits{bytes, sample_bits};
  if (format.carries == Carries::ssi) {
    // The first sample is taken before the first rising edge, which shifts out the MSB.
    if (!bits[0]) return Error::bad_framing;
    const Result<Word> word = ssi::decode_clocked_on(format.ssi(), bits, 1);
    return word ? Result(Position{.word = *word}) : word.error();
  }
  if (bits.load(0, 3) != 0b110) return Error::bad_framing;  // SLO goes low on the second rising edge
  const Result<biss::Reply> reply = biss::decode(format.biss(), bits);
  return reply ? Result(Position{reply->ack_bits, reply->crc, reply->word}) : reply.error();
}

// ---- Commands and replies

/// A command to the interface.
struct Request {
  std::uint8_t letter = letter::samples;  ///< Letter of the command.
  unsigned clock = 0;                     ///< Only for set_clock: number of the clock, 1 to 8.
  unsigned width = 0;                     ///< Only for set_width: width of the position in bits, 1 to 64.
};

/// A decoded reply of the interface.
struct Reply {
  std::uint64_t samples = 0;  ///< The 64 samples in the reply to `4`, the first one in the highest bit.
  std::int64_t number = 0;    ///< Number in the reply to a position, clock or width command.
  Text text{};                ///< Text of a reply line, without white space around it.
};

inline constexpr unsigned widest = 64;  ///< Greatest width of a position in bits.

/// Decodes the 64 samples in the reply to `4`. Errors: wrong_length, bad_framing.
[[nodiscard]] constexpr Result<std::uint64_t> decode_samples(Bytes reply) {
  if (reply.size() != samples_length || reply[samples_length - 1] != end_of_line) return Error::wrong_length;
  std::uint64_t samples = 0;
  for (const std::uint8_t c : reply.first(samples_length - 1)) {
    const int digit = hex_digit(static_cast<char>(c));
    if (digit < 0) return Error::bad_framing;
    samples = samples << 4 | static_cast<std::uint64_t>(digit);
  }
  return samples;
}

/// Decodes a reply that is one line of text. Errors: wrong_length, bad_framing.
[[nodiscard]] constexpr Result<Reply> decode_line(std::uint8_t asked, Bytes bytes) {
  const std::size_t end = end_of_first_line(bytes);
  const Bytes text = trimmed(bytes.first(end));
  if (text.empty() || !trimmed(bytes.subspan(end)).empty()) return Error::wrong_length;
  for (const std::uint8_t c : text) {
    if (c < 0x20 || c > 0x7E) return Error::bad_framing;
  }
  Result<std::int64_t> number = std::int64_t{0};
  if (asked == letter::decimal) number = decode_number(text);
  if (asked == letter::hexadecimal) number = decode_hexadecimal(text);
  if (asked == letter::clock) number = find_clock(text);
  if (asked == letter::width) number = find_number(text);
  if (!number) return number.error();
  Reply reply{.number = *number};
  if (!reply.text.append(text)) return Error::wrong_length;
  return reply;
}

/// The E201-9S protocol, with the members that author/dialog.hpp and author/device.hpp demand.
struct Protocol {
  /// Layout of the encoder's frames and properties of the interface.
  using Format = e201::Format;
  /// C++ type of the commands to the interface.
  using Request = e201::Request;
  /// C++ type of the interface's replies.
  using Reply = e201::Reply;
  /// Assumed length of the longest reply in bytes; no document gives it.
  static constexpr std::size_t longest_reply = 32;

  /// Returns the host's timeouts.
  static constexpr author::HostTimes host_times(const Format&) {
    return {.answer_limit = answer_limit, .gap_limit = gap_limit, .patience = reply_limit};
  }
  /// Returns how a host sends a request (repetitions, pauses) and how the reply to it ends.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    if (request.letter == letter::samples || letter::is_in(letter::answered_by_a_line, request.letter)) return {};
    return {.any_reply = true, .answer_limit = silent_limit};
  }
  /// Returns the bytes of a request; empty if its clock or width is out of range.
  static constexpr ByteBuffer<4> encode(const Format&, const Request& request) {
    ByteBuffer<4> text;
    const bool is_clock = request.letter == letter::set_clock;
    const bool is_width = request.letter == letter::set_width;
    if (is_clock && (request.clock < 1 || request.clock > clocks_khz.size())) return text;
    if (is_width && (request.width < 1 || request.width > widest)) return text;
    text.push_back(request.letter);
    if (is_width) text.push_back(static_cast<std::uint8_t>('0' + request.width / 10));
    if (is_width) text.push_back(static_cast<std::uint8_t>('0' + request.width % 10));
    if (is_clock) text.push_back(static_cast<std::uint8_t>('0' + request.clock));
    if (is_clock || is_width) text.push_back(end_of_line);
    return text;
  }
  /// Returns the length of the request that begins with `begin`, in bytes; 0: it is no request.
  static constexpr std::size_t request_size(const Format&, Bytes begin) {
    if (!letter::is_in(letter::all, begin[0])) return 0;
    return begin[0] == letter::set_clock ? 3 : begin[0] == letter::set_width ? 4 : 1;
  }
  /// Decodes a command, with or without its CR. Errors: unsupported, wrong_length.
  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) {
    const Bytes text = trimmed(bytes);
    if (text.empty()) return Error::wrong_length;
    if (!letter::is_in(letter::all, text[0])) return Error::unsupported;
    const bool is_clock = text[0] == letter::set_clock;
    const std::size_t digits = is_clock ? 1 : text[0] == letter::set_width ? 2 : 0;
    if (text.size() != 1 + digits) return Error::wrong_length;
    unsigned number = 0;
    for (const std::uint8_t c : text.subspan(1)) {
      if (!is_digit(c)) return Error::wrong_length;
      number = 10 * number + static_cast<unsigned>(c - '0');
    }
    const std::size_t most = is_clock ? clocks_khz.size() : widest;
    if (digits != 0 && (number < 1 || number > most)) return Error::unsupported;
    return Request{text[0], is_clock ? number : 0, is_clock ? 0 : number};
  }
  /// Returns the length in bytes of the reply that begins with `reply`; 0: unknown.
  static constexpr std::size_t expected(const Format&, const Request& request, Bytes reply) {
    if (request.letter == letter::samples) return samples_length;
    return letter::is_in(letter::answered_by_a_line, request.letter) ? end_of_first_line(reply) : 0;
  }
  /// Returns whether the host awaits no more bytes after a reply with this error.
  static constexpr bool is_whole(const Format&, Error error) { return error != Error::wrong_length; }
  /// Decodes a reply. Returns the error of a failed check, or unsupported.
  static constexpr Result<Reply> decode(const Format& format, const Request& request, Bytes bytes) {
    if (letter::is_in(letter::answered_by_a_line, request.letter)) return decode_line(request.letter, bytes);
    if (request.letter != letter::samples) return Error::unsupported;
    const Result<std::uint64_t> samples = decode_samples(bytes);
    if (!samples) return samples.error();
    const Error error = decode_position(format, *samples).error();
    return error == Error::none ? Result(Reply{.samples = *samples}) : error;
  }
  /// Converts the samples in a reply to a reading; returns an empty reading for other replies.
  static constexpr Reading reading(const Format& format, const Request& request, const Reply& reply) {
    if (request.letter != letter::samples) return {};
    return to_reading(format.word, decode_position(format, reply.samples)->word, format.scale);
  }
  /// Returns `sent_at`, which is assumed: the document does not say when the position is latched.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
};

}  // namespace absenc::e201
