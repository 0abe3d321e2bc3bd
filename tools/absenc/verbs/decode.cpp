// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "absenc/capture/annotate/judge.hpp"
#include "absenc/client/captures/run.hpp"
#include "absenc/client/captures/sequence_watch.hpp"
#include "absenc/client/port/diagnosis.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/file_name.hpp"
#include "tools/absenc/bug_report.hpp"
#include "tools/absenc/capture_choices.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/annotation_text.hpp"
#include "tools/absenc/text/bit_text.hpp"
#include "tools/absenc/text/capture_statistics.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"
#include "tools/absenc/text/reading_text.hpp"

namespace absenc::tool {

namespace {

WireFrame frame_of(const Unit& unit, const Invocation& invocation, std::string_view option) {
  if (!invocation.has(option)) return {};
  return parse_wire_text(unit.link, option, invocation.text(option));
}

int decode_one(const Invocation& invocation, const Unit& unit, const Options& options) {
  const WireFrame request = frame_of(unit, invocation, "--request");
  const WireFrame reply = frame_of(unit, invocation, "--hex");
  if (invocation.has("--hex") && reply.frame().empty()) {
    throw UsageError("--hex is empty: a reply has at least one byte; without --hex the request itself is decoded");
  }
  if (request.frame().empty() && reply.frame().empty()) {
    throw UsageError(
        "there is nothing to decode: name a capture, or give one frame with --hex, and what was asked "
        "with --request");
  }

  const bool json = invocation.has("--json");
  capture::Judge judge(unit, options);
  const Error error = judge.decode(request.frame(), reply.frame());
  if (error == Error::none) {
    const capture::Contents contents = judge.contents();
    const bool bits = invocation.has("--bits");
    const FieldPlaces places(unit, options, request.frame(), reply.frame(), contents);
    if (json) {
      JsonFields fields;
      for (const FieldValue& field : contents.fields) fields.put(field);
      Json good = Json::object().set("protocol", unit.id).set("ok", true).set("fields", fields.fields);
      if (bits) good.set("bits", places.json());
      if (contents.reading != nullptr) set_state(good, unit, *contents.reading);
      print_line(good.line());
    } else {
      FieldTable rows;
      for (const FieldValue& field : contents.fields) rows.put(field);
      if (contents.reading != nullptr) rows.put_reading(*contents.reading);
      if (bits) places.add_to(rows.rows);
      print_line(table(rows.rows));
    }
    return exit_good;
  }
  const std::string message = sentence_for(unit, options, error, request.frame(), reply.frame());
  if (json) {
    print_line(Json::object()
                   .set("protocol", unit.id)
                   .set("ok", false)
                   .set("error", text_of(error).name)
                   .set("message", message)
                   .line());
  } else {
    print_message(fmt::format("{}: {}", text_of(error).name, message));
  }
  return exit_failed;
}

// ---- Decoding of a whole capture

constexpr std::array<std::string_view, 7> capture_options{"--channel", "--baud", "--parity", "--raw-channels",
                                                          "--rate",    "--csv",  "--stats"};

// Counts the annotations of a capture, and forwards them to the printer if there is one.
struct Counted final : capture::AnnotationSink {
  Counted(CaptureStatistics& all, AnnotationPrinter* some) : statistics(all), printer(some) {}
  void put(const capture::Annotation& annotation) override {
    statistics.put(annotation);
    if (printer != nullptr) printer->put(annotation);
  }
  CaptureStatistics& statistics;
  AnnotationPrinter* printer;
};

// Prints each damage of the capture file. Returns whether data is missing because of one.
bool tell_damages(const CaptureOutcome& outcome, const TickClock& clock) {
  bool damaged = false;
  for (const capture::Damage& damage : outcome.damages) {
    print_message(to_text(damage, clock));
    damaged = damaged || !damage.note;
  }
  return damaged;
}

int decode_capture(const Invocation& invocation, const Unit& unit, const Options& asked_for) {
  const bool statistics_only = invocation.has("--stats");
  const bool json = invocation.has("--json");
  if (json && invocation.has("--csv")) throw UsageError("--json and --csv cannot be given together");
  if (invocation.has("--bits") && (statistics_only || invocation.has("--csv"))) {
    throw UsageError("--bits is about each frame: with --json or as text, without --stats and --csv");
  }
  if (statistics_only && invocation.has("--csv")) throw UsageError("--stats is text or, with --json, an object");

  CaptureRun run(unit, asked_for, capture_choices(invocation, invocation.text("file")));
  const Options& options = run.settle_options();
  const TickClock clock(run.ticks_per_second());
  CaptureStatistics statistics(unit, options, clock);
  const AnnotationFormat format = json                      ? AnnotationFormat::json
                                  : invocation.has("--csv") ? AnnotationFormat::csv
                                                            : AnnotationFormat::text;
  AnnotationPrinter printer(unit, options, clock, format, invocation.has("--bits") ? ShowBits::yes : ShowBits::no);
  Counted counted(statistics, statistics_only ? nullptr : &printer);
  SequenceWatch watched(counted);
  Progress progress;
  const bool live = invocation.text("file") == "-";
  const CaptureOutcome outcome = run.run(watched, [&](capture::Tick tick) {
    if (live && !statistics_only) printer.flush();
    if (statistics_only && progress.visible()) {
      progress.show(
          fmt::format("{} {}, {} errors", clock.has_time() ? "second" : "tick", clock.text(tick), statistics.errors()));
    }
  });
  progress.clear();
  if (!statistics_only) printer.flush();
  if (statistics_only) print_line(json ? statistics.json(outcome).line() : statistics.text(outcome));
  for (const std::string& note : outcome.notes) print_message(fmt::format("note: {}", note));
  const bool damaged = tell_damages(outcome, clock);
  if (statistics.good() == 0) {
    print_message(
        fmt::format("no good frame of {} is in the capture: check the channel, the protocol{} and its options", unit.id,
                    outcome.baud.empty() ? "" : ", --baud"));
    return exit_failed;
  }
  return damaged || statistics.errors() != 0 ? exit_failed : exit_good;
}

// Identifies the protocol of a capture for a user who named none. Returns exit_usage even if a protocol was found.
int identify_instead(std::string_view file) {
  print_message(fmt::format("the protocol is missing before {}: it is looked for", file));
  Invocation search;
  search.add("where", std::string(file));
  identify_subcommand.run(search);
  return exit_usage;
}

int run_decode(const Invocation& invocation) {
  if (invocation.has("file") && find_unit(invocation.text("file")) != nullptr &&
      find_unit(invocation.text("protocol")) == nullptr) {
    throw UsageError(fmt::format("the protocol comes first, then the capture: absenc decode {} {}",
                                 invocation.text("file"), invocation.text("protocol")));
  }
  const std::string_view first = invocation.text("protocol");
  std::error_code error;
  if (!invocation.has("file") && std::filesystem::is_regular_file(os::path_of(first), error) &&
      is_report(std::string(first))) {
    for (const std::string_view option : {"--json", "--csv", "--stats", "--bits"}) {
      if (invocation.has(option)) {
        throw UsageError(
            fmt::format("{} is about a capture, but {} is a report: doctor.json in this zip archive is for programs",
                        option, first));
      }
    }
    return show_report(std::string(first));
  }
  if (!invocation.has("file") && find_unit(first) == nullptr && std::filesystem::exists(os::path_of(first), error)) {
    return identify_instead(first);
  }
  const bool is_path = first.find_first_of("./\\") != std::string_view::npos;
  if (is_path && find_unit(first) == nullptr && !std::filesystem::exists(os::path_of(first), error)) {
    throw Failure(fmt::format(
        "{} does not exist: name the file of a capture, or of a report of `absenc doctor --report`", first));
  }
  const Unit& unit = require_unit(first);
  const Options options = require_options(unit, invocation.text("--model"), invocation.texts("--option"));
  const bool one = invocation.has("--hex") || invocation.has("--request");
  if (invocation.has("--bits") && unit.bits == nullptr) {
    throw UsageError(fmt::format("{} does not say where in a frame its fields stand", unit.id));
  }
  if (invocation.has("file")) {
    if (one) throw UsageError("a capture and --hex or --request cannot be given together");
    return decode_capture(invocation, unit, options);
  }
  for (const std::string_view option : capture_options) {
    if (invocation.has(option)) throw UsageError(fmt::format("{} is about a capture: name its file", option));
  }
  return decode_one(invocation, unit, options);
}

constexpr std::array<Parameter, 15> decode_parameters{{
    parameter::protocol,
    {"file", "",
     "a capture: a sigrok session, VCD, CSV or binary export of a logic analyser, a log of candump, bytes "
     "as text; - for text from standard input"},
    {"--hex", "FRAME",
     "one reply instead: hexadecimal bytes with or without spaces, commas and 0x; a CAN frame as ID:DATA; "
     "a clocked word as a string of 0 and 1"},
    {"--request", "FRAME", "the request it answers; without --hex the request itself is decoded"},
    {"--channel", "[WIRE=]NAME",
     "which channel is which wire: line; host and device; clock and data; clock, miso, mosi and cs; also with commas "
     "between",
     "by their names", false, true},
    {"--baud", "RATE", "of the line", "the protocol's own, or found from the capture"},
    {"--parity", "none|odd|even", "of its characters", "the protocol's own, or found from the capture"},
    {"--raw-channels", "COUNT", "the file is raw samples of so many channels, channel 0 in bit 0"},
    {"--rate", "HZ", "samples a second, where the file does not tell"},
    {"--stats", "", "only what it comes to: counts, errors, turn-around times, the way of the position"},
    {"--csv", "", "a line for each exchange"},
    {"--bits", "",
     "also where in the reply each field stands: bit 0 is the least significant of the first byte, on clocked links "
     "the first on the wire"},
    parameter::model,
    parameter::protocol_option,
    {"--json", "", "one JSON object; of a capture one a line"},
}};

constexpr std::array<Example, 6> decode_examples{{
    {"absenc decode tformat --request 1A --hex \"1A 00 45 23 01 11 34 12 00 00 4A\"",
     "a position, its turns and alarms"},
    {"absenc decode tformat --hex 0200cdab0165 --option strict=false --bits", "the same, and which bits they are"},
    {"absenc decode tformat --hex 0200cdab0165 --option strict=false --json", "without the request, for a program"},
    {"absenc decode tformat drive.sr --channel D0 --stats", "what an hour of a line under load comes to"},
    {"absenc decode bug.zip", "a report of `absenc doctor --report`"},
    {"absenc decode ssi probe.vcd --channel clock=D0,data=D1 --option bits=17", "each word of a clocked encoder"},
}};

}  // namespace

const Subcommand decode_subcommand{
    "decode",
    "say what a captured frame or a whole capture means, or what is wrong with it",
    "Every check that the protocol allows is made: the first that fails names the error.\n"
    "In a capture, requests are paired with their replies; who speaks is found by what is said. Alarms that a\n"
    "reply does not carry are those that an earlier reply of the same encoder has reported, which is taken to stay\n"
    "switched on; what no reply has reported is unknown.\n"
    "Exit status 1 for a bad frame, a damaged file, or a capture without any good frame.",
    decode_parameters,
    decode_examples,
    run_decode};

}  // namespace absenc::tool
