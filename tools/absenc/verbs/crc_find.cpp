// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "absenc/capture/search/crc_search.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/json.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

using capture::CheckedFrame;
using capture::CheckKind;
using capture::CheckSearch;
using capture::CheckSolution;

constexpr std::size_t most_shown = 20;

std::vector<CheckedFrame> frames_of(const Invocation& invocation) {
  const std::span<const std::string> hex = invocation.texts("--hex");
  const std::span<const std::string> bits = invocation.texts("--bits");
  if (!hex.empty() && !bits.empty()) throw UsageError("give all frames with --hex, or all with --bits");
  std::vector<CheckedFrame> frames;
  for (const std::string& text : hex) {
    frames.push_back({parse_wire_text(LinkKind::half_duplex, "--hex", text).bytes});
    if (frames.back().bytes.size() > capture::longest_checked_frame) {
      throw UsageError(fmt::format("--hex: {} bytes are more than the {} that can be searched",
                                   frames.back().bytes.size(), capture::longest_checked_frame));
    }
  }
  for (const std::string& text : bits) {
    WireFrame frame = parse_wire_text(LinkKind::clocked, "--bits", text);
    if (frame.bits > capture::longest_checked_word) {
      throw UsageError(fmt::format("--bits: {} bits are more than the {} that can be searched", frame.bits,
                                   capture::longest_checked_word));
    }
    frames.push_back({std::move(frame.bytes), frame.bits});
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].bytes.size() < 2) throw UsageError(fmt::format("frame {} is too short to hold a check", i + 1));
  }
  if (frames.size() < 2) {
    throw UsageError("one frame fits every polynomial: give several with different data, four to begin with");
  }
  return frames;
}

/// The shortest frame stands for all where positions are counted from the end.
struct Positions {
  explicit Positions(std::span<const CheckedFrame> frames) {
    for (const CheckedFrame& frame : frames) {
      const std::size_t size = frame.bits != 0 ? frame.bits : frame.bytes.size();
      shortest = std::min(shortest, size);
      longest = std::max(longest, size);
    }
    unit = frames.front().bits != 0 ? "bits" : "bytes";
  }
  [[nodiscard]] std::size_t check(const CheckSolution& solution) const {
    return shortest - solution.trailing - solution.check_size;
  }

  std::size_t shortest = SIZE_MAX;
  std::size_t longest = 0;
  std::string_view unit;
};

std::string hex(std::uint32_t value, unsigned width) { return fmt::format("0x{:0{}X}", value, (width + 3) / 4); }

// All powers but the last: what some documents print in place of the normal notation.
std::string koopman(const CrcParameters& crc) { return hex((1u << crc.width | crc.poly) >> 1, crc.width); }

/// How often chance would bring such a solution.
double chance(const CheckSolution& solution) { return std::min(1.0, std::exp2(solution.chance_log2)); }

std::string covered_text(const CheckSolution& solution, const Positions& positions) {
  const std::string end = positions.shortest == positions.longest ? fmt::format("{}", positions.check(solution) - 1)
                                                                  : std::string("before the check");
  return fmt::format("{} {} to {}{}", positions.unit, fmt::join(solution.first, " or "), end,
                     solution.padded ? " and a 00" : "");
}

std::string check_text(const CheckSolution& solution) {
  const std::string at = solution.trailing == 0 ? "at the end" : fmt::format("{} before the end", solution.trailing);
  if (solution.parameters.width <= 8 || solution.check_size > 2) return at;
  return fmt::format("{}, {} byte first", at, solution.low_first ? "low" : "high");
}

std::vector<std::string> row(const CheckSolution& solution, const Positions& positions) {
  const CrcParameters& crc = solution.parameters;
  const std::string often = fmt::format("{:.1g}", chance(solution));
  if (solution.kind != CheckKind::crc) {
    const std::string_view name = solution.kind == CheckKind::sum          ? "sum"
                                  : solution.kind == CheckKind::difference ? "- sum"
                                                                           : "xor";
    return {std::string(name),
            "8",
            "-",
            "-",
            fmt::format("from {}", hex(crc.init, 8)),
            "-",
            "-",
            "-",
            covered_text(solution, positions),
            check_text(solution),
            often};
  }
  return {"CRC",
          fmt::format("{}", crc.width),
          hex(crc.poly, crc.width),
          koopman(crc),
          solution.init_open ? "any, as " + hex(crc.init, crc.width) : hex(crc.init, crc.width),
          crc.refin ? "yes" : "no",
          crc.refout ? "yes" : "no",
          hex(crc.xorout, crc.width),
          covered_text(solution, positions),
          check_text(solution),
          often};
}

