// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>

#include "absenc/client/encoder.hpp"
#include "absenc/client/encoder/pace.hpp"
#include "absenc/client/sample_rows.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/rate.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"

namespace absenc::tool {

namespace {

enum class Format : std::uint8_t { human, json, csv };

// Returns the speed as "   12.0 ± 0.3 rpm"; "" if the speed is unknown, or not greater than its uncertainty.
std::string speed_text(const Sample& sample) {
  if (!sample.speed_valid || std::abs(sample.speed) <= sample.speed_uncertainty) return {};
  return fmt::format("   {} {}", to_text(*sample.measured_speed()), speed_unit(sample.reading));
}

class Display {
 public:
  /// Makes a printer of readings. With `speeds`, the line of a reading contains the speed if the shaft turns.
  Display(const Encoder& live, Format format, bool speeds)
      : live_(&live),
        format_(format),
        speeds_(speeds),
        rows_(live.unit(), live.options(), os::now(), SampleRows::With::reading, live.joint()) {
    if (format == Format::csv) print_line(csv_header(rows_.columns()));
  }

  void show(const Sample& sample) {
    switch (sample.kind) {
      case Sample::Kind::reading:
        last_trouble_ = Error::none;
        return show_reading(sample);
      case Sample::Kind::failed:
        return show_trouble(sample);
      case Sample::Kind::lost:
        print_message(fmt::format("{}\n  Waiting for it to come back.", sample.message));
        return show_row(sample);
      case Sample::Kind::absent:
        if (sample.message != last_absence_) print_message(sample.message);
        last_absence_ = sample.message;
        return;
      case Sample::Kind::back:
        last_absence_.clear();
        print_message(sample.message);
        return show_row(sample);
    }
  }

 private:
  void show_row(const Sample& sample) {
    if (format_ == Format::csv) print_line(to_csv(rows_.of(sample)));
    if (format_ == Format::json) print_line(to_json(rows_.of(sample)).line());
  }

  void show_reading(const Sample& sample) {
    const Unit& unit = live_->unit();
    const Reading& reading = sample.reading;
    if (sample.doubtful && !told_doubt_) {
      print_message("no two readings in a row agree as well as the fastest shaft allows");
    }
    told_doubt_ = sample.doubtful;
    if (format_ != Format::human) return show_row(sample);
    print_line(reading_text(unit, reading, doubt_of(sample)) + (speeds_ ? speed_text(sample) : "") +
               angles_text(live_->joint(), sample));
    // A raised alarm counts as raised until the encoder reports that it is clear.
    const std::uint32_t alarms = reading.alarms | (alarms_ & ~reading.alarms_reported);
    if (alarms == alarms_) return;
    alarms_ = alarms;
    print_note(reading.alarms != 0 ? alarms_in_words(unit, reading)
               : alarms == 0       ? "  the alarms are gone"
                                   : "  the other alarms are gone");
  }

  void show_trouble(const Sample& sample) {
    Trouble trouble = sample.trouble;
    if (format_ == Format::json) return print_line(to_json(trouble).line());
    if (format_ == Format::csv) show_row(sample);
    const bool again = trouble.error == last_trouble_;
    if (again) trouble.advice.clear();
    last_trouble_ = trouble.error;
    print_message(trouble.text());
    if (!again && !trouble.finding.empty()) print_note("  " + finding_line(trouble, connection_of(*live_).uri()));
  }

