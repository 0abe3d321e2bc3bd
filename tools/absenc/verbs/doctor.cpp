// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/bug_report.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/identify_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"

namespace absenc::tool {

namespace {

std::string finding_text(const Finding& one) {
  return fmt::format("{}: {}: {}\n  Likely: {}\n  Try: {}\n", name_of(one.severity), one.id, one.evidence, one.cause,
                     one.action);
}

// Returns the address of the likeliest encoder on a port. Throws if no encoder was found, or only one that may be a
// chance match.
std::string identified(const std::string& port, Progress& progress) {
  LineSearch search = parse_search(port);
  search.limit = std::chrono::seconds(60);
  search.progress = [&](const std::string& what) { progress.show(what); };
  const LineFindings findings = search_line(search);
  progress.clear();
  if (findings.interrupted) throw os::Interrupted{};
  if (findings.candidates.empty()) {
    throw Failure(fmt::format("which encoder is on {}? {}", search.place, advice_for(findings, search)));
  }
  const Candidate& best = findings.candidates.front();
  const std::string address = address_of(best, search.place);
  if (!is_found(best)) {
    throw Failure(
        fmt::format("which encoder is on {0}? It may be {1}, but what came may be chance\n"
                    "  Try: turn the shaft a little while it is asked; `absenc doctor \"{2}\"`, which examines it "
                    "as {1}",
                    search.place, best.unit->id, address));
  }
  print_message(fmt::format("{}: this is examined", address));
  return address;
}

int run_doctor(const Invocation& invocation) {
  os::catch_interrupts();
  Progress progress;
  const std::string_view written = invocation.text("encoder");
  const std::optional<std::string> port = bare_port(written);
  const std::string encoder = port ? identified(*port, progress) : std::string(written);
  const EncoderAddress address = parse_address(encoder, invocation.texts("--option"));
  const auto seconds = [&](std::string_view name, double fallback, double least) {
    const std::chrono::duration<double> time(invocation.real(name, fallback, least, 3600));
    return std::chrono::duration_cast<Time>(time);
  };
  const std::string report_path(invocation.text("--report"));
  if (invocation.has("--report") && !invocation.has("--force") && std::filesystem::exists(os::path_of(report_path))) {
    throw UsageError(fmt::format("{} exists: give another name, or --force to replace it", report_path));
  }
  DoctorChoices choices;
  choices.readings = static_cast<std::size_t>(invocation.number("--readings", 100'000, 10, 1'000'000));
  choices.limit = seconds("--for", 3, 0.1);
  choices.turning = seconds("--turn", 0, 0);
  choices.progress = [&](const std::string& what) { progress.show(what); };
  using SerialNumbers = ReportedExchanges::SerialNumbers;
  const auto serial_numbers = invocation.has("--serial-numbers") ? SerialNumbers::shown : SerialNumbers::masked;
  ReportedExchanges exchanges(*address.unit, address.options, serial_numbers);
  if (invocation.has("--report")) choices.exchanged = [&](const DoctorExchange& one) { exchanges.add(one); };
  const Examination examination = examine(address, choices);
  progress.clear();
  if (invocation.has("--json")) {
    print_line(to_json(examination).line());
  } else {
    std::string text;
    for (const Finding& one : examination.findings) text += finding_text(one);
    print_line(text + examination.verdict());
  }
  if (invocation.has("--report")) {
    const BugReport report = make_report(address, examination, exchanges, serial_numbers);
    print_note(
        fmt::format("The report holds this, and in exchanges.txt the exchanges themselves:\n\n{}", report.summary));
    write_report(report_path, report);
    print_message(fmt::format("{} is written; `absenc decode {}` shows all of it", report_path, report_path));
  }
  return examination.healthy() ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 9> doctor_parameters{{
    parameter::encoder,
    {"--for", "SECONDS", "how long it reads, as fast as it can", "3"},
    {"--readings", "N", "it ends after so many readings", "100000"},
    {"--turn", "SECONDS",
     "then look on while you turn the shaft by hand: a position that stands, jumps, turns that do not fit it, missing "
     "codes",
     "0"},
    {"--report", "FILE.zip",
     "also write a report for those who correct absenc: versions, adapter, settings, findings, the last thousand "
     "exchanges; what it holds is shown first"},
    {"--force", "", "replace the file of --report if it exists"},
    {"--serial-numbers", "", "do not mask serial numbers in the report"},
    parameter::json,
    parameter::option,
}};

constexpr std::array<Example, 5> doctor_examples{{
    {"absenc doctor /dev/ttyUSB0", "which encoder is there, and what is wrong with it"},
    {"absenc doctor tformat:/dev/ttyUSB0", "what is wrong with it, or with the way to it"},
    {"absenc doctor tformat:/dev/ttyUSB0 --report bug.zip",
     "the same as a file to send; `absenc decode bug.zip` shows it"},
    {"absenc doctor tformat:/dev/ttyUSB0 --turn 10", "also while the shaft is turned by hand"},
    {"absenc doctor \"sim:tformat?fault=corrupt=0.1\" --json", "a virtual encoder on a bad line, for programs"},
}};

}  // namespace

const Subcommand doctor_subcommand{
    "doctor",
    "say what is wrong with an encoder, or with the way to it, and what to do",
    "A port without a protocol is identified first. Then looks from the port up: whether it is there, may be\n"
    "opened and is nobody else's; whether the line is silent until it is asked; whether anything answers, and if\n"
    "not, as another model, at another rate, SPI mode, clock or address, or in another protocol; what damaged replies\n"
    "look like, and what adapters do to bytes; what the encoder reports; whether position and turns are quiet and go\n"
    "no faster than a shaft can. Each finding has what was seen, what is likely behind it and what to do. The last\n"
    "line says good, or the first thing to mend. Nothing is ever written to the encoder.\n"
    "Exit status 1 when something is to be mended.",
    doctor_parameters,
    doctor_examples,
    run_doctor};

}  // namespace absenc::tool
