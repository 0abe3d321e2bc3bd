// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/probe.hpp"

#include <array>
#include <optional>

#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/options.hpp"

namespace absenc::encolink {

namespace {

constexpr std::size_t option_resolution = options.find("resolution");
constexpr std::size_t option_multiturn_bits = options.find("multiturn_bits");

// What speaks for a format: the identity, or without one the length that most frames have.
struct Told {
  std::optional<Identity> identity{};
  std::size_t identity_at = 0;         // index of its capture
  std::array<std::size_t, 2> good{};   // position frames without turns, with turns
  std::array<std::size_t, 2> first{};  // the first of them

  [[nodiscard]] bool tells() const { return identity || good[0] != good[1]; }
  [[nodiscard]] bool has_turns() const { return identity ? identity->frame_bytes == 7 : good[1] > good[0]; }
};

Told told_by(const Format& format, std::span<const Capture> captures) {
  Told told;
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const Bytes reply = captures[i].reply;
    const Result<Identity> identity = decode_identity(reply);
    if (identity && !told.identity) {
      told.identity = *identity;
      told.identity_at = i;
    }
    for (std::size_t turns = 0; turns < 2 && !identity; ++turns) {
      const int multiturn_bits = turns != 0 ? static_cast<int>(maximum_multiturn_bits) : 0;
      if (!decode_position({maximum_resolution, multiturn_bits, format.has_ch2}, reply)) continue;
      if (told.good[turns]++ == 0) told.first[turns] = i;
    }
  }
  return told;
}

}  // namespace

bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const Told told = told_by(options.format(values), captures);
  constexpr std::string_view open = "these frames do not tell";
  for (std::int64_t bits = 1; bits <= std::int64_t{maximum_resolution}; ++bits) {
    const bool possible = !told.identity || bits == told.identity->resolution;
    sink.put({option_resolution, bits, possible, possible ? 0 : told.identity_at,
              !told.identity ? open
              : possible     ? "the identity says so"
                             : "the identity says another one"});
  }
  for (std::int64_t bits = 0; bits <= std::int64_t{maximum_multiturn_bits}; ++bits) {
    const bool possible = !told.tells() || (bits > 0) == told.has_turns();
    const std::size_t against = told.identity ? told.identity_at : told.first[told.has_turns() ? 1 : 0];
    sink.put({option_multiturn_bits, bits, possible, possible ? 0 : against,
              possible ? (told.tells() ? "agrees with the length of the frames" : open)
                       : "frames of this encoder have another length"});
  }
  if (told.identity && values[option_resolution] == 0) values.values[option_resolution] = told.identity->resolution;
  if (told.tells() && values[option_multiturn_bits] < 0) {
    values.values[option_multiturn_bits] = told.has_turns() ? std::int64_t{maximum_multiturn_bits} : 0;
  }
  const bool is_resolution = !told.identity || values[option_resolution] == told.identity->resolution;
  return is_resolution && (!told.tells() || (values[option_multiturn_bits] > 0) == told.has_turns());
}

}  // namespace absenc::encolink
