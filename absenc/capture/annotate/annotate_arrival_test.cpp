// SPDX-License-Identifier: Apache-2.0
// Tests annotation of characters with arrival times at a program.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/annotated_bytes_test.hpp"
#include "absenc/capture/annotate/conversation_test.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::capture {
namespace {

using testing::Talker;
using testing::Transmission;
using Kind = Annotation::Kind;
using Wire = std::vector<std::uint8_t>;

constexpr Tick gap = 20;

/// A request with its reply; `reply` is empty if the encoder sent no reply.
struct Exchange {
  Wire request;
  Wire reply;
  friend bool operator==(const Exchange&, const Exchange&) = default;
};

std::string hex(const Wire& wire) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string text;
  for (const std::uint8_t byte : wire) text += {digits[byte >> 4], digits[byte & 15]};
  return text;
}

// Returns the first difference between found and expected exchanges; "" if there is none.
std::string difference(const std::vector<Exchange>& found, const std::vector<Exchange>& exchanges) {
  const auto text = [](const std::vector<Exchange>& all, std::size_t i) {
    return i < all.size() ? hex(all[i].request) + " > " + hex(all[i].reply) : std::string("nothing");
  };
  for (std::size_t i = 0; i < std::max(found.size(), exchanges.size()); ++i) {
    if (i >= found.size() || i >= exchanges.size() || !(found[i] == exchanges[i])) {
      return std::to_string(i) + ": " + text(found, i) + " instead of " + text(exchanges, i);
    }
  }
  return {};
}

class Arrival : public ::testing::TestWithParam<const Unit*> {
 protected:
  void start(bool begins_silent) {
    Annotator::Settings settings;
    settings.begins_silent = begins_silent;
    settings.by_arrival = true;
    settings.gap = gap;
    settings.ticks.limit = LineTicks::never;
    annotator = std::make_unique<Annotator>(unit, options, settings, collector);
  }

  // Returns good exchanges between the unit's host and virtual encoder, possibly none.
  std::vector<Exchange> talk(std::size_t count, std::uint64_t seed) {
    Talker talker(unit, options, {}, seed);
    std::vector<Exchange> exchanges;
    for (std::size_t talks = 0; exchanges.size() < count && talks < exchanges.size() + 20; ++talks) {
      for (const Transmission& sent : talker.talk().transmissions) {
        if (sent.by == sim::NodeRole::host) {
          exchanges.push_back({sent.bytes, {}});
        } else if (!exchanges.empty()) {
          Wire& reply = exchanges.back().reply;
          reply.insert(reply.end(), sent.bytes.begin(), sent.bytes.end());
        }
      }
    }
    std::erase_if(exchanges, [&](const Exchange& one) {
      return one.reply.empty() || unit.check(options, {.bytes = one.request}, {.bytes = one.reply}) != Error::none;
    });
    return exchanges;
  }

  void receive(const Wire& bytes) {
    for (const std::uint8_t byte : bytes) annotator->put({.begin = now, .end = now, .value = byte});
    annotator->report_complete();
  }

  [[nodiscard]] std::vector<Exchange> good() const {
    std::vector<Exchange> all;
    for (const testing::AnnotatedBytes& one : collector.found) {
      if (one.is_good_exchange()) all.push_back({one.request, one.reply});
    }
    return all;
  }
  [[nodiscard]] std::size_t others() const { return collector.found.size() - good().size(); }

  const Unit& unit = *GetParam();
  Options options = testing::options_of(unit);
  testing::BytesCollector collector;
  std::unique_ptr<Annotator> annotator;
  Tick now = 1000;
};

std::vector<const Unit*> units_of_characters() {
  std::vector<const Unit*> units;
  for (const Unit* unit : all_units()) {
    if (unit->link == LinkKind::half_duplex || unit->link == LinkKind::full_duplex) units.push_back(unit);
  }
  return units;
}

