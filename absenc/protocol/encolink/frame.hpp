// SPDX-License-Identifier: Apache-2.0
// EncoLink frames of channel 1, cycles of channel 2 and the identity (RLS AksIM-2, UART and SPI): encode, decode and
// every check they allow. README.md draws them; the bytes of channel 3 are in registers.hpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"

namespace absenc::encolink {

using namespace std::chrono_literals;

// ---- Times, as the host keeps them and the virtual encoder demands them

inline constexpr LineSettings uart_settings{.rate = 1'000'000};  // interface variant L
inline constexpr Time spi_lead = 5us;                            // t_s: NCS low to the first edge of SCK
// 4 MHz at most; CPOL 0, CPHA 1
inline constexpr LineSettings spi_settings{
    .rate = 1'000'000, .spi_mode = 1, .select_lead = spi_lead, .highest_rate = 4'000'000};
inline constexpr Time shortest_clock = 250ns;
inline constexpr Time spi_pause = 5us;  // t_p

// Not in the document. The virtual encoder answers that long after a request; the host waits generously.
inline constexpr Time answer_time = 5us;
inline constexpr Time answer_limit = 500us;
inline constexpr Time gap_limit = 30us;

inline constexpr Time start_up = 100ms;  // of well-formed zeros; assumed
inline constexpr Time save_time = 50ms;  // busy; assumed
inline constexpr Time busy_limit = 2s;
inline constexpr Time calibration_time = 1s;    // of the virtual encoder's shaft
inline constexpr Time calibration_limit = 15s;  // the vendor allows the shaft 10 s
inline constexpr Time calibration_poll = 100ms;
inline constexpr Time listen_limit = 500ms;  // without a good frame of an encoder that transmits by itself

// ---- Frames

/// "Inverted CRC, 0x97 polynom", in normal notation: x8 + x7 + x4 + x2 + x + 1.
inline constexpr CrcParameters crc_parameters{8, 0x97, 0, false, false, 0xFF};

[[nodiscard]] constexpr std::uint8_t checksum(Bytes bytes) { return Crc<crc_parameters, CrcTable::nibble>::of(bytes); }

/// Whether the last byte is the checksum of those before it.
[[nodiscard]] constexpr bool is_sealed(Bytes bytes) {
  return !bytes.empty() && checksum(bytes.first(bytes.size() - 1)) == bytes.back();
}

/// First byte of a request.
enum class Config : std::uint8_t {
  position = 0x00,
  reset_channels = 0xAA,  // and the position
  identify = 0xBB,        // the frame after this one carries the identity
};
[[nodiscard]] constexpr bool is_config(std::uint8_t byte) { return byte == 0x00 || byte == 0xAA || byte == 0xBB; }

inline constexpr std::size_t request_bytes = 2;           // config, ra
inline constexpr std::size_t identity_bytes = 19;         // with the checksum
inline constexpr std::size_t padded_identity_bytes = 20;  // what the vendor's library reads: one byte more
inline constexpr std::size_t reply_capacity = 20;
inline constexpr unsigned maximum_resolution = 22;
inline constexpr unsigned maximum_multiturn_bits = 16;
using ReplyBytes = ByteBuffer<reply_capacity>;

/// A transfer on SPI brings the frame of the moment at which it begins; a UART answers afterwards.
enum class Interface : std::uint8_t { uart, spi };
/// Whether the position offset is added to what the sensor measures or taken off. The register map does not say.
enum class OffsetSign : std::uint8_t { add, subtract };
/// What the position offset counts. The map does not say it either; the vendor's example shows FFFFFFFF refused.
enum class OffsetUnit : std::uint8_t { counts, turn_fraction };
enum class Generation : std::uint8_t { aksim2, aksim4 };

/// What an encoder's frames carry. What is unknown is asked: the identity tells it.
struct Format {
  unsigned resolution = 0;  // bits of the turn, 1 to 22; 0: unknown
  int multiturn_bits = -1;  // 0 to 16; -1: unknown
  bool has_ch2 = true;      // false: frames as those of an AksIM-1, without the last byte
  Interface interface = Interface::uart;
  OffsetSign offset_sign = OffsetSign::add;
  OffsetUnit offset_unit = OffsetUnit::counts;
  std::uint32_t stream_rate = 0;                // frames a second that it sends by itself; 0: it answers requests
  Generation generation = Generation::aksim2;   // of the virtual encoder
  std::uint8_t identity_size = identity_bytes;  // of the virtual encoder on a UART, or padded_identity_bytes

