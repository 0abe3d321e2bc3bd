// SPDX-License-Identifier: Apache-2.0
// Tests of the commands that concern several nodes of a bus.
#include "absenc/protocol/raa38/can/bench_test.hpp"

namespace absenc::raa38::can {
namespace {

using namespace testing;

TEST(Raa38CanScan, FindsSendingAndSilentNodes) {
  Bench bench;
  bench.put(77);
  bench.add({.node = 0x01, .cyclic = 0});
  bench.add({.node = 0xFF, .cyclic = 50});
  bench.add({.bits = 21, .node = 0x30, .cyclic = 0});
  const CommandResult scan = bench.run_command("scan");
  EXPECT_TRUE(ended(scan, Error::none));
  EXPECT_EQ(scan.fields,
            "node=1 clash=0 readings_per_s=0 singleturn=77 node=32 clash=0 readings_per_s=10 singleturn=77 "
            "node=48 clash=0 readings_per_s=0 singleturn=9856 node=255 clash=0 readings_per_s=50 singleturn=77 ");
  for (const VirtualNode& node : bench.encoders) EXPECT_EQ(node.violation_count(), 0u);
}

TEST(Raa38CanScan, TimesOutWithoutNode) {
  Bench bench;
  bench.encoder().power_off(bench.line.now());
  EXPECT_TRUE(ended(bench.run_command("scan"), Error::timeout));
}

TEST(Raa38CanScan, ReportsClashOfTwoNodesWithOneNumber) {
  Bench bench(quiet);
  bench.put(100);
  bench.add_twin();
  bench.add({.node = 0x21, .cyclic = 0});
  EXPECT_EQ(bench.run_command("scan").fields,
            "node=32 clash=1 readings_per_s=0 node=33 clash=0 readings_per_s=0 singleturn=100 ");
  EXPECT_TRUE(ended(bench.run_command("set-node", {0x42}), Error::invalid_argument, "other nodes"));
  bench.encoders.back().power_off(bench.line.now());
  EXPECT_TRUE(ended(bench.run_command("set-node", {0x42}), Error::invalid_argument, "share the number"));
  EXPECT_TRUE(ended(bench.run_command("node"), Error::bad_framing, "no two nodes have one number"));
}

TEST(Raa38CanScan, ReportsWrongBitRateInsteadOfClashes) {
  Scripted noise([](const CanFrame&) { return Frames{}; });
  noise.period = 1ms;
  EXPECT_TRUE(ended(with(noise, "scan", {}, {}, 500'000), Error::bad_framing, "bit rate"));
}

/// Returns the identifiers of all frames that a command sends on a bus without an encoder.
std::vector<std::uint32_t> identifiers_of(std::string_view command, const Format& format) {
  sim::Line<CanFrame> line(LinkKind::can, {.rate = format.bit_rate()});
  std::vector<std::uint32_t> sent;
  line.observe([&](std::size_t, Time, Time, const CanFrame& frame) { sent.push_back(frame.id); });
  // a node that answers nothing, but whose controller acknowledges frames
  Scripted listener([](const CanFrame&) { return Frames{}; });
  line.attach(sim::NodeRole::device, listener);
  raa38::testing::Talk<CanFrame> talk(can_unit, options_of(format), command, {});
  EXPECT_TRUE(line.run(line.attach(sim::NodeRole::host, *talk), 20s));
  return sent;
}

// On a CANopen bus, identifiers 201 to 27F are process data of other devices.
TEST(Raa38CanNode, PollsGivenNodeOnly) {
  EXPECT_EQ(identifiers_of("node", {.node = 0x42}), std::vector<std::uint32_t>{0x242});
  EXPECT_EQ(identifiers_of("scan", {.node = 0x42}).size(), 255u);
}

TEST(Raa38CanNode, CommandsThatPollOtherNodesWarn) {
  for (const Command& command : can_unit.commands) {
    if (!command.arguments.empty() && command.verb != Verb::config_set) continue;
    std::vector<std::int64_t> arguments;
    for (const Argument& argument : command.arguments) arguments.push_back(argument.maximum);
    Scripted silent([](const CanFrame&) { return Frames{}; });
    sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
    bool asks_others = false;
    line.observe([&](std::size_t, Time, Time, const CanFrame& frame) {
      asks_others = asks_others || (function_of(frame) == Function::command && node_of(frame) != 0x20);
    });
    line.attach(sim::NodeRole::device, silent);
    raa38::testing::Talk<CanFrame> talk(can_unit, options_of({}), command.name, arguments);
    EXPECT_TRUE(line.run(line.attach(sim::NodeRole::host, *talk), 60s)) << command.name;
    EXPECT_EQ(asks_others, !command.disturbs.empty()) << command.name;
  }
}

TEST(Raa38CanNode, ReportsNodeThatAnswers) {
  Bench bench({.node = 0x55, .cyclic = 50});
  EXPECT_EQ(bench.run_command("node").fields, "node=85 ");
  EXPECT_TRUE(ended(bench.run_command(Format{}, "node"), Error::timeout, "`absenc scan` asks them all"));
}

// If the adapter is slow, the answer to one node number may arrive while the next number is requested.
TEST(Raa38CanScan, AcceptsAnswersWhileSendingNextRequest) {
  for (const bool unasked_too : {false, true}) {
    Talk conversation("scan");
    Time now{};
    const auto tell = [&](std::uint8_t node) {
      const CanFrame frame = encode_position(node, 5);
      conversation->feed({.kind = Event<CanFrame>::Kind::received, .at = now, .items = {&frame, 1}});
    };
    for (;;) {
      const Step<CanFrame> step = conversation->next(now);
      if (step.kind == Step<CanFrame>::Kind::done) break;
      now = step.at > now ? step.at : now + 100us;
      if (step.kind != Step<CanFrame>::Kind::transfer) continue;
      if (unasked_too && step.out[0].id == 0x220) tell(0x20);
      if (step.out[0].id == 0x221) tell(0x20);
      conversation->feed({.kind = Event<CanFrame>::Kind::sent, .at = now});
    }
    EXPECT_EQ(raa38::testing::result_of<CanFrame>(*conversation).fields,
              "node=32 clash=0 readings_per_s=0 singleturn=5 ");
  }
}

TEST(Raa38CanScan, WaitsForLastAnswers) {
  Talk conversation("scan");
  Time now{};
  unsigned asked = 0;
  for (;;) {
    const Step<CanFrame> step = conversation->next(now);
    if (step.kind == Step<CanFrame>::Kind::done) break;
    if (step.kind == Step<CanFrame>::Kind::transfer) {
      ++asked;
      conversation->feed({.kind = Event<CanFrame>::Kind::sent, .at = now});
    } else if (asked == 255 && step.at >= now + 50ms) {
      const CanFrame late = encode_position(0xFF, 5);
      conversation->feed({.kind = Event<CanFrame>::Kind::received, .at = now, .items = {&late, 1}});
    }
    now = std::max(now, step.at);
  }
  EXPECT_EQ(raa38::testing::result_of<CanFrame>(*conversation).fields,
            "node=255 clash=0 readings_per_s=0 singleturn=5 ");
}

// ---- Settings

TEST(Raa38CanSetNode, SetsAndVerifiesNodeNumber) {
  for (const bool on_7e4 : {false, true}) {
    Bench bench({.answers_on_7e4 = on_7e4});
    EXPECT_EQ(bench.run_command("set-node", {0x42}).fields, "node=66 written=1 answered=1 ");
    EXPECT_EQ(bench.encoder().node(), 0x42);
    EXPECT_EQ(bench.encoder().settings().writes(), 1u);
    EXPECT_EQ(bench.encoder().violation_count(), 0u);
  }
}

TEST(Raa38CanSetNode, DoesNotWritePresentValue) {
  Bench bench;
  EXPECT_EQ(bench.run_command("set-node", {0x20}).fields, "node=32 written=0 ");
  EXPECT_EQ(bench.run_command("bitrate", {250'000}).fields, "bit_rate=250000 written=0 ");
  EXPECT_EQ(bench.encoder().settings().writes(), 0u);
  EXPECT_EQ(bench.run_command("set-node", {0x20, 1}).fields, "node=32 written=1 answered=1 ");
  EXPECT_EQ(bench.encoder().settings().writes(), 1u);
  EXPECT_EQ(bench.encoder().violation_count(), 1u) << "it wears out";
}

TEST(Raa38CanSetNode, RefusesWithOtherNodesOnTheBus) {
  Bench bench;
  const VirtualNode& other = bench.add({.node = 0x21, .cyclic = 0});
  EXPECT_TRUE(ended(bench.run_command("set-node", {0x42}), Error::invalid_argument, "7E5"));
  EXPECT_TRUE(
      ended(bench.run_command(Format{.node = 0x77}, "set-node", {0x42}), Error::unexpected_reply, "not this one"));
  EXPECT_EQ(bench.encoder().settings().writes() + other.settings().writes(), 0u);
  for (VirtualNode& node : bench.encoders) node.power_off(bench.line.now());
  EXPECT_TRUE(ended(bench.run_command("set-node", {0x42}), Error::timeout, "no node answers"));
}

/// A node that does not obey a setting, and answers it with `answer`.
struct Settings {
  Frames answer{};
  bool dies = false;         // whether the node no longer answers after a setting
  std::uint8_t appears = 0;  // number of another node that answers after a setting; 0: none
};

CommandResult set(const Settings& one, std::string_view command, std::int64_t value) {
  bool is_set = false;
  Scripted node([&](const CanFrame& request) {
    const OrderInfo& info = *order_of(request);
    if (info.answer == Answer::error) {
      is_set = true;
      return one.answer;
    }
    if (request.id == 0x220u && !(is_set && one.dies)) return correct_answer(request, 5);
    const bool other = is_set && one.appears != 0 && request.id == (0x200u | one.appears);
    return other ? Frames{encode_position(one.appears, 5)} : Frames{};
  });
  return with(node, command, {value});
}

TEST(Raa38CanSettings, VerifiesEffectOfSettings) {
  const auto answer = [](Order order, std::uint8_t error, std::uint32_t id = 0x7E5) {
    return Frames{encode_configuration_answer(id, order, error)};
  };
  struct Row {
    std::string_view command;
    Settings node;
    Error error;
    std::string_view words;
    std::string_view left = "";
  };
  const Row rows[]{
      {"set-node", {answer(Order::node, 1, 0x7E4)}, Error::request_rejected, "CiA 305", "node=66 "},
      {"set-node", {answer(Order::node, 0)}, Error::cross_check_failed, "keeps its old number", "node=66 "},
      {"set-node", {answer(Order::node, 0), false, 0x42}, Error::cross_check_failed, "another node was", "node=66 "},
      {"set-node", {{}, true}, Error::timeout, "neither", "node=66 "},
      {"bitrate", {answer(Order::rate, 0)}, Error::cross_check_failed, "keeps its old bit", "bit_rate=500000 "},
      {"bitrate", {answer(Order::rate, 0), true}, Error::timeout, "neither", "bit_rate=500000 "},
  };
  for (const Row& row : rows) {
    const CommandResult end = set(row.node, row.command, row.command == "bitrate" ? 500'000 : 0x42);
    EXPECT_TRUE(ended(end, row.error, row.words));
    EXPECT_EQ(end.left, row.left);
  }
}

TEST(Raa38CanSetRate, SwitchesHostToNewRate) {
  Bench bench;
  EXPECT_EQ(bench.run_command("bitrate", {1'000'000}).fields, "bit_rate=1000000 written=1 answered=1 ");
  EXPECT_EQ(bench.encoder().rate(), 1'000'000u);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  EXPECT_TRUE(ended(bench.run_command("position"), Error::none)) << "this end of the line goes to it too";
}

TEST(Raa38CanSetRate, RefusesRateThatTheDocumentLacks) {
  Bench bench;
  EXPECT_TRUE(ended(bench.run_command("bitrate", {125'000}), Error::invalid_argument, "500000"));
  EXPECT_EQ(bench.encoder().answer_count(), 0u);
}

}  // namespace
}  // namespace absenc::raa38::can
