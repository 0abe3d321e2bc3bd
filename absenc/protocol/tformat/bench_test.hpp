// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual Smart-Abs and a host on one line in virtual time, and the commands of the unit.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::tformat::testing {

using TestShaft = sim::testing::TestShaft<17>;
using PowerOn = Device<std::uint8_t>::PowerOn;
using Wire = std::vector<std::uint8_t>;
using Numbers = std::map<std::string, std::int64_t>;

inline Wire wire(Bytes bytes) { return {bytes.begin(), bytes.end()}; }
inline Wire wire(const Reply& reply) { return wire(encode_reply(reply).view()); }
inline Wire wire(const Request& request) { return wire(encode_request(request).view()); }

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(Wire request, Time at = {}) : sim::testing::RawHost(std::move(request), 100us, 12us, at) {}
};

struct Collector final : FieldSink {
  void put(const FieldValue& value) override { numbers[std::string(value.info->name)] = value.number; }
  Numbers numbers;
};

/// Changes the n-th reply (from 0), as a wire may; empty: it is lost.
using Tamper = std::function<void(unsigned index, Wire& reply)>;

class Tampered final : public Machine<std::uint8_t> {
 public:
  Tampered(VirtualEncoder& encoder, Tamper tamper) : encoder_(encoder), tamper_(std::move(tamper)) {}
  void feed(const Event<std::uint8_t>& event) override { encoder_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    Step<std::uint8_t> step = encoder_.next(now);
    if (!tamper_ || step.kind != Step<std::uint8_t>::Kind::transfer) return step;
    out_.assign(step.out.begin(), step.out.end());
    tamper_(replies_++, out_);
    step.out = out_;
    return step;
  }

 private:
  VirtualEncoder& encoder_;
  Tamper tamper_;
  unsigned replies_ = 0;
  Wire out_;
};

/// Refusals in place of these replies.
inline Tamper refuse(unsigned from, unsigned to, std::uint8_t alarm) {
  return [=](unsigned index, Wire& reply) {
    if (index >= from && index < to) reply = wire(Reply{.status = alarm, .encoder_id = 0x11});
  };
}

inline bool has(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// What a command of the unit came to.
struct CommandResult {
  Error error = Error::none;
  std::string detail;
  std::string advice;
  Numbers numbers;
  std::optional<Reading> reading;
};

struct Bench {
  explicit Bench(Tamper tamper = {}, std::vector<OptionText> with = {})
      : settings(std::move(with)), encoder({}, shaft), device(encoder, std::move(tamper)) {
    encoder.power_on(Time{}, PowerOn::skip);
    line.attach(sim::Role::device, device);
  }

  /// Runs a conversation to its end and returns it.
  template <class Conversation>
  Conversation& run(Conversation& conversation) {
    put_on(conversation);
    EXPECT_TRUE(line.run(host, line.now() + 10s));
    return conversation;
  }
  void put_on(Machine<std::uint8_t>& conversation) {
    if (host == none) {
      host = line.attach(sim::Role::host, conversation);
    } else {
      line.replace(host, conversation);
    }
  }
  Wire raw(Wire request) {
    RawHost raw_host(std::move(request), line.now());
    return run(raw_host).reply;
  }
  /// In the storage of this bench.
  Conversation<std::uint8_t>& make(std::string_view name, std::vector<std::int64_t> arguments = {}) {
    Options options;
    EXPECT_EQ(resolve_options(unit, {}, settings, options).kind, OptionError::Kind::none);
    storage.assign(unit.host_storage, std::byte{});
    return *unit.host(options, *find_command(unit, name), arguments, storage).bytes;
  }
  CommandResult command(std::string_view name, std::vector<std::int64_t> arguments = {}) {
    const auto& conversation = run(make(name, std::move(arguments)));
    Collector collector;
    conversation.report(collector);
    CommandResult result{conversation.error(), std::string(conversation.detail()), std::string(conversation.advice()),
                         collector.numbers, std::nullopt};
    if (conversation.reading() != nullptr) result.reading = *conversation.reading();
    return result;
  }
  Reply everything() {
    ReadPosition read({});
    return run(read).reply();
  }
  void pass(Time time) { line.run_until(line.now() + time); }
  void set(ConditionIndex condition, std::int64_t value) { encoder.set_condition(condition, value, line.now()); }
  void switch_off_and_on() {
    encoder.power_off(line.now());
    encoder.power_on(line.now(), PowerOn::skip);
  }

  static constexpr std::size_t none = ~std::size_t{0};
  std::vector<OptionText> settings;
  TestShaft shaft;
  VirtualEncoder encoder;
  Tampered device;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  std::size_t host = none;
  std::vector<std::byte> storage;
};

}  // namespace absenc::tformat::testing