  [[nodiscard]] constexpr bool known() const { return resolution != 0 && multiturn_bits >= 0; }
  [[nodiscard]] constexpr std::size_t turns_bytes() const { return multiturn_bits > 0 ? 2 : 0; }
  /// Zeros behind the turns.
  [[nodiscard]] constexpr unsigned spare_turns() const {
    return maximum_multiturn_bits - static_cast<unsigned>(multiturn_bits);
  }
  /// Of channel 1; the checksum stands behind them.
  [[nodiscard]] constexpr std::size_t position_bytes() const { return turns_bytes() + 3; }
  [[nodiscard]] constexpr std::size_t frame_bytes() const { return position_bytes() + (has_ch2 ? 2 : 1); }
  [[nodiscard]] constexpr std::size_t cycle_bytes() const { return position_bytes() + 4; }

  /// The largest position offset.
  [[nodiscard]] constexpr std::uint32_t largest_offset() const {
    return static_cast<std::uint32_t>(low_mask(offset_unit == OffsetUnit::counts ? resolution : 32));
  }
  /// The offset that takes `singleturn` off what the encoder shows with `offset`.
  [[nodiscard]] constexpr std::uint32_t moved_offset(std::uint32_t offset, std::uint32_t singleturn) const {
    const std::uint32_t here = offset_unit == OffsetUnit::counts ? singleturn : singleturn << (32 - resolution);
    return (offset_sign == OffsetSign::add ? offset - here : offset + here) & largest_offset();
  }
  /// Of a turn, in 2^-32.
  [[nodiscard]] constexpr std::uint32_t offset_fraction(std::uint32_t offset) const {
    return offset_unit == OffsetUnit::counts ? offset << (32 - resolution) : offset;
  }
};

/// What a virtual encoder that is asked for its own format has.
inline constexpr Format virtual_format{.resolution = 20, .multiturn_bits = 16};

/// What channel 1 says. `channel2` is outside the checksum.
struct Position {
  std::uint32_t singleturn = 0;
  std::uint16_t multiturn = 0;
  bool error = false;    // the position is not valid
  bool warning = false;  // valid, but near the limits
  std::uint8_t channel2 = 0;
};

/// One cycle of channel 2, a byte a frame; its position was taken with its first byte.
struct Cycle {
  Position position{};  // channel2: unused
  std::uint16_t status = 0;
  std::uint8_t channel3 = 0;
};

/// Bits of the detailed status.
namespace status {
inline constexpr std::uint16_t acceleration = 0x0001;
inline constexpr std::uint16_t magnetic_pattern = 0x0002;
inline constexpr std::uint16_t system = 0x0004;
inline constexpr std::uint16_t supply = 0x0008;
inline constexpr std::uint16_t temperature = 0x0010;
inline constexpr std::uint16_t signal_lost = 0x0020;
inline constexpr std::uint16_t position_invalid = 0x0200;
inline constexpr std::uint16_t configuration_error = 0x0400;
inline constexpr std::uint16_t multiturn_mismatch = 0x8000;
inline constexpr std::uint16_t warnings = 0x21D0;  // amplitude high and low, near limits, temperature
inline constexpr std::uint16_t errors = 0xDE2F;    // all others
static_assert((warnings ^ errors) == 0xFFFF);
}  // namespace status

/// Bits of Reading::status, from the position frame.
namespace general {
inline constexpr std::uint32_t error = 1;
inline constexpr std::uint32_t warning = 2;
}  // namespace general

/// Of the protocol. The frames of both are the same; the registers behind them are not.
namespace version {
inline constexpr std::uint8_t aksim2 = 2;
inline constexpr std::uint8_t aksim4 = 4;
}  // namespace version

struct Identity {
  std::uint8_t protocol_version = version::aksim2;
  std::uint8_t frame_bytes = 5;
  unsigned resolution = 20;
  std::array<std::uint8_t, 18> text{};  // the whole of it; text[2..17] is the part number
  [[nodiscard]] constexpr Bytes part_number() const { return Bytes(text).subspan(2); }
};

namespace detail {

// Channel 1 is one number: turns, position, error and warning. `format` must be known.
constexpr ReplyBytes position_bytes(const Format& format, const Position& position) {
  std::uint64_t number = std::uint64_t{position.singleturn} << (24 - format.resolution);
  if (!position.error) number |= 2;
  if (!position.warning) number |= 1;
  if (format.turns_bytes() != 0) number |= std::uint64_t{position.multiturn} << (24 + format.spare_turns());
  std::array<std::uint8_t, 5> bytes{};
  store_big_endian(bytes, number);
  ReplyBytes frame;
  frame.append(Bytes(bytes).last(format.position_bytes()));
  return frame;
}

// Padding that is not zero means another resolution.
constexpr Result<Position> load_position(const Format& format, Bytes bytes) {
  const std::uint64_t number = load_big_endian(bytes.first(format.position_bytes()));
  const auto word = static_cast<std::uint32_t>(number & low_mask(24));
  const auto turns = static_cast<std::uint32_t>(number >> 24);
  if ((word >> 2 & low_mask(maximum_resolution - format.resolution)) != 0) return Error::out_of_range;
  if (turns != 0 && (turns & low_mask(format.spare_turns())) != 0) return Error::out_of_range;
  return Position{.singleturn = word >> (24 - format.resolution),
                  .multiturn = static_cast<std::uint16_t>(turns >> format.spare_turns()),
                  .error = (word & 2) == 0,
                  .warning = (word & 1) == 0};
}

}  // namespace detail

[[nodiscard]] constexpr ReplyBytes encode_position(const Format& format, const Position& position) {
  ReplyBytes frame = detail::position_bytes(format, position);
  frame.push_back(checksum(frame));
  if (format.has_ch2) frame.push_back(position.channel2);
  return frame;
}

/// Errors in this order: wrong_length, bad_checksum, out_of_range. `format` must be known.
[[nodiscard]] constexpr Result<Position> decode_position(const Format& format, Bytes bytes) {
  if (bytes.size() != format.frame_bytes()) return Error::wrong_length;
  if (!is_sealed(bytes.first(format.position_bytes() + 1))) return Error::bad_checksum;
  Result<Position> position = detail::load_position(format, bytes);
  if (position && format.has_ch2) position->channel2 = bytes.back();
  return position;
}

[[nodiscard]] constexpr ReplyBytes encode_cycle(const Format& format, const Cycle& cycle) {
  ReplyBytes bytes = detail::position_bytes(format, cycle.position);
  bytes.push_back(static_cast<std::uint8_t>(cycle.status >> 8));
  bytes.push_back(static_cast<std::uint8_t>(cycle.status));
  bytes.push_back(cycle.channel3);
  bytes.push_back(checksum(bytes));
  return bytes;
}

/// Errors in this order: wrong_length, bad_checksum, out_of_range. `format` must be known.
[[nodiscard]] constexpr Result<Cycle> decode_cycle(const Format& format, Bytes bytes) {
  if (bytes.size() != format.cycle_bytes()) return Error::wrong_length;
  if (!is_sealed(bytes)) return Error::bad_checksum;
  const Result<Position> position = detail::load_position(format, bytes);
  if (!position) return position.error();
  const Bytes rest = bytes.subspan(format.position_bytes());
  return Cycle{*position, static_cast<std::uint16_t>(load_big_endian(rest.first(2))), rest[2]};
}

[[nodiscard]] constexpr ReplyBytes encode_identity(const Identity& identity) {
  ReplyBytes bytes;
  bytes.append(identity.text);
  bytes[0] = identity.protocol_version;
  bytes[1] = identity.frame_bytes;
  bytes[10] = static_cast<std::uint8_t>('0' + identity.resolution / 10);
  bytes[11] = static_cast<std::uint8_t>('0' + identity.resolution % 10);
  bytes.push_back(checksum(bytes));
  return bytes;
}

/// With or without a byte behind it, which means nothing. Errors in this order: wrong_length, bad_checksum,
/// unexpected_reply (another protocol version or frame length), out_of_range (the resolution is no number from 1 to
/// 22).
[[nodiscard]] constexpr Result<Identity> decode_identity(Bytes bytes) {
  if (bytes.size() != identity_bytes && bytes.size() != padded_identity_bytes) return Error::wrong_length;
  if (!is_sealed(bytes.first(identity_bytes))) return Error::bad_checksum;
  if ((bytes[0] != version::aksim2 && bytes[0] != version::aksim4) || (bytes[1] != 5 && bytes[1] != 7))
    return Error::unexpected_reply;
  const unsigned tens = bytes[10] - unsigned{'0'};
  const unsigned ones = bytes[11] - unsigned{'0'};
  if (tens > 9 || ones > 9) return Error::out_of_range;
  Identity identity{bytes[0], bytes[1], 10 * tens + ones};
  if (identity.resolution == 0 || identity.resolution > maximum_resolution) return Error::out_of_range;
  for (std::size_t i = 0; i < identity.text.size(); ++i) identity.text[i] = bytes[i];
  return identity;
}

/// The format as the identity says it, which does not tell how many bits of turns there are.
[[nodiscard]] constexpr Format as_identified(const Format& format, const Identity& identity) {
  Format known = format;
  known.resolution = identity.resolution;
  const bool turns = identity.frame_bytes == 7;
  if (known.multiturn_bits < 0 || (known.multiturn_bits > 0) != turns) known.multiturn_bits = turns ? 16 : 0;
  return known;
}

/// The format with what was unknown taken from the identity. Error: unexpected_reply (it says otherwise than what was
/// known: another resolution, or turns where none were expected, or the other way round).
[[nodiscard]] constexpr Result<Format> complete(const Format& format, const Identity& identity) {
  const Format known = as_identified(format, identity);
  const bool other_turns = format.multiturn_bits >= 0 && known.multiturn_bits != format.multiturn_bits;
  if (other_turns || (format.resolution != 0 && known.resolution != format.resolution)) return Error::unexpected_reply;
  return known;
}

/// Whether two positions are the same; channel 2 repeats that of channel 1.
[[nodiscard]] constexpr bool same_place(const Position& a, const Position& b) {
  return a.singleturn == b.singleturn && a.multiturn == b.multiturn;
}

/// What may be a real position as well as what an encoder sends while it starts.
[[nodiscard]] constexpr bool is_all_zero(const Position& position) {
  return position.singleturn == 0 && position.multiturn == 0;
}

/// Returns the alarms that the two bits of a frame report clear: all errors, all warnings. A bit that is set does not
/// say which alarm it is for. Without channel 2 an encoder has no alarms by name.
[[nodiscard]] constexpr std::uint32_t clear_by(const Format& format, const Position& position) {
  if (!format.has_ch2) return 0;
  return (position.error ? 0u : status::errors) | (position.warning ? 0u : status::warnings);
}

/// `detailed`: the status of a cycle, where there was one.
[[nodiscard]] constexpr Reading to_reading(const Format& format, const Position& position,
                                           std::optional<std::uint16_t> detailed = {}) {
  const std::uint16_t alarms = detailed.value_or(0);
  const bool valid = !position.error && (alarms & status::position_invalid) == 0;
  Reading reading;
  reading.singleturn = position.singleturn;
  reading.singleturn_bits = format.resolution;
  reading.singleturn_valid_bits = valid ? format.resolution : 0;
  reading.multiturn = position.multiturn;
  reading.multiturn_bits = static_cast<unsigned>(format.multiturn_bits);
  reading.multiturn_valid = format.multiturn_bits > 0 && !position.error && (alarms & status::multiturn_mismatch) == 0;
  reading.status = (position.error ? general::error : 0) | (position.warning ? general::warning : 0);
  reading.alarms = alarms;
  reading.status_reported = general::error | general::warning;
  reading.alarms_reported = detailed ? 0xFFFFu : clear_by(format, position);
  return reading;
}

/// See Unit. The status of a cycle of channel 2 holds as long as the error and warning bits of position frames agree
/// with it: which alarm has come or gone the next cycle tells. A bit that is set does not say which alarm it is for,
/// and a bit that is clear says only that the alarms of its own kind are.
[[nodiscard]] constexpr Reading remembered(const Reading& before, Reading now) {
  const std::uint32_t unknown = before.alarms_reported & ~now.alarms_reported;
  if (unknown == 0 || now.singleturn_bits == 0) return now;
  const bool has_error = (before.alarms & status::errors) != 0;
  const bool has_warning = (before.alarms & status::warnings) != 0;
  const std::uint32_t general = (has_error ? general::error : 0) | (has_warning ? general::warning : 0);
  if (now.status != general) return now;
  now.alarms |= before.alarms & unknown;
  now.alarms_reported |= unknown;
  if ((now.alarms & status::position_invalid) != 0) now.singleturn_valid_bits = 0;
  if ((now.alarms & status::multiturn_mismatch) != 0) now.multiturn_valid = false;
  return now;
}

}  // namespace absenc::encolink
