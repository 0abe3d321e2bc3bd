// SPDX-License-Identifier: Apache-2.0
// Compares reported changes with the virtual encoder's memory, with faults and lost ports.
#include "absenc/client/change.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/port/virtual_link_test.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/all.hpp"
#include "tests/cases.hpp"

namespace absenc::client {
namespace {

using Values = std::vector<std::int64_t>;
using Stored = std::vector<std::uint8_t>;

/// A port that calls `trouble` before each step after the first `left` ones.
template <class Item>
class TroubledPort final : public Port<Item> {
 public:
  TroubledPort(Link link, Port<Item>& port, std::size_t left, std::function<void()> trouble)
      : link_(std::move(link)), port_(port), left_(left), trouble_(std::move(trouble)) {}
  Time now() override { return port_.now(); }
  void begin(const Step<Item>& step) override {
    use();
    port_.begin(step);
  }
  Event<Item> wait(const Step<Item>& step) override {
    use();
    return port_.wait(step);
  }

 private:
  void use() {
    if (left_ == 0) return trouble_();
    --left_;
  }
  Link link_;  // owns the port to which `port_` refers
  Port<Item>& port_;
  std::size_t left_;
  std::function<void()> trouble_;
};

Link troubled_link(Link whole, std::size_t steps, const std::function<void()>& trouble) {
  Link link;
  link.device = std::move(whole.device);
  link.place = whole.place;
  if (whole.bytes != nullptr) {
    Port<std::uint8_t>& port = *whole.bytes;
    take_port<std::uint8_t>(link, std::make_shared<TroubledPort<std::uint8_t>>(std::move(whole), port, steps, trouble));
  } else {
    Port<CanFrame>& port = *whole.frames;
    take_port<CanFrame>(link, std::make_shared<TroubledPort<CanFrame>>(std::move(whole), port, steps, trouble));
  }
  return link;
}

/// Returns a link whose port fails after `steps` steps, as if its adapter were unplugged.
Link breaking_link(Link whole, std::size_t steps) {
  return troubled_link(std::move(whole), steps,
                       [] { throw os::Failure(os::Failure::Kind::lost, "the port went away"); });
}

struct Ended {
  Error error = Error::none;
  bool thrown = false;
  Change change;
  Stored before;
  Stored after;
};

Stored stored(VirtualDevice& device) {
  const auto of = [](MutableBytes bytes) { return Stored(bytes.begin(), bytes.end()); };
  const Any<Device>& one = device.device();
  return one.bytes != nullptr ? of(one.bytes->memory()) : of(one.frames->memory());
}

/// Runs a command on a virtual encoder. The port fails after `steps` steps; without a value it never fails.
Ended run(const std::string& address, const Command& command, const Values& values,
          std::optional<std::size_t> steps = {}) {
  VirtualDevice* device = nullptr;
  const EncoderAddress encoder = parse_address(address);
  const std::unique_ptr<Connection> connection = Connection::make(encoder, [&](const EncoderAddress& one) {
    Link link = virtual_link(one);
    device = link.device.get();
    return steps ? breaking_link(std::move(link), *steps) : std::move(link);
  });
  connection->connect();
  Ended ended;
  ended.before = stored(*device);
  try {
    const Outcome outcome = connection->run(command, values);
    ended.error = outcome.error;
    ended.change = outcome.change;
    if (outcome.error != Error::none) {
      EXPECT_EQ(connection->trouble(outcome).change.state, outcome.change.state);
    }
  } catch (const os::Failure& failure) {
    ended.thrown = true;
    if (const Change* change = change_of(failure)) ended.change = *change;
    EXPECT_NE(std::string(failure.what()).find(std::string("Change: ")), std::string::npos) << failure.what();
  }
  EXPECT_EQ(connection->change().state, ended.change.state);
  ended.after = stored(*device);
  return ended;
}

/// Returns arguments with which the encoder confirms the change on a line without faults; nothing: none were found.
std::optional<Values> working_values(const Unit& unit, const Command& command) {
  std::vector<Values> candidates;
  for (const std::int64_t wanted : {INT64_MAX, std::int64_t{2}, std::int64_t{3}, std::int64_t{90}, INT64_MIN}) {
    Values values;
    for (const Argument& argument : command.arguments) {
      values.push_back(argument.required ? std::clamp(wanted, argument.minimum, argument.maximum)
                                         : argument.default_value);
    }
    candidates.push_back(values);
  }
  for (const Option& option : unit.options) {
    if (option.name != command.changes_option) continue;
    for (std::size_t i = 0; i < option.choices.size(); ++i) {
      candidates.push_back(candidates.front());
      // The first argument of the command selects a choice of the option: it is the choice itself if that is a number,
      // else the index of the choice.
      candidates.back().front() = parse_number(option.choices[i]).value_or(static_cast<std::int64_t>(i));
    }
  }
  if (command.verb == Verb::memory_write) {
    candidates.clear();
    for (const MemoryArea& area : unit.memory) {
      if (!area.writable || !area.protection.empty()) continue;
      candidates.push_back(role_arguments(
          command, {{Role::page, area.page}, {Role::address, area.first}, {Role::value, 0x5A}, {Role::force, 0}}));
    }
    for (const RegisterInfo& one : unit.registers) {
      if (!one.writable) continue;
      candidates.push_back(role_arguments(command, {{Role::address, one.address}, {Role::value, 3}}));
    }
  }
  const std::string address = fmt::format("sim:{}?singleturn=77", unit.id);
  for (const Values& values : candidates) {
    try {
      if (run(address, command, values).change.state == ChangeState::confirmed) return values;
    } catch (const UsageError&) {  // skips option values with which the command does not exist
    }
  }
  return std::nullopt;
}

void require_truth(const Ended& ended, const Ended& good, const std::string& what) {
  SCOPED_TRACE(what);
  switch (ended.change.state) {
    case ChangeState::none:
      ADD_FAILURE() << "nothing is said of the change";
      break;
    case ChangeState::not_sent:
    case ChangeState::refused:
      EXPECT_EQ(ended.before, ended.after) << "the encoder was changed, though " << ended.change.text();
      break;
    case ChangeState::confirmed:
      EXPECT_TRUE(!ended.thrown && ended.error == Error::none);
      EXPECT_EQ(ended.after, good.after) << "the encoder was not changed";
      break;
    case ChangeState::unknown:
      EXPECT_TRUE(ended.thrown || ended.error != Error::none);
      EXPECT_FALSE(ended.change.advice.empty());
      break;
  }
}

// Returns the smallest number of steps, at least 33, for which the port must work so that the command throws nothing.
std::size_t steps_of(const std::string& address, const Command& command, const Values& values) {
  std::size_t most = 64;
  while (run(address, command, values, most).thrown) most *= 2;
  std::size_t least = most / 2;
  while (most - least > 1) {
    const std::size_t middle = (least + most) / 2;
    (run(address, command, values, middle).thrown ? least : most) = middle;
  }
  return most;
}

using Counts = std::array<std::size_t, 5>;

void count(Counts& counts, const Ended& ended) { ++counts[static_cast<std::size_t>(ended.change.state)]; }

void tell(const Counts& counts) {
  for (std::size_t i = 1; i < counts.size(); ++i) {
    testing::Test::RecordProperty(std::string(word_of(static_cast<ChangeState>(i))), static_cast<int>(counts[i]));
  }
}

class EveryUnit : public testing::TestWithParam<const Unit*> {
 protected:
  template <class Use>
  void each_command(const Use& use) const {
    const Unit& unit = *GetParam();
    for (const Command& command : unit.commands) {
      if (!command.changes_encoder) continue;
      const std::optional<Values> values = working_values(unit, command);
      if (values) use(unit, command, *values);
    }
  }
};

TEST_P(EveryUnit, ReportedChangeMatchesMemoryUnderFaults) {
  Counts counts{};
  each_command([&](const Unit& unit, const Command& command, const Values& values) {
    const std::string address = fmt::format("sim:{}?singleturn=77", unit.id);
    const Ended good = run(address, command, values);
    for (const std::string_view fault : sim::fault_names) {
      // Skips wrong bits on CAN: a CAN controller drops frames whose CRC is wrong.
      if (unit.link == LinkKind::can && fault.ends_with("corrupt")) continue;
      for (const double rate : {0.1, 0.4, 1.0}) {
        for (unsigned seed = 1; seed <= test_cases(5); ++seed) {
          const std::string bad = fmt::format("{}&fault={}={}&seed={}", address, fault, rate, seed);
          try {
            const Ended ended = run(bad, command, values);
            count(counts, ended);
            require_truth(ended, good, fmt::format("{} {}", bad, command.name));
          } catch (const UsageError&) {  // skips a fault that cannot occur on the unit's kind of line
          }
        }
      }
    }
  });
  tell(counts);
}

TEST_P(EveryUnit, ReportedChangeMatchesMemoryAfterPortLoss) {
  Counts counts{};
  each_command([&](const Unit& unit, const Command& command, const Values& values) {
    const std::string address = fmt::format("sim:{}?singleturn=77", unit.id);
    const Ended good = run(address, command, values);
    Counts of_command{};
    const std::size_t all = steps_of(address, command, values);
    // A command changes the encoder in its last steps, so the port fails at each of these in turn, and at some earlier
    // ones.
    const std::size_t each = test_cases(60);
    const std::size_t last = all > each ? all - each : 0;
    for (std::size_t steps = 0; steps < all; steps = steps < last ? std::min(steps + 1 + all / 12, last) : steps + 1) {
      const Ended ended = run(address, command, values, steps);
      count(counts, ended);
      count(of_command, ended);
      require_truth(ended, good, fmt::format("{} {} after {} steps", address, command.name, steps));
    }
    EXPECT_NE(of_command[static_cast<std::size_t>(ChangeState::unknown)], 0U) << unit.id << ' ' << command.name;
  });
  tell(counts);
}

INSTANTIATE_TEST_SUITE_P(Units, EveryUnit, testing::ValuesIn(all_units().begin(), all_units().end()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(Change, AdvisesAfterUnknownResult) {
  const EncoderAddress encoder = parse_address("sim:raa38-modbus?fault=silence=1");
  const Unit& unit = *encoder.unit;
  const Command& setter = *require_setting(unit, "baud").setter;
  std::optional<Change> change;
  for (std::size_t steps = 0; steps < 100 && !change; ++steps) {
    const Ended ended =
        run("sim:raa38-modbus", setter, complete_arguments(setter, std::array<std::int64_t, 1>{57600}), steps);
    if (ended.change.state == ChangeState::unknown) change = ended.change;
  }
  ASSERT_TRUE(change);
  EXPECT_NE(change->text().find("sent, result unknown"), std::string::npos) << change->text();
  EXPECT_NE(change->text().find("57600"), std::string::npos) << change->text();
  EXPECT_NE(change->text().find("as before"), std::string::npos) << change->text();
}

TEST(Change, IsReportedIfOnlyReadBackFails) {
  Encoder encoder = make_encoder(parse_address("sim:tformat"), Time{},
                                 [](const EncoderAddress& one) { return breaking_link(virtual_link(one), 400); });
  encoder.connect();
  Settings settings = encoder.settings();
  bool failed = false;
  for (std::int64_t degrees = 80; degrees < 100 && !failed; ++degrees) {
    try {
      settings.set("overheat-threshold", std::array<std::int64_t, 1>{degrees});
    } catch (const std::exception& failure) {
      failed = true;
      ASSERT_NE(change_of(failure), nullptr) << failure.what();
    }
  }
  EXPECT_TRUE(failed);
}

TEST(Change, AdvisesHowToReadASettingThatIsAnotherOneAfterwards) {
  std::optional<std::string> problem;
  for (std::size_t steps = 0; steps < 100 && !problem; ++steps) {
    Encoder encoder = make_encoder(parse_address("sim:tformat"), Time{}, [&](const EncoderAddress& one) {
      Link whole = virtual_link(one);
      VirtualDevice& device = *whole.device;
      return troubled_link(std::move(whole), steps, [&device, before = stored(device)] {
        std::ranges::copy(before, device.device().bytes->memory().begin());
      });
    });
    encoder.connect();
    try {
      encoder.settings().set("overheat-threshold", std::array<std::int64_t, 1>{80});
    } catch (const std::exception& failure) {
      // If the value is lost earlier, the command that writes it finds out.
      if (!std::string_view(failure.what()).starts_with("overheat-threshold was written, but")) continue;
      problem = failure.what();
      ASSERT_NE(change_of(failure), nullptr);
      EXPECT_EQ(change_of(failure)->state, ChangeState::unknown);
      EXPECT_EQ(change_of(failure)->advice, "`absenc config get sim:tformat overheat-threshold` shows what it is now");
    }
  }
  EXPECT_TRUE(problem);
}

}  // namespace
}  // namespace absenc::client
