// SPDX-License-Identifier: Apache-2.0
// Compares the annotations of random exchanges with those expected, for all units that do not use CAN.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/annotate_frames.hpp"
#include "absenc/capture/annotate/conversation_test.hpp"
#include "absenc/protocol/all.hpp"
#include "tests/cases.hpp"

namespace absenc::capture {
namespace {

using testing::Talker;
using testing::TalkRecord;
using testing::Transmission;
using Kind = Annotation::Kind;
using Wire = std::vector<std::uint8_t>;

/// A copy of an annotation that owns its bytes and fields.
struct OwnedAnnotation {
  Kind kind;
  Remark remark;
  Error error;
  Tick begin;
  Tick end;
  Wire request;
  Wire reply;
  std::optional<Reading> reading;
  std::optional<Tick> turnaround;
};

struct AnnotationCollector final : AnnotationSink {
  void put(const Annotation& annotation) override {
    collected.push_back(
        {annotation.kind, annotation.remark, annotation.error, annotation.begin, annotation.end,
         Wire(annotation.request.bytes.begin(), annotation.request.bytes.end()),
         Wire(annotation.reply.bytes.begin(), annotation.reply.bytes.end()),
         annotation.contents.reading == nullptr ? std::nullopt : std::optional(*annotation.contents.reading),
         annotation.turnaround});
  }
  std::vector<OwnedAnnotation> collected;
};

std::string to_text(const Wire& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    for (const int nibble : {byte >> 4, byte & 15}) text += "0123456789ABCDEF"[nibble];
  }
  return text;
}

std::string to_text(const OwnedAnnotation& one) {
  return std::to_string(one.begin) + ".." + std::to_string(one.end) + " kind " +
         std::to_string(static_cast<int>(one.kind)) + " " + to_text(one.request) + " -> " + to_text(one.reply) + " " +
         std::string(text_of(one.error).name) + " " + std::string(text_of(one.remark)) +
         (one.reading ? " position " + std::to_string(one.reading->singleturn) : "") +
         (one.turnaround ? " after " + std::to_string(*one.turnaround) : "");
}

// ---- Expected annotations, computed from the transmissions of each side

class Truth {
 public:
  Truth(const Unit& unit, const Options& options) : judge_(unit, options), limit_(unit.timing.turnaround_limit) {}