void show(std::span<const CheckSolution> solutions, const Positions& positions) {
  std::vector<std::vector<std::string>> rows{
      {"check", "width", "poly", "Koopman", "init", "refin", "refout", "xorout", "covers", "stands", "chance"}};
  for (const CheckSolution& solution : solutions) rows.push_back(row(solution, positions));
  print_line(table(rows));
}

Json solution_json(const CheckSolution& solution, const Positions& positions) {
  const CrcParameters& crc = solution.parameters;
  Json json = Json::object();
  if (solution.kind == CheckKind::crc) {
    json.set("check", "crc").set("width", crc.width).set("poly", hex(crc.poly, crc.width));
    json.set("init", hex(crc.init, crc.width)).set("refin", crc.refin).set("refout", crc.refout);
    json.set("xorout", hex(crc.xorout, crc.width)).set("init_open", solution.init_open);
    if (solution.check_size == 2 && positions.unit == "bytes") {
      json.set("byte_order", solution.low_first ? "low_first" : "high_first");
    }
    json.set("padded", solution.padded);
  } else {
    const std::string_view name = solution.kind == CheckKind::sum          ? "sum"
                                  : solution.kind == CheckKind::difference ? "negative_sum"
                                                                           : "xor";
    json.set("check", name).set("width", 8u);
    json.set("init", hex(crc.init, 8));
  }
  Json first = Json::array();
  for (const std::size_t one : solution.first) first.append(one);
  json.set("unit", positions.unit).set("covered_from", first).set("check_size", solution.check_size);
  json.set("behind_check", solution.trailing).set("chance", chance(solution));
  return json.set("frames_to_settle", capture::frames_to_settle(solution));
}

/// The one frame without which a check explains all others, or none.
std::size_t odd_one_out(std::span<const CheckedFrame> frames) {
  for (std::size_t i = 0; frames.size() >= 5 && i < frames.size(); ++i) {
    std::vector<CheckedFrame> others(frames.begin(), frames.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const CheckSearch search = capture::find_checks(others);
    if (!search.solutions.empty() && capture::frames_to_settle(search.solutions.front()) == 0) return i + 1;
  }
  return 0;
}

// What is still open, in words; "": nothing.
std::string advice(const CheckSearch& search) {
  const unsigned more = search.solutions.empty() ? 1 : capture::frames_to_settle(search.solutions.front());
  if (search.open != 0 && more != 0) return "these frames tell too little: give two more with other data";
  const CheckSolution& best = search.solutions.front();
  std::string text;
  if (more != 0) text = fmt::format("{} more frame{} with other data would settle it", more, more == 1 ? "" : "s");
  if (best.init_open) {
    text += fmt::format("{}a frame of another length would tell init from xorout", text.empty() ? "" : "; ");
  }
  return text;
}

int run_crc_find(const Invocation& invocation) {
  const std::vector<CheckedFrame> frames = frames_of(invocation);
  const Positions positions(frames);
  const CheckSearch search = capture::find_checks(frames);
  const bool found = !search.solutions.empty();
  if (invocation.has("--json")) {
    Json list = Json::array();
    for (const CheckSolution& solution : search.solutions) list.append(solution_json(solution, positions));
    print_line(Json::object().set("ok", found).set("frames", frames.size()).set("solutions", list).line());
  } else if (found) {
    const std::size_t shown =
        invocation.has("--all") ? search.solutions.size() : std::min(most_shown, search.solutions.size());
    show(std::span(search.solutions).first(shown), positions);
    if (shown != search.solutions.size()) {
      print_note(fmt::format("{} more, each likelier to be chance: --all shows them", search.solutions.size() - shown));
    }
  }
  if (found || search.open != 0) {
    const std::string text = advice(search);
    if (!text.empty()) print_note(text);
    return found ? exit_good : exit_failed;
  }
  const std::size_t odd = odd_one_out(frames);
  print_message(odd != 0
                    ? fmt::format("no check of 3 to 16 bits explains all frames, but one explains all except frame {}: "
                                  "is it damaged? Try again without it",
                                  odd)
                    : "no CRC of 3 to 16 bits and no sum explains all frames: are they whole, of one kind, and "
                      "from the first bit on?");
  return exit_failed;
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
    "the frames as well. Exit status 1 when nothing explains them.",
    crc_find_parameters,
    crc_find_examples,
    run_crc_find};

}  // namespace absenc::tool
