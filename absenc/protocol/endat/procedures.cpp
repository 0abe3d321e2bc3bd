// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/endat/procedures.hpp"

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/endat/access.hpp"
#include "absenc/protocol/endat/host.hpp"

namespace absenc::endat {

using namespace author;

namespace {

// Reads error messages and warnings, and adds them to `found`.
Part<std::uint32_t> read_alarms(Dialog& dialog, ProcedureResult& found) {
  std::uint8_t selected = 0;
  const std::uint16_t errors = co_await read_word_21(dialog, selected, error_word, "");
  const std::uint16_t warnings = co_await read_word_21(dialog, selected, warning_word, "");
  add_alarms(found.reading, {errors, warnings});
  found.alarms = static_cast<std::uint16_t>(found.reading.alarms);
  found.command.reset();  // the values are of several exchanges
  found.start.reset();
  co_return found.reading.alarms;
}

}  // namespace

// ---- Position, status, parameters

Procedure read_position(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  for (int tries = 0; tries < most_tries; ++tries) {
    const Reading reading = co_await look(dialog, found);
    if (reading.alarms == 0 && reading.singleturn_valid_bits != 0) break;
    // An error bit without an error message may be damage that the checksum misses: the position is read again.
    const std::uint32_t alarms = co_await read_alarms(dialog, found);
    if ((alarms & (alarm::errors | alarm::warnings)) != 0) break;
  }
  co_return done;
}

Procedure read_status(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  co_await look(dialog, found);
  co_await read_alarms(dialog, found);
  co_return done;
}

Procedure clear_alarms(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  std::uint8_t selected = 0;
  co_await select(dialog, selected, area::status, "nothing was cleared");
  for (const WordPlace word : {error_word, warning_word}) {
    // If the reply is lost, the alarms that are read afterwards show whether they were cleared.
    static_cast<void>(co_await dialog.attempt({.code = ModeCommand::write, .byte = word.address, .word = 0}).changes());
  }
  co_await look(dialog, found);
  const std::uint32_t alarms = co_await read_alarms(dialog, found);
  if (alarms != 0) {
    co_return {Error::cross_check_failed, "alarms remain", "mend the cause that `absenc alarms` names, then try again"};
  }
  co_return done;
}

namespace {

std::string_view kind_of(std::uint16_t type) {
  switch (type >> 8) {
    case 0x40:
      return "linear, absolute";
    case 0x60:
      return "linear, absolute, cyclic";
    case 0x10:
      return "linear, incremental, distance-coded reference marks";
    case 0x00:
      return "linear, incremental";
    case 0x20:
    case 0x30:
      return "linear, with battery";
    case 0xC0:
      return "rotary, single-turn";
    case 0xE0:
      return "rotary, multi-turn with gears";
    case 0xD0:
      return "rotary, multi-turn with battery";
    case 0x80:
    case 0x90:
      return "rotary, incremental";
    default:
      return "of a kind that no source names";
  }
}

// Reads `count` words and appends them to the words of `found`, the low byte of each first.
Part<bool> append_words(Dialog& dialog, std::uint8_t& selected, ProcedureResult& found, WordPlace first,
                        std::uint8_t count) {
  for (std::uint8_t i = 0; i < count; ++i) {
    const std::uint16_t word =
        co_await read_word_21(dialog, selected, {first.mrs, static_cast<std::uint8_t>(first.address + i)}, "");
    static_cast<void>(found.words.push_back(static_cast<std::uint8_t>(word)));
    static_cast<void>(found.words.push_back(static_cast<std::uint8_t>(word >> 8)));
  }
  co_return true;
}

}  // namespace

Procedure read_info(Dialog& dialog, ProcedureResult& found) {
  std::uint8_t selected = 0;
  const std::uint16_t count = co_await read_word_21(dialog, selected, clock_count_word, "");
  const std::uint16_t type = co_await read_word_21(dialog, selected, type_word, "");
  const std::uint16_t periods_low = co_await read_word_21(dialog, selected, periods_word, "");
  const std::uint16_t periods_high = co_await read_word_21(dialog, selected, periods_high_word, "");
  const std::uint16_t revolutions = co_await read_word_21(dialog, selected, revolutions_word, "");
  const std::uint16_t steps_low = co_await read_word_21(dialog, selected, steps_word, "");
  const std::uint16_t steps_high = co_await read_word_21(dialog, selected, steps_high_word, "");
  co_await append_words(dialog, selected, found, id_words, 3);
  co_await append_words(dialog, selected, found, serial_words, 3);
  const std::uint16_t set = co_await read_word_21(dialog, selected, command_set_word, "");
  found.bits = static_cast<std::uint8_t>(count & 0x3F);
  found.type = type;
  found.kind = kind_of(type);
  found.periods = double_word(periods_low, periods_high);
  found.revolutions = revolutions;
  found.steps = double_word(steps_low, steps_high);
  found.speaks_22 = (set & 3) == 1;
  found.id = found.words.view().first(6);
  found.serial = found.words.view().subspan(6, 6);
  const Format& format = dialog.format();
  if (format.is_known() && format.bits() != *found.bits) {
    co_return {Error::cross_check_failed, "the encoder states another number of bits than the options",
               "leave out singleturn_bits and multiturn_bits: they are then asked from the encoder"};
  }
  co_return done;
}

// ---- Resets, zero, recovery time

namespace {

// Notes that the encoder has ended the selection of additional information, and returns the one from before.
SelectedInfos end_selection(Dialog& dialog) {
  Format format = dialog.format();
  const SelectedInfos before{format.info1, format.info2};
  format.info1 = format.info2 = 0;
  dialog.set_format(format);
  return before;
}

}  // namespace

Procedure reset(Dialog& dialog, ProcedureResult& found) {
  static_cast<void>(co_await dialog.ask({.code = ModeCommand::reset}).changes());
  co_await dialog.rest(reset_time);
  const SelectedInfos before = end_selection(dialog);
  co_await know_resolution(dialog);
  co_await look(dialog, found);
  co_await restore(dialog, before);
  co_return done;
}

Procedure reset_errors(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  co_await find_selection(dialog);
  static_cast<void>(co_await dialog.ask({.code = ModeCommand::error_reset_22}).changes());
  const SelectedInfos before = end_selection(dialog);
  co_await dialog.rest(memory_access_time);
  co_await look(dialog, found);
  const bool remains = has_error(ModeCommand::position_22, dialog.last());
  co_await restore(dialog, before);
  if (remains) {
    co_return {Error::cross_check_failed, "an error remains",
               "`absenc run ... status` names it, then `absenc clear-alarms`"};
  }
  co_return done;
}

namespace {

// Counts of a signal period of the position: 0 if the encoder does not tell a whole number.
Part<std::uint64_t> counts_of_period(Dialog& dialog, std::uint8_t& selected) {
  const std::uint16_t low = co_await read_word_21(dialog, selected, periods_word, "nothing was changed");
  const std::uint16_t high = co_await read_word_21(dialog, selected, periods_high_word, "nothing was changed");
  const std::uint64_t periods = double_word(low, high);
  const Format& format = dialog.format();
  if (periods == 0) co_return 0;
  // A linear encoder states the length of a signal period in nm.
  if (format.is_linear()) {
    const std::uint64_t unit = format.unit_pm();
    co_return unit == 0 || periods * 1000 % unit != 0 ? 0 : periods * 1000 / unit;
  }
  const std::uint64_t counts = std::uint64_t{1} << format.singleturn_bits;
  co_return counts % periods == 0 ? counts / periods : 0;
}

// Whether a position is at most `distance` counts away from 0.
bool is_within(std::uint64_t counts, unsigned bits, std::uint64_t distance) {
  const std::int64_t away = wrapped_difference(counts, 0, bits);
  return static_cast<std::uint64_t>(away < 0 ? -away : away) <= distance;
}

}  // namespace

Procedure set_zero(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  const Reading first = co_await look(dialog, found);
  co_await dialog.rest(between_looks);
  const Reading second = co_await look(dialog, found);
  const Outcome why_not = objection_to_zero(first, second);
  if (why_not.error != Error::none) co_return why_not;
  std::uint8_t selected = 0;
  const std::uint64_t period = co_await counts_of_period(dialog, selected);
  if (period == 0) {
    co_return {Error::unsupported,
               "the encoder states no signal period, in which its datum shift is counted; nothing was changed",
               "store the zero as an offset in the drive"};
  }
  const std::uint16_t low = co_await read_word_21(dialog, selected, shift_word, "nothing was changed");
  const std::uint16_t high = co_await read_word_21(dialog, selected, shift_high_word, "nothing was changed");
  // Rounded to the nearest signal period, so the new position may be up to half a period away from 0.
  const auto by = static_cast<std::uint32_t>((second.singleturn + period / 2) / period);
  const std::uint32_t before = double_word(low, high);
  const std::uint32_t wanted = dialog.format().datum_shift == DatumShift::subtracted ? before + by : before - by;
  const std::array<WordPlace, 2> places{shift_word, shift_high_word};
  const std::array<std::uint16_t, 2> values{static_cast<std::uint16_t>(wanted),
                                            static_cast<std::uint16_t>(wanted >> 16)};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::uint16_t now = co_await write_word_21(dialog, selected, places[i], values[i],
                                                     "the datum shift was written, but could not be read back");
    if (now != values[i]) {
      const bool is_first_change = i == 0 || values[0] == low;
      if (is_first_change && now == (i == 0 ? low : high)) dialog.refused();
      co_return {
          Error::cross_check_failed,
          "the encoder has another datum shift than was written: its operating parameters may be write-protected",
          "read words 0 and 1 of area 0xA7 with `absenc memory read`"};
    }
  }
  static_cast<void>(co_await dialog.ask({.code = ModeCommand::reset})
                        .or_say("the datum shift is stored and holds after the next start"));
  co_await dialog.rest(reset_time);
  const SelectedInfos selection = end_selection(dialog);
  const Reading now = co_await look(dialog, found);
  co_await restore(dialog, selection);
  found.datum_shift = static_cast<std::int32_t>(wanted);
  found.command.reset();
  const bool is_zero = is_near(now.singleturn, 0, now.singleturn_bits, zero_millidegrees) ||
                       is_within(now.singleturn, now.singleturn_bits, period);
  if (!is_zero) {
    co_return {Error::cross_check_failed, "the datum shift is stored, but the position is not zero",
               "hold the shaft still; if it stays so, try the other value of the option datum_shift"};
  }
  if (wanted == before) {
    dialog.unproven(
        "the position was within half a signal period of zero before, so the datum shift is the same and cannot show "
        "whether the encoder stored it: turn the shaft and try again");
  }
  co_return done;
}

