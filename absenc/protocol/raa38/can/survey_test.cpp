// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "absenc/protocol/raa38/can/bench_test.hpp"

namespace absenc::raa38::can {
namespace {

using testing::Bench;
using testing::Fields;
using testing::report;
using testing::silent;
using testing::Talk;
using Numbers = std::vector<std::int64_t>;

TEST(CanScan, FindsWhoSendsAndWhoOnlyAnswers) {
  Bench bench;
  bench.shaft.put(0, 77);
  bench.add({.node = 0x01, .cyclic = 0});
  bench.add({.node = 0xFF, .cyclic = 50});
  bench.add({.bits = 21, .node = 0x30, .cyclic = 0});
  Talk scan({}, "scan");
  EXPECT_EQ(bench.run(scan).error(), Error::none);
  const Fields fields = report(scan);
  EXPECT_EQ(fields.every("node"), (Numbers{0x01, 0x20, 0x30, 0xFF}));
  EXPECT_EQ(fields.every("clash"), (Numbers{0, 0, 0, 0}));
  EXPECT_EQ(fields.every("readings_per_s"), (Numbers{0, 10, 0, 50}));
  EXPECT_EQ(fields.every("singleturn"), (Numbers{77, 77, 77 << 7, 77}));
  for (const auto& node : bench.nodes) EXPECT_EQ(node->violation_count(), 0u);
}

TEST(CanScan, NobodyThere) {
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
  Talk scan({}, "scan");
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, scan), 10s));
  EXPECT_EQ(scan.error(), Error::timeout);
}

TEST(CanScan, TwoNodesWithOneNumber) {
  Bench bench({.cyclic = 0});
  bench.shaft.put(0, 100);
  bench.add({.positive = 1, .negative = 0, .cyclic = 0});
  bench.raw(encode_command(0x20, command::direction, 0));  // now they differ
  bench.add({.node = 0x21, .cyclic = 0});
  Talk scan({}, "scan");
  EXPECT_EQ(bench.run(scan).error(), Error::none);
  EXPECT_EQ(report(scan).every("node"), (Numbers{0x20, 0x21}));
  EXPECT_EQ(report(scan).every("clash"), (Numbers{1, 0}));
}

TEST(CanScan, AWrongBitRateIsNotManyClashes) {
  Bench bench({.cyclic = 255});
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 500'000});
  struct Noise final : Machine<CanFrame> {
    void feed(const Event<CanFrame>&) override {}
    Step<CanFrame> next(Time now) override {
      if (std::exchange(configure, false)) {
        return {.kind = Step<CanFrame>::Kind::configure, .settings = {.rate = 250'000}};
      }
      if (now < at) return {.at = at};
      at = now + 1ms;
      return {.kind = Step<CanFrame>::Kind::transfer, .out = {&frame, 1}};
    }
    CanFrame frame = encode_position(0x20, 5);
    bool configure = true;
    Time at = 1ms;
  } noise;
  line.attach(sim::Role::device, noise);
  Talk scan({}, "scan");
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, scan), 10s));
  EXPECT_EQ(scan.error(), Error::bad_framing);
  EXPECT_NE(scan.advice().find("bit rate"), std::string_view::npos);
}

TEST(CanFindNode, TheOnlyOneOrTheOneThatIsMeant) {
  Bench bench({.node = 0x55});
  Talk only({}, "node");
  EXPECT_EQ(report(bench.run(only))["node"], 0x55);
  bench.add({.node = 0x56, .cyclic = 0});
  Talk meant({.node = 0x56}, "node");
  EXPECT_EQ(report(bench.run(meant))["node"], 0x56);
  Talk neither({}, "node");
  EXPECT_EQ(bench.run(neither).error(), Error::unexpected_reply);
}

TEST(CanFindNode, WhatItSendsByItselfIsNoSecondAnswer) {
  const Format format{.node = 1, .cyclic = 50};
  Bench bench(format);
  Talk find(format, "node");
  EXPECT_EQ(bench.run(find).error(), Error::none) << find.detail();
  EXPECT_EQ(report(find)["node"], 1);
}

