// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "absenc/client/encoder.hpp"
#include "absenc/client/encoder/pace.hpp"
#include "absenc/client/recording.hpp"
#include "absenc/client/recording/record_file.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/parts.hpp"
#include "tools/absenc/rate.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"

namespace absenc::tool {

namespace {

/// Shows the progress of a recording once per second.
class RecordingProgress {
 public:
  void show(const Recording& recording, const Encoder& live) {
    const Time now = os::now();
    if (!progress_.visible() || now < next_) return;
    next_ = now + std::chrono::seconds(1);
    const bool connected = live.connected();
    progress_.show(fmt::format("{}: {} readings, {}, {} failures, {} bytes", to_text(now - recording.start()),
                               recording.counts().readings,
                               connected ? fmt::format("{:.1f} a second", live.rate()) : "the port is away",
                               recording.counts().failures, recording.bytes()));
  }
  void clear() { progress_.clear(); }

 private:
  Progress progress_;
  Time next_{};
};

// Prints the first restart of the position, and each loss and return of the port.
void tell(const Sample& sample, const Encoder& live, RecordingProgress& report) {
  // only the first restart is printed; the summary has the number of restarts
  if (sample.restarted && live.restarts() == 1) {
    report.clear();
    print_message(sample.message);
  }
  if (sample.kind != Sample::Kind::lost && sample.kind != Sample::Kind::back) return;
  report.clear();
  print_message(sample.kind == Sample::Kind::lost ? fmt::format("{}\n  Waiting for it to come back.", sample.message)
                                                  : sample.message);
}

RecordingSettings settings_of(const Invocation& invocation) {
  RecordingSettings settings;
  settings.path = invocation.text("--output");
  settings.encoder = invocation.text("encoder");
  settings.rate_hz = readings_a_second(invocation, 100);
  settings.every = static_cast<std::uint64_t>(invocation.number("--every", 1, 1, INT64_MAX));
  if (invocation.has("--part-size")) {
    settings.part_bytes = static_cast<std::uint64_t>(1e6 * invocation.real("--part-size", 0, 0.001, 1e9));
  }
  if (invocation.has("--part-time")) {
    settings.part_time = Time(static_cast<std::int64_t>(1e9 * invocation.real("--part-time", 0, 0.01, 1e9)));
  }
  settings.count = static_cast<std::uint64_t>(invocation.number("--count", 0, 0, INT64_MAX));
  if (invocation.has("--for")) {
    settings.duration = Time(static_cast<std::int64_t>(1e9 * invocation.real("--for", 0, 0.001, 1e9)));
  }
  return settings;
}

// Prints a summary of the recording. `whole`: no file of the recording was removed, replaced or cut.
void summarize_recording(const Recording& recording, const Encoder& live, bool whole) {
  std::string text = fmt::format("{} readings and {} failures in {} {}", recording.counts().readings,
                                 recording.counts().failures, to_text(os::now() - recording.start()),
                                 whole ? fmt::format("are in {}", recording.names()) : "were written");
  if (recording.counts().gaps != 0) {
    text += fmt::format("; {} readings that were due were not taken, in {} gap{}", recording.counts().missed,
                        recording.counts().gaps, recording.counts().gaps == 1 ? "" : "s");
  }
  if (live.restarts() != 0) {
    text += fmt::format("; the position started again {} times (event restarted): turns are only right between",
                        live.restarts());
  }
  if (live.losses() != 0) text += fmt::format("; the port went away: {}", live.losses());
  print_message(fmt::format("{}; exchanges: {}", text, exchanges_text(live.counters(), live.readings())));
}

int run_record(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), reading_settings(invocation));
  const RecordingSettings settings = settings_of(invocation);
  Encoder live = open_encoder(uri, Pace(settings.rate_hz).period());
  if (const std::string note = live.rate_note(); !note.empty()) print_message(fmt::format("note: {}", note));
  if (record_form(settings.path) == RecordForm::hdf5) load_hdf5();
  Recording recording(settings, live);
  RecordingProgress report;
  bool good = false;
  bool whole = true;
  const auto end_early = [&](std::string_view why) {
    report.clear();
    print_message(fmt::format("{}: the recording has ended{}", why, whole ? "; what is written so far is whole" : ""));
    good = false;
  };
  try {
    good = recording.run([&](const Sample& sample) {
      tell(sample, live, report);
      report.show(recording, live);
    });
  } catch (const os::Failure& failure) {
    whole = failure.kind() != os::Failure::Kind::lost;
    end_early(failure.what());
  } catch (const Failure& failure) {
    end_early(failure.what());
  }
  report.clear();
  summarize_recording(recording, live, whole);
  return good ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 11> record_parameters{{
    parameter::encoder,
    {"--output", "FILE",
     "where to; the name ends in .csv, in .jsonl for JSON lines or in .h5 for HDF5; it must not exist yet", "", true},
    {"--rate", "HZ", "readings a second; 0: as many as the line allows", "100"},
    {"--every", "N", "of N readings write one, and each with other alarms than the one before", "1"},
    {"--count", "N", "end after so many readings in the file", "until Ctrl-C"},
    {"--for", "SECONDS", "end after this time", "until Ctrl-C"},
    {"--part-size", "MEGABYTES", "begin another file when one is this large: NAME-0001.csv, NAME-0002.csv ..."},
    {"--part-time", "SECONDS", "begin another file after this time"},
    parameter::read_command,
    parameter::realtime,
    parameter::option,
}};

constexpr std::array<Example, 2> record_examples{{
    {"absenc record tformat:/dev/ttyUSB0 --output log.csv", "100 readings a second, until Ctrl-C"},
    {"absenc record tformat:/dev/ttyUSB0 --output log.jsonl --rate 1000 --every 10 --part-time 3600",
     "a file an hour, with each tenth of 1000 readings a second"},
}};

}  // namespace

const Subcommand record_subcommand{
    "record",
    "write readings to files, for hours",
    "Each file begins with the encoder, its model and options, the start time and the units. Lines are handed to\n"
    "the system as they come: nothing is lost when the command is killed, and a full disk leaves whole lines. When\n"
    "the port goes away, that is a line, the command waits for it to come back, and that is another line. Readings\n"
    "that --rate asked for and that could not be taken are a line with their number. A file that is removed or\n"
    "replaced ends the recording at once, with status 1.\n"
    "After a pause in which the shaft may have turned too far to know, the position starts again: the event of that\n"
    "reading is restarted. max_rpm=RPM (linear encoders: max_mm_s=MM/S) behind ? says how fast it may move.\n"
    "In CSV, lines before the column names begin with #. HDF5 has a dataset for each column, with its unit, meaning\n"
    "and missing_value; rows reach it four times a second, and however the command ends it can be opened.",
    record_parameters,
    record_examples,
    run_record};

}  // namespace absenc::tool
