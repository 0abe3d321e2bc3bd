// SPDX-License-Identifier: Apache-2.0
// EncoLink frames of RLS AksIM-2 encoders: positions, cycles of channel 2 (one byte in each reply, a cycle in seven),
// and the identity. README.md draws them.
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

// ---- Times of hosts and of the virtual encoder

inline constexpr LineSettings uart_settings{.rate = 1'000'000};  ///< Settings of the UART line (interface variant L).
inline constexpr Time spi_lead = 5us;  ///< Time t_s: shortest time from NCS low to the first edge of SCK.
/// Settings of the SPI line: mode 1 (CPOL 0, CPHA 1), at most 4 MHz.
inline constexpr LineSettings spi_settings{
    .rate = 1'000'000, .spi_mode = 1, .select_lead = spi_lead, .highest_rate = 4'000'000};
inline constexpr Time shortest_clock = 250ns;  ///< Shortest period of the SPI clock.
inline constexpr Time spi_pause = 5us;         ///< Time t_p: shortest time that NCS stays high between two frames.

/// Assumed time from a request to the reply of the virtual encoder; the document gives none.
inline constexpr Time answer_time = 5us;
inline constexpr Time answer_limit = 500us;  ///< Longest time that the host waits until a reply begins.
inline constexpr Time gap_limit = 30us;      ///< Longest time that the host waits between two characters of a reply.

/// Assumed time after power on during which the encoder sends well-formed frames with position zero.
inline constexpr Time start_up = 100ms;
inline constexpr Time save_time = 50ms;  ///< Assumed time for which the encoder is busy after the command `save`.
/// Longest time for which the host waits while the encoder is busy with a register access.
inline constexpr Time busy_limit = 2s;
inline constexpr Time calibration_time = 1s;  ///< Duration of the virtual encoder's self-calibration.
/// Timeout of a self-calibration; the vendor wants the shaft turned within 10 s.
inline constexpr Time calibration_limit = 15s;
inline constexpr Time calibration_poll = 100ms;  ///< Time between two polls of a running self-calibration.
/// Longest time that the host waits for the next frame or error of a stream.
inline constexpr Time listen_limit = 500ms;

// ---- Frames

/// Checksum of all frames: "Inverted CRC, 0x97 polynom", x8 + x7 + x4 + x2 + x + 1.
inline constexpr CrcParameters crc_parameters{8, 0x97, 0, false, false, 0xFF};

/// Returns the checksum of `bytes`.
[[nodiscard]] constexpr std::uint8_t checksum(Bytes bytes) { return Crc<crc_parameters, CrcTable::nibble>::of(bytes); }

/// Returns whether the last byte is the checksum of the bytes before it.
[[nodiscard]] constexpr bool is_sealed(Bytes bytes) {
  return !bytes.empty() && checksum(bytes.first(bytes.size() - 1)) == bytes.back();
}

/// First byte of a request. The encoder answers each request with a frame; some requests have a further effect.
enum class Config : std::uint8_t {
  position = 0x00,
  reset_channels = 0xAA,  ///< Requests a position, and that channels 2 and 3 restart in the next frame.
  identify = 0xBB,        ///< Requests a position, and that the next frame carries the identity.
};
/// Returns whether a byte is a valid first byte of a request.
[[nodiscard]] constexpr bool is_config(std::uint8_t byte) { return byte == 0x00 || byte == 0xAA || byte == 0xBB; }

/// Number of bytes of a request: its purpose (`config`) and one byte of a register access (`ra`).
inline constexpr std::size_t request_bytes = 2;
inline constexpr std::size_t identity_bytes = 19;  ///< Number of bytes of an identity frame, with its checksum.
/// Number of bytes of an identity frame as the vendor's library reads it.
inline constexpr std::size_t padded_identity_bytes = 20;
/// Number of bytes of the longest reply, an identity with the byte that may follow it.
inline constexpr std::size_t reply_capacity = 20;
/// Greatest number of bits of the position that an encoder can have.
inline constexpr unsigned maximum_resolution = 22;
/// Greatest number of bits of the turns that an encoder can have.
inline constexpr unsigned maximum_multiturn_bits = 16;
/// Buffer for the bytes of one reply.
using ReplyBytes = ByteBuffer<reply_capacity>;