Procedure read_recovery(Dialog& dialog, ProcedureResult& found) {
  std::uint8_t selected = 0;
  const std::uint16_t word = co_await read_word_21(dialog, selected, initialisation_word, "");
  found.recovery = (word & recovery_mask) == short_recovery_bits ? 1 : 0;
  co_return done;
}

Procedure set_recovery(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  std::uint8_t selected = 0;
  const std::uint16_t before = co_await read_word_21(dialog, selected, initialisation_word, "nothing was changed");
  // The other bits of the word are written back as they were read, and the checksum misses one damaged reply of 32.
  if (co_await read_word_21(dialog, selected, initialisation_word, "nothing was changed") != before) {
    co_return {Error::cross_check_failed, "two reads of the recovery time disagree; nothing was changed",
               "check wiring and clock rate, then try again"};
  }
  const std::uint16_t bits = arguments[0] == 0 ? long_recovery_bits : short_recovery_bits;
  const auto wanted = static_cast<std::uint16_t>((before & ~recovery_mask) | bits);
  found.recovery = static_cast<std::uint8_t>(arguments[0]);
  found.written = wanted != before;
  if (wanted == before) co_return done;
  const std::uint16_t now = co_await write_word_21(dialog, selected, initialisation_word, wanted,
                                                   "the recovery time was written, but could not be read back");
  if (now == wanted) co_return done;
  if (now == before) dialog.refused();
  co_return {Error::cross_check_failed, "the encoder has another recovery time than was written",
             "look at `absenc config get ... recovery` before you write it again"};
}