  void add(const std::vector<Transmission>& sent) {
    for (std::size_t i = 0; i < sent.size(); ++i) {
      if (sent[i].by == sim::NodeRole::device) {
        unsolicited(sent[i]);
        continue;
      }
      if (i + 1 < sent.size() && sent[i + 1].by == sim::NodeRole::device) {
        answered(sent[i], sent[i + 1]);
        ++i;
      } else {
        const bool bad = judge_.decode({.bytes = sent[i].bytes}, {}) != Error::none;
        const bool may = !bad && !judge_.is_answered({.bytes = sent[i].bytes});
        add(Kind::request, may ? Remark::none : Remark::unanswered, may ? Error::none : Error::timeout, sent[i], {});
      }
    }
  }
  // Adds the annotation that is expected for a burst on a bidirectional link; `unit` tells which bits the host has
  // sent.
  void add_both_ways(const Burst& burst, const Unit& unit, const Options& options) {
    std::vector<bool> bits;
    for (std::size_t i = 1; i < burst.bits; ++i) bits.push_back((burst.in[i / 8] >> (7 - i % 8) & 1) != 0);
    if (burst.has_last) bits.push_back(burst.last);
    BitBuffer<4096> line;
    for (const bool bit : bits) line.append(bit ? 1 : 0, 1);
    const BitRanges ranges = unit.host_bits(options, {.bytes = line.bytes(), .bits = line.size()});
    BitBuffer<4096> request;
    BitBuffer<4096> reply;
    for (std::size_t i = 0; i < bits.size(); ++i) {
      bool by_host = false;
      for (std::size_t k = 0; k < ranges.size(); ++k) {
        by_host = by_host || (i >= ranges[k].first && i < ranges[k].first + ranges[k].count);
      }
      (by_host ? request : reply).append(bits[i] ? 1 : 0, 1);
    }
    const Error error = judge_.decode({.bytes = request.bytes(), .bits = request.size()},
                                      {.bytes = reply.bytes(), .bits = reply.size()});
    expected.push_back({Kind::exchange,
                        Remark::none,
                        error,
                        burst.begin,
                        burst.end,
                        Wire(request.bytes().begin(), request.bytes().end()),
                        Wire(reply.bytes().begin(), reply.bytes().end()),
                        reading(error),
                        {}});
  }
  void add(const Burst& burst, const Unit& unit) {
    if (control_.settle(false)) add(control_.annotation(judge_));
    std::size_t idle = unit.link == LinkKind::clocked ? unit.line.idle_clocks : 0;
    if (burst.low_before && unit.control_bit != nullptr) ++idle;
    Wire bits((burst.bits - idle + 7) / 8);
    for (std::size_t i = idle; i < burst.bits; ++i) {
      const unsigned bit = burst.in[i / 8] >> (7 - i % 8) & 1u;
      bits[(i - idle) / 8] = static_cast<std::uint8_t>(bits[(i - idle) / 8] | bit << (7 - (i - idle) % 8));
    }
    const bool clocked = unit.link == LinkKind::clocked;
    const Frame request{.bytes = clocked ? Bytes{} : Bytes(burst.out).first(2)};
    const std::optional<std::size_t> place = judge_.control_bit({.bytes = bits, .bits = burst.bits - idle});
    const bool bit_is_one = place && (bits[*place / 8] >> (7 - *place % 8) & 1) != 0;
    if (bit_is_one && control_.may_answer()) bits[*place / 8] &= static_cast<std::uint8_t>(~(0x80u >> *place % 8));
    Error error = judge_.decode(request, {.bytes = bits, .bits = clocked ? burst.bits - idle : 0});
    // A host may send more clocks than the reply needs, so the reply may be shorter than the burst.
    const std::size_t size = clocked ? 0 : judge_.frame_size(Direction::reply, bits);
    if (error != Error::none && size != 0 &&
        judge_.decode(request, {.bytes = Bytes(bits).first(size)}) == Error::none) {
      error = Error::none;
      bits.resize(size);
    }
    expected.push_back({clocked ? Kind::reply : Kind::exchange,
                        Remark::none,
                        error,
                        burst.begin,
                        burst.end,
                        Wire(request.bytes.begin(), request.bytes.end()),
                        bits,
                        reading(error),
                        {}});
    if (unit.control_bit != nullptr) control_.put(burst, bit_is_one, error);
  }

  std::vector<OwnedAnnotation> expected;

 private:
  ControlFrames control_;
  std::size_t stream_size_ = 0;  // size of the last good unsolicited frame in bytes; 0: none yet
  std::optional<Reading> reading(Error error) {
    return error == Error::none && judge_.contents().reading != nullptr ? std::optional(*judge_.contents().reading)
                                                                        : std::nullopt;
  }

  void add(const Annotation& control) {
    expected.push_back({control.kind,
                        control.remark,
                        control.error,
                        control.begin,
                        control.end,
                        Wire(control.request.bytes.begin(), control.request.bytes.end()),
                        Wire(control.reply.bytes.begin(), control.reply.bytes.end()),
                        {},
                        {}});
  }

  void add(Kind kind, Remark remark, Error error, const Transmission& sent, std::optional<Reading> read) {
    OwnedAnnotation one{kind, remark, error, sent.begin, sent.end, {}, {}, read, {}};
    (kind == Kind::request ? one.request : one.reply) = sent.bytes;
    expected.push_back(one);
  }

  void unsolicited(const Transmission& sent) {
    const std::size_t size = stream_size_;
    const Error error = judge_.decode({}, {.bytes = sent.bytes});
    if (error == Error::none) stream_size_ = sent.bytes.size();
    if (error != Error::none && judge_.streams() && size != 0 && sent.bytes.size() > size) {
      const auto middle = sent.bytes.end() - static_cast<std::ptrdiff_t>(size);
      const Wire last(middle, sent.bytes.end());
      if (judge_.decode({}, {.bytes = last}) == Error::none) return add_disturbed(sent, middle, last);
    }
    add(Kind::reply, Remark::none, error, sent, reading(error));
  }

  void add_disturbed(const Transmission& sent, Wire::const_iterator middle, const Wire& last) {
    const Wire before(sent.bytes.begin(), middle);
    const Tick each = (sent.end - sent.begin) / sent.bytes.size();
    const Tick turn = sent.begin + each * before.size();
    add(Kind::reply, Remark::none, judge_.decode({}, {.bytes = before}), {sent.by, before, sent.begin, turn}, {});
    static_cast<void>(judge_.decode({}, {.bytes = last}));
    add(Kind::reply, Remark::none, Error::none, {sent.by, last, turn, sent.end}, reading(Error::none));
  }

