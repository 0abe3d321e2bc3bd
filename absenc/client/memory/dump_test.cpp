// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/memory/dump.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <string>

#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

const Unit& unit = require_unit("tformat");

Options options_of(std::string_view model) { return require_options(unit, model, std::span<const OptionText>()); }

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// Returns the text of the error with which a dump is refused; "nothing" if it is accepted.
std::string refusal(std::string_view text, MemoryAccess access = MemoryAccess::write) {
  try {
    static_cast<void>(parse_dump("file", text, unit, options_of("TS5700N8500"), access));
  } catch (const Failure& failure) {
    return failure.what();
  }
  return "nothing";
}

void expect_refusal(std::string_view text, std::initializer_list<std::string_view> words) {
  const std::string said = refusal(text);
  for (const std::string_view word : words) EXPECT_NE(said.find(word), std::string::npos) << said;
}

constexpr std::string_view small =
    "absenc dump 1\n"
    "protocol: tformat\n"
    "model: TS5700N8500\n"
    "page 0 address 0x05: 5A 5B\n";

TEST(DumpFile, RoundTrip) {
  const bool holds = rc::check("any bytes at any addresses come back", [] {
    MemoryImage image;
    const MemoryImage all = dump_addresses(unit);
    const auto size = *rc::gen::inRange<std::size_t>(1, 40);
    while (image.size() < size) {
      auto at = all.begin();
      std::advance(at, *rc::gen::inRange<int>(0, static_cast<int>(all.size())));
      image[at->first] = *rc::gen::arbitrary<std::uint8_t>();
    }
    const bool known = *rc::gen::arbitrary<bool>();
    Options options = options_of("23-bit");
    if (!known) options.model = nullptr;
    const Dump dump = parse_dump("file", to_dump(unit, options, image), unit, options, MemoryAccess::write);
    RC_ASSERT(dump.image == image);
    RC_ASSERT(dump.checked);
  });
  EXPECT_TRUE(holds);
}

TEST(DumpFile, WhateverIsEditedIsReadOrRefused) {
  const std::string good = to_dump(unit, options_of("TS5700N8500"), {{{0, 5}, 0x5A}, {{0, 6}, 1}, {{3, 126}, 0}});
  const bool holds = rc::check("an edited text gives open addresses or a refusal", [&] {
    std::string text = good;
    if (*rc::gen::arbitrary<bool>()) text.resize(text.find("checksum"));
    const auto edits = *rc::gen::inRange(1, 6);
    for (int i = 0; i < edits; ++i) {
      const std::string piece =
          *rc::gen::element<std::string>("", "0", "F", " ", "\n", ":", "page ", "address ", "-1", "\xFF");
      const auto at = *rc::gen::inRange<std::size_t>(0, text.size());
      const auto taken = *rc::gen::inRange<std::size_t>(0, 3);
      text.replace(at, taken, piece);
    }
    try {
      for (const auto& [at, value] :
           parse_dump("file", text, unit, options_of("TS5700N8500"), MemoryAccess::write).image) {
        RC_ASSERT(closed(unit, at, MemoryAccess::write).empty());
      }
    } catch (const Failure& failure) {
      RC_ASSERT(std::string_view(failure.what()).starts_with("file"));
    }
  });
  EXPECT_TRUE(holds);
}

TEST(DumpFile, EveryDamagedCharacterThatCountsIsNoticed) {
  const std::string good = to_dump(unit, options_of("TS5700N8500"), {{{0, 5}, 0x5A}, {{3, 126}, 0}});
  const std::size_t comment = good.find('#');
  const std::size_t checksum = good.find("checksum");
  for (std::size_t i = 0; i + 1 < good.size(); ++i) {
    if (i >= comment && i < checksum) continue;
    std::string damaged = good;
    damaged[i] = good[i] == '1' ? '0' : '1';
    EXPECT_NE(refusal(damaged), "nothing") << damaged;
  }
}

TEST(DumpFile, ChecksumCountsOnlyWhatCounts) {
  const std::string good = to_dump(unit, options_of("TS5700N8500"), {{{0, 5}, 0x5A}});
  const std::string with_comment = replaced(good, "page 0", "# mine\r\n\npage 0");
  EXPECT_EQ(refusal(with_comment), "nothing");
  expect_refusal(replaced(good, "5A", "5B"), {"file, line 6", "damaged, or edited", "checksum: edited"});
  const std::string edited = replaced(good, "5A", "5B");
  EXPECT_EQ(refusal(edited.substr(0, edited.find("checksum"))), "nothing");
  EXPECT_EQ(refusal(edited.substr(0, edited.find("checksum")) + "checksum: edited\n"), "nothing");
  expect_refusal(good + "page 0 address 6: 00\n", {"line 7", "last line"});
}

TEST(DumpFile, ChecksumIsTheDocumentedOne) {
  // DDEB is the CRC-16/IBM-3740 of the four lines of `small`, computed with another program.
  const std::string text = to_dump(unit, options_of("TS5700N8500"), {{{0, 5}, 0x5A}, {{0, 6}, 0x5B}});
  EXPECT_TRUE(text.starts_with(small)) << text;
  EXPECT_TRUE(text.ends_with("checksum: DDEB\n")) << text;
}

