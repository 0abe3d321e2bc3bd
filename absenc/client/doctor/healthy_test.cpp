// SPDX-License-Identifier: Apache-2.0
// Checks that healthy encoders get no warning and no fault.
#include <fmt/format.h>
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/doctor/modes_test.hpp"
#include "absenc/client/doctor/observed_test.hpp"
#include "absenc/client/port/virtual_link_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::client {
namespace {

using namespace std::chrono_literals;
using testing::IsEmpty;

constexpr unsigned examinations = 200;  // number of examinations with the encoder in each mode
constexpr std::size_t readings = 40;

class HealthyEncoder : public ::testing::TestWithParam<const Unit*> {};

Examination examined(const EncoderAddress& address, std::uint64_t seed) {
  const Surroundings surroundings{
      [&](const EncoderAddress& to) { return virtual_link(to, {.pauses = seed, .seed = seed}); },
      [](const std::string&) { return os::PortFacts{}; }};
  return examine(address, {.readings = readings, .limit = 60s}, surroundings);
}

std::string random_motion(const EncoderAddress& address, bool may_go_back, sim::Random& random) {
  const host::SpeedLimit limit = speed_limit(address);
  const Resolution resolution = address.unit->resolution(address.options);
  double fastest = std::min(limit.rpm, 6000u);
  if (resolution.unit_um > 0) {
    const double turn_mm = std::ldexp(resolution.unit_um, static_cast<int>(resolution.singleturn_bits)) / 1000;
    fastest = std::min(fastest, limit.mm_s * 60 / turn_mm);
  }
  const double rpm = fastest * static_cast<double>(random.below(1000)) / 1000;
  switch (random.below(4)) {
    case 0:
      return "still";
    case 1:
      return fmt::format("rpm={:.3f}", rpm);
    case 2:
      return fmt::format("rpm={:.3f}", may_go_back ? -rpm : rpm);
    default:
      return fmt::format("rpm={:.3f}", std::min(rpm, 1.0 + static_cast<double>(random.below(60))));
  }
}

TEST_P(HealthyEncoder, IsNeverCalledIll) {
  const Unit& unit = *GetParam();
  std::size_t modes = 0;
  const Options defaults = parse_address(fmt::format("sim:{}", unit.id)).options;
  const bool counts_turns = unit.resolution(defaults).multiturn_bits >= 8;
  for (const std::string& mode : modes_of(unit)) {
    std::optional<EncoderAddress> usual;
    try {
      usual = parse_address(fmt::format("sim:{}{}{}", unit.id, mode.empty() ? "" : "?", mode));
      if (examined(*usual, 1).good == 0) continue;  // skips options with which the virtual encoder cannot be read
    } catch (const std::exception&) {               // skips option values that exclude each other
      continue;
    }
    ++modes;
    sim::Random random(modes);
    const unsigned bits = std::min(unit.resolution(usual->options).singleturn_bits, 62u);
    unsigned ill = 0;
    for (unsigned i = 0; i < examinations && ill < 3; ++i) {
      // The shaft begins at turn 100, so that it can turn backwards without passing 0.
      const bool has_turns = unit.resolution(usual->options).multiturn_bits >= 8;
      const std::string turns = has_turns ? "&multiturn=100" : "";
      const std::string state = fmt::format("singleturn={}{}&motion={}", random.below(std::uint64_t{1} << bits), turns,
                                            random_motion(*usual, mode.empty() || !counts_turns, random));
      const std::string text = fmt::format("sim:{}?{}{}{}", unit.id, mode, mode.empty() ? "" : "&", state);
      const Examination one = examined(parse_address(text), random.next());
      ill += one.healthy() ? 0 : 1;
      EXPECT_TRUE(one.healthy()) << text << "\n" << (one.first() != nullptr ? one.first()->sentence() : one.verdict());
    }
  }
  EXPECT_GT(modes, 0u);
}

std::string name_of_test(const ::testing::TestParamInfo<const Unit*>& one) {
  std::string name(one.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Units, HealthyEncoder, ::testing::ValuesIn(all_units().begin(), all_units().end()),
                         name_of_test);

TEST(Doctor, AThousandHealthyEncodersGiveNoFinding) {
  std::mt19937_64 random(16);
  std::size_t runs = 0;
  while (runs < 1000) {
    for (const Unit* unit : all_units()) {
      if (find_command(*unit, Verb::read) == nullptr) continue;
      const std::uint64_t seed = random();
      const std::string motion = seed % 2 == 0 ? "" : "?motion=rpm=" + std::to_string(seed % 97);
      const EncoderAddress address = parse_address("sim:" + std::string(unit->id) + motion);
      const Surroundings surroundings{[seed](const EncoderAddress& to) { return virtual_link(to, {.pauses = seed}); },
                                      [](const std::string&) { return os::PortFacts{}; }};
      const Examination examination = examine(address, {.readings = 60, .limit = 30s}, surroundings);
      EXPECT_THAT(ids(examination), IsEmpty())
          << unit->id << motion << " seed " << seed << ": " << examination.verdict();
      EXPECT_TRUE(examination.healthy());
      EXPECT_GT(examination.good, 20u) << unit->id;
      if (++runs % 100 == 0 && testing::Test::HasFailure()) return;
    }
  }
}

/// A flicker of the position by one count is no noise; neither is an even or an accelerated motion.
TEST(Doctor, AFlickeringLastBitIsNoNoise) {
  EXPECT_THAT(ids(judged(positions([](std::size_t i) { return i % 2; }))), IsEmpty());
  EXPECT_THAT(ids(judged(positions([](std::size_t i) { return i * 13; }))), IsEmpty());
  EXPECT_THAT(ids(judged(positions([](std::size_t i) { return i * i / 3 + i; }))), IsEmpty());
}

}  // namespace
}  // namespace absenc::client
