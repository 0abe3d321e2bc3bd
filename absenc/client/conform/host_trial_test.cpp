// SPDX-License-Identifier: Apache-2.0
// Our own host holds every clause of a host, and each is broken by a mutant of a host that breaks it alone.
#include "absenc/client/conform/host_trial.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <cstdio>
#include <string>
#include <vector>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/way/address.hpp"
#include "absenc/host/session.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client {
namespace {

/// What is wrong with a host.
struct Flaws {
  bool babbles = false;  // it sends what nobody understands
  bool stops_at_silence = false;
  bool stops_at_damage = false;
  Time hasty{};                    // waits of up to so long are left out
  const Command* first = nullptr;  // sent once at its end, without a look at the reply
  const Command* then = nullptr;   // and this ten times
  Time distance{};                 // so long after what was sent before
};

struct Stopped {};

/// The port of a host that does not wait, or gives up.
class HastyPort final : public Port<std::uint8_t> {
 public:
  explicit HastyPort(Port<std::uint8_t>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const ByteStep& step) override {
    sending_ = step.kind == ByteStep::Kind::transfer;
    if (sending_ && requests_left-- == 0) throw Stopped{};
    port_.begin(step);
  }
  ByteEvent wait(const ByteStep& step) override {
    const Time left = step.at - port_.now();
    if (!sending_ && step.at != never && left > Time{} && left <= hasty) {
      return {.kind = ByteEvent::Kind::timer, .at = step.at};
    }
    const ByteEvent event = port_.wait(step);
    if (event.kind == ByteEvent::Kind::sent) sending_ = false;
    return event;
  }

  Time hasty{};
  unsigned requests_left = UINT_MAX;

 private:
  Port<std::uint8_t>& port_;
  bool sending_ = false;
};

class Host {
 public:
  Host(const EncoderAddress& address, const Flaws& flaws)
      : address_(address),
        unit_(*address.unit),
        flaws_(flaws),
        device_(unit_, address.options, settings(address)),
        line_(unit_.link, address.line.with_some_rate(), *device_.bytes()),
        port_(line_),
        storage_(unit_.host_storage) {
    device_.power_on(Time{});
  }

  Conformance judged() {
    constexpr unsigned most_rounds = 40;
    HostTrial trial(20);
    for (unsigned i = 0; i < most_rounds && !stopped_ && !trial.over(); ++i) {
      round(trial);
    }
    device_.set_faults({});
    if (flaws_.then != nullptr) send_raw();
    std::vector<std::string> rules;
    for (const Violation& violation : device_.device().bytes->violations()) rules.emplace_back(violation.rule);
    return trial.judge(unit_, rules);
  }

 private:
  static DeviceSettings settings(const EncoderAddress& address) {
    DeviceSettings with = address.device;
    with.faults_may_come = true;
    return with;
  }

  void round(HostTrial& trial) {
    if (flaws_.babbles) return send({0x00});
    one(trial, *find_command(unit_, Verb::read), {});
    port_.hasty = flaws_.hasty;
    const Command* memory = find_command(unit_, Verb::memory_read);
    for (const std::int64_t page : {1, 0}) {
      if (memory != nullptr) one(trial, *memory, role_arguments(*memory, {{Role::page, page}, {Role::address, 3}}));
    }
    port_.hasty = Time{};
  }

  void one(HostTrial& trial, const Command& command, Arguments arguments) {
    if (stopped_ || trial.over()) return;
    sim::FaultRates rates;
    const HostTrial::Fault fault = trial.look(device_.device().bytes->answer_count());
    if (fault == HostTrial::Fault::silence) rates[require_fault("drop=1").kind] = 1;
    if (fault == HostTrial::Fault::damage) rates[require_fault("corrupt=1").kind] = 1;
    device_.set_faults(rates);
    host::Session<std::uint8_t> session(unit_, address_.options, port_, storage_, host::EchoMode::off, 1);
    const bool stops = fault == HostTrial::Fault::silence  ? flaws_.stops_at_silence
                       : fault == HostTrial::Fault::damage ? flaws_.stops_at_damage
                                                           : false;
    port_.requests_left = stops ? 1 : UINT_MAX;
    try {
      static_cast<void>(session.run(command, arguments));
    } catch (const Stopped&) {
      stopped_ = true;
    }
    stopped_ = stopped_ || stops;
    trial.look(device_.device().bytes->answer_count());
  }

