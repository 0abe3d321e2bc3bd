// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/client/find_crc.hpp"
#include "absenc/client/text/json.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

constexpr std::size_t most_shown = 20;
constexpr std::string_view crc_name = "crc";

std::vector<CheckedFrame> frames_of(const Invocation& invocation) {
  std::vector<CheckedFrame> frames;
  for (const std::string& text : invocation.texts("--hex")) {
    frames.push_back({parse_wire_text(LinkKind::half_duplex, "--hex", text).bytes});
  }
  const std::span<const std::string> words = invocation.texts("--bits");
  if (!words.empty() && !frames.empty()) throw UsageError("give all frames with --hex, or all with --bits");
  for (const std::string& text : words) {
    WireFrame frame = parse_wire_text(LinkKind::clocked, "--bits", text);
    frames.push_back({std::move(frame.bytes), frame.bits});
  }
  return frames;
}

std::string hex(std::uint32_t value, unsigned width) { return fmt::format("0x{:0{}X}", value, (width + 3) / 4); }

// Returns the polynomial in Koopman's notation: with the highest power, without x^0.
std::string koopman(const CrcParameters& crc) { return hex((1u << crc.width | crc.poly) >> 1, crc.width); }

/// Returns the part of the frame that the checksum covers, as text such as "bytes 0 to 7"; `unit` is the word for bytes
/// or bits.
std::string covered_text(const FoundCheck& check, const CheckFindings& findings, std::string_view unit) {
  const std::string end = findings.shortest == findings.longest
                              ? fmt::format("{}", findings.shortest - check.trailing - check.check_size - 1)
                              : std::string("before the check");
  return fmt::format("{} {} to {}{}", unit, fmt::join(check.first, " or "), end, check.padded ? " and a 00" : "");
}

std::string check_text(const FoundCheck& solution) {
  const std::string at = solution.trailing == 0 ? "at the end" : fmt::format("{} before the end", solution.trailing);
  if (solution.parameters.width <= 8 || solution.check_size > 2) return at;
  return fmt::format("{}, {} byte first", at, solution.low_first ? "low" : "high");
}

std::vector<std::string> row(const FoundCheck& check, const CheckFindings& findings, std::string_view unit) {
  const CrcParameters& crc = check.parameters;
  const std::string often = fmt::format("{:.1g}", check.chance);
  if (check.name != crc_name) {
    return {check.name == "negative_sum" ? "- sum" : std::string(check.name),
            "8",
            "-",
            "-",
            fmt::format("from {}", hex(crc.init, 8)),
            "-",
            "-",
            "-",
            covered_text(check, findings, unit),
            check_text(check),
            often};
  }
  return {"CRC",
          fmt::format("{}", crc.width),
          hex(crc.poly, crc.width),
          koopman(crc),
          check.init_open ? "any, as " + hex(crc.init, crc.width) : hex(crc.init, crc.width),
          crc.refin ? "yes" : "no",
          crc.refout ? "yes" : "no",
          hex(crc.xorout, crc.width),
          covered_text(check, findings, unit),
          check_text(check),
          often};
}

void show_checks(const CheckFindings& findings, std::size_t most, std::string_view unit) {
  std::vector<std::vector<std::string>> rows{
      {"check", "width", "poly", "Koopman", "init", "refin", "refout", "xorout", "covers", "stands", "chance"}};
  const std::size_t shown = std::min(most, findings.checks.size());
  for (std::size_t i = 0; i < shown; ++i) rows.push_back(row(findings.checks[i], findings, unit));
  print_line(table(rows));
  const std::size_t left = findings.checks.size() - shown;
  if (left != 0) print_note(fmt::format("{} more, each likelier to be chance: --all shows them", left));
}

