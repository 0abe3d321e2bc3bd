// SPDX-License-Identifier: Apache-2.0
// For the tests of units: the virtual encoder of a unit, its commands, and a host that sends anything, on one line of
// characters in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absenc/protocol/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::sim::testing {

class UnitBench final : Machine<std::uint8_t> {
 public:
  using Wire = std::vector<std::uint8_t>;
  using PowerOn = Device<std::uint8_t>::PowerOn;

  explicit UnitBench(const Unit& unit, std::vector<OptionText> settings = {})
      : unit_(unit), device_storage_(unit.device_storage), host_storage_(unit.host_storage) {
    EXPECT_EQ(resolve_options(unit, {}, settings, options_).kind, OptionError::Kind::none);
    encoder_ = unit.device(options_, shaft, device_storage_).bytes;
    encoder_->power_on(Time{}, PowerOn::skip);
    line.emplace(unit.link, unit.settings != nullptr ? unit.settings(options_) : unit.line);
    line->attach(Role::device, *this);
  }

  /// What a command came to.
  struct Result {
    Error error = Error::none;
    std::string detail{};
    std::map<std::string, std::int64_t> numbers{};
    std::optional<Reading> reading{};
  };
  Result run(std::string_view command, std::vector<std::int64_t> arguments = {}) {
    auto& conversation = *unit_.host(options_, *find_command(unit_, command), arguments, host_storage_).bytes;
    run(conversation);
    Result result{conversation.error(), std::string(conversation.detail())};
    struct Collector final : FieldSink {
      explicit Collector(Result& all) : result(all) {}
      void put(const FieldValue& value) override { result.numbers[std::string(value.info->name)] = value.number; }
      Result& result;
    } collector(result);
    if (result.error == Error::none) conversation.report(collector);
    if (conversation.reading() != nullptr) result.reading = *conversation.reading();
    return result;
  }
  /// Sends these bytes, and what came back until the line was silent for `gap`; none within `answer`.
  RawHost send(Wire request, Time answer, Time gap) {
    RawHost host(std::move(request), answer, gap, line->now());
    run(host);
    return host;
  }
  void pass(Time time) { line->run_until(line->now() + time); }
  [[nodiscard]] Device<std::uint8_t>& encoder() { return *encoder_; }

  TestShaft<32> shaft;
  std::optional<Line<std::uint8_t>> line;
  /// Changes the n-th reply (from 0), as a wire may; empty: it is lost.
  std::function<void(unsigned index, Wire& reply)> tamper;

 private:
  void run(Machine<std::uint8_t>& host) {
    host_ = host_ ? (line->replace(*host_, host), host_) : line->attach(Role::host, host);
    EXPECT_TRUE(line->run(*host_, line->now() + std::chrono::seconds(100)));
    line->replace(*host_, idle_);
  }
  void feed(const Event<std::uint8_t>& event) override { encoder_->feed(event); }
  Step<std::uint8_t> next(Time now) override {
    Step<std::uint8_t> step = encoder_->next(now);
    if (!tamper || step.kind != Step<std::uint8_t>::Kind::transfer) return step;
    tampered_.assign(step.out.begin(), step.out.end());
    tamper(replies_++, tampered_);
    step.out = tampered_;
    return step;
  }

  /// At the host's end while nobody speaks there.
  struct Idle final : Machine<std::uint8_t> {
    void feed(const Event<std::uint8_t>&) override {}
    Step<std::uint8_t> next(Time) override { return {.kind = Step<std::uint8_t>::Kind::done}; }
  };

  const Unit& unit_;
  Options options_;
  std::vector<std::byte> device_storage_;
  std::vector<std::byte> host_storage_;
  Device<std::uint8_t>* encoder_ = nullptr;
  std::optional<Line<std::uint8_t>::Node> host_;
  Idle idle_;
  unsigned replies_ = 0;
  Wire tampered_;
};

}  // namespace absenc::sim::testing
