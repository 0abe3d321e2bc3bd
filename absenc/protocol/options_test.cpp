// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/options.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absenc/protocol/biss/unit.hpp"
#include "absenc/protocol/esl/unit.hpp"
#include "absenc/protocol/ssi/unit.hpp"

namespace absenc {
namespace {

TEST(Options, DecimalNumbers) {
  EXPECT_EQ(parse_decimal("0.05", 3).value(), 50);
  EXPECT_EQ(parse_decimal("0.050", 3).value(), 50);
  EXPECT_EQ(parse_decimal("12", 3).value(), 12'000);
  EXPECT_EQ(parse_decimal("1.16", 2).value(), 116);
  EXPECT_EQ(parse_decimal("9223372036854775807", 0).value(), INT64_MAX);
}

TEST(Options, RefusesInvalidDecimalNumbers) {
  for (const char* text : {"", ".", "1.", ".5", "-1", "0.0005", "1.2.3", "1,5", "0x10", "1e3", "1.-5", " 1", "1.5 ",
                           "9223372036854775807"}) {
    EXPECT_EQ(parse_decimal(text, 3).error(), Error::invalid_argument) << text;
  }
}

struct Resolved {
  Options options;
  OptionError error;
};

Resolved resolve(const Unit& unit, std::string_view model, const std::vector<OptionText>& settings) {
  Resolved resolved;
  resolved.error = resolve_options(unit, model, settings, resolved.options);
  return resolved;
}

constexpr std::string_view word = "multiturn:12 position:24 battery=value:3 error:1";

TEST(Options, WordReplacesOptionsThatDescribeIt) {
  const Resolved resolved = resolve(biss::unit, {}, {{"ma_khz", "500"}, {"word", word}, {"unit_um", "0.5"}});
  ASSERT_EQ(resolved.error.kind, OptionError::Kind::none);
  EXPECT_EQ(resolved.options.model, nullptr);
  EXPECT_EQ(resolved.options.word.bits(), 40u);
  EXPECT_EQ(resolved.options.word.fields()[2].name, "battery");
  const Resolution resolution = biss::unit.resolution(resolved.options);
  EXPECT_EQ(resolution.singleturn_bits, 24u);
  EXPECT_EQ(resolution.multiturn_bits, 12u);
  EXPECT_EQ(resolution.unit_um, 0.5);
  for (std::size_t i = 0; i < biss::unit.options.size(); ++i) {
    if (biss::unit.options[i].name == "ma_khz") {
      EXPECT_EQ(resolved.options[i], 500);
    }
  }
}

TEST(Options, WordExcludesOptionsAndModels) {
  for (const Unit* unit : {&biss::unit, &ssi::unit}) {
    ASSERT_TRUE(takes_word(*unit));
    for (const Option& option : unit->options) {
      std::int64_t most = option.maximum;
      for (unsigned i = 0; i < option.decimals; ++i) most /= 10;
      const std::string value = option.choices.empty() ? std::to_string(most) : std::string(option.choices[0]);
      const Resolved resolved = resolve(*unit, {}, {{"word", word}, {option.name, value}});
      EXPECT_EQ(resolved.error.kind == OptionError::Kind::beside_word, option.describes_word) << option.name;
      EXPECT_EQ(resolved.error.text, option.describes_word ? option.name : "");
    }
    EXPECT_EQ(resolve(*unit, unit->models[0].name, {{"word", word}}).error.kind, OptionError::Kind::beside_word);
  }
}

TEST(Options, SharedLineSetsOption) {
  const auto bus = [](std::vector<std::pair<std::string_view, std::string_view>> settings) {
    std::vector<OptionText> texts;
    for (const auto& [name, value] : settings) texts.push_back({name, value});
    Options options;
    EXPECT_EQ(resolve_options(esl::unit, {}, texts, options).kind, OptionError::Kind::none);
    const Options before = options;
    tell_shared(esl::unit, options);
    std::size_t changed = 0;
    for (std::size_t i = 0; i < esl::unit.options.size(); ++i) changed += before[i] != options[i];
    EXPECT_EQ(changed, settings.empty() ? 1u : 0u);
  };
  bus({});
  bus({{"bus", "true"}});
  bus({{"bus", "false"}});  // `true` and `false` from the user have priority over `tell_shared`
}

TEST(Options, InvalidWordIsReportedWithItsPlace) {
  const Resolved wrong = resolve(ssi::unit, {}, {{"word", "position:12 eror:1"}});
  EXPECT_EQ(wrong.error.kind, OptionError::Kind::bad_word);
  EXPECT_EQ(wrong.error.word.at, 12u);
  // A value in a word format must not have the name of a field of the protocol.
  const Resolved hiding = resolve(biss::unit, {}, {{"word", "position:12 crc=value:3"}});
  EXPECT_EQ(hiding.error.kind, OptionError::Kind::bad_word);
  EXPECT_EQ(hiding.error.word.at, 12u);
  EXPECT_EQ(resolve(ssi::unit, {}, {{"word", "position:12 crc=value:3"}}).error.kind, OptionError::Kind::none);
}

}  // namespace
}  // namespace absenc
