// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/encoder.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/reading_text.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

namespace {

enum class Format : std::uint8_t { human, json, csv };

/// Shows readings and failures as they come, and keeps quiet about what was said already.
class Display {
 public:
  Display(Encoder& encoder, Format format) : encoder_(&encoder), format_(format), start_(encoder.now()) {
    if (format == Format::csv) print_line(csv_header);
  }

  void show(const Outcome& outcome) {
    if (outcome.error != Error::none) return show_trouble(outcome);
    last_trouble_ = Error::none;
    if (outcome.reading == nullptr) throw ToolFailure("the encoder's reply carries no position");
    show_reading(*outcome.reading);
  }

 private:
  void show_reading(Reading reading) {
    const Unit& unit = encoder_->unit();
    const bool doubtful = reading.ready && reading.singleturn_valid() && !encoder_->confirmed();
    if (doubtful) {
      reading.singleturn_valid_bits = 0;
      reading.multiturn_valid = false;
      if (!told_doubt_) print_message("no two readings in a row agree as well as the fastest shaft allows");
    }
    told_doubt_ = doubtful;
    const double seconds = std::chrono::duration<double>(reading.latched - start_).count();
    if (format_ == Format::json) return print_line(to_json(unit, reading, seconds, encoder_->confirmed()).line());
    if (format_ == Format::csv) return print_line(to_csv(unit, reading, seconds));
    print_line(to_text(unit, reading));
    if (reading.alarms != alarms_) {
      print_note(reading.alarms != 0 ? alarms_in_words(unit, reading) : "  the alarms are gone");
      alarms_ = reading.alarms;
    }
  }

  void show_trouble(const Outcome& outcome) {
    Trouble trouble = encoder_->trouble(outcome);
    if (format_ == Format::json) return print_line(trouble.json().line());
    if (trouble.error == last_trouble_) trouble.advice.clear();
    last_trouble_ = trouble.error;
    print_message(trouble.text());
  }

  Encoder* encoder_;
  Format format_;
  Time start_;
  std::uint32_t alarms_ = 0;
  bool told_doubt_ = false;
  Error last_trouble_ = Error::none;
};

/// Times of equal distance that do not drift: one that was missed is skipped.
class Pace {
 public:
  explicit Pace(double rate) : period_(rate > 0 ? static_cast<std::int64_t>(1e9 / rate) : 0), next_(os::now()) {}

  void wait() {
    if (period_ == Time{}) return;
    next_ += period_;
    const Time late = os::now() - next_;
    if (late > Time{}) next_ += late / period_ * period_;
    os::sleep_until(next_);
  }

 private:
  Time period_;
  Time next_;
};

struct Tally {
  std::uint64_t good = 0;
  std::uint64_t bad = 0;
  bool last_good = false;
};

void read_all(Encoder& encoder, Display& display, std::uint64_t count, double rate, Tally& tally) {
  Pace pace(rate);
  for (std::uint64_t i = 0; count == 0 || i < count; ++i) {
    if (i > 0) pace.wait();
    if (os::interrupted()) throw os::Interrupted{};
    const Outcome outcome = encoder.read();
    tally.last_good = outcome.error == Error::none;
    ++(tally.last_good ? tally.good : tally.bad);
    display.show(outcome);
  }
}

int run_read(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderUri uri = parse_encoder(invocation.text("encoder"), invocation.texts("--option"));
  const auto count = static_cast<std::uint64_t>(invocation.number("--count", 1, 0, INT64_MAX));
  const double rate = invocation.real("--rate", 10, 0, 1e6);
  if (invocation.has("--json") && invocation.has("--csv")) throw UsageError("--json and --csv exclude each other");
  const Format format = invocation.has("--json") ? Format::json : invocation.has("--csv") ? Format::csv : Format::human;

  const std::unique_ptr<Encoder> encoder = Encoder::open(uri);
  Display display(*encoder, format);
  Tally tally;
  if (count != 0) {
    read_all(*encoder, display, count, rate, tally);
    return tally.bad == 0 ? exit_good : exit_failed;
  }
  const Time start = os::now();
  const auto summarize = [&] {
    print_message(fmt::format("{} good readings and {} failed ones in {}; exchanges: {}", tally.good, tally.bad,
                              to_text(os::now() - start), summary(encoder->counters())));
  };
  try {
    read_all(*encoder, display, 0, rate, tally);
  } catch (const os::Interrupted&) {
    summarize();
    return tally.last_good ? exit_good : exit_failed;
  } catch (const os::Failure&) {
    summarize();
    throw;
  }
  return exit_failed;
}

constexpr std::array<Parameter, 6> parameters{{
    {"encoder", "", "PROTOCOL:PORT, PROTOCOL:tcp:HOST:PORT or sim:PROTOCOL, with ?NAME=VALUE&NAME=VALUE behind it", "",
     true},
    {"--count", "N", "how many readings; 0: until Ctrl-C", "1"},
    {"--rate", "HZ", "readings a second; 0: as many as the line allows", "10"},
    {"--json", "", "one JSON object a line, failures too"},
    {"--csv", "", "comma-separated values with a header"},
    {"--option", "NAME=VALUE", "sets an option of the protocol or of the port, as behind the encoder", "", false, true},
}};

constexpr std::array<Example, 3> examples{{
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
    "shown as INVALID, and in JSON and CSV by the _valid fields; there the angle is then null or empty.\n"
    "Settings of the port: baud=RATE, rs485=auto|on|off, latency=MS, echo=auto|on|off; of sim also\n"
    "motion=, singleturn=, multiturn=, alarm=, fault=. `absenc list <protocol>` shows the protocol's options.\n"
    "Exit status 1 when a reading failed; endless reading is judged by its last one.",
    parameters,
    examples,
    run_read};

}  // namespace absenc::tool
