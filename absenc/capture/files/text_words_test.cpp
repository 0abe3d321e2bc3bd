// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/text_words.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

namespace absenc::capture {
namespace {

using Places = std::vector<std::pair<std::uint64_t, std::string>>;

// Returns the words of `text` with their offsets: the reference for TextWords.
Places plain_words(const std::string& text) {
  Places words;
  bool inside = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool blank = std::string(" \t\n\v\f\r").find(text[i]) != std::string::npos;
    if (!blank && !inside) words.push_back({i, ""});
    if (!blank) words.back().second += text[i];
    inside = !blank;
  }
  return words;
}

TEST(TextWords, AreTheSameAsOneCharacterAfterTheOther) {
  const std::string characters = " \t\n\v\f\r!#0~\x01\x1F\x7F\x80\xA0\xFF";
  std::mt19937 random(3);
  for (unsigned round = 0; round < 300; ++round) {
    // on average one character in `rare` (1 to 40) is chosen so that it may be a blank, the others are no blanks
    const auto rare = 1 + random() % 40;
    std::string text(random() % 3000, ' ');
    for (char& c : text) c = characters[(random() % rare == 0 ? 0 : 6) + random() % (characters.size() - 6)];
    const auto source = memory_source({text.begin(), text.end()});
    TextWords words(*source);
    Places found;
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
      found.push_back({words.offset(), std::string(word)});
    }
    ASSERT_EQ(found, plain_words(text));
  }
}

}  // namespace
}  // namespace absenc::capture
