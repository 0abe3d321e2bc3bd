// SPDX-License-Identifier: Apache-2.0
// For tests: virtual nodes and a host on one CAN bus in virtual time.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absenc/protocol/raa38/can/device.hpp"
#include "absenc/protocol/raa38/can/protocol.hpp"
#include "absenc/protocol/raa38/talk_test.hpp"
#include "absenc/protocol/raa38/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::raa38::can::testing {

using TestShaft = sim::testing::TestShaft<14>;

[[nodiscard]] inline Options options_of(const Format& format) {
  Options options;
  options.values = {format.bits,     format.node,     format.rate,   format.listens ? 1 : 0,
                    format.positive, format.negative, format.cyclic, format.answers_on_7e4 ? 1 : 0};
  return options;
}

/// A command to an encoder of this format.
struct Talk final : raa38::testing::Talk<CanFrame> {
  Talk(const Format& format, std::string_view name, std::vector<std::int64_t> arguments = {})
      : raa38::testing::Talk<CanFrame>(can_unit, options_of(format), name, std::move(arguments)) {}
};

struct Fields final : FieldSink {
  void put(const FieldValue& value) override { all.emplace_back(value.info->name, value.number); }
  /// The last with this name; -1 when there is none.
  [[nodiscard]] std::int64_t operator[](std::string_view name) const {
    std::int64_t found = -1;
    for (const auto& [field, number] : all) {
      if (field == name) found = number;
    }
    return found;
  }
  [[nodiscard]] std::vector<std::int64_t> every(std::string_view name) const {
    std::vector<std::int64_t> found;
    for (const auto& [field, number] : all) {
      if (field == name) found.push_back(number);
    }
    return found;
  }
  std::vector<std::pair<std::string, std::int64_t>> all;
};

inline Fields report(const Conversation<CanFrame>& conversation) {
  Fields fields;
  conversation.report(fields);
  return fields;
}

/// Sends one frame and keeps what comes until `until`.
class RawHost final : public Machine<CanFrame> {
 public:
  RawHost(const CanFrame& request, Time until) : request_(request), until_(until) {}
  void feed(const Event<CanFrame>& event) override {
    if (event.kind == Event<CanFrame>::Kind::received)
      heard.insert(heard.end(), event.items.begin(), event.items.end());
    if (event.kind == Event<CanFrame>::Kind::timer) done_ = true;
  }
  Step<CanFrame> next(Time) override {
    using Kind = Step<CanFrame>::Kind;
    if (done_) return {.kind = Kind::done};
    if (std::exchange(sent_, true)) return {.at = until_};
    return {.kind = Kind::transfer, .out = {&request_, 1}};
  }
  std::vector<CanFrame> heard;

 private:
  CanFrame request_;
  Time until_;
  bool sent_ = false;
  bool done_ = false;
};

struct Bench {
  explicit Bench(const Format& bench_format = {}) : format(bench_format) { add(bench_format); }

  VirtualNode& add(const Format& node_format) {
    nodes.push_back(std::make_unique<VirtualNode>(node_format, shaft));
    nodes.back()->power_on(line.now(), Device<CanFrame>::PowerOn::skip);
    line.attach(sim::Role::device, *nodes.back());
    return *nodes.back();
  }
  VirtualNode& node() { return *nodes.front(); }

  template <class Conversation>
  Conversation& run(Conversation& conversation) {
    const std::size_t host = line.attach(sim::Role::host, conversation);
    finished = line.run(host, line.now() + std::chrono::seconds(60));
    line.run_until(line.now());
    return conversation;
  }
  /// What comes within 20 ms of a request.
  std::vector<CanFrame> raw(const CanFrame& request) {
    RawHost host(request, line.now() + 20ms);
    return run(host).heard;
  }
  [[nodiscard]] std::uint64_t read() {
    Talk reading(format, "position");
    run(reading);
    return reading.reading() != nullptr ? reading.reading()->singleturn : ~std::uint64_t{0};
  }

  Format format;
  TestShaft shaft;
  std::vector<std::unique_ptr<VirtualNode>> nodes;
  sim::Line<CanFrame> line{LinkKind::can, {.rate = format.bit_rate()}};
  bool finished = true;
};

inline constexpr Format silent{.cyclic = 0};

}  // namespace absenc::raa38::can::testing