// ---- Additional information

Procedure read_infos(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  co_await know_resolution(dialog);
  const SelectedInfos before = co_await find_selection(dialog);
  for (const std::int64_t code : arguments) {
    if (code == 0) continue;
    co_await select_22(dialog, static_cast<std::uint8_t>(code), "the information could not be selected");
    co_await find_selection(dialog);
  }
  co_await look(dialog, found);
  const bool has_first = arguments[0] == 0 || arguments[0] == mrs::stop_info_1 || found.info1_code == arguments[0];
  const bool has_second = arguments[1] == 0 || arguments[1] == mrs::stop_info_2 || found.info2_code == arguments[1];
  const bool has_both = has_first && has_second;
  const Reading reading = found.reading;
  co_await restore(dialog, before);
  found.reading = reading;
  if (!has_both) co_return {Error::request_rejected, "the encoder does not have this additional information"};
  co_return done;
}

Procedure read_temperature(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  const SelectedInfos before = co_await find_selection(dialog);
  const std::uint16_t tenths = co_await read_info_1(dialog, mrs::internal_temperature, "");
  co_await restore(dialog, before);
  found.temperature = (static_cast<double>(tenths) * 10 - 27'315) / 100;
  co_return done;
}

// ---- Delay of the line

namespace {

// Clocks before the start bit at this rate of the clock; 0 if three positions do not agree.
Part<std::size_t> clocks_at(Dialog& dialog, std::uint16_t khz) {
  Format format = dialog.format();
  format.clock_khz = khz;
  dialog.set_format(format);
  std::size_t first = 0;
  for (int i = 0; i < 3; ++i) {
    const Reply reply = co_await dialog.ask({.code = position_command(dialog.format()), .seeks_infos = true});
    if (i > 0 && reply.start != first) co_return 0;
    first = reply.start;
  }
  co_return first;
}

// Returns the shortest delay of the line that moves the start bit by a clock, at the clock rate of the last exchange.
Time shortest_delay(const Dialog& dialog) {
  return dialog.sampled_after() != Time{} ? dialog.sampled_after() : dialog.format().period() / 2;
}

}  // namespace

// At a clock so slow that the position is ready behind the mode command, the start bit comes with clock 11. The delay
// moves it by a clock as soon as it is longer than the time from the edge to the sample, which is half a period on most
// ports: the slowest clock at which it does is searched.
Procedure measure_delay(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  const Format given = dialog.format();
  constexpr std::size_t earliest = command_bits + turn_bits;
  auto low = static_cast<std::uint16_t>(slowest / 1000);
  // Above this rate the start bit may be late because the position is still being calculated.
  const std::int64_t limit = static_cast<std::int64_t>(earliest) * 1'000'000 / given.latency.count();
  auto high = static_cast<std::uint16_t>(std::clamp<std::int64_t>(limit, low, given.clock_khz));
  if (co_await clocks_at(dialog, low) != earliest) {
    dialog.set_format(given);
    co_return {Error::unsupported,
               "the start bit is late even at 100 kHz: the position takes too long to be calculated",
               "compute the delay from the cable (10 ns for each metre) and the transceivers, and set line_delay_ns"};
  }
  const bool moves = high > low && co_await clocks_at(dialog, high) != earliest;
  if (!moves) low = high;
  Time delay = shortest_delay(dialog);
  while (high - low > low / 50 + 1) {
    const auto middle = static_cast<std::uint16_t>((low + high) / 2);
    const std::size_t clocks = co_await clocks_at(dialog, middle);
    (clocks == earliest ? low : high) = middle;
    if (clocks != earliest) delay = shortest_delay(dialog);
  }
  dialog.set_format(given);
  found.line_delay = static_cast<std::uint32_t>(delay.count());
  found.delay_shorter = !moves;
  co_return done;
}

}  // namespace absenc::endat
