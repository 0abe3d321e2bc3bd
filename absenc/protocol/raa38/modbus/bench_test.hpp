// SPDX-License-Identifier: Apache-2.0
// For tests: virtual and scripted RAA38S6 slaves, and a host, on one line in virtual time.
#pragma once

#include "absenc/protocol/raa38/modbus/device.hpp"
#include "absenc/protocol/raa38/talk_test.hpp"

namespace absenc::raa38::rtu {

[[nodiscard]] inline Options options_of(const Format& format) {
  Options options;
  options.values = {format.address,
                    format.bits,
                    format.registers,
                    static_cast<std::int64_t>(format.baud),
                    static_cast<std::int64_t>(format.data),
                    static_cast<std::int64_t>(format.address_crc)};
  return options;
}

namespace testing {

using author::testing::PowerOn;
using author::testing::Wire;
using raa38::testing::CommandResult;
using raa38::testing::ended;
using raa38::testing::says;

struct Talk final : raa38::testing::Talk<std::uint8_t> {
  Talk(const Format& format, std::string_view name, std::vector<std::int64_t> arguments = {})
      : raa38::testing::Talk<std::uint8_t>(modbus_unit, options_of(format), name, std::move(arguments)) {}
};

/// Returns the frame that consists of `body` and its CRC.
[[nodiscard]] inline Wire framed(const Wire& body) {
  modbus::FrameBytes frame;
  frame.append(body);
  modbus::append_crc(frame);
  return {frame.view().begin(), frame.view().end()};
}

struct Bench : raa38::testing::Bench<std::uint8_t, VirtualEncoder, Format, modbus_unit> {
  explicit Bench(const Format& own = {})
      : raa38::testing::Bench<std::uint8_t, VirtualEncoder, Format, modbus_unit>(own, LinkKind::half_duplex,
                                                                                 own.line()) {
    add(own);
  }
  /// Turns the shaft to the position `counts`, in counts of the encoder's resolution.
  void put(std::int64_t counts) { shaft.put(0, counts << (21 - format.bits)); }
  /// Sends the bytes of `request` unchanged, after 20 ms of silence, and returns the reply.
  Wire raw(const Wire& request) {
    sim::testing::RawHost host(request, 100ms, 20ms, line.now() + 20ms);
    return run(host).reply;
  }
  /// Sends `request` with a CRC and returns the reply without its CRC.
  Wire body(const Wire& request) {
    const Wire reply = raw(framed(request));
    if (reply.empty()) return {};
    EXPECT_EQ(modbus::crc_order(reply), CrcOrder::low_first);
    return {reply.begin(), reply.end() - 2};
  }
};

/// A slave whose replies a function makes from the request and the number of earlier requests.
class Scripted final : public Machine<std::uint8_t> {
 public:
  using Script = std::function<Wire(Bytes request, unsigned before)>;
  explicit Scripted(Script script) : script_(std::move(script)) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::received)
      request_bytes_.insert(request_bytes_.end(), event.items.begin(), event.items.end());
    if (event.kind != Event<std::uint8_t>::Kind::silence || request_bytes_.empty()) return;
    request_times.push_back(event.at);
    reply_ = script_(request_bytes_, requests++);
    request_bytes_.clear();
    pending_ = !reply_.empty();
  }
  Step<std::uint8_t> next(Time) override {
    if (!std::exchange(pending_, false)) return {.at = never, .gap = 2ms};
    return {.kind = Step<std::uint8_t>::Kind::transfer, .out = reply_};
  }

  unsigned requests = 0;
  std::vector<Time> request_times{};

 private:
  Script script_;
  Wire request_bytes_;
  Wire reply_;
  bool pending_ = false;
};

struct ScriptedResult : CommandResult {
  unsigned requests = 0;
  std::vector<Time> request_times{};
};

/// Runs a command against a scripted slave and returns its result.
[[nodiscard]] inline ScriptedResult with(const Scripted::Script& script, std::string_view command,
                                         std::vector<std::int64_t> arguments = {}, const Format& format = {}) {
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  Scripted scripted(script);
  Talk talk(format, command, std::move(arguments));
  line.attach(sim::NodeRole::device, scripted);
  EXPECT_TRUE(line.run(line.attach(sim::NodeRole::host, *talk), 60s));
  return {raa38::testing::result_of<std::uint8_t>(*talk), scripted.requests, scripted.request_times};
}

}  // namespace testing
}  // namespace absenc::raa38::rtu
