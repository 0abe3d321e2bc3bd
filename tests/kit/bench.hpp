// SPDX-License-Identifier: Apache-2.0
// For the tests of units on lines of characters: a virtual encoder and a host on one line in virtual time, by the
// unit's own commands.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absenc/protocol/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::kit {

using Wire = std::vector<std::uint8_t>;
using PowerOn = Device<std::uint8_t>::PowerOn;
using Numbers = std::map<std::string, std::int64_t>;

inline Wire wire(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

/// Changes the n-th reply (from 0) on its way to the line; empty: it is lost.
using Tamper = std::function<void(unsigned index, Wire& reply)>;

class Tampered final : public Machine<std::uint8_t> {
 public:
  Tampered(Machine<std::uint8_t>& device, Tamper tamper) : device_(device), tamper_(std::move(tamper)) {}
  void feed(const Event<std::uint8_t>& event) override { device_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    Step<std::uint8_t> step = device_.next(now);
    if (!tamper_ || step.kind != Step<std::uint8_t>::Kind::transfer) return step;
    out_ = wire(step.out);
    tamper_(replies_++, out_);
    step.out = out_;
    return step;
  }

 private:
  Machine<std::uint8_t>& device_;
  Tamper tamper_;
  unsigned replies_ = 0;
  Wire out_;
};

/// How a command ended.
struct Outcome final : FieldSink {
  void put(const FieldValue& value) override {
    fields[std::string(value.info->name)] = value.number;
    if (!value.bytes.empty()) data = wire(value.bytes);
  }
  [[nodiscard]] bool says(std::string_view words) const { return detail.find(words) != std::string::npos; }

  Error error{};
  std::string detail;
  std::string advice;
  std::optional<Reading> reading;
  Numbers fields;
  Wire data;
  Wire sent;
  Time received_at{};
  bool ended = false;
};

/// A command of a unit; `arguments` may leave out the last ones.
struct Made {
  Made(const Unit& unit, const Options& options, std::string_view command, std::vector<std::int64_t> arguments = {})
      : storage(unit.host_storage), host(make(unit, options, *find_command(unit, command), std::move(arguments))) {}
  Conversation<std::uint8_t>& make(const Unit& unit, const Options& options, const Command& info,
                                   std::vector<std::int64_t> arguments) {
    for (const Argument& more : info.arguments.subspan(arguments.size())) arguments.push_back(more.default_value);
    return *unit.host(options, info, arguments, storage).bytes;
  }
  std::vector<std::byte> storage;
  Conversation<std::uint8_t>& host;
};

/// A line with one host at a time.
struct HostedLine : sim::Line<std::uint8_t> {
  explicit HostedLine(const LineSettings& settings) : Line(LinkKind::half_duplex, settings) {}
  void put_on(Machine<std::uint8_t>& host) {
    if (node) return replace(*node, host);
    node = attach(sim::Role::host, host);
  }
  bool converse(Machine<std::uint8_t>& host) {
    put_on(host);
    return run(*node, now() + std::chrono::seconds(10));
  }
  Outcome run_command(const Unit& unit, const Options& options, std::string_view command,
                      std::vector<std::int64_t> arguments = {}) {
    const Made made(unit, options, command, std::move(arguments));
    Outcome outcome;
    outcome.ended = converse(made.host);
    outcome.error = made.host.error();
    outcome.detail = made.host.detail();
    outcome.advice = made.host.advice();
    if (made.host.reading() != nullptr) outcome.reading = *made.host.reading();
    made.host.report(outcome);
    outcome.sent = wire(made.host.exchange().sent);
    outcome.received_at = made.host.exchange().received_at;
    return outcome;
  }
  std::optional<std::size_t> node{};
};

/// One encoder on a line of its own, made of a format and the options that say the same.
template <class Encoder, class Shaft>
struct Bench {
  template <class Format>
  Bench(const Unit& of, const Options& with, const Format& format, Tamper tamper = {})
      : unit(of), options(with), encoder(format, shaft), device(encoder, std::move(tamper)), line(of.settings(with)) {
    encoder.power_on(Time{}, PowerOn::skip);
    line.attach(sim::Role::device, device);
  }

  Outcome run(std::string_view command, std::vector<std::int64_t> arguments = {}) {
    return line.run_command(unit, options, command, std::move(arguments));
  }
  /// What is answered to these bytes.
  Wire raw(Wire request) {
    sim::testing::RawHost host(std::move(request), std::chrono::microseconds(100), std::chrono::microseconds(12),
                               line.now());
    line.converse(host);
    return host.reply;
  }
  void set(std::size_t condition, std::int64_t value) { encoder.set_condition(condition, value, line.now()); }
  void pass(Time time) { line.run_until(line.now() + time); }
  void switch_off_and_on(PowerOn kind = PowerOn::skip) {
    encoder.power_off(line.now());
    encoder.power_on(line.now(), kind);
  }
  [[nodiscard]] std::uint32_t violations() const { return encoder.violation_count(); }

  const Unit& unit;
  Options options;
  Shaft shaft;
  Encoder encoder;
  Tampered device;
  HostedLine line;
};

}  // namespace absenc::kit