/// Interface of the encoder. On SPI, the encoder makes its frame before it receives the request in the same transfer.
enum class Interface : std::uint8_t { uart, spi };
/// Whether the encoder adds or subtracts the position offset; no document states it.
enum class OffsetSign : std::uint8_t { add, subtract };
/// Unit of the position offset: counts, or 2^-32 of a turn. The register map does not state it.
enum class OffsetUnit : std::uint8_t { counts, turn_fraction };
/// Generation of the encoder, on which its registers depend.
enum class Generation : std::uint8_t { aksim2, aksim4 };

/// Layout of an encoder's frames. The host reads unknown members from the encoder's identity.
struct Format {
  unsigned resolution = 0;  ///< Number of bits of the position in a turn, 1 to 22; 0: unknown.
  int multiturn_bits = -1;  ///< Number of bits of the turns, 0 to 16; 0: single-turn encoder; -1: unknown.
  bool has_ch2 = true;      ///< Whether frames have a channel 2 byte; those of an AksIM-1 have none.
  Interface interface = Interface::uart;        ///< Interface of the encoder: UART or SPI.
  OffsetSign offset_sign = OffsetSign::add;     ///< Whether the encoder adds or subtracts the position offset.
  OffsetUnit offset_unit = OffsetUnit::counts;  ///< Unit of the position offset: counts or a fraction of a turn.
  /// Frames per second that the encoder sends without requests; 0: it answers requests.
  std::uint32_t stream_rate = 0;
  Generation generation = Generation::aksim2;  ///< Whether the virtual encoder is an AksIM-2 or an AksIM-4.
  /// Number of bytes of the identity that the virtual encoder sends on a UART, 19 or 20.
  std::uint8_t identity_size = identity_bytes;

  /// Returns whether both the resolution and the number of bits of the turns are known.
  [[nodiscard]] constexpr bool known() const { return resolution != 0 && multiturn_bits >= 0; }
  /// Returns the number of bytes that a position frame has for the turns: 2, or 0 for a single-turn encoder.
  [[nodiscard]] constexpr std::size_t turns_bytes() const { return multiturn_bits > 0 ? 2 : 0; }
  /// Returns the number of padding bits below the turns, which take 16 bits together with this padding.
  [[nodiscard]] constexpr unsigned spare_turns() const {
    return maximum_multiturn_bits - static_cast<unsigned>(multiturn_bits);
  }
  /// Returns the number of bytes of channel 1 (turns and position), without its checksum.
  [[nodiscard]] constexpr std::size_t position_bytes() const { return turns_bytes() + 3; }
  /// Returns the number of bytes of a position frame, with its checksum and, if frames have one, its channel 2 byte.
  [[nodiscard]] constexpr std::size_t frame_bytes() const { return position_bytes() + (has_ch2 ? 2 : 1); }
  /// Returns the number of bytes of a whole cycle of channel 2, which is also its number of frames.
  [[nodiscard]] constexpr std::size_t cycle_bytes() const { return position_bytes() + 4; }

  /// Returns the largest position offset that the encoder's register can hold.
  [[nodiscard]] constexpr std::uint32_t largest_offset() const {
    return static_cast<std::uint32_t>(low_mask(offset_unit == OffsetUnit::counts ? resolution : 32));
  }
  /// Returns the position offset that makes the position `singleturn` zero; `offset` is the present offset.
  [[nodiscard]] constexpr std::uint32_t moved_offset(std::uint32_t offset, std::uint32_t singleturn) const {
    const std::uint32_t here = offset_unit == OffsetUnit::counts ? singleturn : singleturn << (32 - resolution);
    return (offset_sign == OffsetSign::add ? offset - here : offset + here) & largest_offset();
  }
  /// Converts a position offset to 2^-32 of a turn.
  [[nodiscard]] constexpr std::uint32_t offset_fraction(std::uint32_t offset) const {
    return offset_unit == OffsetUnit::counts ? offset << (32 - resolution) : offset;
  }
};

