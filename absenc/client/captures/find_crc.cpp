// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/find_crc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absenc/capture/search/crc_search.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {

namespace {

using capture::CheckKind;

using SearchedFrames = std::vector<capture::CheckedFrame>;

SearchedFrames searched(std::span<const CheckedFrame> frames) {
  SearchedFrames all;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const CheckedFrame& frame = frames[i];
    if ((frame.bits != 0) != (frames[0].bits != 0)) throw UsageError("all frames are bytes, or all are bits");
    if (frame.bytes.size() < 2) throw UsageError(fmt::format("frame {} is too short to hold a check", i + 1));
    if (frame.bits == 0 && frame.bytes.size() > capture::longest_checked_frame) {
      throw UsageError(fmt::format("{} bytes are more than the {} that can be searched", frame.bytes.size(),
                                   capture::longest_checked_frame));
    }
    if (frame.bits > capture::longest_checked_word) {
      throw UsageError(
          fmt::format("{} bits are more than the {} that can be searched", frame.bits, capture::longest_checked_word));
    }
    all.push_back({frame.bytes, frame.bits});
  }
  if (all.size() < 2) {
    throw UsageError("one frame fits every polynomial: give several with different data, four to begin with");
  }
  return all;
}

std::string_view check_name(CheckKind kind) {
  switch (kind) {
    case CheckKind::sum:
      return "sum";
    case CheckKind::difference:
      return "negative_sum";
    case CheckKind::exclusive_or:
      return "xor";
    case CheckKind::crc:
      break;
  }
  return "crc";
}

FoundCheck found(const capture::CheckSolution& solution) {
  return {.name = check_name(solution.kind),
          .parameters = solution.parameters,
          .low_first = solution.low_first,
          .padded = solution.padded,
          .init_open = solution.init_open,
          .first = solution.first,
          .check_size = solution.check_size,
          .trailing = solution.trailing,
          .chance = std::min(1.0, std::exp2(solution.chance_log2)),
          .frames_to_settle = capture::frames_to_settle(solution)};
}

std::size_t odd_one_out(const SearchedFrames& frames) {
  for (std::size_t i = 0; frames.size() >= 5 && i < frames.size(); ++i) {
    SearchedFrames others = frames;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const capture::CheckSearch search = capture::find_checks(others);
    if (!search.solutions.empty() && capture::frames_to_settle(search.solutions.front()) == 0) return i + 1;
  }
  return 0;
}

std::string advice(const CheckFindings& findings) {
  if (findings.checks.empty() && !findings.is_open) {
    if (findings.odd == 0) {
      return "no CRC of 3 to 16 bits and no sum explains all frames: are they whole, of one kind, and from the first "
             "bit "
             "on?";
    }
    return fmt::format(
        "no check of 3 to 16 bits explains all frames, but one explains all except frame {}: is it damaged? Try again "
        "without it",
        findings.odd);
  }
  const unsigned more = findings.checks.empty() ? 1 : findings.checks.front().frames_to_settle;
  if (findings.is_open && more != 0) return "these frames tell too little: give two more with other data";
  std::string text;
  if (more != 0) text = fmt::format("{} more frame{} with other data would settle it", more, more == 1 ? "" : "s");
  if (findings.checks.front().init_open) {
    text += fmt::format("{}a frame of another length would tell init from xorout", text.empty() ? "" : "; ");
  }
  return text;
}

}  // namespace

CheckFindings find_crc(std::span<const CheckedFrame> frames) {
  const SearchedFrames all = searched(frames);
  const capture::CheckSearch search = capture::find_checks(all);
  CheckFindings findings{.shortest = SIZE_MAX, .is_open = search.open != 0};
  for (const capture::CheckSolution& solution : search.solutions) findings.checks.push_back(found(solution));
  for (const CheckedFrame& frame : frames) {
    const std::size_t size = frame.bits != 0 ? frame.bits : frame.bytes.size();
    findings.shortest = std::min(findings.shortest, size);
    findings.longest = std::max(findings.longest, size);
  }
  if (findings.checks.empty() && !findings.is_open) findings.odd = odd_one_out(all);
  findings.advice = advice(findings);
  return findings;
}

namespace {

// Returns a CRC like `crc`, but with another `xorout`, and with that initial value with which the result for frames of
// `covered` bits stays the same.
CrcParameters with_xorout(CrcParameters crc, std::uint32_t xorout, std::size_t covered) {
  std::uint32_t change = crc.xorout ^ xorout;
  for (std::size_t i = 0; i < covered; ++i) {
    const bool fed_back = (change & 1) != 0;
    change = (fed_back ? change ^ crc.poly : change) >> 1 | (fed_back ? 1u << (crc.width - 1) : 0u);
  }
  crc.init = static_cast<decltype(crc.init)>(crc.init ^ change);
  crc.xorout = static_cast<decltype(crc.xorout)>(xorout);
  return crc;
}

}  // namespace

std::vector<CheckOptions> options_for(const FoundCheck& check, std::size_t frame_size, LinkKind link) {
  CrcParameters crc = check.parameters;
  const auto all_ones = static_cast<std::uint32_t>(low_mask(crc.width));
  const bool is_plain = check.name == "crc" && !crc.refin && !crc.refout && check.trailing == 0 && !check.padded;
  const bool from_begin = std::find(check.first.begin(), check.first.end(), 0u) != check.first.end();
  if (check.init_open && from_begin && link == LinkKind::clocked) {
    crc = with_xorout(crc, all_ones, frame_size - check.check_size);
  }
  if (!is_plain || (crc.xorout != 0 && crc.xorout != all_ones)) return {};
  const std::array<std::pair<Role, std::int64_t>, 4> wanted{{{Role::check_width, crc.width},
                                                             {Role::check_polynomial, crc.poly},
                                                             {Role::check_init, crc.init},
                                                             {Role::check_inverted, crc.xorout != 0}}};
  std::vector<CheckOptions> all;
  for (const Unit* unit : all_units()) {
    CheckOptions one{unit, {}};
    const auto takes = [&](const auto& part) {
      const Option* option = find_role(unit->options, part.first);
      if (option == nullptr) return false;
      const bool is_number = option->choices.empty();
      if (is_number && (part.second < option->minimum || part.second > option->maximum)) return false;
      if (part.second != option->default_value) {
        one.options.push_back(fmt::format("{}={}", option->name, to_text(*option, part.second)));
      }
      return true;
    };
    if (unit->link == link && std::all_of(wanted.begin(), wanted.end(), takes)) all.push_back(one);
  }
  return all;
}

}  // namespace absenc::client