  void answered(const Transmission& request_sent, const Transmission& sent) {
    Wire reply = sent.bytes;
    OwnedAnnotation one{
        Kind::exchange, Remark::none, Error::none, request_sent.begin, sent.end, request_sent.bytes, {}, {}, {}};
    one.turnaround = sent.begin - request_sent.end;
    const Tick each = (sent.end - sent.begin) / reply.size();
    const auto good = [&](const Wire& bytes) {
      return judge_.decode({.bytes = request_sent.bytes}, {.bytes = bytes}) == Error::none;
    };
    const Wire half(reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(reply.size() / 2));
    const Wire second(reply.begin() + static_cast<std::ptrdiff_t>(reply.size() / 2), reply.end());
    bool twice = half == second && !half.empty() && good(half);
    if (twice) reply = half;
    if (twice) one.end = sent.begin + each * half.size();
    if (!good(reply) && reply.size() > request_sent.bytes.size() &&
        std::equal(request_sent.bytes.begin(), request_sent.bytes.end(), reply.begin())) {
      const Wire behind(reply.begin() + static_cast<std::ptrdiff_t>(request_sent.bytes.size()), reply.end());
      if (good(behind)) {
        one.remark = Remark::echo;
        one.turnaround = *one.turnaround + each * request_sent.bytes.size();
        reply = behind;
      }
    }
    one.error = judge_.decode({.bytes = request_sent.bytes}, {.bytes = reply});
    one.reply = reply;
    if (one.error == Error::unsupported && !judge_.is_answered({.bytes = request_sent.bytes})) {
      one.error = Error::none;
      one.remark = Remark::undocumented;
    }
    one.reading = reading(one.error);
    // A late reply that equals its request is annotated as a repeated request.
    if (one.error == Error::none && *one.turnaround > static_cast<Tick>(limit_.count()) && one.request == one.reply) {
      add(Kind::request, Remark::unanswered, Error::timeout, request_sent, {});
      return add(Kind::request, Remark::unanswered, Error::timeout, sent, {});
    }
    if (one.error == Error::none && *one.turnaround > static_cast<Tick>(limit_.count())) {
      one.error = Error::timeout;
      one.remark = Remark::late;
      one.reading.reset();
    }
    expected.push_back(one);
    if (twice) {
      const Transmission rest{sent.by, half, one.end, sent.end};
      add(Kind::reply, Remark::repeated, Error::unexpected_reply, rest, {});
    }
  }

  Judge judge_;
  Time limit_;
};

// ---- Comparison of found and expected annotations

// Requires that `found` equals `expected`. Of the bad exchanges only a `share` (0 to 1) must match exactly, because
// several faults together may look like another fault.
void expect_same(const std::vector<OwnedAnnotation>& found, const std::vector<OwnedAnnotation>& expected,
                 double share = 1) {
  std::size_t next = 0;
  std::size_t bad = 0;
  std::size_t exact = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const OwnedAnnotation& one = expected[i];
    const std::string context =
        std::to_string(i) + " " + to_text(one) + (i == 0 ? "" : "\nbefore: " + to_text(expected[i - 1]));
    ASSERT_LT(next, found.size()) << context;
    if (one.error == Error::none) {
      ASSERT_EQ(to_text(found[next++]), to_text(one)) << context;
      continue;
    }
    ++bad;
    if (to_text(found[next]) == to_text(one)) {
      ++exact;
      ++next;
      continue;
    }
    if (share == 1) ADD_FAILURE() << context << "\nfound " << to_text(found[next]);
    const std::size_t first = next;
    bool has_error = false;
    // A host may send its next request while an encoder still sends a doubled reply.
    const std::string following = i + 1 < expected.size() ? to_text(expected[i + 1]) : "";
    for (; next < found.size() && found[next].begin >= one.begin && found[next].end <= one.end; ++next) {
      if (to_text(found[next]) == following) break;
      has_error = has_error || found[next].error != Error::none;
    }
    ASSERT_TRUE(has_error) << context << "\nfound " << to_text(found[first]);
  }
  EXPECT_EQ(next, found.size());
  EXPECT_GE(static_cast<double>(exact), share * static_cast<double>(bad)) << "of " << bad;
}

