// SPDX-License-Identifier: Apache-2.0
// Tests annotation in special cases, such as lines without pauses, bytes without times, CAN.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/annotate_frames.hpp"
#include "absenc/capture/annotate/completed_readings.hpp"
#include "absenc/capture/annotate/conversation_test.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::capture {
namespace {

using testing::Talker;
using testing::TalkRecord;
using testing::Transmission;
using Kind = Annotation::Kind;
using Wire = std::vector<std::uint8_t>;

struct FoundAnnotation {
  Kind kind;
  Remark remark;
  Error error;
  Tick begin;
  Wire request;
  Wire reply;
  std::optional<Tick> turnaround;
};

struct AnnotationCollector final : AnnotationSink {
  void put(const Annotation& one) override {
    found.push_back({one.kind,
                     one.remark,
                     one.error,
                     one.begin,
                     {one.request.bytes.begin(), one.request.bytes.end()},
                     {one.reply.bytes.begin(), one.reply.bytes.end()},
                     one.turnaround});
    for (const Frame* frame : {&one.request, &one.reply}) {
      if (frame->can != nullptr) ids.push_back(frame->can->id);
    }
  }
  std::vector<FoundAnnotation> found;
  std::vector<std::uint32_t> ids;
};

class OfUnit : public ::testing::TestWithParam<const Unit*> {
 protected:
  const Unit& unit = *GetParam();
  Options options = testing::options_of(unit);

