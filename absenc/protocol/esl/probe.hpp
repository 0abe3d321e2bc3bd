// SPDX-License-Identifier: Apache-2.0
// Which profiles fit frames captured from a real encoder: what the document leaves open, the hardware tells.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "absenc/protocol/esl/options.hpp"
#include "absenc/protocol/esl/reply.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::esl {

/// One value of one option.
struct Evidence {
  bool possible = false;
  std::size_t capture = 0;    // not possible: the first capture that no profile with this value explains
  Check why = Check::passed;  // not possible: what is wrong there with the best of these profiles
};

struct ProbeResult {
  /// By the index of the option and of its value.
  std::array<std::array<Evidence, 3>, open_options> values{};
  std::size_t profiles = 0;  // how many fit; sequence_step and what the frames do not carry counted once
  Profile best{};            // one of them: defaults where the frames do not tell

  [[nodiscard]] constexpr std::size_t possible(std::size_t option) const {
    std::size_t count = 0;
    for (const Evidence& evidence : values[option]) count += evidence.possible ? 1 : 0;
    return count;
  }
};

/// `base` gives what is not open (tolerance). Without a request, the reply's own control field says what was asked; an
/// empty reply proves nothing. Captures must follow each other without a gap for sequence_step to be
/// judged: nothing else may have been sent to the encoder between them.
[[nodiscard]] ProbeResult probe(const Profile& base, std::span<const Capture> captures);

/// What to say about one value.
[[nodiscard]] std::string_view sentence(const ProbeResult& result, std::size_t option, std::size_t value);

/// What to change in `profile`, in one option or two, so that a reply that it does not explain is good.
struct Change {
  std::array<OptionValue, 2> options{};
  std::size_t count = 0;  // 0: nothing was found
};
[[nodiscard]] Change find_change(const Profile& profile, const Capture& capture);

}  // namespace absenc::esl