std::vector<const Unit*> units_with(bool characters) {
  std::vector<const Unit*> units;
  for (const Unit* unit : all_units()) {
    const bool is = unit->link == LinkKind::half_duplex || unit->link == LinkKind::full_duplex;
    if (is == characters && unit->link != LinkKind::can) units.push_back(unit);
  }
  return units;
}

sim::FaultRates faults_of(const Unit& unit, const Options& options) {
  sim::FaultRates rates = sim::testing::damaged_replies(0.05);
  rates[sim::FaultKind::request_corrupt] = 0.005;
  rates.delay = unit.timing.turnaround_limit * 3 / 2;
  // In a stream these faults cannot be detected: a frame sent twice looks like two frames, a late frame like one in
  // time.
  if (unit.streams != nullptr && unit.streams(options)) {
    rates[sim::FaultKind::repeat] = rates[sim::FaultKind::delay] = 0;
  }
  return rates;
}

Annotator::Settings settings_of(const Unit& unit) {
  Annotator::Settings settings;
  settings.ticks = line_ticks(unit, 1e9 / testing::line_of(unit).rate, 1'000'000'000);
  settings.begins_silent = true;
  if (unit.link == LinkKind::full_duplex) {
    settings.channels = {Carries::detect, Carries::detect};
    settings.channel_count = 2;
  }
  return settings;
}

std::string name_of(const ::testing::TestParamInfo<const Unit*>& info) {
  std::string name(info.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

class Characters : public ::testing::TestWithParam<const Unit*> {
 protected:
  const Unit& unit = *GetParam();
  Options options = testing::options_of(unit);

  /// Runs commands until at least `exchanges` annotations are expected.
  void talk(const sim::FaultRates& rates, std::size_t exchanges, std::uint64_t seed) {
    Talker talker(unit, options, rates, seed);
    while (truth.expected.size() < exchanges) {
      const TalkRecord one = talker.talk();
      if (one.collided) continue;
      truth.add(one.transmissions);
      characters.insert(characters.end(), one.characters.begin(), one.characters.end());
    }
    std::stable_sort(characters.begin(), characters.end(),
                     [](const Character& a, const Character& b) { return a.begin < b.begin; });
    end = talker.now();
  }
  std::vector<OwnedAnnotation> annotate(const Annotator::Settings& settings) const {
    AnnotationCollector collector;
    const auto annotator = std::make_unique<Annotator>(unit, options, settings, collector);
    for (const Character& character : characters) annotator->put(character);
    annotator->finish(end);
    return collector.collected;
  }

  Truth truth{unit, options};
  std::vector<Character> characters;
  Tick end = 0;
};

TEST_P(Characters, EveryExchangeWithoutFaults) {
  talk({}, 2000, 1);
  for (const OwnedAnnotation& one : truth.expected) ASSERT_EQ(one.error, Error::none) << to_text(one);
  expect_same(annotate(settings_of(unit)), truth.expected);
}

// Returns whether the unit accepts many random replies as good, so that it would also accept damaged replies.
bool has_weak_check(const Unit& unit, const Options& options) {
  NoFields nowhere;
  sim::Random random(1);
  for (const Vector& vector : unit.vectors) {
    unsigned good = 0;
    for (int i = 0; i < 4096 && vector.error == Error::none && !vector.reply.empty(); ++i) {
      std::vector<std::uint8_t> noise(vector.reply.size());
      for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random.below(256));
      if (unit.decode(options, {.bytes = vector.request}, {.bytes = noise}, nowhere) == Error::none) ++good;
    }
    if (good > 4096 / 64) return true;
  }
  return false;
}

TEST_P(Characters, FindsEveryErrorAtItsPlace) {
  if (has_weak_check(unit, options)) GTEST_SKIP() << "its check is too weak";
  talk(faults_of(unit, options), 5000, 2);
  expect_same(annotate(settings_of(unit)), truth.expected, 0.97);
  std::map<Error, int> errors;
  for (const OwnedAnnotation& one : truth.expected) ++errors[one.error];
  EXPECT_GT(errors.size(), 3u);
  EXPECT_GT(errors[Error::none], 2000);
}

TEST_P(Characters, FindsRepliesWithoutRequests) {
  talk({}, 500, 3);
  if (unit.link != LinkKind::full_duplex) return;
  std::erase_if(characters, [](const Character& character) { return character.channel == 0; });
  for (Character& character : characters) character.channel = 0;
  Annotator::Settings settings = settings_of(unit);
  settings.channel_count = 1;
  settings.channels[0] = Carries::replies;
  std::size_t positions = 0;
  for (const OwnedAnnotation& one : annotate(settings)) positions += one.reading ? 1u : 0u;
  std::size_t expected = 0;
  for (const OwnedAnnotation& one : truth.expected) expected += one.reading ? 1u : 0u;
  EXPECT_GE(positions, expected);
}

// Checks that a wrong stop bit in a reply makes this exchange bad, and no other exchange.
TEST_P(Characters, DamagedCharacters) {
  if (has_weak_check(unit, options)) GTEST_SKIP() << "its check is too weak";
  talk({}, 1000, 4);
  sim::Random random(4);
  std::vector<OwnedAnnotation> expected = truth.expected;
  for (OwnedAnnotation& one : expected) {
    const auto first = std::find_if(characters.begin(), characters.end(),
                                    [&](const Character& character) { return character.begin >= one.begin; });
    if (!random.chance(0.1) || one.kind != Kind::exchange || &one == &expected.front()) continue;
    std::vector<Character*> of_reply;
    for (auto character = first; character != characters.end() && character->begin < one.end; ++character) {
      if (character->begin >= one.begin + (one.end - one.begin) / 2) of_reply.push_back(&*character);
    }
    if (of_reply.empty()) continue;
    of_reply.back()->bad_stop = true;
    one.error = Error::bad_framing;
    one.remark = Remark::damaged;
    one.reading.reset();
  }
  expect_same(annotate(settings_of(unit)), expected);
}

TEST_P(Characters, BeginsAnywhere) {
  talk({}, 300, 5);
  const std::vector<Character> all = characters;
  std::map<std::pair<Tick, Tick>, const OwnedAnnotation*> there;
  for (const OwnedAnnotation& one : truth.expected) there[{one.begin, one.end}] = &one;
  const std::size_t step = 200 / test_cases(200);
  for (std::size_t from = 1; from < std::min<std::size_t>(all.size(), 200); from += step) {
    characters.assign(all.begin() + static_cast<std::ptrdiff_t>(from), all.end());
    Annotator::Settings settings = settings_of(unit);
    settings.begins_silent = false;
    settings.begin = characters.front().begin - 1;
    std::size_t missed = 0;
    std::size_t first = 0;
    for (const OwnedAnnotation& one : truth.expected) first += one.begin < settings.begin ? 1u : 0u;
    const std::vector<OwnedAnnotation> found = annotate(settings);
    for (const OwnedAnnotation& one : found) {
      if (one.error != Error::none && ++missed == 1) std::printf("%zu: %s\n", from, to_text(one).c_str());
      if (one.error != Error::none || one.kind != Kind::exchange) continue;
      const auto known = there.find({one.begin, one.end});
      ASSERT_NE(known, there.end()) << from << ": " << to_text(one);
      ASSERT_EQ(to_text(one), to_text(*known->second));
    }
    EXPECT_LE(missed, 0u) << from;
    EXPECT_GE(found.size() + 2, truth.expected.size() - first) << from;
  }
}

INSTANTIATE_TEST_SUITE_P(Units, Characters, ::testing::ValuesIn(units_with(true)), name_of);

// ---- SPI and clocked links

class Bursts : public ::testing::TestWithParam<const Unit*> {};

TEST_P(Bursts, EveryExchange) {
  const Unit& unit = *GetParam();
  const Options options = testing::options_of(unit);
  Talker talker(unit, options, faults_of(unit, options), 6);
  Truth truth(unit, options);
  AnnotationCollector collector;
  BurstAnnotator annotator(unit, options, collector);
  while (truth.expected.size() < 5000) {
    for (const Burst& burst : talker.talk().bursts) {
      if (unit.link == LinkKind::clocked_bidirectional) {
        truth.add_both_ways(burst, unit, options);
      } else {
        truth.add(burst, unit);
      }
      annotator.put(burst);
    }
  }
  expect_same(collector.collected, truth.expected);
  EXPECT_GT(talker.faulty().damaged_replies(), 100u);
}

INSTANTIATE_TEST_SUITE_P(Units, Bursts, ::testing::ValuesIn(units_with(false)), name_of);

}  // namespace
}  // namespace absenc::capture
