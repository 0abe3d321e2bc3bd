// SPDX-License-Identifier: Apache-2.0
// Every vector of every unit: decoded whole, cut, with each bit flipped; and fed to the unit's own host conversation
// whole, byte by byte and with garbage around. Units on CAN: can_battery_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absenc/protocol/all.hpp"

namespace absenc {
namespace {

using Wire = std::vector<std::uint8_t>;

struct Case {
  const Unit* unit;
  const Vector* vector;
};

template <class Wanted>
std::vector<Case> cases_where(Wanted&& wanted) {
  std::vector<Case> cases;
  for (const Unit* unit : all_units()) {
    if (unit->link == LinkKind::can) continue;
    for (const Vector& vector : unit->vectors) {
      if (wanted(Case{unit, &vector})) cases.push_back({unit, &vector});
    }
  }
  return cases;
}

/// Real numbers as float: what differs by rounding is the same.
using Value = std::pair<std::int64_t, float>;

Value comparable(std::int64_t number, double real) { return {number, static_cast<float>(real)}; }

struct Collector final : FieldSink {
  void put(const FieldValue& value) override {
    fields[std::string(value.info->name)] = comparable(value.number, value.real);
  }
  void put_reading(const Reading& reading) override {
    EXPECT_FALSE(has_reading);
    has_reading = true;
    const auto is = [this](const char* name, std::uint64_t counts) {
      const auto field = fields.find(name);
      return field != fields.end() && static_cast<std::uint64_t>(field->second.first) == counts;
    };
    EXPECT_TRUE(reading.singleturn_bits == 0 || is("singleturn", reading.singleturn) ||
                is("position", reading.singleturn));
    EXPECT_TRUE(reading.multiturn_bits == 0 || is("multiturn", reading.multiturn));
  }
  /// A position among the fields, of which there must be a reading.
  [[nodiscard]] bool has_position() const {
    return fields.contains("singleturn") || fields.contains("multiturn") || fields.contains("position");
  }
  std::map<std::string, Value> fields;
  bool has_reading = false;
};

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

std::map<std::string, Value> expected_fields(const Vector& vector) {
  std::map<std::string, Value> fields;
  for (const Expected& expected : vector.fields) {
    fields[std::string(expected.field)] = comparable(expected.number, expected.real);
  }
  return fields;
}

// A text of 0 and 1, MSB first.
Wire pack(Bytes text) {
  Wire bytes((text.size() + 7) / 8);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '1') bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] | 0x80u >> i % 8);
  }
  return bytes;
}

class Battery : public ::testing::TestWithParam<Case> {
 protected:
  const Unit& unit = *GetParam().unit;
  const Vector& vector = *GetParam().vector;
  Options options = options_of(GetParam());

  // What a vector's reply is made of: bits as characters on clocked links, bytes elsewhere.
  const bool clocked = unit.link == LinkKind::clocked;

  Error decode(Bytes reply, Collector& collector) const {
    const Wire packed = clocked ? pack(reply) : Wire(reply.begin(), reply.end());
    const Frame frame{.bytes = packed, .bits = clocked ? reply.size() : 0};
    return unit.decode(options, {.bytes = vector.request}, frame, collector);
  }
};

TEST_P(Battery, Whole) {
  Collector collector;
  ASSERT_EQ(text_of(decode(vector.reply, collector)).name, text_of(vector.error).name);
  EXPECT_EQ(collector.fields, expected_fields(vector));
  EXPECT_EQ(collector.has_reading, collector.has_position());
}

class GoodReply : public Battery {};

bool is_good_reply(const Case& test) { return !test.vector->reply.empty() && test.vector->error == Error::none; }

TEST_P(GoodReply, EveryTruncation) {
  for (std::size_t size = 1; size < vector.reply.size(); ++size) {
    Collector collector;
    EXPECT_NE(decode(vector.reply.first(size), collector), Error::none) << size;
    EXPECT_TRUE(collector.fields.empty());
  }
}