/// Format of a virtual encoder if its options leave resolution and turns unknown.
inline constexpr Format virtual_format{.resolution = 20, .multiturn_bits = 16};

/// Content of a position frame. The frame's checksum does not cover `channel2`.
struct Position {
  std::uint32_t singleturn = 0;  ///< Position within the turn, in counts.
  std::uint16_t multiturn = 0;   ///< Number of turns.
  bool error = false;            ///< Whether the position is invalid.
  /// Whether the position is valid, but a quantity such as the temperature is near its limit.
  bool warning = false;
  std::uint8_t channel2 = 0;  ///< Byte of channel 2 in the frame.
};

/// A cycle of channel 2: a message of which each position frame carries one byte.
struct ChannelCycle {
  /// Position of the frame that carried the first byte of the cycle; its member `channel2` is unused.
  Position position{};
  std::uint16_t status = 0;  ///< Detailed status: bits of the namespace `status`.
  /// Byte of channel 3: state of the encoder, or a byte of its answer to a register access.
  std::uint8_t channel3 = 0;
};

/// Bits of the detailed status in a channel 2 cycle.
namespace status {
/// Status bit: the position changed faster than a shaft can turn.
inline constexpr std::uint16_t acceleration = 0x0001;
inline constexpr std::uint16_t magnetic_pattern = 0x0002;  ///< Status bit: the magnetic pattern of the ring is faulty.
inline constexpr std::uint16_t system = 0x0004;            ///< Status bit: the encoder has a system error.
inline constexpr std::uint16_t supply = 0x0008;            ///< Status bit: the supply voltage is out of range.
inline constexpr std::uint16_t temperature = 0x0010;       ///< Status bit: the temperature is out of range.
inline constexpr std::uint16_t signal_lost = 0x0020;       ///< Status bit: the signal of the ring is lost.
inline constexpr std::uint16_t position_invalid = 0x0200;  ///< Status bit: the position is invalid.
inline constexpr std::uint16_t configuration_error = 0x0400;  ///< Status bit: the stored configuration is damaged.
inline constexpr std::uint16_t multiturn_mismatch = 0x8000;  ///< Status bit: the turn counter contradicts the position.
/// Mask of the status bits that are warnings.
inline constexpr std::uint16_t warnings = 0x21D0;
inline constexpr std::uint16_t errors = 0xDE2F;  ///< Mask of the status bits that are errors: all but the warnings.
static_assert((warnings ^ errors) == 0xFFFF);
}  // namespace status

/// Bits of Reading::status, made from the error and the warning bit of a position frame.
namespace general {
inline constexpr std::uint32_t error = 1;  ///< Bit of Reading::status: the position is invalid.
/// Bit of Reading::status: the position is valid, but a quantity such as the temperature is near its limit.
inline constexpr std::uint32_t warning = 2;
}  // namespace general

/// Protocol versions in an identity. Both versions have the same frames, but different registers.
namespace version {
inline constexpr std::uint8_t aksim2 = 2;  ///< Protocol version of an AksIM-2.
inline constexpr std::uint8_t aksim4 = 4;  ///< Protocol version of an AksIM-4.
}  // namespace version

/// Content of an identity frame.
struct Identity {
  std::uint8_t protocol_version = version::aksim2;  ///< Protocol version: 2 or 4.
  /// Number of bytes of a position frame: 5 without turns, 7 with turns.
  std::uint8_t frame_bytes = 5;
  unsigned resolution = 20;  ///< Number of bits of the position in a turn, 1 to 22.
  /// All bytes of the identity before its checksum; bytes 2 to 17 are the part number.
  std::array<std::uint8_t, 18> text{};
  /// Returns the characters of the part number.
  [[nodiscard]] constexpr Bytes part_number() const { return Bytes(text).subspan(2); }
};

