// SPDX-License-Identifier: Apache-2.0
// Constants of Nikon's A-format, and Format. README.md names the sources of the values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/time.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::nikon {

using namespace std::chrono_literals;

/// Bit rates that encoders can have, in bits per second.
inline constexpr std::array<std::uint32_t, 5> rates{2'500'000, 4'000'000, 6'666'667, 8'000'000, 16'000'000};

inline constexpr Time answer_time = 3us;          ///< assumed time from a request to its reply
inline constexpr Time answer_limit = 300us;       ///< assumed longest time that a host waits for a reply
inline constexpr Time frame_pause = 10us;         ///< shortest pause between the frames of one request
inline constexpr Time memory_read_time = 300us;   ///< longest time in which the encoder fetches a word of the EEPROM
inline constexpr Time memory_write_time = 30ms;   ///< longest time of a write to the EEPROM, or of a reset
inline constexpr std::uint8_t encoder_count = 8;  ///< number of encoders that one line can have

inline constexpr std::size_t word_count = 256;             ///< number of words of the EEPROM
inline constexpr std::uint8_t user_words = 0xF0;           ///< number of words of the EEPROM that hosts may write
inline constexpr std::uint8_t temperature_address = 0xF9;  ///< EEPROM address of the word with the temperature

/// Areas of the EEPROM, whose words have 16 bits.
inline constexpr std::array<MemoryArea, 2> memory_areas{{
    {.page = 0, .first = 0, .count = user_words, .meaning = "the user's EEPROM", .word = 2},
    {.page = 0,
     .first = user_words,
     .count = word_count - user_words,
     .meaning = "of the maker; 0xF9 is the temperature",
     .writable = false,
     .in_dump = false,
     .word = 2},
}};

/// Command codes (CC) of requests.
enum class Code : std::uint8_t {
  position = 0,  ///< asks for the position within the turn and the turns, together 40 bits
  lower = 1,     ///< asks for the lower 24 of the 40 bits of position and turns
  upper = 2,     ///< asks for the upper 24 of the 40 bits of position and turns
  alarms = 3,
  all_positions = 4,  ///< asks all encoders of the line for position and turns; they answer in turn
  all_lower = 5,
  all_upper = 6,
  all_alarms = 7,
  clear_alarms = 8,
  clear_turns = 9,
  clear_both = 10,
  set_address = 11,  ///< gives the address in the request to the only encoder of the line
  zero = 12,
  read_memory = 13,
  write_memory = 14,
  temperature = 15,
  read_identity = 16,
  read_only_identity = 17,  ///< asks the only encoder of the line for its identification, whatever its address is
  write_identity = 18,
  write_only_identity = 19,  ///< writes an identification to the only encoder of the line, whatever its address is
  assign_address = 20,  ///< gives the address in the request to the encoder that has the identification in the request
  short_position = 21,  ///< asks for the lower 17 bits of the position
  all_short_positions = 22,
  with_alarms = 27,  ///< asks for the lower 24 of the 40 bits of position and turns, and for 16 bits of alarms
  all_with_alarms = 28,
  with_temperature = 29,  ///< asks for the lower 24 of the 40 bits of position and turns, and for the temperature
  all_with_temperature = 30,
};

/// Bits of the alarms (ALM); bit 0 is the first on the wire.
namespace alarm {
inline constexpr std::uint16_t battery = 1u << 0;  ///< alarm: the battery's voltage is low
/// alarm: battery and capacitor were empty, so the turns are lost
inline constexpr std::uint16_t multiturn_error = 1u << 1;
inline constexpr std::uint16_t overflow = 1u << 2;      ///< alarm: the turn counter has overflowed
inline constexpr std::uint16_t over_speed = 1u << 3;    ///< alarm: the shaft turned too fast
inline constexpr std::uint16_t memory_error = 1u << 4;  ///< alarm: an access to the EEPROM failed
/// alarm: the absolute and the incremental position of the encoder differ
inline constexpr std::uint16_t singleturn_error = 1u << 5;
/// alarm: the calculations of the position within the turn and of the turns contradict each other
inline constexpr std::uint16_t ps_error = 1u << 6;
inline constexpr std::uint16_t busy = 1u << 7;  ///< alarm bit that shows a state: the encoder determines its position
/// alarm bit that shows a state: the EEPROM is being read or written
inline constexpr std::uint16_t memory_busy = 1u << 8;
inline constexpr std::uint16_t over_temperature = 1u << 9;  ///< alarm: the encoder is too hot
inline constexpr std::uint16_t increment_error = 1u << 10;  ///< alarm: a signal of the incremental track is bad
inline constexpr std::uint16_t all = 0x07FF;                ///< mask of all alarm bits that have a meaning
/// Mask of the alarms that are assumed to make the position within the turn invalid.
inline constexpr std::uint16_t position_lost = over_speed | singleturn_error | ps_error | busy | increment_error;
/// Mask of the alarms that are assumed to make the turns invalid.
inline constexpr std::uint16_t turns_lost = multiturn_error | over_speed | ps_error | busy;
}  // namespace alarm

