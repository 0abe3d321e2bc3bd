// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/search/evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "absenc/capture/search/hypotheses.hpp"
#include "absenc/capture/search/stream.hpp"
#include "absenc/protocol/all.hpp"
#include "tests/cases.hpp"

namespace absenc::capture {
namespace {

/// A toy unit, whose reply is the request's first byte and a number.
struct Toy {
  static constexpr std::array<std::string_view, 2> order_choices{"up", "down"};
  static constexpr std::array<Option, 2> options{{
      {.name = "bits", .meaning = "", .default_value = 3, .minimum = 1, .maximum = 8},
      {.name = "order", .meaning = "", .default_value = 0, .choices = order_choices},
  }};
  static constexpr std::array<OptionValue, 1> four{{{0, 4}}};
  static constexpr std::array<Model, 1> models{{{"four", "", 0, four}}};

  static Error decode(const Options& values, Frame request, Frame reply, FieldSink& sink) {
    if (reply.bytes.size() != 2) return Error::wrong_length;
    if (!request.bytes.empty() && reply.bytes[0] != request.bytes[0]) return Error::unexpected_reply;
    const unsigned value = values[1] == 0 ? reply.bytes[1] : 255u - reply.bytes[1];
    if (value >= 1u << values[0]) return Error::out_of_range;
    const auto bits = static_cast<unsigned>(values[0]);
    sink.put_reading({.singleturn = value, .singleturn_bits = bits, .singleturn_valid_bits = bits});
    return Error::none;
  }
  static Resolution resolution(const Options& values) { return {static_cast<unsigned>(values[0]), 0}; }