  const Encoder* live_;
  Format format_;
  bool speeds_;
  SampleRows rows_;
  std::uint32_t alarms_ = 0;
  bool told_doubt_ = false;
  Error last_trouble_ = Error::none;
  std::string last_absence_;
};

struct Tally {
  std::uint64_t good = 0;
  std::uint64_t bad = 0;
  bool last_good = false;
};

// With `count` 0, reads without end, and continues when a lost port is back.
void read_all(Encoder& live, Display& display, std::uint64_t count, Pace& pace, Tally& tally) {
  for (std::uint64_t i = 0; count == 0 || i < count; ++i) {
    if (i > 0) os::sleep_until(pace.next());
    if (os::interrupted()) throw os::Interrupted{};
    const Sample sample = live.next();
    if (sample.kind == Sample::Kind::lost && count != 0) throw os::Failure(os::Failure::Kind::lost, sample.message);
    tally.last_good = sample.kind == Sample::Kind::reading;
    tally.good += tally.last_good ? 1 : 0;
    tally.bad += sample.kind == Sample::Kind::failed ? 1 : 0;
    display.show(sample);
  }
}

void print_tally(const Encoder& live, const Tally& tally, Time time) {
  const host::Counters& counters = live.counters();
  print_message(fmt::format("{} good readings and {} failed ones in {}; exchanges: {}; the port went away: {}",
                            tally.good, tally.bad, to_text(time), exchanges_text(counters, live.readings()),
                            live.losses()));
}

int run_read(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), reading_settings(invocation));
  const auto count = static_cast<std::uint64_t>(invocation.number("--count", 1, 0, INT64_MAX));
  Pace pace(readings_a_second(invocation, 10));
  if (invocation.has("--json") && invocation.has("--csv")) throw UsageError("--json and --csv exclude each other");
  const Format format = invocation.has("--json") ? Format::json : invocation.has("--csv") ? Format::csv : Format::human;

  Encoder live = open_encoder(uri, pace.period());
  Display display(live, format, count == 0);
  Tally tally;
  const Time start = os::now();
  if (count != 0) {
    read_all(live, display, count, pace, tally);
    // The printed readings do not show that damaged frames of a stream were dropped, so the counters are printed.
    if (live.counters().discarded != 0) print_tally(live, tally, os::now() - start);
    return tally.bad == 0 ? exit_good : exit_failed;
  }
  try {
    read_all(live, display, 0, pace, tally);
  } catch (const os::Interrupted&) {
  }
  print_tally(live, tally, os::now() - start);
  return tally.last_good ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 8> read_parameters{{
    parameter::encoder,
    {"--count", "N", "how many readings; 0: until Ctrl-C", "1"},
    {"--rate", "HZ", "readings a second; 0: as many as the line allows", "10"},
    {"--json", "", "one JSON object a line, failures too"},
    {"--csv", "", "comma-separated values with a header"},
    parameter::read_command,
    parameter::realtime,
    parameter::option,
}};

constexpr std::array<Example, 3> read_examples{{
    {"absenc read tformat:/dev/ttyUSB0", "one reading"},
    {"absenc read \"tformat:/dev/ttyUSB0?model=23-bit&echo=on\" --count 0 --rate 100 --csv > log.csv",
     "100 a second into a file, until Ctrl-C; the quotes keep ? and & from the shell"},
    {"absenc read \"sim:tformat?motion=rpm=60\" --count 0", "a virtual encoder that turns, without hardware"},
}};

}  // namespace

const Subcommand read_subcommand{
    "read",
    "read the position, the turns and the alarms",
    "Readings go to standard output, messages to standard error. What the encoder says is not valid is\n"
    "shown as INVALID, what nobody has reported as unknown; in JSON and CSV the _valid fields say so: false,\n"
    "and null or empty. There the angle is then null or empty too. Alarms are [] or none only where the\n"
    "encoder has reported all of them clear, and null or empty where it has not reported them.\n"
    "In CSV, event is empty for a reading; otherwise the row stands for the error of that name that came in its\n"
    "place, or for the port: lost, back.\n"
    "Endless reading (--count 0) shows the speed of a shaft that turns: its mean since an earlier reading, with the\n"
    "most that it can be off the true mean (12.0 ± 0.3 rpm); none while the times of the readings leave much open.\n"
    "Linear encoders, those with a unit_um, have millimetres and micrometres in place of degrees.\n"
    "Settings of the port: baud=RATE, rs485=auto|on|off|rts, latency=MS, echo=auto|on|off; of sim also\n"
    "motion=, singleturn=, multiturn=, alarm=, fault=. `absenc list <protocol>` shows the protocol's options.\n"
    "Exit status 1 when a reading failed; endless reading is judged by its last one.",
    read_parameters,
    read_examples,
    run_read};

}  // namespace absenc::tool