  void send_raw() {
    const auto request = [&](const Command& command) {
      std::vector<std::uint8_t> bytes(300);
      const auto size = unit_.encode(address_.options, command, complete_arguments(command, given(command)), bytes);
      bytes.resize(size ? *size : 0);
      return bytes;
    };
    listen(std::chrono::milliseconds(50));
    send(request(*flaws_.first));
    for (unsigned i = 0; i < 10; ++i) {
      listen(flaws_.distance);
      send(request(*flaws_.then));
    }
    listen(std::chrono::milliseconds(50));
  }
  static std::vector<std::int64_t> given(const Command& command) {
    std::vector<std::int64_t> values;
    for (const Argument& one : command.arguments) {
      if (one.required) values.push_back(std::max<std::int64_t>(one.minimum, 1));
    }
    return values;
  }
  void send(const std::vector<std::uint8_t>& bytes) {
    if (bytes.empty()) return;
    ByteStep step{.kind = ByteStep::Kind::transfer};
    step.out = bytes;
    line_.begin(step);
    while (line_.wait({.at = never}).kind != ByteEvent::Kind::sent) {
    }
  }
  void listen(Time time) {
    const ByteStep step{.at = line_.now() + time};
    while (line_.now() < step.at && line_.wait(step).kind != ByteEvent::Kind::timer) {
    }
  }

  const EncoderAddress& address_;
  const Unit& unit_;
  Flaws flaws_;
  VirtualDevice device_;
  sim::SimPort<std::uint8_t> line_;
  HastyPort port_;
  std::vector<std::byte> storage_;
  bool stopped_ = false;
};

std::vector<Flaws> flaws_for(const EncoderAddress& address) {
  std::vector<Flaws> all{{.babbles = true}, {.stops_at_silence = true}, {.stops_at_damage = true}};
  for (const Time hasty : {Time(100'000), Time(1'000'000), Time(19'000'000), Time(100'000'000)}) {
    all.push_back({.hasty = hasty});
  }
  const Time character = address.line.with_some_rate().character();
  for (const Command& first : address.unit->commands) {
    for (const Command& then : address.unit->commands) {
      const auto add = [&](Time distance) { all.push_back({.first = &first, .then = &then, .distance = distance}); };
      for (int halves = 0; halves <= 60; halves += 4) add(character * halves / 2);
      for (const int us : {45, 100, 150}) add(std::chrono::microseconds(us));
    }
  }
  return all;
}

std::vector<std::string> broken_by(const EncoderAddress& address, const Flaws& flaws) {
  std::vector<std::string> ids;
  for (const ClauseResult& one : Host(address, flaws).judged().clauses) {
    if (one.verdict == Verdict::broken) ids.emplace_back(one.id);
  }
  return ids;
}

class HostClauses : public ::testing::TestWithParam<const Unit*> {};

TEST_P(HostClauses, EachIsBrokenByAMutantAlone) {
  const std::string name(GetParam()->id);
  std::size_t tried = 0;
  std::vector<std::string> found;
  for (const char* const motion : {"still", "rpm=60"}) {
    const EncoderAddress address = parse_address(fmt::format("sim:{}?motion={}", name, motion));
    const Conformance own = Host(address, {}).judged();
    EXPECT_TRUE(own.good()) << own.report();
    for (const Flaws& flaws : flaws_for(address)) {
      if (found.size() == host_clauses_of(*GetParam()).size()) break;
      ++tried;
      const std::vector<std::string> broken = broken_by(address, flaws);
      if (broken.size() == 1 && std::find(found.begin(), found.end(), broken[0]) == found.end()) {
        found.push_back(broken[0]);
      }
    }
  }
  for (const HostClause& clause : host_clauses_of(*GetParam())) {
    EXPECT_NE(std::find(found.begin(), found.end(), clause.id), found.end()) << clause.id;
  }
  std::printf("%s: %zu clauses of a host, %zu mutants\n", name.c_str(), host_clauses_of(*GetParam()).size(), tried);
}

INSTANTIATE_TEST_SUITE_P(Units, HostClauses, ::testing::ValuesIn([] {
                           std::vector<const Unit*> units;
                           for (const Unit* unit : all_units()) {
                             if (!host_clauses_of(*unit).empty()) units.push_back(unit);
                           }
                           return units;
                         }()),
                         [](const auto& one) {
                           std::string name(one.param->id);
                           for (char& letter : name) letter = letter == '-' ? '_' : letter;
                           return name;
                         });

}  // namespace
}  // namespace absenc::client
