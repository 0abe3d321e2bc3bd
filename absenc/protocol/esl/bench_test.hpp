// SPDX-License-Identifier: Apache-2.0
// For tests: virtual QS35 encoders and a host on one line in virtual time, by the unit's own commands.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/reply.hpp"
#include "absenc/protocol/esl/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::esl::testing {

using TestShaft = sim::testing::TestShaft<24>;
using Wire = std::vector<std::uint8_t>;
using PowerOn = Device<std::uint8_t>::PowerOn;

inline Wire wire(Bytes bytes) { return {bytes.begin(), bytes.end()}; }
inline Wire wire(const Reply& reply) { return wire(encode_reply({}, reply).view()); }

struct RawHost final : sim::testing::RawHost {
  explicit RawHost(Wire request, Time at = {})
      : sim::testing::RawHost(std::move(request), answer_limit, gap_limit, at) {}
};

/// Changes the n-th reply (from 0) of an encoder as a script wants, on its way to the line.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<void(unsigned index, Wire& reply)>;
  Tampered(VirtualEncoder& encoder, Tamper tamper) : encoder_(encoder), tamper_(std::move(tamper)) {}
  void feed(const Event<std::uint8_t>& event) override { encoder_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    Step<std::uint8_t> step = encoder_.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::transfer) {
      out_.assign(step.out.begin(), step.out.end());
      if (tamper_) tamper_(replies_++, out_);
      step.out = out_;
    }
    return step;
  }

 private:
  VirtualEncoder& encoder_;
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
  Error error{};
  std::string detail;
  std::optional<Reading> reading;
  std::map<std::string, std::int64_t> fields;
  Wire data;
  Wire sent;
  Time received_at{};
  bool ended = false;
};

inline Options options_of(const Profile& profile) {
  Options values;
  for (std::size_t i = 0; i < options.infos.size(); ++i) values.values[i] = options.get(profile, i);
  return values;
}

/// A line with one host at a time.
struct HostedLine : sim::Line<std::uint8_t> {
  HostedLine() : Line(LinkKind::half_duplex, line_settings) {}
  bool converse(Machine<std::uint8_t>& host) {
    if (node) {
      replace(*node, host);
    } else {
      node = attach(sim::Role::host, host);
    }
    return run(*node, now() + std::chrono::seconds(10));
  }
  std::optional<std::size_t> node{};
};

/// A command of the unit; `arguments` may leave out the last ones.
struct Made {
  Made(const Profile& profile, std::string_view command, std::vector<std::int64_t> arguments = {})
      : host(make(profile, *find_command(unit, command), std::move(arguments))) {}
  Conversation<std::uint8_t>& make(const Profile& profile, const Command& info, std::vector<std::int64_t> arguments) {
    for (const Argument& more : info.arguments.subspan(arguments.size())) arguments.push_back(more.default_value);
    return *unit.host(options_of(profile), info, arguments, storage).bytes;
  }
  std::vector<std::byte> storage = std::vector<std::byte>(unit.host_storage);
  Conversation<std::uint8_t>& host;
};

inline Outcome run(HostedLine& line, const Profile& profile, std::string_view command,
                   std::vector<std::int64_t> arguments = {}) {
  const Made made(profile, command, std::move(arguments));
  Outcome outcome;
  outcome.ended = line.converse(made.host);
  outcome.error = made.host.error();
  outcome.detail = made.host.detail();
  if (made.host.reading() != nullptr) outcome.reading = *made.host.reading();
  made.host.report(outcome);
  outcome.sent = wire(made.host.exchange().sent);
  outcome.received_at = made.host.exchange().received_at;
  return outcome;
}

inline bool says(const Outcome& outcome, std::string_view words) {
  return outcome.detail.find(words) != std::string::npos;
}

/// One encoder on a line of its own.
struct Bench {
  explicit Bench(const Profile& bench_profile = {}, Tampered::Tamper tamper = {})
      : profile(bench_profile), encoder(bench_profile, shaft), device(encoder, std::move(tamper)) {
    encoder.power_on(Time{}, PowerOn::skip);
    line.attach(sim::Role::device, device);
  }

  Outcome run(std::string_view command, std::vector<std::int64_t> arguments = {}) {
    return testing::run(line, profile, command, std::move(arguments));
  }
  Wire raw(Wire request) {
    RawHost host(std::move(request), line.now());
    return raw(host);
  }
  Wire raw(RawHost& host) {
    line.converse(host);
    return host.reply;
  }
  Wire raw(Request request) {
    request.encoder_address = profile.address;
    return raw(wire(encode_request(profile, request).view()));
  }
  Reply read(DataId id = DataId::position) {
    const Wire bytes = raw(Request{id});
    return decode_reply(profile, {id, profile.address}, bytes).value();
  }
  void set(condition::Index index, std::int64_t value) { encoder.set_condition(index, value, line.now()); }
  void switch_off_and_on(PowerOn kind = PowerOn::skip) {
    encoder.power_off(line.now());
    encoder.power_on(line.now(), kind);
  }
  void pass(Time time) { line.run_until(line.now() + time); }
  [[nodiscard]] std::uint32_t violations() const { return encoder.violation_count(); }

  Profile profile;
  TestShaft shaft;
  VirtualEncoder encoder;
  Tampered device;
  HostedLine line;
};

}  // namespace absenc::esl::testing