TEST_P(GoodReply, EveryBitFlip) {
  const std::size_t bits_each = clocked ? 1 : 8;
  const Wire packed = clocked ? pack(vector.reply) : Wire(vector.reply.begin(), vector.reply.end());
  const Frame good{.bytes = packed, .bits = clocked ? vector.reply.size() : 0};
  for (std::size_t bit = 0; bit < vector.reply.size() * bits_each; ++bit) {
    Wire reply(vector.reply.begin(), vector.reply.end());
    if (unit.covered != nullptr && !unit.covered(options, {.bytes = vector.request}, good, bit)) continue;
    reply[bit / bits_each] ^= static_cast<std::uint8_t>(1u << bit % bits_each);
    Collector collector;
    EXPECT_NE(decode(reply, collector), Error::none) << bit;
    EXPECT_TRUE(collector.fields.empty());
  }
}

class DelimitedReply : public Battery {};

// On clocked links the pause of the clock is the end.
bool is_delimited(const Case& test) { return test.unit->link != LinkKind::clocked && is_good_reply(test); }

TEST_P(DelimitedReply, DelimitFindsTheEnd) {
  Wire stream(vector.reply.begin(), vector.reply.end());
  stream.push_back(0);
  const Delimit whole = unit.delimit(options, Direction::reply, stream);
  EXPECT_EQ(whole.kind, Delimit::Kind::complete);
  EXPECT_EQ(whole.size, vector.reply.size());
  for (std::size_t size = 0; size < vector.reply.size(); ++size) {
    EXPECT_EQ(unit.delimit(options, Direction::reply, Bytes(stream).first(size)).kind, Delimit::Kind::incomplete);
  }
}

// ---- The same frames through the unit's host conversation.

/// Plays the encoder: the request under test gets `reply` in pieces, every other one what a virtual encoder says.
class Player {
 public:
  Player(const Unit& unit, const Options& options) : device_storage_(unit.device_storage) {
    device_ = unit.device(options, still_, device_storage_).bytes;
    if (device_ != nullptr) device_->power_on(now_, Device<std::uint8_t>::PowerOn::skip);
  }

  void run(Conversation<std::uint8_t>& conversation, Bytes request, const std::vector<Wire>& pieces) {
    using Kind = Event<std::uint8_t>::Kind;
    for (unsigned steps = 0; steps < 1000; ++steps) {
      const Step<std::uint8_t> step = conversation.next(now_);
      if (step.kind == Step<std::uint8_t>::Kind::done) return;
      now_ += std::chrono::milliseconds(1);
      if (step.kind != Step<std::uint8_t>::Kind::transfer) {
        conversation.feed({.kind = Kind::silence, .at = now_});
        continue;
      }
      const Wire sent(step.out.begin(), step.out.end());
      now_ = std::max(now_, step.at);
      conversation.feed({.kind = Kind::sent, .at = now_});
      const bool tested = std::equal(sent.begin(), sent.end(), request.begin(), request.end());
      for (const Wire& piece : tested ? pieces : std::vector<Wire>{ask_device(sent)}) {
        if (conversation.next(now_).kind != Step<std::uint8_t>::Kind::wait) break;
        conversation.feed({.kind = Kind::received, .at = now_, .items = piece});
      }
    }
    ADD_FAILURE() << "the conversation does not end";
  }

 private:
  struct Still final : Shaft {
    [[nodiscard]] ShaftState at(Time) const override { return {}; }
  };

  Wire ask_device(Bytes request) {
    device_->feed({.kind = Event<std::uint8_t>::Kind::received, .at = now_, .items = request});
    const Step<std::uint8_t> step = device_->next(now_);
    Wire reply(step.out.begin(), step.out.end());
    device_->feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now_});
    return reply;
  }

  Time now_{};
  Still still_;
  std::vector<std::byte> device_storage_;
  Device<std::uint8_t>* device_;
};

