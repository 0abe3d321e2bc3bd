// SPDX-License-Identifier: Apache-2.0
// Checks what is known of a zero that an encoder ignores.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "absenc/client/conform/changed_encoder_test.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

// Result of a zero: its error, and what the session knows of the change.
struct Zeroed {
  Error error;
  ChangeSent change;
  std::string note;
};

// Sets the zero of an encoder at the position `counts`. `is_ignored`: the encoder replies, but stores nothing.
template <class Item>
Zeroed zero_at(const Unit& unit, std::uint64_t counts, bool is_ignored) {
  const ChangedEncoder<Item> bench(parse_address(fmt::format("sim:{}?singleturn={}", unit.id, counts)));
  const Command& zero = *find_command(unit, Verb::zero);
  if (is_ignored) {
    bench.mutant->spoils_all = true;
    bench.mutant->spoil = [](MutableBytes now, const ByteList& before) {
      std::copy(before.begin(), before.end(), now.begin());
    };
  }
  std::vector<std::byte> storage(unit.host_storage);
  host::Session<Item> session(unit, bench.address.options, *bench.line, storage);
  const Conversation<Item>* const ended = session.run(zero, complete_arguments(zero, {}));
  return {ended->error(), session.change_sent(), std::string(session.change_note())};
}

// An encoder that ignores the zero, and stands so near to it that the position read back is right nevertheless.
TEST(Zero, IsNotConfirmedIfItCouldHaveBeenIgnored) {
  unsigned unproven = 0;
  for (const Unit* const unit : all_units()) {
    if (find_command(*unit, Verb::zero) == nullptr) continue;
    const EncoderAddress address = parse_address(fmt::format("sim:{}", unit->id));
    const std::uint64_t turn = std::uint64_t{1} << unit->resolution(address.options).singleturn_bits;
    const auto at = [&](std::uint64_t counts, bool is_ignored) {
      return unit->link == LinkKind::can ? zero_at<CanFrame>(*unit, counts, is_ignored)
                                         : zero_at<std::uint8_t>(*unit, counts, is_ignored);
    };
    if (at(turn / 3, false).error == Error::unsupported) continue;
    const Zeroed obeyed = at(turn / 3, false);
    EXPECT_EQ(obeyed.error, Error::none) << unit->id;
    EXPECT_EQ(obeyed.change, ChangeSent::yes) << unit->id;
    EXPECT_EQ(obeyed.note, "") << unit->id;
    const Zeroed ignored = at(turn / 3, true);
    if (ignored.error == Error::none) continue;  // this virtual encoder has its zero not only in its memory
    EXPECT_EQ(ignored.change, ChangeSent::refused) << unit->id;
    const Zeroed near = at(std::max<std::uint64_t>(turn >> 15, 1), true);
    EXPECT_TRUE(near.error != Error::none || near.change != ChangeSent::yes) << unit->id;
    if (near.change == ChangeSent::unproven) {
      ++unproven;
      EXPECT_NE(near.note.find("turn the shaft and try again"), std::string::npos) << unit->id << ": " << near.note;
    }
  }
  EXPECT_GE(unproven, 5U);
}

}  // namespace
}  // namespace absenc::client
