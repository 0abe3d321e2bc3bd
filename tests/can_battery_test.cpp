// SPDX-License-Identifier: Apache-2.0
// The battery (battery_test.cpp) for units whose link carries CAN frames: every vector decoded whole, cut and with each
// bit flipped, and fed to the unit's own host conversation among the traffic of others.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "absenc/protocol/vector_check.hpp"

namespace absenc {
namespace {

struct Case {
  const Unit* unit;
  const Vector* vector;
};

std::vector<Case> cases_where(bool (*wanted)(const Case&)) {
  std::vector<Case> cases;
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::can) continue;
    for (const Vector& vector : unit->vectors) {
      if (wanted({unit, &vector})) cases.push_back({unit, &vector});
    }
  }
  return cases;
}

using Fields = std::map<std::string, std::pair<std::int64_t, float>>;

struct Collector final : FieldSink {
  void put(const FieldValue& value) override {
    fields[std::string(value.info->name)] = {value.number, static_cast<float>(value.real)};
  }
  Fields fields;
};

Fields expected_fields(const Vector& vector) {
  Fields fields;
  for (const Expected& one : vector.fields) fields[std::string(one.field)] = {one.number, static_cast<float>(one.real)};
  return fields;
}

Options options_of(const Case& test) {
  std::vector<OptionText> settings;
  std::string_view text = test.vector->options;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), one.size() + 1));
    settings.push_back({one.substr(0, one.find('=')), one.substr(one.find('=') + 1)});
  }
  Options options;
  EXPECT_EQ(resolve_options(*test.unit, {}, settings, options).kind, OptionError::Kind::none) << test.vector->options;
  return options;
}

class CanBattery : public ::testing::TestWithParam<Case> {
 protected:
  const Unit& unit = *GetParam().unit;
  const Vector& vector = *GetParam().vector;
  const Options options = options_of(GetParam());
  const CanFrame request = can_frame_of_text(vector.request);
  const CanFrame reply = can_frame_of_text(vector.reply);

  [[nodiscard]] Frame request_frame() const { return {.can = vector.request.empty() ? nullptr : &request}; }
  Error decode(const CanFrame* frame, Fields& fields) const {
    Collector collector;
    const Error error = unit.decode(options, request_frame(), {.can = frame}, collector);
    fields = collector.fields;
    return error;
  }
};

TEST_P(CanBattery, Whole) {
  Fields fields;
  ASSERT_EQ(text_of(decode(vector.reply.empty() ? nullptr : &reply, fields)).name, text_of(vector.error).name);
  EXPECT_EQ(fields, expected_fields(vector));
}

class GoodCanReply : public CanBattery {};
class AnsweredCanReply : public CanBattery {};

// Not those that are only named: they may be of any length.
bool is_good_reply(const Case& test) {
  const bool only_named = std::any_of(test.vector->fields.begin(), test.vector->fields.end(),
                                      [](const Expected& one) { return one.field == "function"; });
  return !test.vector->reply.empty() && test.vector->error == Error::none && !only_named;
}

// Without a request any node may send it.
bool answers_a_request(const Case& test) { return is_good_reply(test) && !test.vector->request.empty(); }

TEST_P(GoodCanReply, EveryTruncation) {
  for (std::uint8_t size = 0; size < reply.size; ++size) {
    CanFrame cut = reply;
    cut.size = size;
    Fields fields;
    EXPECT_EQ(decode(&cut, fields), Error::wrong_length);
    EXPECT_TRUE(fields.empty());
  }
}