// The reading command whose request this vector has; null when there is none.
const Command* command_of(const Case& test) {
  for (const Command& candidate : test.unit->commands) {
    if (!candidate.arguments.empty() || candidate.changes_encoder) continue;
    std::array<std::uint8_t, 64> request{};
    const Result<std::size_t> size = test.unit->encode(options_of(test), candidate, {}, request);
    if (size && std::ranges::equal(Bytes(request).first(*size), test.vector->request)) return &candidate;
  }
  return nullptr;
}

class HostBattery : public Battery {
 protected:
  const Command* command = command_of(GetParam());

  struct Outcome {
    Error error;
    std::map<std::string, Value> fields;
  };
  Outcome converse(const std::vector<Wire>& pieces) {
    std::vector<std::byte> storage(unit.host_storage);
    Conversation<std::uint8_t>* conversation = unit.host(options, *command, {}, storage).bytes;
    Player(unit, options).run(*conversation, vector.request, pieces);
    Collector collector;
    conversation->report(collector);
    return {conversation->error(), collector.fields};
  }
};

std::vector<Wire> bytewise(Bytes reply) {
  std::vector<Wire> pieces;
  for (const std::uint8_t byte : reply) pieces.push_back({byte});
  return pieces;
}

TEST_P(HostBattery, WholeAndByteByByte) {
  const Outcome whole = converse({Wire(vector.reply.begin(), vector.reply.end())});
  EXPECT_EQ(text_of(whole.error).name, text_of(vector.error).name);
  // What a unit makes of its raw fields (a temperature of a memory byte) has other names.
  for (const auto& [name, value] : expected_fields(vector)) {
    if (whole.fields.contains(name)) {
      EXPECT_EQ(whole.fields.at(name), value) << name;
    }
  }
  // A byte after a complete good reply belongs to whatever comes next: it is found there.
  const Delimit end = unit.delimit(options, Direction::reply, vector.reply);
  if (end.kind == Delimit::Kind::complete && end.size < vector.reply.size()) return;
  const Outcome pieces = converse(bytewise(vector.reply));
  EXPECT_EQ(text_of(pieces.error).name, text_of(vector.error).name);
  EXPECT_EQ(pieces.fields, whole.fields);
}

TEST_P(HostBattery, GarbageAround) {
  for (const std::uint8_t garbage : std::to_array<std::uint8_t>({0x00, 0x1A, 0x55, 0xFF})) {
    Wire before{garbage};
    before.insert(before.end(), vector.reply.begin(), vector.reply.end());
    Wire after(vector.reply.begin(), vector.reply.end());
    after.push_back(garbage);
    for (const Wire& reply : {before, after}) {
      Collector ignored;
      if (decode(reply, ignored) == Error::none) continue;  // it stands for a byte that no check covers
      const Outcome outcome = converse({reply});
      EXPECT_NE(outcome.error, Error::none) << int{garbage};
      EXPECT_TRUE(outcome.fields.empty());
    }
    EXPECT_NE(converse(bytewise(before)).error, Error::none) << int{garbage};
  }
}

// ---- What a unit says of its memory and its settings.

bool takes(const Command& command, std::string_view name, std::uint32_t least, std::uint32_t most) {
  for (const Argument& argument : command.arguments) {
    if (argument.name == name) return argument.minimum <= least && argument.maximum >= most;
  }
  return false;
}

