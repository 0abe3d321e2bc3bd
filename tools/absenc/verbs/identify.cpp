// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <filesystem>
#include <optional>

#include "absenc/client/captures/identify_capture.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/protocol/all.hpp"
#include "tools/absenc/capture_choices.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/identify_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"

namespace absenc::tool {

namespace {

using capture::ObservedExchange;
using capture::ObservedFrame;

// ---- Identification from frames on the command line

ObservedFrame heard(LinkKind link, std::string_view what, std::string_view text) {
  if (text.empty()) return {};
  WireFrame frame = parse_wire_text(link, what, text);
  return {std::move(frame.bytes), frame.bits, frame.can};
}

std::vector<ObservedExchange> frames_for(const Unit& unit, const Invocation& invocation) {
  const std::span<const std::string> requests = invocation.texts("--request");
  const std::span<const std::string> replies = invocation.texts("--hex");
  std::vector<ObservedExchange> exchanges;
  for (std::size_t i = 0; i < replies.size(); ++i) {
    const std::string_view request = i < requests.size() ? std::string_view(requests[i]) : std::string_view();
    exchanges.push_back({heard(unit.link, "--request", request), heard(unit.link, "--hex", replies[i])});
    if (exchanges.back().reply.frame().empty()) throw UsageError("--hex is empty: a reply has at least one byte");
  }
  return exchanges;
}

int identify_frames(const Invocation& invocation) {
  const std::size_t requests = invocation.texts("--request").size();
  const std::size_t replies = invocation.texts("--hex").size();
  if (requests != 0 && requests != replies) {
    throw UsageError(
        fmt::format("{} --request for {} --hex: give one for each in the same order, or none; \"\" where "
                    "it is not known",
                    requests, replies));
  }
  std::vector<Candidate> candidates;
  std::optional<UsageError> unreadable;
  bool readable = false;
  std::size_t searches = 0;
  for (const Unit* unit : all_units()) {
    try {
      const std::vector<ObservedExchange> exchanges = frames_for(*unit, invocation);
      readable = true;
      ++searches;
      for (capture::Hypothesis& one : capture::find_hypotheses(*unit, {}, exchanges)) {
        candidates.push_back({unit, std::move(one), {}, false, line_of(*unit)});
      }
    } catch (const UsageError& error) {
      // The text of the frame may have the form of another kind of link; then it is no frame of this unit.
      if (!unreadable) unreadable = error;
    }
  }
  if (!readable) throw UsageError(*unreadable);
  rank(candidates, searches);
  const auto command = [&](const Candidate& candidate) {
    std::string text = decode_command(candidate);
    if (requests != 0) text += fmt::format(" --request \"{}\"", invocation.texts("--request").front());
    return text + fmt::format(" --hex \"{}\"", invocation.texts("--hex").front());
  };
  const int status = show_candidates(candidates, {}, command, invocation.has("--json"));
  if (candidates.empty()) {
    print_message(
        "no protocol explains any of these frames\n"
        "  Try: whole frames, each with its request; without the adapter's echo; a frame that is not damaged");
  }
  return status;
}

// ---- Identification of the encoder on a line

LineSearch search_of(const Invocation& invocation) {
  LineSearch search = parse_search(invocation.text("where"));
  search.limit =
      std::chrono::duration_cast<Time>(std::chrono::duration<double>(invocation.real("--for", 60, 0.1, 86'400)));
  return search;
}

int identify_line(const Invocation& invocation) {
  LineSearch search = search_of(invocation);
  Progress progress;
  search.progress = [&](const std::string& text) { progress.show(text); };
  const LineFindings findings = search_line(search);
  progress.clear();
  for (const std::string& note : findings.notes) print_message(fmt::format("note: {}", note));
  const auto command = [&](const Candidate& candidate) { return read_command(candidate, search.place); };
  const SearchNotes notes{findings.notes, !findings.interrupted && !findings.out_of_time};
  const int status = show_candidates(findings.candidates, notes, command, invocation.has("--json"));
  if (findings.interrupted) print_message("interrupted: not everything was tried");
  if (findings.out_of_time) print_message("the time is over, and not everything was tried: give more with --for");
  if (findings.candidates.empty() && !findings.interrupted) print_message(advice_for(findings, search));
  return findings.interrupted ? exit_failed : status;
}

// ---- Identification from a capture

int identify_capture(const Invocation& invocation) {
  const CaptureChoices choices = capture_choices(invocation, invocation.text("where"));
  Progress progress;
  const CaptureFindings findings = search_capture(choices, [&](const std::string& text) { progress.show(text); });
  progress.clear();
  const auto command = [&](const Candidate& candidate) {
    std::string text = decode_command(candidate) + " " + choices.path;
    for (const std::string& channel : choices.how.channels) text += " --channel " + channel;
    if (choices.how.raw_channels != 0) text += fmt::format(" --raw-channels {}", choices.how.raw_channels);
    if (choices.how.samples_per_second != 0) text += fmt::format(" --rate {}", choices.how.samples_per_second);
    if (choices.how.baud > 0) text += fmt::format(" --baud {}", choices.how.baud);
    return invocation.has("--parity") ? text + fmt::format(" --parity {}", invocation.text("--parity")) : text;
  };
  std::vector<std::string> notes = findings.damages;
  if (findings.candidates.empty()) notes.insert(notes.end(), findings.refusals.begin(), findings.refusals.end());
  const int status = show_candidates(findings.candidates, {notes}, command, invocation.has("--json"));
  for (const std::string& note : notes) print_message(fmt::format("note: {}", note));
  if (findings.candidates.empty()) {
    print_message(
        "no protocol explains anything in the capture\n"
        "  Try: which channel is which wire, with --channel; --baud; a capture with at least four samples a bit");
  }
  return status;
}

// Returns whether `where` names a file, or a folder such as a logic analyser's export.
bool is_capture(std::string_view where) {
  std::error_code error;
  const std::filesystem::path path = os::path_of(where);
  return std::filesystem::is_regular_file(path, error) || std::filesystem::is_directory(path, error);
}

// Throws Failure if no such file exists and `where` looks like the name of a file, not of a port.
void refuse_missing_file(std::string_view where) {
  const std::filesystem::path path = os::path_of(where);
  std::error_code error;
  if (where.find(':') != std::string_view::npos || where.find('?') != std::string_view::npos || !path.has_extension()) {
    return;
  }
  if (where.starts_with("/dev/") || std::filesystem::exists(path, error)) return;
  std::vector<std::string> files;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    files.push_back(path.has_parent_path() ? os::name_of(entry.path()) : os::name_of(entry.path().filename()));
  }
  const std::vector<std::string_view> names(files.begin(), files.end());
  const std::string_view near = nearest(where, names);
  throw Failure(fmt::format("there is no file {}, and no port of that name{}", where,
                            near.empty() ? "" : fmt::format("; did you mean {}?", near)));
}

int run_identify(const Invocation& invocation) {
  os::catch_interrupts();
  const bool frames = invocation.has("--hex") || invocation.has("--request");
  if (frames == invocation.has("where")) {
    throw UsageError(
        fmt::format("give one of: a port, as {}; a capture file; captured frames with --hex", os::example_port()));
  }
  if (frames && !invocation.has("--hex")) throw UsageError("requests alone do not tell: give the replies with --hex");
  if (frames) return identify_frames(invocation);
  if (is_capture(invocation.text("where"))) return identify_capture(invocation);
  refuse_missing_file(invocation.text("where"));
  for (const std::string_view option : {"--channel", "--baud", "--parity", "--raw-channels", "--rate"}) {
    if (invocation.has(option)) throw UsageError(fmt::format("{} is about a capture: name its file", option));
  }
  return identify_line(invocation);
}

constexpr std::array<Parameter, 10> identify_parameters{{
    {"where", "",
     "a port: /dev/ttyUSB0, tcp:HOST:PORT, spi:/dev/spidev0.0, ftdi, can0 or slcan:/dev/ttyACM0, with its settings "
     "behind ?; "
     "or a capture file, as for `absenc decode`"},
    {"--hex", "FRAME", "instead: a reply that was captured, as for `absenc decode`", "", false, true},
    {"--request", "FRAME", "what it answers, one for each --hex in the same order; \"\": not known", "", false, true},
    {"--for", "SECONDS", "end the search on a port after that time", "60"},
    {"--channel", "[WIRE=]NAME", "of a capture: which channel is which wire", "by their names", false, true},
    {"--baud", "RATE", "of the line in a capture", "the protocol's own, or found from the capture"},
    {"--parity", "none|odd|even", "of its characters", "the protocol's own, or found from the capture"},
    {"--raw-channels", "COUNT", "the file is raw samples of so many channels, channel 0 in bit 0"},
    {"--rate", "HZ", "samples a second, where the file does not tell"},
    parameter::json,
}};

constexpr std::array<Example, 4> identify_examples{{
    {"absenc identify /dev/ttyUSB0", "asks in every protocol and says how to go on"},
    {"absenc identify \"tcp:192.168.1.20:4001?latency=50\" --json", "behind a slow serial server, for a program"},
    {"absenc identify drive.sr --channel D0", "whose frames are in a capture, and how to decode it"},
    {"absenc identify --request 1A --hex \"1A 00 45 23 01 11 34 12 00 00 4A\"", "whose frame is this?"},
}};

}  // namespace

const Subcommand identify_subcommand{
    "identify",
    "find out which encoder is on a line, or whose frames were captured",
    "On a port: listens, then asks in every protocol that fits, at its rates and addresses, only by reads that\n"
    "change nothing. Candidates are ranked by how unlikely it is that chance explains what came. Who was found is\n"
    "asked who it is: its type, its serial number.\n"
    "Exit status 1 when nothing was found, or nothing that chance could not explain as well.",
    identify_parameters,
    identify_examples,
    run_identify};

}  // namespace absenc::tool