TEST_P(GoodCanReply, EveryBitFlipOfItsData) {
  unsigned tested = 0;
  for (std::size_t bit = 0; bit < std::size_t{8} * reply.size; ++bit) {
    if (unit.covered != nullptr && !unit.covered(options, request_frame(), {.can = &reply}, bit)) continue;
    CanFrame flipped = reply;
    flipped.data[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    Fields fields;
    EXPECT_NE(decode(&flipped, fields), Error::none) << bit;
    EXPECT_TRUE(fields.empty());
    ++tested;
  }
  EXPECT_GT(tested, 0u);
}

// Whoever else sends that must not be taken for the encoder that was asked.
TEST_P(AnsweredCanReply, EveryBitFlipOfItsIdentifier) {
  for (unsigned bit = 0; bit < 11; ++bit) {
    CanFrame other = reply;
    other.id ^= 1u << bit;
    if (other.id == 0x7E4 || other.id == 0x7E5) continue;  // a configuration is answered on either
    Fields fields;
    EXPECT_NE(decode(&other, fields), Error::none) << bit;
  }
}

TEST_P(GoodCanReply, ExtendedAndRemoteFrames) {
  CanFrame extended = reply;
  extended.extended = true;
  CanFrame remote = reply;
  remote.remote = true;
  for (const CanFrame& frame : {extended, remote}) {
    Fields fields;
    EXPECT_NE(decode(&frame, fields), Error::none);
  }
}

// ---- Through the unit's host conversation.

// The reading command whose request this vector has; null when there is none.
const Command* command_of(const Case& test) {
  for (const Command& candidate : test.unit->commands) {
    if (candidate.verb != Verb::read) continue;
    std::array<std::uint8_t, 64> request{};
    const Result<std::size_t> size = test.unit->encode(options_of(test), candidate, {}, request);
    if (size && std::ranges::equal(Bytes(request).first(*size), test.vector->request)) return &candidate;
  }
  return nullptr;
}

bool is_read_by_a_command(const Case& test) { return is_good_reply(test) && command_of(test) != nullptr; }

class CanHostBattery : public CanBattery {
 protected:
  struct Outcome {
    Error error;
    Fields fields;
  };
  // The encoder sends `frames` after the request.
  Outcome converse(const std::vector<CanFrame>& frames) {
    using Kind = Event<CanFrame>::Kind;
    std::vector<std::byte> storage(unit.host_storage);
    Conversation<CanFrame>& conversation = *unit.host(options, *command_of(GetParam()), {}, storage).frames;
    Time now{};
    for (unsigned steps = 0; steps < 100; ++steps) {
      const Step<CanFrame> step = conversation.next(now);
      if (step.kind == Step<CanFrame>::Kind::done) break;
      now += std::chrono::milliseconds(1);
      if (step.kind == Step<CanFrame>::Kind::wait) {
        conversation.feed({.kind = Kind::silence, .at = now});
        continue;
      }
      EXPECT_EQ(step.out[0], request);
      conversation.feed({.kind = Kind::sent, .at = now});
      for (const CanFrame& frame : frames) {
        conversation.feed({.kind = Kind::received, .at = now, .items = {&frame, 1}});
      }
    }
    Collector collector;
    conversation.report(collector);
    return {conversation.error(), collector.fields};
  }
};

TEST_P(CanHostBattery, AmongTheTrafficOfOthers) {
  const CanFrame other{.id = 0x7A5, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  for (const std::vector<CanFrame>& frames :
       {std::vector{reply}, std::vector{other, reply}, std::vector{reply, other}, std::vector{request, other, reply}}) {
    const Outcome outcome = converse(frames);
    EXPECT_EQ(outcome.error, Error::none);
    EXPECT_EQ(outcome.fields, expected_fields(vector));
  }
}

TEST_P(CanHostBattery, OnlyTheTrafficOfOthers) {
  const CanFrame other{.id = 0x7A5, .size = 8};
  for (const std::vector<CanFrame>& frames : {std::vector<CanFrame>{}, std::vector{other}, std::vector{request}}) {
    const Outcome outcome = converse(frames);
    EXPECT_EQ(outcome.error, Error::timeout);
    EXPECT_TRUE(outcome.fields.empty());
  }
}

TEST(CanUnits, RequestsAreFramesThatTheyDecode) {
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::can) continue;
    for (const Command& command : unit->commands) {
      std::vector<std::int64_t> arguments;
      for (const Argument& argument : command.arguments) arguments.push_back(argument.maximum);
      Options options;
      ASSERT_EQ(resolve_options(*unit, {}, {}, options).kind, OptionError::Kind::none);
      std::array<std::uint8_t, 64> request{};
      const Result<std::size_t> size = unit->encode(options, command, arguments, request);
      ASSERT_TRUE(size) << command.name;
      const CanFrame frame = can_frame_of_text(Bytes(request).first(*size));
      Collector collector;
      EXPECT_EQ(unit->decode(options, {.can = &frame}, {}, collector), Error::none) << command.name;
      std::array<std::uint8_t, 4> small{};
      EXPECT_EQ(unit->encode(options, command, arguments, small).error(), Error::buffer_too_small);
    }
  }
}

std::string test_name(const ::testing::TestParamInfo<Case>& info) {
  std::string name(info.param.vector->id);
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

INSTANTIATE_TEST_SUITE_P(Vectors, CanBattery, ::testing::ValuesIn(cases_where([](const Case&) { return true; })),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Vectors, GoodCanReply, ::testing::ValuesIn(cases_where(is_good_reply)), test_name);
INSTANTIATE_TEST_SUITE_P(Vectors, AnsweredCanReply, ::testing::ValuesIn(cases_where(answers_a_request)), test_name);
INSTANTIATE_TEST_SUITE_P(Vectors, CanHostBattery, ::testing::ValuesIn(cases_where(is_read_by_a_command)), test_name);

}  // namespace
}  // namespace absenc
