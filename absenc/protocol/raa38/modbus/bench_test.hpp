// SPDX-License-Identifier: Apache-2.0
// For tests: virtual RAA38S6 slaves and a host on one Modbus line in virtual time.
#pragma once

#include <memory>
#include <vector>

#include "absenc/protocol/raa38/modbus/device.hpp"
#include "absenc/protocol/raa38/modbus/options.hpp"
#include "absenc/protocol/raa38/talk_test.hpp"
#include "absenc/protocol/raa38/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::raa38::rtu::testing {

using PowerOn = Device<std::uint8_t>::PowerOn;

/// The top 21 bits of a turn: what the finest of these encoders sees.
using TestShaft = sim::testing::TestShaft<21>;

[[nodiscard]] inline Options options_of(const Format& format) {
  Options options;
  options.values = {format.address, format.bits, format.registers, static_cast<std::int64_t>(format.baud),
                    static_cast<std::int64_t>(format.data)};
  return options;
}

/// A command of an encoder of this format.
struct Talk final : raa38::testing::Talk<std::uint8_t> {
  Talk(const Format& format, std::string_view name, std::vector<std::int64_t> arguments = {})
      : raa38::testing::Talk<std::uint8_t>(modbus_unit, options_of(format), name, std::move(arguments)) {}
};

struct Bench {
  explicit Bench(const Format& bench_format = {}) : format(bench_format), encoder(bench_format, shaft) {
    put_on_line(encoder);
  }

  void put_on_line(VirtualEncoder& another) {
    another.power_on(line.now(), PowerOn::skip);
    line.attach(sim::Role::device, another);
  }

  /// `counts` of the encoder's own bits.
  void put_shaft(std::int64_t counts) { shaft.put(0, counts << (21 - format.bits)); }

  /// Runs a conversation to its end and returns it.
  template <class Conversation>
  Conversation& run(Conversation& conversation) {
    if (host == none) {
      host = line.attach(sim::Role::host, conversation);
    } else {
      line.replace(host, conversation);
    }
    finished = line.run(host, line.now() + std::chrono::seconds(60));
    return conversation;
  }
  /// Sends any bytes, CRC included, after 20 ms of silence.
  std::vector<std::uint8_t> raw(std::vector<std::uint8_t> request) {
    sim::testing::RawHost raw_host(std::move(request), 100ms, 20ms, line.now() + 20ms);
    return run(raw_host).reply;
  }
  /// The same with the CRC appended.
  std::vector<std::uint8_t> raw_body(std::initializer_list<std::uint8_t> body) {
    modbus::FrameBytes frame;
    for (const std::uint8_t byte : body) frame.push_back(byte);
    modbus::append_crc(frame);
    return raw({frame.view().begin(), frame.view().end()});
  }

  static constexpr std::size_t none = ~std::size_t{0};
  Format format;
  TestShaft shaft;
  VirtualEncoder encoder;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, format.line()};
  std::size_t host = none;
  bool finished = true;
};

}  // namespace absenc::raa38::rtu::testing