TEST(CanSetNode, AnswersUnderTheNewNumber) {
  for (const std::uint32_t id : {0x7E5u, 0x7E4u}) {
    Bench bench({.answers_on_7e4 = id == 0x7E4});
    Talk set({}, "set-node", {0x42});
    EXPECT_EQ(bench.run(set).error(), Error::none) << set.detail();
    EXPECT_EQ(report(set)["node"], 0x42);
    EXPECT_EQ(report(set)["answered"], 1);
    EXPECT_EQ(bench.node().node(), 0x42);
    EXPECT_EQ(bench.node().wear(), 1u);
    EXPECT_EQ(bench.node().violation_count(), 0u);
  }
}

TEST(CanSetNode, WritesNothingTwice) {
  Bench bench;
  Talk again({}, "set-node", {0x20});
  EXPECT_EQ(bench.run(again).error(), Error::none);
  EXPECT_EQ(report(again)["written"], 0);
  EXPECT_EQ(bench.node().wear(), 0u);
  Talk forced({}, "set-node", {0x20, 1});
  EXPECT_EQ(bench.run(forced).error(), Error::none) << forced.detail();
  EXPECT_EQ(report(forced)["written"], 1);
  EXPECT_EQ(bench.node().wear(), 1u);
  EXPECT_EQ(bench.node().violation_count(), 1u);  // it wears out
}

TEST(CanSetNode, NotWithOthersOnTheBus) {
  Bench bench;
  VirtualNode& other = bench.add({.node = 0x21, .cyclic = 0});
  Talk set({}, "set-node", {0x42});
  EXPECT_EQ(bench.run(set).error(), Error::invalid_argument);
  EXPECT_NE(set.advice().find("7E5"), std::string_view::npos);
  Talk absent({.node = 0x77}, "set-node", {0x42});
  EXPECT_EQ(bench.run(absent).error(), Error::unexpected_reply);
  EXPECT_EQ(bench.node().wear() + other.wear(), 0u);
}

// Answers what it is asked by a table, and changes nothing.
struct Scripted final : Machine<CanFrame> {
  explicit Scripted(const CanFrame& answer_to_settings) : answer(answer_to_settings) {}
  void feed(const Event<CanFrame>& event) override {
    if (event.kind == Event<CanFrame>::Kind::sent) sending = false;
    if (event.kind != Event<CanFrame>::Kind::received) return;
    const CanFrame& frame = event.items[0];
    if (frame.id == 0x220 && !dead) queue.push_back(encode_position(0x20, 5));
    if (frame.id == 0x7E5 && frame.data[0] != configuration::enter && has_answer) queue.push_back(answer);
    if (frame.id == 0x7E5 && frame.data[0] != configuration::enter) dead = dies, is_set = true;
    if (is_set && frame.id == appears) queue.push_back(encode_position(static_cast<std::uint8_t>(appears), 5));
  }
  Step<CanFrame> next(Time) override {
    if (queue.empty() || sending) return {.at = never};
    out = queue.front();
    queue.erase(queue.begin());
    sending = true;
    return {.kind = Step<CanFrame>::Kind::transfer, .out = {&out, 1}};
  }
  CanFrame answer;
  bool has_answer = true;
  bool dies = false;  // answers nothing any more after a setting
  bool dead = false;
  bool is_set = false;
  std::uint32_t appears = 0;  // another node that answers afterwards
  bool sending = false;
  std::vector<CanFrame> queue;
  CanFrame out{};
};

template <class Conversation>
Conversation& with(Scripted& node, Conversation& conversation) {
  sim::Line<CanFrame> line(LinkKind::can, {.rate = 250'000});
  line.attach(sim::Role::device, node);
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, conversation), 20s));
  return conversation;
}