  [[nodiscard]] static Unit unit() {
    Unit toy{};
    toy.id = "toy";
    toy.options = options;
    toy.models = models;
    toy.decode = decode;
    toy.resolution = resolution;
    return toy;
  }
};

ObservedExchange exchange_of(std::uint8_t value, std::uint8_t first = 7) {
  return {.request = {.bytes = {7}}, .reply = {.bytes = {first, value}}};
}

Options with_bits(std::int64_t bits) {
  Options options;
  options.values[0] = bits;
  return options;
}

TEST(Evidence, AcceptanceIsThatOfNoiseBehindRepeatedBytes) {
  EXPECT_NEAR(acceptance(Toy::unit(), with_bits(4), exchange_of(1)), 16.0 / 256, 0.01);
  EXPECT_DOUBLE_EQ(acceptance(Toy::unit(), with_bits(8), exchange_of(1)), 1);
  // If the request of a reply was not captured, no byte of the reply is known to repeat a byte of the request.
  const ObservedExchange unsolicited{.reply = {.bytes = {7, 1}}};
  EXPECT_NEAR(acceptance(Toy::unit(), with_bits(4), unsolicited), 16.0 / 256, 0.01);
}

TEST(Evidence, AcceptanceIsNeverZero) {
  const Unit& real = *find_unit("tformat");
  const ObservedExchange good{.request = {.bytes = {0x1A}},
                              .reply = {.bytes = {0x1A, 0, 0x45, 0x23, 1, 0x11, 0x34, 0x12, 0, 0, 0x4A}}};
  Options options;
  ASSERT_EQ(resolve_options(real, {}, {}, options).kind, OptionError::Kind::none);
  ASSERT_TRUE(explains(real, options, good));
  const double acceptance_of = acceptance(real, options, good);
  EXPECT_GT(acceptance_of, 0);
  EXPECT_LT(acceptance_of, 1e-3);
}

TEST(Evidence, RepeatedFrameAddsNoEvidence) {
  const std::vector<ObservedExchange> same(5, exchange_of(1));
  const Evidence once = weigh(Toy::unit(), with_bits(4), std::span(same).first(1));
  const Evidence often = weigh(Toy::unit(), with_bits(4), same);
  EXPECT_EQ(often.explained, 5u);
  EXPECT_EQ(often.distinct, 1u);
  EXPECT_DOUBLE_EQ(once.frames, often.frames);
  const std::vector<ObservedExchange> other{exchange_of(1), exchange_of(2), exchange_of(3)};
  EXPECT_NEAR(weigh(Toy::unit(), with_bits(4), other).frames, 3 * once.frames, 1e-9);
}

TEST(Evidence, UnexplainedExchangesCountAgainst) {
  const std::vector<ObservedExchange> mixed{exchange_of(1), exchange_of(200), exchange_of(201), exchange_of(202),
                                            exchange_of(203)};
  const Evidence evidence = weigh(Toy::unit(), with_bits(4), mixed);
  EXPECT_EQ(evidence.tried, 5u);
  EXPECT_EQ(evidence.explained, 1u);
  EXPECT_FALSE(evidence.explains_all());
  EXPECT_NEAR(std::pow(10, evidence.frames), 1 - std::pow(1 - 1.0 / 16, 5), 0.02);
}

TEST(Evidence, TailOfTheBinomialDistribution) {
  EXPECT_DOUBLE_EQ(tail(0, 4, 0.5), 0);
  EXPECT_NEAR(tail(4, 4, 0.5), std::log10(1.0 / 16), 1e-9);
  EXPECT_NEAR(tail(3, 4, 0.5), std::log10(5.0 / 16), 1e-9);
  EXPECT_DOUBLE_EQ(tail(3, 4, 1), 0);
  EXPECT_NEAR(tail(900, 1000, 0.9), std::log10(0.53), 0.02);
}

TEST(Evidence, UsesMotionWhereFramesProveNothing) {
  const auto motion_of = [](std::initializer_list<std::uint8_t> values) {
    std::vector<ObservedExchange> exchanges;
    for (const std::uint8_t value : values) exchanges.push_back(exchange_of(value));
    return weigh(Toy::unit(), with_bits(8), exchanges);
  };
  EXPECT_FALSE(motion_of({9, 9, 9}).motion);
  EXPECT_DOUBLE_EQ(motion_of({9, 9, 9}).chance(), 0);
  EXPECT_LT(motion_of({254, 255, 0, 1, 2, 3}).chance(), -5);
  EXPECT_GT(motion_of({0, 130, 20, 190, 60, 180}).chance(), -0.7);
}

// Tests that streams of 12 to 2048 random bytes are attributed to no unit that uses characters.
class RandomStream : public ::testing::TestWithParam<unsigned> {};

TEST_P(RandomStream, MatchesNoUnit) {
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::half_duplex && unit->link != LinkKind::full_duplex) continue;
    for (unsigned seed = GetParam(); seed < GetParam() + 4; ++seed) {
      std::mt19937_64 random(seed);
      std::vector<std::uint8_t> bytes(std::array<std::size_t, 4>{12, 100, 600, 2048}[seed % 4]);
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
      for (const Hypothesis& one : find_stream_hypotheses(*unit, bytes, std::chrono::milliseconds(100))) {
        EXPECT_GT(one.chance(), is_found)
            << unit->id << ", seed " << seed << ": " << one.evidence.explained << " of " << one.evidence.tried;
      }
    }
  }
}

// A build with sanitizers runs only the first series of random streams.
INSTANTIATE_TEST_SUITE_P(Seeds, RandomStream, ::testing::Range(0u, 40u, 4u));

TEST(Hypotheses, ListsEqualMeaningsOnce) {
  static constexpr std::array<std::string_view, 2> names{"one", "other"};
  static constexpr std::array<Option, 3> options{{Toy::options[0], Toy::options[1], {"name", "", 0, 0, 0, names}}};
  Unit unit = Toy::unit();
  unit.options = options;
  const std::vector<ObservedExchange> all{exchange_of(254), exchange_of(253), exchange_of(250), exchange_of(3, 8)};
  const std::vector<Hypothesis> found = find_hypotheses(unit, {}, all);
  ASSERT_FALSE(found.empty());
  for (const Hypothesis& one : found) EXPECT_EQ(one.options[2], 0);
}

TEST(Hypotheses, FramesThatProveThemselvesGoFirst) {
  Hypothesis checked{.evidence = {.tried = 20, .explained = 20, .distinct = 20, .frames = -36}};
  Hypothesis moving{.evidence = {.tried = 20, .explained = 20, .distinct = 20, .frames = 0, .motion = -114}};
  EXPECT_TRUE(is_likelier(checked, moving));
  EXPECT_FALSE(is_likelier(moving, checked));
}