TEST(DumpFile, WithoutChecksumIsNotChecked) {
  EXPECT_FALSE(parse_dump("file", small, unit, options_of("TS5700N8500"), MemoryAccess::write).checked);
}

TEST(DumpFile, NumbersAsPeopleWriteThem) {
  const Dump dump = parse_dump("file", std::string(small) + "page 0x1 address 16: 01 02\r\n", unit,
                               options_of("TS5700N8500"), MemoryAccess::write);
  EXPECT_EQ(dump.image, (MemoryImage{{{0, 5}, 0x5A}, {{0, 6}, 0x5B}, {{1, 16}, 1}, {{1, 17}, 2}}));
}

TEST(DumpFile, RefusesOtherFiles) {
  expect_refusal("", {"no dump"});
  expect_refusal("precious\n", {"no dump"});
  expect_refusal("absenc dump 2\n", {"absenc dump 2", "absenc dump 1", "use a newer absenc"});
  expect_refusal("absenc memory 1\nprotocol: tformat\n", {"memory file of a virtual encoder", "emulate --memory"});
  expect_refusal(replaced(std::string(small), "protocol: tformat", "protocol: esl"),
                 {"line 2", "protocol: esl", "protocol: tformat"});
  expect_refusal(replaced(std::string(small), "TS5700N8500", "23-bit"),
                 {"line 3", "model: 23-bit", "model: TS5700N8500"});
  expect_refusal("absenc dump 1\nmodel: TS5700N8500\n", {"line 2", "protocol"});
  expect_refusal("absenc dump 1\nprotocol: tformat\nmodel: TS5700N8500\n", {"no bytes"});
}

TEST(DumpFile, RefusesOtherOptionsWithoutAModel) {
  Options options = options_of("TS5700N8500");
  options.model = nullptr;
  const std::string text = to_dump(unit, options, {{{0, 0}, 1}});
  EXPECT_NE(text.find("option: singleturn_bits=17\n"), std::string::npos) << text;
  Options other = options;
  other.values[0] = 20;
  EXPECT_THROW(static_cast<void>(parse_dump("file", text, unit, other, MemoryAccess::write)), Failure);
}

TEST(DumpFile, NamesLineAndTrouble) {
  const std::string text(small);
  expect_refusal(text + "something\n", {"file, line 5", "page 0 address 0x00: BYTES"});
  expect_refusal(text + "page x address 7: 00\n", {"line 5", "number"});
  expect_refusal(text + "page 4294967296 address 7: 00\n", {"line 5", "number"});
  expect_refusal(text + "page -1 address 7: 00\n", {"line 5", "number"});
  expect_refusal(text + "page 0 address 7\n", {"line 5", "BYTES"});
  expect_refusal(text + "page 0 address 7:\n", {"line 5", "two hexadecimal digits"});
  expect_refusal(text + "page 0 address 7: 0\n", {"line 5", "two hexadecimal digits"});
  expect_refusal(text + "page 0 address 7: 100\n", {"line 5", "two hexadecimal digits"});
  expect_refusal(text + "page 0 address 7: 0G\n", {"line 5", "two hexadecimal digits"});
  expect_refusal(text + "page 0 address 126: 00 00\n", {"line 5", "0x7F", "0x00 to 0x7E"});
  expect_refusal(text + "page 6 address 0: 00\n", {"line 5", "no page 6"});
  expect_refusal(text + "page 1 address 0: 00\npage 0 address 6: 01\n", {"line 6", "already given in line 4"});
}

TEST(DumpFile, WhatCanOnlyBeReadMayBeComparedButNotWritten) {
  const std::string text = std::string(small) + "page 7 address 5: 23\n";
  expect_refusal(text, {"line 5", "temperature", "only be read"});
  EXPECT_EQ(refusal(text, MemoryAccess::read), "nothing");
}

TEST(MemoryImage, AddressesInWords) {
  MemoryImage image = dump_addresses(unit);
  EXPECT_EQ(addresses_in_words(unit, image), "page 0 to 5: 0x00 to 0x7E");
  image.erase({2, 5});
  EXPECT_EQ(addresses_in_words(unit, image),
            "page 0 to 1: 0x00 to 0x7E; page 2: 0x00 to 0x04, 0x06 to 0x7E; page 3 to 5: 0x00 to 0x7E");
  EXPECT_EQ(addresses_in_words(unit, {{{1, 3}, 0}, {{3, 3}, 0}}), "page 1: 0x03; page 3: 0x03");
}

TEST(MemoryImage, RunsEndAtGapsPagesAndTheirLength) {
  const MemoryImage image{{{0, 126}, 1}, {{1, 127}, 2}, {{1, 128}, 3}, {{1, 129}, 4}, {{1, 131}, 5}};
  std::vector<std::size_t> sizes;
  for (const MemoryRun& run : runs(image, 2)) sizes.push_back(run.words.size());
  EXPECT_EQ(sizes, (std::vector<std::size_t>{1, 2, 1, 1}));
}

}  // namespace
}  // namespace absenc::client
