// SPDX-License-Identifier: Apache-2.0
#include "absenc/core/result.hpp"

#include <gtest/gtest.h>

#include <cctype>
#include <set>
#include <string_view>

namespace absenc {
namespace {

constexpr Result<int> half_of(int number) {
  if (number % 2 != 0) return Error::invalid_argument;
  return number / 2;
}
static_assert(half_of(4) && half_of(4).has_value() && *half_of(4) == 2 && half_of(4).error() == Error::none);
static_assert(!half_of(3) && half_of(3).error() == Error::invalid_argument);
static_assert(half_of(3).value_or(-1) == -1 && half_of(4).value_or(-1) == 2 && half_of(8).value() == 4);

struct Pair {
  int first = 0;
  int second = 0;
};
static_assert(Result<Pair>(Pair{1, 2})->second == 2);

// The table of error texts is indexed by Error, so each entry must stand at the index of its error.
static_assert(text_of(Error::none).name == "none" && text_of(Error::invalid_argument).name == "invalid_argument");
static_assert(text_of(Error::timeout).name == "timeout" && text_of(Error::truncated).name == "truncated");
static_assert(text_of(Error::wrong_length).name == "wrong_length");
static_assert(text_of(Error::cross_check_failed).name == "cross_check_failed");
static_assert(text_of(Error::busy).name == "busy" && text_of(Error::request_rejected).name == "request_rejected");
static_assert(static_cast<std::size_t>(Error::not_still) + 1 == error_texts.size());

TEST(ErrorTexts, HaveDistinctOneWordNamesAndAdvice) {
  std::set<std::string_view> names;
  for (const ErrorText& text : error_texts) {
    EXPECT_TRUE(names.insert(text.name).second) << text.name << " twice";
    for (const char c : text.name) EXPECT_TRUE(std::islower(static_cast<unsigned char>(c)) || c == '_') << text.name;
    EXPECT_FALSE(text.description.empty()) << text.name;
    EXPECT_EQ(text.advice.empty(), text.name == "none") << text.name;
  }
}

}  // namespace
}  // namespace absenc