TEST(Units, MemoryIsReachedByTheirCommands) {
  for (const Unit* unit : all_units()) {
    std::uint64_t after = 0;  // of the area before
    for (const MemoryArea& area : unit->memory) {
      const std::uint32_t last = area.first + area.count - 1;
      const std::uint64_t begin = std::uint64_t{area.page} << 32 | area.first;
      EXPECT_GE(begin, after) << unit->id << ": areas are in order and do not overlap";
      after = begin + area.count;
      EXPECT_GT(area.count, 0u);
      EXPECT_TRUE(area.writable || area.write_life == 0);
      for (const Verb verb : {Verb::memory_read, Verb::memory_write}) {
        const Command* command = find_command(*unit, verb);
        if (verb == Verb::memory_write && !area.writable) continue;
        ASSERT_NE(command, nullptr) << unit->id;
        EXPECT_TRUE(takes(*command, "address", area.first, last)) << unit->id;
        EXPECT_TRUE(area.page == 0 || takes(*command, "page", area.page, area.page)) << unit->id;
        EXPECT_TRUE(verb == Verb::memory_read || takes(*command, "value", 0, 255)) << unit->id;
        EXPECT_TRUE(verb == Verb::memory_read || area.protection.empty() || takes(*command, "force", 1, 1)) << unit->id;
      }
    }
  }
}

TEST(Units, RegistersAreReachedByTheirCommands) {
  for (const Unit* unit : all_units()) {
    std::set<std::string_view> names;
    for (const RegisterInfo& one : unit->registers) {
      EXPECT_TRUE(names.insert(one.name).second) << one.name << " is there twice";
      EXPECT_GT(one.size, 0u);
      EXPECT_TRUE(one.readable || one.writable) << one.name;
      for (const Verb verb : {Verb::memory_read, Verb::memory_write}) {
        const Command* command = find_command(*unit, verb);
        ASSERT_NE(command, nullptr) << unit->id;
        EXPECT_TRUE(takes(*command, "address", one.address, one.address)) << unit->id << " " << one.name;
        EXPECT_TRUE(verb == Verb::memory_read || takes(*command, "value", 0, 255)) << unit->id;
      }
    }
    EXPECT_TRUE(unit->registers.empty() || unit->memory.empty()) << unit->id << " has bytes or registers, not both";
  }
}

bool has_option(const Unit& unit, std::string_view name) {
  return std::ranges::any_of(unit.options, [&](const Option& option) { return option.name == name; });
}

TEST(Units, EverySetterReadsBack) {
  for (const Unit* unit : all_units()) {
    for (const Command& command : unit->commands) {
      if (command.verb != Verb::config_set) {
        EXPECT_TRUE(command.reads_back.empty()) << unit->id << " " << command.name;
        continue;
      }
      if (command.reads_back.empty()) {  // it cannot be read, and has no other name
        const Command* same_name = find_command(*unit, command.name);
        EXPECT_EQ(same_name, &command) << unit->id << " " << command.name;
        continue;
      }
      const Command* getter = find_command(*unit, command.reads_back);
      ASSERT_NE(getter, nullptr) << unit->id << " " << command.name;
      EXPECT_EQ(getter->verb, Verb::config_get);
      EXPECT_TRUE(command.changes_option.empty() || has_option(*unit, command.changes_option)) << command.name;
    }
  }
}

std::string test_name(const ::testing::TestParamInfo<Case>& info) {
  std::string name(info.param.vector->id);
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

// On clocked links nothing is asked, and a reply has as many bits as were clocked.
bool is_read_by_a_command(const Case& test) {
  return test.unit->link != LinkKind::clocked && !test.vector->reply.empty() && command_of(test) != nullptr;
}

INSTANTIATE_TEST_SUITE_P(Vectors, Battery, ::testing::ValuesIn(cases_where([](const Case&) { return true; })),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Vectors, GoodReply, ::testing::ValuesIn(cases_where(is_good_reply)), test_name);
INSTANTIATE_TEST_SUITE_P(Vectors, DelimitedReply, ::testing::ValuesIn(cases_where(is_delimited)), test_name);
INSTANTIATE_TEST_SUITE_P(Vectors, HostBattery, ::testing::ValuesIn(cases_where(is_read_by_a_command)), test_name);

}  // namespace
}  // namespace absenc
