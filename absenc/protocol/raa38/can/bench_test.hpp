// SPDX-License-Identifier: Apache-2.0
// For tests: virtual nodes, scripted nodes, and a host on one CAN bus in virtual time.
#pragma once

#include "absenc/protocol/raa38/can/device.hpp"
#include "absenc/protocol/raa38/can/host.hpp"
#include "absenc/protocol/raa38/talk_test.hpp"

namespace absenc::raa38::can {

[[nodiscard]] inline Options options_of(const Format& format) {
  Options options;
  options.values = {format.bits,     format.node,     format.rate,   format.listens ? 1 : 0,
                    format.positive, format.negative, format.cyclic, format.answers_on_7e4 ? 1 : 0};
  return options;
}

namespace testing {

using raa38::testing::CommandResult;
using raa38::testing::ended;
using raa38::testing::says;
using Frames = std::vector<CanFrame>;

inline constexpr Format quiet{.cyclic = 0};

struct Talk final : raa38::testing::Talk<CanFrame> {
  explicit Talk(std::string_view name, std::vector<std::int64_t> arguments = {})
      : raa38::testing::Talk<CanFrame>(can_unit, options_of({}), name, std::move(arguments)) {}
};

/// Sends one frame and records all frames that are received until the time `until`.
class RawHost final : public Machine<CanFrame> {
 public:
  RawHost(const CanFrame& request, Time until) : request_(request), until_(until) {}
  void feed(const Event<CanFrame>& event) override {
    if (event.kind == Event<CanFrame>::Kind::received)
      received_frames.insert(received_frames.end(), event.items.begin(), event.items.end());
    if (event.kind == Event<CanFrame>::Kind::timer) done_ = true;
  }
  Step<CanFrame> next(Time) override {
    using Kind = Step<CanFrame>::Kind;
    if (done_) return {.kind = Kind::done};
    if (std::exchange(sent_, true)) return {.at = until_};
    return {.kind = Kind::transfer, .out = {&request_, 1}};
  }
  Frames received_frames;

 private:
  CanFrame request_;
  Time until_;
  bool sent_ = false;
  bool done_ = false;
};

struct Bench : raa38::testing::Bench<CanFrame, VirtualNode, Format, can_unit> {
  explicit Bench(const Format& own = {})
      : raa38::testing::Bench<CanFrame, VirtualNode, Format, can_unit>(own, LinkKind::can, {.rate = own.bit_rate()}) {
    add(own);
  }
  /// Adds a node that has the same number as the default node, 20 (hex), and counts down.
  void add_twin() {
    add({.positive = 1, .negative = 0, .cyclic = 0});
    static_cast<void>(raw(encode(Order::direction, 0x20, 0)));
    ASSERT_NE(encoders.front().settings().position(line.now()), encoders.back().settings().position(line.now()));
  }
  /// Turns the shaft to the position `counts`, in counts of the encoder's resolution.
  void put(std::int64_t counts) { shaft.put(0, counts << (21 - format.bits)); }
  /// Sends a request and returns the frames that were received within 20 ms.
  Frames raw(const CanFrame& request) {
    RawHost host(request, line.now() + 20ms);
    return run(host).received_frames;
  }
  /// Returns the number of frames that nodes send without a request within `duration`.
  std::size_t count(Time duration) {
    RawHost host(CanFrame{.id = 0x7FF}, line.now() + duration);
    return run(host).received_frames.size();
  }
};

/// A test node that answers each received frame with the frames that its function returns; it may also send cyclic
/// frames.
struct Scripted final : Machine<CanFrame> {
  using Script = std::function<Frames(const CanFrame& received_frames)>;
  explicit Scripted(Script script_) : script(std::move(script_)) {}
  void feed(const Event<CanFrame>& event) override {
    if (event.kind == Event<CanFrame>::Kind::sent) sending = false;
    if (event.kind != Event<CanFrame>::Kind::received) return;
    const Frames answers = script(event.items[0]);
    queue.insert(queue.end(), answers.begin(), answers.end());
  }
  Step<CanFrame> next(Time now) override {
    if (std::exchange(rate_changed, false)) {
      return {.kind = Step<CanFrame>::Kind::configure, .rate = rate};
    }
    if (sending) return {.at = never};
    const bool by_itself = queue.empty() && period != Time{} && (left == nullptr || *left != 0);
    if (queue.empty() && (!by_itself || now < due)) return {.at = by_itself ? due : never};
    if (by_itself) due = now + period + (wobble = -wobble);
    if (by_itself && left != nullptr) --*left;
    out = by_itself ? unsolicited : queue.front();
    if (!by_itself) queue.erase(queue.begin());
    sending = true;
    return {.kind = Step<CanFrame>::Kind::transfer, .out = {&out, 1}};
  }

  Script script;
  CanFrame unsolicited = encode_position(0x20, 49);
  Time period{};             // period of cyclic frames; 0: no cyclic frames
  Time wobble{};             // time by which cyclic frames are early and late in turn
  unsigned* left = nullptr;  // number of cyclic frames left to send; null: no limit
  std::uint32_t rate = 250'000;
  bool rate_changed = true;

 private:
  Frames queue;
  Time due{};
  CanFrame out{};
  bool sending = false;
};

inline CommandResult with(Scripted node, std::string_view command, std::vector<std::int64_t> arguments = {},
                          const Format& format = {}, std::uint32_t rate = 250'000) {
  sim::Line<CanFrame> line(LinkKind::can, {.rate = rate});
  line.attach(sim::NodeRole::device, node);
  raa38::testing::Talk<CanFrame> talk(can_unit, options_of(format), command, std::move(arguments));
  EXPECT_TRUE(line.run(line.attach(sim::NodeRole::host, *talk), 20s));
  return raa38::testing::result_of<CanFrame>(*talk);
}

/// Returns the frames with which a correct node 20 (hex) at position `counts` answers an order for one node.
[[nodiscard]] inline Frames correct_answer(const CanFrame& received_frames, std::uint64_t counts) {
  const OrderInfo& info = *order_of(received_frames);
  if (info.answer == Answer::position) return {encode_position(0x20, counts)};
  if (info.answer == Answer::code) return {encode_answer(0x20, info.order)};
  return {};
}

}  // namespace testing
}  // namespace absenc::raa38::can