// Prints the options with which units that decode words use the likeliest checksum.
void show_options(const CheckFindings& findings, LinkKind link) {
  for (const CheckOptions& one : options_for(findings.checks.front(), findings.shortest, link)) {
    const std::string options =
        one.options.empty() ? "as it is" : fmt::format("with --option {}", fmt::join(one.options, " --option "));
    print_line(fmt::format("{} has the first of these {}", one.unit->id, options));
  }
}

Json check_json(const FoundCheck& check, std::size_t frame_size, LinkKind link, std::string_view unit) {
  const CrcParameters& crc = check.parameters;
  Json json = Json::object().set("check", check.name).set("width", crc.width);
  if (check.name == crc_name) {
    json.set("poly", hex(crc.poly, crc.width));
    json.set("init", hex(crc.init, crc.width)).set("refin", crc.refin).set("refout", crc.refout);
    json.set("xorout", hex(crc.xorout, crc.width)).set("init_open", check.init_open);
    if (check.check_size == 2 && unit == "bytes") json.set("byte_order", check.low_first ? "low_first" : "high_first");
    json.set("padded", check.padded);
  } else {
    json.set("init", hex(crc.init, 8));
  }
  json.set("unit", unit).set("covered_from", Json::list(check.first)).set("check_size", check.check_size);
  json.set("behind_check", check.trailing).set("chance", check.chance);
  Json options = Json::object();
  for (const CheckOptions& one : options_for(check, frame_size, link))
    options.set(one.unit->id, Json::list(one.options));
  if (!options.empty()) json.set("options", options);
  return json.set("frames_to_settle", check.frames_to_settle);
}

int run_crc_find(const Invocation& invocation) {
  const std::vector<CheckedFrame> frames = frames_of(invocation);
  const CheckFindings findings = find_crc(frames);
  const bool found = !findings.checks.empty();
  const LinkKind link = frames.front().bits != 0 ? LinkKind::clocked : LinkKind::half_duplex;
  const std::string_view unit = carries_bits(link) ? "bits" : "bytes";
  if (invocation.has("--json")) {
    const Json list = Json::list(findings.checks,
                                 [&](const auto& check) { return check_json(check, findings.shortest, link, unit); });
    print_line(Json::object().set("ok", found).set("frames", frames.size()).set("solutions", list).line());
  } else if (found) {
    show_checks(findings, invocation.has("--all") ? SIZE_MAX : most_shown, unit);
    show_options(findings, link);
  }
  if (!found && !findings.is_open) {
    print_message(findings.advice);
  } else if (!findings.advice.empty()) {
    print_note(findings.advice);
  }
  return found ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 4> crc_find_parameters{{
    {"--hex", "FRAME", "a whole frame in bytes, its check included", "", false, true},
    {"--bits", "WORD", "the same of a clocked line, as a string of 0 and 1", "", false, true},
    {"--all", "", "every solution, not only the 20 that are least likely to be chance"},
    parameter::json,
}};

constexpr std::array<Example, 2> crc_find_examples{{
    {"absenc crc find --hex 7942BDF22187 --hex 06F084776297 --hex F0F3CB4D7665 --hex 4DC70720510C",
     "four frames of five bytes with a CRC behind them"},
    {"absenc crc find --bits 00010101100110100000111110001001001101 --bits 11110010110001101101101011001010000100 \\\n"
     "      --bits 11100011010001001011101100110001110101 --bits 00010010010001011111110101101111000110",
     "words of a clocked line"},
}};

}  // namespace

const Subcommand crc_find_subcommand{
    "crc find",
    "find the CRC or sum of an unknown encoder from a few of its frames",
    "Give whole frames with different data. For each solution: polynomial in normal and in Koopman's notation,\n"
    "what is covered (first byte or bit from 0 on), where the check stands, and how often chance would explain\n"
    "the frames as well; and the options by which a protocol here has the first of them. Exit status 1 when\n"
    "nothing explains them.",
    crc_find_parameters,
    crc_find_examples,
    run_crc_find};

}  // namespace absenc::tool
