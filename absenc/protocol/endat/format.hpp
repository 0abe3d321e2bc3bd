// SPDX-License-Identifier: Apache-2.0
// Properties of one EnDat encoder, its memory areas, and the times of the protocol. README.md names the sources.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/protocol/author/memory_map.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::endat {

using namespace std::chrono_literals;

/// Version of the protocol whose commands read the position and the memory.
enum class CommandSet : std::uint8_t { v21, v22 };
/// Recovery time that the encoder keeps after commands of EnDat 2.2 (word 3 of the operating status).
enum class Recovery : std::uint8_t {
  long_time,   ///< 10 to 30 us, as after commands of EnDat 2.1
  short_time,  ///< 1.25 to 3.75 us
};
/// How an encoder applies its datum shift, which the sources do not say.
enum class DatumShift : std::uint8_t { subtracted, added };

/// Properties of one encoder and its line, as the unit's options give them.
struct Format {
  std::uint8_t singleturn_bits = 0;  ///< Bits of the position within the turn; 0: asked from the encoder, or linear.
  std::uint8_t multiturn_bits = 0;   ///< Bits of the turns; 0: none.
  std::uint8_t position_bits = 0;    ///< Bits of a linear encoder's position; 0: rotary.
  double unit_um = 0;                ///< Micrometres per count of a linear encoder; 0: not given.
  CommandSet version = CommandSet::v22;  ///< Version whose commands are used.
  std::uint16_t clock_khz = 1000;        ///< Rate of the clock, 100 to 16 000 kHz.
  Time latency = 10us;                   ///< Longest time from the first falling edge until the position is calculated.
  std::uint32_t line_delay_ns = 0;       ///< Delay of line and transceivers, there and back, in ns.
  Recovery recovery = Recovery::long_time;  ///< Recovery time after commands of EnDat 2.2.
  /// MRS code of the additional information 1 that is selected when the host begins, 0x40 to 0x4E; 0: none.
  std::uint8_t info1 = 0;
  /// MRS code of the additional information 2 that is selected when the host begins, 0x50 to 0x5E; 0: none.
  std::uint8_t info2 = 0;
  DatumShift datum_shift = DatumShift::subtracted;  ///< How the encoder applies the datum shift.

  /// Returns whether the number of bits of the position is known.
  [[nodiscard]] constexpr bool is_known() const { return singleturn_bits + position_bits != 0; }
  /// Returns the number of additional informations that each position of EnDat 2.2 has, 0 to 2.
  [[nodiscard]] constexpr std::size_t infos() const { return (info1 != 0 ? 1u : 0u) + (info2 != 0 ? 1u : 0u); }
  /// Returns whether the encoder is linear.
  [[nodiscard]] constexpr bool is_linear() const { return position_bits != 0; }
  /// Returns the number of bits of position and turns together.
  [[nodiscard]] constexpr unsigned bits() const {
    return is_linear() ? position_bits : unsigned{singleturn_bits} + multiturn_bits;
  }
  /// Returns the whole picometres per count of a linear encoder; 0: not given.
  [[nodiscard]] constexpr std::uint64_t unit_pm() const { return static_cast<std::uint64_t>(unit_um * 1e6 + 0.5); }
  /// Returns the resolution of the encoder.
  [[nodiscard]] constexpr Resolution resolution() const {
    if (is_linear()) return {.singleturn_bits = position_bits, .unit_um = unit_um};
    return {.singleturn_bits = singleturn_bits, .multiturn_bits = multiturn_bits};
  }
  /// Returns the period of the clock.
  [[nodiscard]] constexpr Time period() const { return Time(1'000'000 / clock_khz); }
  /// Returns the settings of the line.
  [[nodiscard]] constexpr LineSettings line() const {
    return {.rate = std::uint32_t{clock_khz} * 1000,
            .spi_mode = 3,
            .delay = Time(line_delay_ns),
            .highest_rate = 16'000'000};
  }
};

/// Bits of an encoder whose resolution is not given, for virtual encoders and captures.
inline constexpr std::uint8_t assumed_bits = 25;
/// Greatest number of bits of position and turns together: three words of 16 bits carry position value 2.
inline constexpr unsigned most_bits = 48;

/// Returns `format` with the resolution of a virtual encoder if it has none.
[[nodiscard]] constexpr Format with_resolution(Format format) {
  if (!format.is_known()) format.singleturn_bits = assumed_bits;
  return format;
}