  std::vector<Transmission> talk(std::size_t count, std::uint64_t seed) {
    Talker talker(unit, options, {}, seed);
    std::vector<Transmission> transmissions;
    while (transmissions.size() < count) {
      const TalkRecord one = talker.talk();
      transmissions.insert(transmissions.end(), one.transmissions.begin(), one.transmissions.end());
    }
    return transmissions;
  }
  std::vector<FoundAnnotation> annotate(const std::vector<Character>& characters,
                                        const Annotator::Settings& settings) const {
    AnnotationCollector collector;
    const auto annotator = std::make_unique<Annotator>(unit, options, settings, collector);
    for (const Character& character : characters) annotator->put(character);
    annotator->finish(characters.empty() ? 0 : characters.back().end + settings.ticks.pause);
    return collector.found;
  }
};

std::string name_of(const ::testing::TestParamInfo<const Unit*>& info) {
  std::string name(info.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::vector<const Unit*> units_of_characters() {
  std::vector<const Unit*> units;
  for (const Unit* unit : all_units()) {
    if (unit->link == LinkKind::half_duplex || unit->link == LinkKind::full_duplex) units.push_back(unit);
  }
  return units;
}

constexpr Tick length = 100;  // duration of a character in ticks

TEST_P(OfUnit, ALineThatNeverPauses) {
  std::vector<Character> characters;
  std::vector<Tick> begins;
  std::vector<std::size_t> sizes;
  for (const Transmission& transmission : talk(2000, 1)) {
    AnnotationCollector collector;
    Judge judge(unit, options);
    const bool is_position = transmission.by == sim::NodeRole::device &&
                             judge.decode({}, {.bytes = transmission.bytes}) == Error::none &&
                             judge.contents().reading != nullptr;
    if (!is_position) continue;
    begins.push_back(characters.size() * length);
    sizes.push_back(transmission.bytes.size());
    for (const std::uint8_t byte : transmission.bytes) {
      const Tick begin = characters.size() * length;
      characters.push_back({.begin = begin, .end = begin + length, .value = byte});
    }
  }
  ASSERT_GT(begins.size(), 50u);
  ASSERT_GT(characters.size(), 2 * Run::capacity / 3);
  Annotator::Settings settings;
  settings.channels[0] = Carries::replies;
  settings.ticks = {.pause = length / 2, .character = length};
  for (std::size_t from = 0; from < 2 * sizes[0]; ++from) {
    std::vector<Character> seen(characters.begin() + static_cast<std::ptrdiff_t>(from), characters.end());
    // more characters without a pause than a Run can hold, because only then the annotator knows that the line never
    // pauses
    while (seen.size() <= Run::capacity) {
      const Tick behind = seen.back().end - characters.front().begin;
      for (Character character : characters) {
        character.begin += behind;
        character.end += behind;
        seen.push_back(character);
      }
    }
    settings.begin = seen.front().begin;
    std::size_t good = 0;
    Tick skipped_until = 0;
    for (const FoundAnnotation& one : annotate(seen, settings)) {
      const Tick begin = one.begin % (characters.size() * length);
      if (one.error != Error::none || one.remark != Remark::none) {
        EXPECT_LT(one.begin, settings.begin + 200 * length) << from << " " << text_of(one.error).name;
        skipped_until = one.begin;
        continue;
      }
      ++good;
      const auto there = std::find(begins.begin(), begins.end(), begin);
      ASSERT_NE(there, begins.end()) << from << ": a frame at " << begin / length;
      EXPECT_EQ(one.reply.size(), sizes[static_cast<std::size_t>(there - begins.begin())]);
    }
    EXPECT_GE(good + 3, begins.size()) << from << ", skipped until " << skipped_until;
  }
}

TEST_P(OfUnit, BytesWithoutTimes) {
  std::vector<Character> characters;
  std::vector<Transmission> transmissions = talk(1200, 2);
  for (std::size_t i = 0; i < transmissions.size(); ++i) {
    for (const std::uint8_t byte : transmissions[i].bytes) {
      const Tick begin = characters.size();
      characters.push_back({.begin = begin, .end = begin + 1, .value = byte});
    }
  }
  ASSERT_GT(characters.size(), 3 * Run::capacity);
  Annotator::Settings settings;
  settings.begins_silent = true;
  const std::vector<FoundAnnotation> found = annotate(characters, settings);
  std::size_t next = 0;
  std::size_t wrong = 0;
  for (const FoundAnnotation& one : found) {
    Wire bytes = one.request;
    bytes.insert(bytes.end(), one.reply.begin(), one.reply.end());
    Wire expected;
    while (next < transmissions.size() && expected.size() < bytes.size()) {
      expected.insert(expected.end(), transmissions[next].bytes.begin(), transmissions[next].bytes.end());
      ++next;
    }
    wrong += one.error != Error::none || bytes != expected ? 1u : 0u;
    if (one.error != Error::none)
      ADD_FAILURE() << text_of(one.error).name << " at " << one.begin << " " << std::string(bytes.begin(), bytes.end());
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(next, transmissions.size());
}

TEST_P(OfUnit, FindsWireOfRequests) {
  if (unit.link != LinkKind::full_duplex) return;
  for (const std::uint8_t swapped : {std::uint8_t{0}, std::uint8_t{1}}) {
    Talker talker(unit, options, {}, 3);
    std::vector<Character> characters;
    for (int i = 0; i < 200; ++i) {
      for (Character character : talker.talk().characters) {
        character.channel ^= swapped;
        characters.push_back(character);
      }
    }
    Annotator::Settings settings;
    settings.channels = {Carries::detect, Carries::detect};
    settings.channel_count = 2;
    settings.begins_silent = true;
    settings.ticks = line_ticks(unit, 1e9 / testing::line_of(unit).rate, 1'000'000'000);
    std::size_t exchanges = 0;
    for (const FoundAnnotation& one : annotate(characters, settings)) {
      EXPECT_EQ(one.error, Error::none);
      exchanges += one.kind == Kind::exchange ? 1u : 0u;
    }
    EXPECT_GE(exchanges, 150u);
  }
}

TEST_P(OfUnit, NoiseBetweenExchanges) {
  const auto begins_nothing = [&](std::uint8_t byte) {
    for (const Direction direction : {Direction::request, Direction::reply}) {
      const Wire many(64, byte);
      const FrameEnd end = unit.frame_end(options, direction, Bytes(many).first(1));
      const bool may = end.kind == FrameEnd::Kind::complete ||
                       unit.frame_end(options, direction, many).kind == FrameEnd::Kind::complete;
      if (may) return false;
    }
    return true;
  };
  Wire noise;
  for (unsigned byte = 0; byte < 256; ++byte) {
    if (begins_nothing(static_cast<std::uint8_t>(byte))) noise.push_back(static_cast<std::uint8_t>(byte));
  }
  if (noise.empty()) GTEST_SKIP() << "any byte may begin a frame";
  Talker talker(unit, options, {}, 4);
  std::vector<Character> quiet;
  std::vector<Character> noisy;
  std::size_t noises = 0;
  const auto pause = static_cast<Tick>((unit.timing.turnaround_limit + std::chrono::milliseconds(1)).count());
  const Tick each = static_cast<Tick>(testing::line_of(unit).character().count());
  for (int i = 0; i < 300; ++i) {
    for (const Character& character : talker.talk().characters) {
      quiet.push_back(character);
      noisy.push_back(character);
    }
    const std::uint8_t byte = noise[talker.random().below(noise.size())];
    ++noises;
    const std::uint64_t count = 1 + talker.random().below(3);
    for (std::uint64_t k = 0; k < count; ++k) {
      const Tick begin = talker.now() - pause / 2 + k * each;
      noisy.push_back({.begin = begin, .end = begin + each, .value = byte});
    }
  }
  Annotator::Settings settings;
  settings.begins_silent = true;
  settings.ticks = line_ticks(unit, 1e9 / testing::line_of(unit).rate, 1'000'000'000);
  if (unit.link == LinkKind::full_duplex) {
    settings.channels = {Carries::requests, Carries::replies};
    settings.channel_count = 2;
  }
  const std::vector<FoundAnnotation> without = annotate(quiet, settings);
  std::size_t next = 0;
  std::size_t bad = 0;
  for (const FoundAnnotation& one : annotate(noisy, settings)) {
    if (one.error != Error::none) {
      ++bad;
      EXPECT_NE(one.kind, Kind::exchange) << one.begin;
      continue;
    }
    ASSERT_LT(next, without.size());
    EXPECT_EQ(one.begin, without[next].begin);
    EXPECT_EQ(one.request, without[next].request);
    EXPECT_EQ(one.reply, without[next].reply);
    ++next;
  }
  EXPECT_EQ(next, without.size());
  EXPECT_EQ(bad, noises);
}

INSTANTIATE_TEST_SUITE_P(Units, OfUnit, ::testing::ValuesIn(units_of_characters()), name_of);

// ---- CAN: a toy protocol; requests on 0x200 + node, replies of equal data on 0x100 + node

Error decode_toy(const Options&, Frame request, Frame reply, FieldSink& sink) {
  if (reply.can == nullptr) return (request.can->id & 0x700) == 0x200 ? Error::none : Error::unexpected_reply;
  if ((reply.can->id & 0x700) != 0x100) return Error::unexpected_reply;
  if (request.can != nullptr) {
    const bool is_answer = (request.can->id & 0xFF) == (reply.can->id & 0xFF) && request.can->data == reply.can->data;
    if (!is_answer) return Error::unexpected_reply;
  }
  sink.put_reading({.singleturn = reply.can->data[0], .singleturn_bits = 8, .singleturn_valid_bits = 8});
  return Error::none;
}

Unit toy() {
  Unit unit{};
  unit.id = "toy";
  unit.link = LinkKind::can;
  unit.decode = decode_toy;
  return unit;
}

CanRecord record(Tick at, std::uint32_t id, std::uint8_t value) {
  CanRecord one{.at = at};
  one.frame.id = id;
  one.frame.size = 8;
  one.frame.data[0] = value;
  return one;
}

TEST(Can, NodesAnswerInAnyOrder) {
  const Unit unit = toy();
  AnnotationCollector collector;
  CanAnnotator annotator(unit, {}, {.limit = 1000}, collector);
  annotator.put(record(0, 0x201, 7));
  annotator.put(record(10, 0x202, 8));
  // an unsolicited frame of node 2, which is not the reply to the request sent before
  annotator.put(record(20, 0x102, 9));
  annotator.put(record(30, 0x102, 8));
  annotator.put(record(40, 0x101, 7));
  annotator.put(record(50, 0x333, 0));
  CanRecord error = record(60, 0x004, 0);
  error.error_frame = true;
  annotator.put(error);
  annotator.put(record(70, 0x203, 1));
  annotator.put(record(2000, 0x204, 1));
  annotator.finish(2500);
  ASSERT_EQ(collector.found.size(), 7u);
  const auto expect = [&](std::size_t i, Kind kind, Error wrong, Remark remark, Tick begin) {
    EXPECT_EQ(collector.found[i].kind, kind) << i;
    EXPECT_EQ(collector.found[i].error, wrong) << i;
    EXPECT_EQ(collector.found[i].remark, remark) << i;
    EXPECT_EQ(collector.found[i].begin, begin) << i;
  };
  expect(0, Kind::reply, Error::none, Remark::none, 20);
  expect(1, Kind::exchange, Error::none, Remark::none, 10);
  expect(2, Kind::exchange, Error::none, Remark::none, 0);
  EXPECT_EQ(collector.found[1].turnaround, 20u);
  EXPECT_EQ(collector.found[2].turnaround, 40u);
  expect(3, Kind::noise, Error::unexpected_reply, Remark::none, 50);
  expect(4, Kind::noise, Error::bad_framing, Remark::damaged, 60);
  expect(5, Kind::request, Error::timeout, Remark::unanswered, 70);
  expect(6, Kind::request, Error::none, Remark::cut, 2000);
  EXPECT_EQ(collector.ids, (std::vector<std::uint32_t>{0x102, 0x202, 0x102, 0x201, 0x101, 0x333, 4, 0x203, 0x204}));
}

TEST(CompletedReadings, CompletesAReadingByWhatTheSameEncoderReported) {
  static constexpr std::array<FieldInfo, 1> fields{
      {{.name = "node", .kind = FieldInfo::Kind::number, .unit = "", .meaning = "", .role = Role::encoder}}};
  Unit unit = toy();
  unit.remembered = [](const Reading& before, Reading now) {
    now.alarms_reported |= before.alarms_reported;
    now.singleturn_known = now.alarms_reported != 0;
    return now;
  };
  struct Last final : AnnotationSink {
    void put(const Annotation& one) override {
      if (one.contents.reading != nullptr) known = one.contents.reading->singleturn_known;
    }
    bool known = false;
  } last;
  CompletedReadings remembering(unit, {}, last);
  const auto is_known_after = [&](std::int64_t node, std::uint32_t reported, Error error = Error::none) {
    const Reading reading{.singleturn_known = false, .alarms_reported = reported};
    const FieldValue value{.info = &fields[0], .number = node};
    remembering.put({.kind = Kind::reply, .error = error, .contents = {{&value, 1}, &reading}});
    return last.known;
  };
  EXPECT_FALSE(is_known_after(1, 0));
  EXPECT_FALSE(is_known_after(1, 1, Error::sequence_mismatch)) << "nothing of a bad reply counts";
  EXPECT_FALSE(is_known_after(1, 0));
  EXPECT_TRUE(is_known_after(1, 1));
  EXPECT_TRUE(is_known_after(1, 0));
  EXPECT_FALSE(is_known_after(2, 0)) << "another encoder";
  remembering.put({.kind = Kind::request, .remark = Remark::unanswered, .error = Error::timeout});
  EXPECT_FALSE(is_known_after(1, 0)) << "it may have been switched off";
  EXPECT_TRUE(is_known_after(1, 1));
  EXPECT_TRUE(is_known_after(1, 0));
}

TEST(CompletedReadings, ForgetsAlarmsThatWereCleared) {
  const Unit& unit = *find_unit("tformat");
  const Options options = testing::options_of(unit);
  struct Last final : AnnotationSink {
    void put(const Annotation& one) override { reading = *one.contents.reading; }
    Reading reading{};
  } last;
  CompletedReadings remembering(unit, options, last);
  const auto after = [&](std::uint8_t command, std::vector<std::uint8_t> reply) {
    const std::vector<std::uint8_t> request{command};
    std::uint8_t check = 0;
    for (const std::uint8_t byte : reply) check ^= byte;
    reply.push_back(check);
    Judge judge(unit, options);
    const Frame sent{.bytes = request};
    const Frame received{.bytes = reply};
    EXPECT_EQ(judge.decode(sent, received), Error::none);
    remembering.put({.kind = Kind::exchange,
                     .error = Error::none,
                     .request = sent,
                     .reply = received,
                     .contents = judge.contents()});
    return last.reading;
  };
  constexpr std::uint32_t counter_overflow = 0x08;
  EXPECT_EQ(after(0x1A, {0x1A, 0, 0, 0, 0, 0x11, 0, 0, 0, counter_overflow}).alarms, counter_overflow);
  EXPECT_EQ(after(0x02, {0x02, 0, 0, 0, 0}).alarms, counter_overflow);
  EXPECT_EQ(after(0xBA, {0xBA, 0, 0, 0, 0}).alarms, counter_overflow) << "the tenth still has the old ones";
  const Reading cleared = after(0x02, {0x02, 0, 0, 0, 0});
  EXPECT_EQ(cleared.alarms, 0u);
  EXPECT_EQ(cleared.alarms_reported & counter_overflow, 0u) << "not reported by any reply since";
}

TEST(Can, EachReplyBelongsToTheNewestRequest) {
  const Unit& unit = *find_unit("raa38-can");
  Options options;
  ASSERT_EQ(resolve_options(unit, {}, {}, options).kind, OptionError::Kind::none);
  AnnotationCollector collector;
  CanAnnotator annotator(unit, options, {.limit = 100'000}, collector);
  const auto send_request = [&](Tick at) {
    CanRecord one = record(at, 0x220, 0xFF);
    one.frame.data[0] = 0x80;
    one.frame.data[1] = 0x20;
    annotator.put(one);
  };
  const auto reply = [&](Tick at, bool good) {
    CanRecord one = record(at, 0x120, 5);
    one.frame.data[7] = good ? 0 : 1;
    annotator.put(one);
  };
  for (Tick i = 0; i < 6; ++i) {
    send_request(1000 * i);
    if (i != 3) reply(1000 * i + 70, i != 1);
  }
  annotator.finish(1'000'000);
  ASSERT_EQ(collector.found.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const FoundAnnotation& one = collector.found[i];
    EXPECT_EQ(one.begin, 1000 * i);
    EXPECT_EQ(one.error, i == 1 ? Error::out_of_range : i == 3 ? Error::timeout : Error::none) << i;
    EXPECT_EQ(one.kind, i == 3 ? Kind::request : Kind::exchange) << i;
    if (i != 3) {
      EXPECT_EQ(one.turnaround, 70u) << i;
    }
  }
}

}  // namespace
}  // namespace absenc::capture