TEST(CanSetNode, Refused) {
  Scripted node(encode_configuration_answer(0x7E4, configuration::node, 1));
  Talk set({}, "set-node", {0x42});
  EXPECT_EQ(with(node, set).error(), Error::request_rejected);
}

TEST(CanSetNode, AnAnswerAloneIsNoNumber) {
  Scripted node(encode_configuration_answer(0x7E5, configuration::node, 0));
  Talk set({}, "set-node", {0x42});
  EXPECT_EQ(with(node, set).error(), Error::cross_check_failed);
  EXPECT_NE(set.detail().find("keeps its old number"), std::string_view::npos);
  Fields left;
  set.report_left(left);
  EXPECT_EQ(left["node"], 0x42);
}

TEST(CanSetNode, AnotherNodeWithTheNewNumberIsFoundOut) {
  Scripted node(encode_configuration_answer(0x7E5, configuration::node, 0));
  node.appears = 0x242;
  Talk set({}, "set-node", {0x42});
  EXPECT_EQ(with(node, set).error(), Error::cross_check_failed);
  EXPECT_NE(set.detail().find("another node was there"), std::string_view::npos) << set.detail();
}

TEST(CanSetNode, NotWithTwoOfOneNumber) {
  Bench bench({.cyclic = 0});
  bench.shaft.put(0, 100);
  bench.add({.positive = 1, .negative = 0, .cyclic = 0});
  bench.raw(encode_command(0x20, command::direction, 0));  // now they differ
  Talk set({}, "set-node", {0x42});
  EXPECT_EQ(bench.run(set).error(), Error::invalid_argument);
  EXPECT_NE(set.detail().find("share the number"), std::string_view::npos) << set.detail();
}

TEST(CanSetNode, GoneAfterwards) {
  Scripted node({});
  node.has_answer = false;
  node.dies = true;
  Talk set({}, "set-node", {0x42});
  EXPECT_EQ(with(node, set).error(), Error::timeout);
  EXPECT_NE(set.detail().find("neither"), std::string_view::npos);
}

TEST(CanSetRate, IsFollowed) {
  Bench bench;
  bench.shaft.put(0, 321);
  Talk set({}, "bitrate", {1'000'000});
  EXPECT_EQ(bench.run(set).error(), Error::none) << set.detail();
  EXPECT_EQ(report(set)["bit_rate"], 1'000'000);
  EXPECT_EQ(bench.node().rate(), 1'000'000u);
  EXPECT_EQ(bench.node().violation_count(), 0u);
  Talk before({}, "position");  // still at 250 kbit/s
  EXPECT_NE(bench.run(before).error(), Error::none);
}

TEST(CanSetRate, WritesNothingTwice) {
  Bench bench;
  Talk set({}, "bitrate", {250'000});
  EXPECT_EQ(bench.run(set).error(), Error::none);
  EXPECT_EQ(report(set)["written"], 0);
  EXPECT_EQ(bench.node().wear(), 0u);
}

TEST(CanSetRate, OnlyThoseOfTheDocument) {
  Bench bench;
  Talk set({}, "bitrate", {125'000});
  EXPECT_EQ(bench.run(set).error(), Error::invalid_argument);
  EXPECT_NE(set.advice().find("500000"), std::string_view::npos);
  EXPECT_EQ(bench.node().answered(), 0u);
}

TEST(CanSetRate, GoesBackWhenTheNodeDoesNot) {
  Scripted node(encode_configuration_answer(0x7E5, configuration::rate, 0));
  Talk set({}, "bitrate", {500'000});
  EXPECT_EQ(with(node, set).error(), Error::cross_check_failed);
  EXPECT_NE(set.detail().find("keeps its old bit rate"), std::string_view::npos);
  Scripted gone(encode_configuration_answer(0x7E5, configuration::rate, 0));
  gone.dies = true;
  Talk lost({}, "bitrate", {500'000});
  EXPECT_EQ(with(gone, lost).error(), Error::timeout);
}

}  // namespace
}  // namespace absenc::raa38::can
