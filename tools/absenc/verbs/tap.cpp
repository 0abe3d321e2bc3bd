// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "absenc/client/tap/request_rates.hpp"
#include "absenc/client/tap/tap_run.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/annotation_text.hpp"
#include "tools/absenc/text/capture_statistics.hpp"
#include "tools/absenc/text/identify_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"

namespace absenc::tool {

namespace {

using capture::Annotation;

constexpr std::string_view requests_missing =
    "only replies came: this is the encoder's pair of a line with two pairs, or its requests are damaged\n"
    "  Try: a second receiver on the host's pair, with a second `absenc tap`";
constexpr std::string_view replies_missing =
    "only requests came: this is the host's pair of a line with two pairs, or the encoder does not answer\n"
    "  Try: a second receiver on the encoder's pair, with a second `absenc tap`; is the encoder switched on?";

// Counts annotations and measures the rates of requests. Forwards the annotations to the printer, if there is one.
struct TapCounts final : capture::AnnotationSink {
  TapCounts(const Unit& unit, const Options& options, const TickClock& clock, AnnotationPrinter* some)
      : statistics(unit, options, clock), rates(unit, options), printer(some) {}
  void put(const Annotation& annotation) override {
    statistics.put(annotation);
    rates.put(annotation);
    has_alarms = has_alarms || raises_alarm(annotation);
    pairs += annotation.kind == Annotation::Kind::exchange ? 1 : 0;
    requests += annotation.kind == Annotation::Kind::request ? 1 : 0;
    replies += annotation.kind == Annotation::Kind::reply && annotation.error == Error::none ? 1 : 0;
    if (printer != nullptr) printer->put(annotation);
  }
  CaptureStatistics statistics;
  RequestRates rates;
  AnnotationPrinter* printer;
  bool has_alarms = false;
  std::uint64_t pairs = 0, requests = 0, replies = 0;
};

std::string rates_text(const Unit& unit, const RequestRates& rates) {
  std::vector<std::vector<std::string>> rows{{"request", "first", "count", "a second", "bad or unanswered"}};
  for (const RequestRates::RequestKind& kind : rates.kinds()) {
    const double rate = kind.per_second();
    rows.push_back({kind.name.empty() ? "of no command" : kind.name, to_wire_text(unit.link, {.bytes = kind.first}),
                    fmt::format("{}", kind.count), rate == 0 ? "" : fmt::format("{:.1f}", rate),
                    fmt::format("{}", kind.errors)});
  }
  return rows.size() == 1 ? "" : '\n' + table(rows);
}

Json rates_json(const Unit& unit, const RequestRates& rates) {
  return Json::list(rates.kinds(), [&](const RequestRates::RequestKind& kind) {
    return Json::object()
        .set("command", kind.name.empty() ? Json() : Json(kind.name))
        .set("request", to_compact_wire_text(unit.link, {.bytes = kind.first}))
        .set("count", kind.count)
        .set("errors", kind.errors)
        .set("per_second", kind.per_second());
  });
}

TapChoices choices_of(const Invocation& invocation) {
  TapChoices choices;
  choices.protocol = invocation.text("protocol");
  choices.model = invocation.text("--model");
  choices.options.assign(invocation.texts("--option").begin(), invocation.texts("--option").end());
  choices.record = invocation.text("--record");
  choices.replaces = invocation.has("--force");
  if (invocation.has("--for")) {
    choices.duration = Time(static_cast<std::int64_t>(1e9 * invocation.real("--for", 0, 0.001, 1e9)));
  }
  return choices;
}

void introduce_tap(const TapRun& run) {
  for (const std::string& note : run.receiver().notes()) print_message(fmt::format("note: {}", note));
  print_message(fmt::format(
      "listening on {}; nothing is sent\n"
      "  Times are those of arrival at this computer, up to {} late by the adapter, more on a busy computer. Shorter\n"
      "  pauses cannot be seen, nor how fast the encoder answers: frames are told apart by length and content.",
      run.receiver().place(), tool::to_text(run.receiver().latency())));
}

// Identifies the protocol of the tapped line, unless the user has given it. Returns false if none was found.
bool settle_tap(TapRun& run, bool is_given) {
  Progress progress;
  const bool settled = run.settle([&](const std::string& text) { progress.show(text); });
  progress.clear();
  for (const std::string& note : run.notes()) print_message(fmt::format("note: {}", note));
  if (settled && is_given) return true;
  if (settled) {
    std::string settings;
    for (const std::string& one : settings_for(run.unit(), run.options())) settings += fmt::format(" --option {}", one);
    print_message(fmt::format("{} explains what is said{}", run.unit().id,
                              settings.empty() ? "" : fmt::format(", with{}", settings)));
    const auto equal = std::count_if(run.candidates().begin(), run.candidates().end(),
                                     [&](const Candidate& one) { return is_as_likely(one, run.candidates().front()); });
    if (equal > 1) {
      print_message(
          fmt::format("note: {} protocols or models explain it equally well: this is the first of them", equal));
    }
    return true;
  }
  if (run.received_bytes() == 0) {
    print_message(
        "nothing came\n"
        "  Try: is the drive switched on, and does it ask the encoder? A and B swapped; ground; the receiver enabled");
  } else {
    print_message(fmt::format(
        "{} bytes came, but no protocol explains them\n"
        "  Try: the baud rate, as in {}?baud=9600; A and B swapped, which makes every byte wrong; say the protocol\n"
        "  behind the port to see its damaged frames",
        run.received_bytes(), run.receiver().place().substr(0, run.receiver().place().find(' '))));
  }
  return false;
}

void summarize_tap(const TapCounts& counted, const TapRun& run, AnnotationFormat format) {
  CaptureOutcome outcome;
  if (format == AnnotationFormat::json) {
    Json summary = counted.statistics.json(outcome);
    summary.set("per_request", rates_json(run.unit(), counted.rates)).set("bytes", run.outcome().bytes);
    print_line(Json::object().set("summary", summary).line());
    return;
  }
  const std::string text = counted.statistics.text(outcome) + rates_text(run.unit(), counted.rates);
  if (format == AnnotationFormat::text) return print_line('\n' + text);
  print_note(text);
}

int run_tap(const Invocation& invocation) {
  os::catch_interrupts();
  const bool statistics_only = invocation.has("--stats");
  const bool json = invocation.has("--json");
  if (json && invocation.has("--csv")) throw UsageError("--json and --csv cannot be given together");
  if (statistics_only && invocation.has("--csv")) throw UsageError("--stats is text or, with --json, an object");
  if (invocation.has("--force") && !invocation.has("--record")) {
    throw UsageError("--force is about the file of --record");
  }
  const AnnotationFormat format = json                      ? AnnotationFormat::json
                                  : invocation.has("--csv") ? AnnotationFormat::csv
                                                            : AnnotationFormat::text;
  TapRun run(invocation.text("port"), choices_of(invocation));
  introduce_tap(run);
  if (!settle_tap(run, run.is_protocol_given())) return exit_failed;
  const TickClock clock(arrival_ticks_per_second);
  AnnotationPrinter printer(run.unit(), run.options(), clock, format, ShowBits::no, MarkAlarms::yes);
  TapCounts counted(run.unit(), run.options(), clock, statistics_only ? nullptr : &printer);
  run.begin(counted);
  Progress progress;
  while (run.advance()) {
    if (!statistics_only) printer.flush();
    if (statistics_only && progress.visible()) {
      progress.show(fmt::format("{} exchanges, {} errors", counted.pairs, counted.statistics.errors()));
    }
  }
  progress.clear();
  if (!statistics_only) printer.flush();
  summarize_tap(counted, run, format);
  const TapOutcome outcome = run.outcome();
  if (!outcome.problem.empty()) print_message(outcome.problem);
  if (outcome.dropped != 0) {
    print_message(fmt::format("{} bytes were received and not looked at: what was printed was taken too slowly",
                              outcome.dropped));
  }
  if (counted.pairs == 0 && counted.replies != 0) print_message(requests_missing);
  if (counted.pairs == 0 && counted.replies == 0 && counted.requests != 0) print_message(replies_missing);
  if (counted.statistics.count() == 0) {
    print_message("nothing came\n  Try: does the drive ask the encoder? A and B swapped; ground; the receiver enabled");
  }
  const bool whole = outcome.problem.empty() && outcome.dropped == 0;
  return whole && counted.statistics.good() != 0 && counted.statistics.errors() == 0 ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 10> tap_parameters{{
    {"port", "",
     "a serial port or tcp:HOST:PORT, with ?baud=RATE&parity=none|odd|even&latency=MS behind it where they differ from "
     "the protocol's; - for raw bytes from standard input",
     "", true},
    {"protocol", "", "see `absenc list`; without it, found out from what is said"},
    {"--for", "SECONDS", "end after this time", "until Ctrl-C, or the end of the input"},
    {"--record", "FILE", "also write each frame to it, with its time, for `absenc decode`; it must not exist yet"},
    {"--force", "", "replace the file of --record if it exists"},
    {"--stats", "", "only the summary"},
    {"--csv", "", "a line for each exchange"},
    parameter::model,
    parameter::protocol_option,
    {"--json", "", "one JSON object a line, and at the end one with the summary"},
}};

constexpr std::array<Example, 4> tap_examples{{
    {"absenc tap /dev/ttyUSB0", "whose frames they are, then what drive and encoder say"},
    {"absenc tap /dev/ttyUSB0 tformat --record drive.txt", "also for `absenc decode tformat drive.txt`"},
    {"absenc tap /dev/ttyUSB0?baud=115200 raa38-modbus --stats --for 60", "what a minute comes to"},
    {"nc 192.168.1.20 4001 | absenc tap - tformat", "raw bytes that another program receives"},
}};

}  // namespace

const Subcommand tap_subcommand{
    "tap",
    "listen to a drive and its encoder without asking: show what they say, live",
    "A receive-only adapter sits on the pair between both. The port is opened without writing: nothing is sent. Each\n"
    "exchange is shown as soon as it is whole, as `absenc decode` shows it; ! marks alarms and errors. At the end\n"
    "comes a summary: counts, errors, how often each request is sent.\n"
    "Adapters hand on what they received up to their latency late (FTDI: 1 to 16 ms), and several frames at once. So\n"
    "shorter pauses cannot be seen, nor how fast the encoder answers: frames are told apart by length and content, "
    "and\n"
    "what is damaged is shown when the next frames tell where it ends. A logic analyser shows times: `absenc decode`.\n"
    "One receiver hears one pair. On a line with two pairs (RS-422) that is one side alone: requests without replies,\n"
    "or replies without requests.\n"
    "Of CAN: candump -L can0 | absenc decode PROTOCOL -\n"
    "Exit status 1 when something was bad, when nothing came, or when the port went away.",
    tap_parameters,
    tap_examples,
    run_tap};

}  // namespace absenc::tool