// ---- Times

inline constexpr std::uint32_t memory_rate = 100'000;    ///< Rate of the clock for parameters, in Hz: the lowest one.
inline constexpr Time memory_access_time = 12ms;         ///< Longest time of an access to a parameter (tac).
inline constexpr Time long_recovery = 30us;              ///< Longest recovery time (tm) after commands of EnDat 2.1.
inline constexpr Time short_recovery = 3750ns;           ///< Longest short recovery time after commands of EnDat 2.2.
inline constexpr Time reset_time = 50ms;                 ///< How long a host waits after a reset.
inline constexpr std::uint32_t fastest_21 = 2'000'000;   ///< Highest clock rate without delay compensation, in Hz.
inline constexpr std::uint32_t fastest_22 = 16'000'000;  ///< Highest clock rate with delay compensation, in Hz.
inline constexpr std::uint32_t slowest = 100'000;        ///< Lowest clock rate, in Hz.

// ---- Memory: areas are selected by their MRS code, words have 16 bits

/// MRS codes of memory areas.
namespace area {
inline constexpr std::uint8_t maker_1 = 0xA1;    ///< Parameters of the encoder's maker, words 4 to 15.
inline constexpr std::uint8_t maker_2 = 0xA3;    ///< Parameters of the encoder's maker, words 16 to 31.
inline constexpr std::uint8_t maker_3 = 0xA5;    ///< Parameters of the encoder's maker, words 32 to 47.
inline constexpr std::uint8_t operating = 0xA7;  ///< Operating parameters, such as the datum shift.
inline constexpr std::uint8_t status = 0xB9;     ///< Operating status: errors, warnings, function initialisation.
inline constexpr std::uint8_t maker_22 = 0xBD;   ///< Parameters of the encoder's maker for EnDat 2.2.
}  // namespace area

/// Returns the description of `count` words of an area, the first of which has the number `first`.
constexpr MemoryArea words(std::uint32_t mrs, std::uint32_t first, std::uint32_t count, std::string_view meaning,
                           bool writable) {
  return {.page = mrs, .first = first, .count = count, .meaning = meaning, .writable = writable, .word = 2};
}

/// Areas of the memory, in the order of their MRS codes.
inline constexpr std::array<MemoryArea, 15> memory_areas{
    words(area::maker_1, 4, 12, "parameters of the maker, part 1", false),
    words(area::maker_2, 0, 16, "parameters of the maker, part 2", false),
    words(area::maker_3, 0, 16, "parameters of the maker, part 3", false),
    words(area::operating, 0, 16, "operating parameters; 0 and 1: datum shift", true),
    words(0xA9, 0, 64, "parameters of the machine's maker (OEM), part 1", true),
    words(0xAB, 0, 128, "parameters of the machine's maker (OEM), part 2", true),
    words(0xAD, 0, 128, "parameters of the machine's maker (OEM), part 3", true),
    words(0xAF, 0, 64, "parameters of the machine's maker (OEM), part 4", true),
    words(0xB1, 0, 64, "compensation values, part 1", false),
    words(0xB3, 0, 64, "compensation values, part 2", false),
    words(0xB5, 0, 64, "compensation values, part 3", false),
    words(0xB7, 0, 64, "compensation values, part 4", false),
    MemoryArea{.page = area::status,
               .first = 0,
               .count = 2,
               .meaning = "operating status: error messages, warnings",
               .writable = false,
               .in_dump = false,
               .word = 2},
    MemoryArea{.page = area::status,
               .first = 2,
               .count = 2,
               .meaning = "operating status: write protection, function initialisation",
               .in_dump = false,
               .word = 2},
    words(area::maker_22, 0, 64, "parameters of the maker for EnDat 2.2", false),
};

/// Number of words of all areas.
inline constexpr std::size_t word_count = [] {
  std::size_t sum = 0;
  for (const MemoryArea& one : memory_areas) sum += one.count;
  return sum;
}();

/// Returns the area that has the word `address`, or null.
[[nodiscard]] constexpr const MemoryArea* find_word(unsigned mrs, unsigned address) {
  return author::find_area(memory_areas, mrs, address);
}