TEST(Hypotheses, ModelsComeFirst) {
  const std::vector<ObservedExchange> small{exchange_of(1), exchange_of(2)};
  const std::vector<Hypothesis> found = find_hypotheses(Toy::unit(), {}, small);
  ASSERT_EQ(found.size(), 1u);
  ASSERT_NE(found[0].options.model, nullptr);
  EXPECT_EQ(found[0].options.model->name, "four");
  EXPECT_FALSE(found[0].at_least);
}

TEST(Hypotheses, TheFewestBitsWhereNoModelFits) {
  const std::vector<ObservedExchange> large{exchange_of(1), exchange_of(40)};
  const std::vector<Hypothesis> found = find_hypotheses(Toy::unit(), {}, large);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].options.model, nullptr);
  EXPECT_EQ(found[0].options[0], 6);
  EXPECT_TRUE(found[0].at_least);
  EXPECT_GT(found[0].tried, 2u);
}

TEST(Hypotheses, ASingleChoiceThatExplainsMore) {
  const std::vector<ObservedExchange> downwards{exchange_of(254), exchange_of(253), exchange_of(250)};
  const std::vector<Hypothesis> found = find_hypotheses(Toy::unit(), {}, downwards);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].options[1], 1);
}

TEST(Hypotheses, NothingWhereNothingIsExplained) {
  const std::vector<ObservedExchange> other{exchange_of(1, 8)};
  EXPECT_TRUE(find_hypotheses(Toy::unit(), {}, other).empty());
}

TEST(Hypotheses, EveryVectorOfEveryUnitIsFoundByItsUnit) {
  for (const Unit* unit : all_units()) {
    // The test vectors of clocked and CAN units are left out, because their frames are no sequences of bytes.
    if (carries_bits(unit->link) || unit->link == LinkKind::can) continue;
    unsigned left = test_cases(static_cast<unsigned>(unit->vectors.size()));
    for (const Vector& vector : unit->vectors) {
      if (left == 0 || vector.error != Error::none || vector.reply.empty() || !vector.options.empty()) continue;
      const ObservedExchange one{.request = {.bytes = {vector.request.begin(), vector.request.end()}},
                                 .reply = {.bytes = {vector.reply.begin(), vector.reply.end()}}};
      EXPECT_FALSE(find_hypotheses(*unit, {}, {&one, 1}).empty()) << vector.id;
      --left;
    }
  }
}

TEST(Stream, ExtractsFramesFromNoise) {
  const Unit& unit = *find_unit("raa38");
  std::vector<std::uint8_t> bytes{0x12, 0x81};
  for (unsigned i = 0; i < 8; ++i) {
    const std::uint8_t high = 0x10;
    const auto low = static_cast<std::uint8_t>(3 * i);
    bytes.insert(bytes.end(), {0xFF, 0x81, high, low, static_cast<std::uint8_t>(0xFF + 0x81 + high + low)});
  }
  bytes.push_back(0xFF);
  Options options;
  ASSERT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
  EXPECT_EQ(split_stream(unit, options, bytes).size(), 8u);
  const std::vector<Hypothesis> found = find_stream_hypotheses(unit, bytes, std::chrono::milliseconds(100));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].evidence.explains_all());
  EXPECT_LE(found[0].chance(), is_found);
  EXPECT_TRUE(unit.streams(found[0].options));
}

TEST(Stream, NoiseIsNotFound) {
  std::vector<std::uint8_t> noise(test_cases(2000));
  std::uint32_t state = 1;
  for (std::uint8_t& byte : noise) {
    state = state * 1664525 + 1013904223;
    byte = static_cast<std::uint8_t>(state >> 24);
  }
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::half_duplex && unit->link != LinkKind::full_duplex) continue;
    for (const Hypothesis& one : find_stream_hypotheses(*unit, noise, std::chrono::milliseconds(100))) {
      EXPECT_GT(one.chance(), is_found) << unit->id;
    }
  }
}

}  // namespace
}  // namespace absenc::capture