Wire joined(const std::vector<Exchange>& exchanges) {
  Wire all;
  for (const Exchange& one : exchanges) {
    all.insert(all.end(), one.request.begin(), one.request.end());
    all.insert(all.end(), one.reply.begin(), one.reply.end());
  }
  return all;
}

TEST_P(Arrival, ExchangesInPartsAndSeveralAtOnce) {
  const std::vector<Exchange> exchanges = talk(1000, 1);
  if (exchanges.empty()) return;
  start(true);
  const Wire all = joined(exchanges);
  sim::Random random(2);
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t size = std::min<std::size_t>(all.size() - at, 1 + random.below(random.below(4) == 0 ? 60 : 6));
    receive({all.begin() + static_cast<std::ptrdiff_t>(at), all.begin() + static_cast<std::ptrdiff_t>(at + size)});
    at += size;
    // one in ten of the groups of bytes that arrive together is followed by a pause of 5 * gap, often within a frame
    now += random.below(10) == 0 ? 5 * gap : 1;
  }
  annotator->report_after_silence();
  EXPECT_EQ(difference(good(), exchanges), "");
  EXPECT_EQ(others(), 0u);
}

TEST_P(Arrival, ReportsExchangeWhenComplete) {
  const std::vector<Exchange> exchanges = talk(300, 3);
  if (exchanges.empty()) return;
  start(true);
  std::size_t late = 0;
  for (std::size_t i = 0; i < exchanges.size(); ++i) {
    receive(exchanges[i].request);
    now += gap / 2;
    receive(exchanges[i].reply);
    now += gap / 2;
    late += good().size() <= i ? 1u : 0u;
  }
  EXPECT_EQ(difference(good(), exchanges), "");
  // a reply that is shorter than the previous reply to the same command may be reported only when more bytes arrive
  EXPECT_LE(late, exchanges.size() / 20);
}

TEST_P(Arrival, CaptureBeginsWithinAnExchange) {
  const std::vector<Exchange> exchanges = talk(80, 4);
  if (exchanges.empty()) return;
  const Wire all = joined(exchanges);
  const std::size_t first = exchanges[0].request.size() + exchanges[0].reply.size();
  for (std::size_t from = 1; from < first; ++from) {
    collector.found.clear();
    now += 1000;
    start(false);
    receive({all.begin() + static_cast<std::ptrdiff_t>(from), all.end()});
    annotator->report_after_silence();
    const std::vector<Exchange> found = good();
    ASSERT_GE(found.size() + 3, exchanges.size()) << from << " " << hex(collector.found[0].reply) << " " << hex(all);
    // The exchanges found must be the last ones that were sent, in the same order.
    for (std::size_t i = 1; i <= found.size(); ++i) {
      ASSERT_EQ(found[found.size() - i], exchanges[exchanges.size() - i]) << from;
    }
    for (const testing::AnnotatedBytes& one : collector.found) {
      EXPECT_TRUE(one.error == Error::none) << from << ": cut, not bad: " << text_of(one.error).name;
    }
  }
}

TEST_P(Arrival, ADamagedReplyCostsNoOtherExchange) {
  if (unit.link != LinkKind::half_duplex) return;
  const std::vector<Exchange> exchanges = talk(400, 5);
  if (exchanges.empty()) return;
  start(true);
  sim::Random random(6);
  std::vector<Exchange> whole;
  std::size_t damaged = 0;
  for (std::size_t i = 0; i < exchanges.size(); ++i) {
    Wire reply = exchanges[i].reply;
    if (i % 16 == 8) {
      std::uint8_t& byte = reply[random.below(reply.size())];
      byte = static_cast<std::uint8_t>(byte ^ 1u << random.below(8));
      if (unit.check(options, {.bytes = exchanges[i].request}, {.bytes = reply}) == Error::none) continue;
      ++damaged;
    } else {
      whole.push_back(exchanges[i]);
    }
    receive(exchanges[i].request);
    receive(reply);
    now += 2 * gap;
  }
  annotator->report_after_silence();
  EXPECT_EQ(difference(good(), whole), "");
  std::size_t bad = 0;
  for (const testing::AnnotatedBytes& one : collector.found) bad += one.error != Error::none ? 1u : 0u;
  EXPECT_GE(bad, damaged);
}