/// Whether EEPROM words and the identification are sent with their low or their high bit first. The sources contradict
/// each other.
enum class BitOrder : std::uint8_t { low_first, high_first };

/// Properties of an encoder that its frames depend on; they are the options of the unit.
struct Format {
  unsigned singleturn_bits = 20;  ///< number of bits of the position within the turn, 17 to 24
  unsigned multiturn_bits = 16;   ///< number of bits of the turns, 0 to 16; 0: single-turn encoder
  std::uint8_t address = 0;       ///< address of the encoder on its line, 0 to 7
  std::uint8_t rate = 0;          ///< index of the bit rate in `rates`
  /// whether EEPROM words and the identification are sent with their low or their high bit first
  BitOrder bit_order = BitOrder::low_first;

  /// Returns the settings of the RS-485 line: characters of 16 bits.
  [[nodiscard]] constexpr LineSettings line() const { return {.rate = rates[rate], .data_bits = 16}; }
  /// Returns the numbers of bits of position and turns.
  [[nodiscard]] constexpr Resolution resolution() const { return {singleturn_bits, multiturn_bits}; }
};

/// Returns whether all encoders of the line answer a request with this command code, one after the other.
[[nodiscard]] constexpr bool is_for_all(Code code) {
  return (code >= Code::all_positions && code <= Code::all_alarms) || code == Code::all_short_positions ||
         code == Code::all_with_alarms || code == Code::all_with_temperature;
}
/// Returns the command code with which a host asks one encoder for the data that `code` asks of all.
[[nodiscard]] constexpr Code single(Code code) {
  if (!is_for_all(code)) return code;
  const auto number = static_cast<std::uint8_t>(code);
  return static_cast<Code>(code <= Code::all_alarms ? number - 4 : number - 1);
}
/// Returns whether an encoder answers requests with this command code whatever address they have.
[[nodiscard]] constexpr bool is_for_any_address(Code code) {
  return code == Code::set_address || code == Code::read_only_identity || code == Code::write_only_identity ||
         code == Code::assign_address;
}
/// Returns whether an encoder executes this command code only after eight consecutive requests with it.
[[nodiscard]] constexpr bool is_reset(Code code) { return code >= Code::clear_alarms && code <= Code::zero; }
/// Returns whether replies to this command code have an identification as their data.
[[nodiscard]] constexpr bool has_identity(Code code) {
  return code >= Code::read_identity && code <= Code::assign_address;
}
/// Returns whether requests with this command code carry an identification.
[[nodiscard]] constexpr bool sends_identity(Code code) {
  return code >= Code::write_identity && code <= Code::assign_address;
}
/// Returns whether requests with this command code read or write a word of the EEPROM.
[[nodiscard]] constexpr bool is_memory_access(Code code) {
  return code == Code::read_memory || code == Code::write_memory;
}
/// Returns whether requests with this command code carry a value: a word or an identification.
[[nodiscard]] constexpr bool is_write(Code code) { return code == Code::write_memory || sends_identity(code); }

/// Returns the command code with this number; no value for a number that no source lists.
[[nodiscard]] constexpr std::optional<Code> code_of(unsigned number) {
  if (number > 30 || (number > 22 && number < 27)) return std::nullopt;
  return static_cast<Code>(number);
}

/// Number of bits of the position that command codes 21 and 22 read.
inline constexpr unsigned short_bits = 17;

/// Returns the number of data bits in one encoder's reply to this command code: 40, 24 or 17.
[[nodiscard]] constexpr unsigned data_bits(Code code) {
  const Code one = single(code);
  if (one == Code::short_position) return short_bits;
  return one == Code::position || one == Code::with_alarms || one == Code::with_temperature ? 40 : 24;
}
/// Returns the length in bytes of one encoder's reply to this command code.
[[nodiscard]] constexpr std::size_t reply_length(Code code) {
  return single(code) == Code::short_position ? 4 : 3 + data_bits(code) / 8;
}
/// Returns the number of frames of a request: 1 (command frame), 2 (with the memory frame MDF2) or 4 (with MDF0 to
/// MDF2).
[[nodiscard]] constexpr std::size_t frames_of(Code code) {
  if (code == Code::read_memory) return 2;
  return is_write(code) ? 4 : 1;
}

/// Returns the time for one encoder's reply and the pause behind it, if all encoders of a line answer in turn.
[[nodiscard]] constexpr Time slot(const Format& format, Code code) {
  const Time pause = format.rate == 0 ? Time(3us) : format.rate < 3 ? Time(2us) : Time(1500ns);
  return format.line().byte_time() * static_cast<int>(reply_length(code)) + pause;
}

}  // namespace absenc::nikon