/// A word of the memory.
struct WordPlace {
  std::uint8_t mrs;      ///< MRS code of its area.
  std::uint8_t address;  ///< Address in the area.
};
inline constexpr WordPlace error_word{area::status, 0};                ///< Error messages; writing 0 clears them.
inline constexpr WordPlace warning_word{area::status, 1};              ///< Warnings; writing 0 clears them.
inline constexpr WordPlace initialisation_word{area::status, 3};       ///< Function initialisation.
inline constexpr WordPlace clock_count_word{area::maker_1, 0x0D};      ///< Number of bits of the position, bits 5 to 0.
inline constexpr WordPlace type_word{area::maker_1, 0x0E};             ///< Type of the encoder.
inline constexpr WordPlace periods_word{area::maker_1, 0x0F};          ///< Signal periods, low word.
inline constexpr WordPlace periods_high_word{area::maker_2, 0};        ///< Signal periods, high word.
inline constexpr WordPlace revolutions_word{area::maker_2, 1};         ///< Distinguishable revolutions; 0: none.
inline constexpr WordPlace steps_word{area::maker_2, 4};               ///< Measuring steps, low word.
inline constexpr WordPlace steps_high_word{area::maker_2, 5};          ///< Measuring steps, high word.
inline constexpr WordPlace errors_supported_word{area::maker_3, 3};    ///< Error messages that the encoder has.
inline constexpr WordPlace warnings_supported_word{area::maker_3, 4};  ///< Warnings that the encoder has.
inline constexpr WordPlace command_set_word{area::maker_3, 5};         ///< Bits 1 to 0: 1 means EnDat 2.2.
inline constexpr WordPlace shift_word{area::operating, 0};             ///< Datum shift, low word.
inline constexpr WordPlace shift_high_word{area::operating, 1};        ///< Datum shift, high word.

inline constexpr WordPlace id_words{area::maker_2, 8};        ///< First of three words of the ID number.
inline constexpr WordPlace serial_words{area::maker_2, 0xB};  ///< First of three words of the serial number.

/// MRS codes of additional information.
namespace mrs {
inline constexpr std::uint8_t nothing = 0x40;               ///< Information 1 without content.
inline constexpr std::uint8_t diagnosis = 0x41;             ///< Valuation numbers.
inline constexpr std::uint8_t position_2 = 0x42;            ///< Low word of position value 2; the others follow.
inline constexpr std::uint8_t memory_low = 0x45;            ///< Address and low byte of a word.
inline constexpr std::uint8_t memory_high = 0x46;           ///< Address and high byte of a word.
inline constexpr std::uint8_t acknowledge_mrs = 0x47;       ///< MRS code of the selected memory area.
inline constexpr std::uint8_t acknowledge_test = 0x48;      ///< Port of the last test command.
inline constexpr std::uint8_t test_values = 0x49;           ///< Low word of test values; the others follow.
inline constexpr std::uint8_t external_temperature = 0x4C;  ///< Resistance of an external sensor, in ohm.
inline constexpr std::uint8_t internal_temperature = 0x4D;  ///< Temperature inside the encoder, in 0.1 K.
inline constexpr std::uint8_t sensors = 0x4E;               ///< Additional sensors.
inline constexpr std::uint8_t stop_info_1 = 0x4F;           ///< Ends additional information 1.
inline constexpr std::uint8_t nothing_2 = 0x50;             ///< Information 2 without content.
inline constexpr std::uint8_t commutation = 0x51;           ///< Position for the commutation.
inline constexpr std::uint8_t acceleration = 0x52;          ///< Acceleration.
inline constexpr std::uint8_t limits = 0x54;                ///< Limit position signals.
inline constexpr std::uint8_t asynchronous = 0x56;          ///< Low word of the asynchronous position; others follow.
inline constexpr std::uint8_t error_sources = 0x59;         ///< Sources of operating status errors.
inline constexpr std::uint8_t timestamp = 0x5B;             ///< Time stamp.
inline constexpr std::uint8_t stop_info_2 = 0x5F;           ///< Ends additional information 2.
}  // namespace mrs

/// Bits 1 and 0 of the function initialisation select the recovery time.
inline constexpr std::uint16_t recovery_mask = 3;
inline constexpr std::uint16_t short_recovery_bits = 1;  ///< Value of these bits for the short recovery time.
inline constexpr std::uint16_t long_recovery_bits = 2;   ///< Value of these bits for the long recovery time.
/// Bit of the encoder's type: rotary encoder.
inline constexpr std::uint16_t rotary_type = 0x8000;
/// Bit that the word `clock_count_word` always has.
inline constexpr std::uint16_t clock_count_marker = 0x8000;

}  // namespace absenc::endat