TEST_P(Arrival, ReportsUnansweredRequests) {
  const std::vector<Exchange> exchanges = talk(20, 7);
  if (exchanges.empty()) return;
  start(true);
  receive(exchanges[0].request);
  receive(exchanges[0].reply);
  constexpr std::size_t count = 50;
  for (std::size_t i = 0; i < count; ++i) {
    now += 2 * gap;
    receive(exchanges[0].request);
  }
  EXPECT_GE(collector.found.size() + 3, count) << "they are handed out while it goes on";
  annotator->report_after_silence();
  EXPECT_EQ(good().size(), 1u);
  EXPECT_EQ(collector.found.size(), 1 + count);
  for (std::size_t i = 1; i < collector.found.size(); ++i) {
    EXPECT_EQ(collector.found[i].request, exchanges[0].request);
    EXPECT_EQ(collector.found[i].remark, Remark::unanswered);
  }
  // From here on the encoder replies to every request again.
  for (const Exchange& one : exchanges) {
    receive(one.request);
    receive(one.reply);
  }
  EXPECT_EQ(good().size(), 1 + exchanges.size());
}

std::string name_of(const ::testing::TestParamInfo<const Unit*>& info) {
  std::string name(info.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

TEST_P(Arrival, ReportsUnsolicitedFrames) {
  if (unit.streams == nullptr || !unit.streams(options)) return;
  Talker talker(unit, options, {}, 8);
  std::vector<Wire> frames;
  while (frames.size() < 300) {
    for (const Transmission& sent : talker.talk().transmissions) {
      if (unit.check(options, {}, {.bytes = sent.bytes}) == Error::none) frames.push_back(sent.bytes);
    }
  }
  start(true);
  for (const Wire& frame : frames) {
    receive({frame.begin(), frame.begin() + 2});
    now += 5 * gap;
    receive({frame.begin() + 2, frame.end()});
  }
  annotator->report_after_silence();
  ASSERT_EQ(collector.found.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(collector.found[i].error, Error::none);
    EXPECT_EQ(hex(collector.found[i].reply), hex(frames[i]));
  }
}

// Checks that replies to two commands, with different lengths, are reported as soon as they are complete.
TEST(ArrivalOfCommands, ReplyHasUsualLengthOfItsCommand) {
  const Unit& unit = *find_unit("raa38-modbus");
  const std::vector<Exchange> exchanges{
      {{0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A}, {0x01, 0x03, 0x02, 0x01, 0x7F, 0xF8, 0x34}},
      {{0x01, 0xA1, 0x02, 0xD8, 0x51}, {0x02, 0xA1, 0xC1, 0x68}}};
  Annotator::Settings settings;
  settings.begins_silent = settings.by_arrival = true;
  settings.gap = gap;
  settings.ticks.limit = LineTicks::never;
  testing::BytesCollector collector;
  const auto annotator =
      std::make_unique<Annotator>(unit, testing::options_of(unit, {{"bits", "14"}}), settings, collector);
  Tick now = 1000;
  for (std::size_t i = 0; i < 10; ++i) {
    for (const Wire& bytes : {exchanges[i % 2].request, exchanges[i % 2].reply}) {
      for (const std::uint8_t byte : bytes) annotator->put({.begin = now, .end = now, .value = byte});
      annotator->report_complete();
      now += gap / 2;
    }
    EXPECT_EQ(collector.found.size(), i + 1);
    EXPECT_TRUE(collector.found.back().is_good_exchange()) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Arrival, ::testing::ValuesIn(units_of_characters()), name_of);

}  // namespace
}  // namespace absenc::capture