namespace detail {

// Returns the bytes of channel 1, turns and position. Resolution and turns of `format` must be known.
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

// Decodes channel 1. If its padding is not zero, the encoder has more bits than `format`, which gives out_of_range.
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

/// Returns the position frame that carries `position`.
[[nodiscard]] constexpr ReplyBytes encode_position(const Format& format, const Position& position) {
  ReplyBytes frame = detail::position_bytes(format, position);
  frame.push_back(checksum(frame));
  if (format.has_ch2) frame.push_back(position.channel2);
  return frame;
}

/// Decodes a position frame of a known format. Errors: wrong_length, bad_checksum, out_of_range.
[[nodiscard]] constexpr Result<Position> decode_position(const Format& format, Bytes bytes) {
  if (bytes.size() != format.frame_bytes()) return Error::wrong_length;
  if (!is_sealed(bytes.first(format.position_bytes() + 1))) return Error::bad_checksum;
  Result<Position> position = detail::load_position(format, bytes);
  if (position && format.has_ch2) position->channel2 = bytes.back();
  return position;
}

/// Returns the bytes of a whole cycle of channel 2.
[[nodiscard]] constexpr ReplyBytes encode_cycle(const Format& format, const ChannelCycle& cycle) {
  ReplyBytes bytes = detail::position_bytes(format, cycle.position);
  bytes.push_back(static_cast<std::uint8_t>(cycle.status >> 8));
  bytes.push_back(static_cast<std::uint8_t>(cycle.status));
  bytes.push_back(cycle.channel3);
  bytes.push_back(checksum(bytes));
  return bytes;
}

/// Decodes a channel 2 cycle of a known format. Errors: wrong_length, bad_checksum, out_of_range.
[[nodiscard]] constexpr Result<ChannelCycle> decode_cycle(const Format& format, Bytes bytes) {
  if (bytes.size() != format.cycle_bytes()) return Error::wrong_length;
  if (!is_sealed(bytes)) return Error::bad_checksum;
  const Result<Position> position = detail::load_position(format, bytes);
  if (!position) return position.error();
  const Bytes rest = bytes.subspan(format.position_bytes());
  return ChannelCycle{*position, static_cast<std::uint16_t>(load_big_endian(rest.first(2))), rest[2]};
}

/// Returns the identity frame.
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

/// Decodes an identity frame, also with one byte behind it. Errors: wrong_length, bad_checksum, unexpected_reply,
/// out_of_range.
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

/// Returns `format` with the resolution of `identity`. The number of turn bits stays if it agrees with the frame length
/// in the identity; otherwise it becomes 16 for frames with turns, 0 for frames without.
[[nodiscard]] constexpr Format as_identified(const Format& format, const Identity& identity) {
  Format known = format;
  known.resolution = identity.resolution;
  const bool turns = identity.frame_bytes == 7;
  if (known.multiturn_bits < 0 || (known.multiturn_bits > 0) != turns) known.multiturn_bits = turns ? 16 : 0;
  return known;
}

/// Returns `format` completed by `identity`. Error: unexpected_reply if they contradict each other.
[[nodiscard]] constexpr Result<Format> complete(const Format& format, const Identity& identity) {
  const Format known = as_identified(format, identity);
  const bool other_turns = format.multiturn_bits >= 0 && known.multiturn_bits != format.multiturn_bits;
  if (other_turns || (format.resolution != 0 && known.resolution != format.resolution)) return Error::unexpected_reply;
  return known;
}

/// Returns whether two positions have equal turns and counts.
[[nodiscard]] constexpr bool same_place(const Position& a, const Position& b) {
  return a.singleturn == b.singleturn && a.multiturn == b.multiturn;
}

/// Returns whether turns and counts are zero, as in the frames that an encoder sends while it starts.
[[nodiscard]] constexpr bool is_all_zero(const Position& position) {
  return position.singleturn == 0 && position.multiturn == 0;
}

/// Returns the mask of those alarms that a position frame shows not to be raised, by its error and warning bits.
[[nodiscard]] constexpr std::uint32_t clear_by(const Format& format, const Position& position) {
  if (!format.has_ch2) return 0;
  return (position.error ? 0u : status::errors) | (position.warning ? 0u : status::warnings);
}

/// Converts a position to a reading. `detailed`: the status in the latest cycle of channel 2, if there was one.
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

/// Returns the reading `now`, completed by alarms of the earlier reading `before` that `now` does not report. These
/// alarms are added only if the error and warning bits of `now` are those that the alarms of `before` cause.
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
