// SPDX-License-Identifier: Apache-2.0
// Our own host holds every clause of a host, and each is broken by a mutant of a host that breaks it alone.
#include "absenc/client/conform/host_trial.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstdio>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "absenc/client/conform/host_stage.hpp"
#include "absenc/client/emulation/rule_counter.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/client/way/address.hpp"
#include "absenc/host/session.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client {
namespace {

/// What a host sends besides, without a look at the reply.
struct Sent {
  Time pause{};           // behind what was sent before
  std::string_view what;  // a command, of which only its own request is sent, or what stands on the wire
  std::vector<std::int64_t> arguments{};
};

/// What is wrong with a host.
struct Flaws {
  bool babbles = false;  // it sends what nobody understands
  bool stops_at_silence = false;
  bool stops_at_damage = false;
  Time hasty{};  // waits of up to so long are left out
  std::vector<Sent> sends{};
  // Of an SPI controller:
  Time early{};            // transfers begin so much too early
  std::uint32_t rate = 0;  // Hz; 0: as it is told
  int bytes = 0;           // more than it is told, at least one
  bool other_mode = false;
  bool without_lead = false;
};

struct Stopped {};

/// The port of a host that does not wait, or gives up.
template <class Item>
class HastyPort final : public Port<Item> {
 public:
  explicit HastyPort(Port<Item>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const Step<Item>& step) override {
    sending_ = step.kind == Step<Item>::Kind::transfer;
    if (sending_ && requests_left-- == 0) throw Stopped{};
    port_.begin(step);
  }
  Event<Item> wait(const Step<Item>& step) override {
    const Time left = step.at - port_.now();
    if (!sending_ && step.at != never && left > Time{} && left <= hasty) {
      return {.kind = Event<Item>::Kind::timer, .at = step.at};
    }
    const Event<Item> event = port_.wait(step);
    if (event.kind == Event<Item>::Kind::sent) sending_ = false;
    return event;
  }

  Time hasty{};
  unsigned requests_left = UINT_MAX;

 private:
  Port<Item>& port_;
  bool sending_ = false;
};

/// An SPI controller in virtual time, with what is wrong with it.
class ControllerPort final : public Port<std::uint8_t> {
 public:
  ControllerPort(LinkKind kind, const LineSettings& line, Machine<std::uint8_t>& device, const Flaws& flaws)
      : line_(line), flaws_(flaws), rate_(line.rate), device_(kind, line, device) {
    device_.begin(now_);
  }

  Time now() override { return now_; }
  void begin(const ByteStep& step) override {
    if (step.kind == ByteStep::Kind::configure) rate_ = step.rate;
    if (step.kind != ByteStep::Kind::transfer) return;
    now_ = std::max(now_, step.at - flaws_.early);
    if (device_.timer() <= now_) device_.wake(now_);
    if (step.hold_low) device_.rest(line_.spi_mode & 1u);
    const std::size_t told =
        step.bits > 0 ? (step.bits + line_.idle_clocks + 7) / 8 : std::max(step.out.size(), step.expect);
    const std::size_t size = static_cast<std::size_t>(std::max(static_cast<int>(told) + flaws_.bytes, 1));
    std::vector<std::uint8_t> out(step.out.begin(), step.out.end());
    out.resize(size);
    std::vector<std::uint8_t> in(size);
    const auto mode = static_cast<std::uint8_t>(line_.spi_mode ^ (flaws_.other_mode ? 2u : 0u));
    const std::array<os::SpiTransfer, 2> message{
        {{.mode = mode, .delay = flaws_.without_lead ? Time{} : line_.select_lead},
         {.size = size, .out = out, .in = in, .rate = flaws_.rate != 0 ? flaws_.rate : rate_, .mode = mode}}};
    now_ = device_.message(message, now_);
    in.resize(told, 0xFF);
    const bool idle_low = line_.idle_clocks > 0 && (in[0] & 0x80) == 0;
    for (std::size_t i = 0; i < told && line_.idle_clocks == 1; ++i) {
      in[i] = static_cast<std::uint8_t>(in[i] << 1 | (i + 1 < told ? in[i + 1] >> 7 : 0));
    }
    came_ = in;
    events_.push_back({.kind = ByteEvent::Kind::sent, .at = now_});
    events_.push_back({.kind = ByteEvent::Kind::received, .at = now_, .items = came_, .idle_low = idle_low});
  }
  ByteEvent wait(const ByteStep& step) override {
    if (!events_.empty()) {
      const ByteEvent event = events_.front();
      events_.pop_front();
      return event;
    }
    if (step.at == never) throw std::logic_error("nothing can happen on this line");
    now_ = std::max(now_, step.at);
    return {.kind = ByteEvent::Kind::timer, .at = step.at};
  }
  [[nodiscard]] const os::SpiDevice& device() const { return device_; }

 private:
  LineSettings line_;
  const Flaws& flaws_;
  std::uint32_t rate_;
  Time now_{};
  os::SpiDevice device_;
  std::vector<std::uint8_t> came_;
  std::deque<ByteEvent> events_;
};

template <class Item>
class Host {
 public:
  Host(const EncoderAddress& address, const Flaws& flaws)
      : address_(address),
        unit_(*address.unit),
        flaws_(flaws),
        device_(unit_, address.options, settings(address)),
        line_(make_line()),
        port_(*line_),
        storage_(unit_.host_storage) {
    device_.watch_rules(&rules_);
    device_.power_on(Time{});
    port_.hasty = flaws_.early;
  }

  /// `all`: at its end it runs every command once.
  Conformance judged(bool all = false) {
    constexpr unsigned most_rounds = 40;
    HostTrial trial(20);
    for (unsigned i = 0; i < most_rounds && !stopped_ && !trial.over(); ++i) {
      round(trial);
    }
    device_.set_faults({});
    if (!flaws_.sends.empty()) send_all();
    for (const Command& command : unit_.commands) {
      const bool moves = !command.changes_option.empty();  // then it would have to follow
      if (all && !moves) run(command, complete_arguments(command, given(command)));
    }
    trial.look(answered(), counts());
    return trial.judge(unit_);
  }

 private:
  std::shared_ptr<Port<Item>> make_line() {
    const LineSettings line = address_.line.with_some_rate();
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      if (unit_.link == LinkKind::spi || unit_.link == LinkKind::clocked) {
        controller_ = std::make_shared<ControllerPort>(unit_.link, line, *machine(), flaws_);
        return controller_;
      }
    }
    return std::make_shared<sim::SimPort<Item>>(unit_.link, line, *machine());
  }
  [[nodiscard]] std::vector<RuleCount> counts() const {
    return controller_ != nullptr ? with_mode(rules_.counts(), controller_->device()) : rules_.counts();
  }
  static DeviceSettings settings(const EncoderAddress& address) {
    DeviceSettings with = address.device;
    with.faults_may_come = true;
    return with;
  }
  Machine<Item>* machine() {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      return device_.frames();
    } else {
      return device_.bytes();
    }
  }
  [[nodiscard]] std::uint64_t answered() const {
    const Any<Device>& device = device_.device();
    return device.bytes != nullptr ? device.bytes->answer_count() : device.frames->answer_count();
  }

  void round(HostTrial& trial) {
    if (flaws_.babbles) {
      if (controller_ != nullptr) return;  // whatever is clocked is answered
      if constexpr (std::is_same_v<Item, CanFrame>) return send({CanFrame{.id = 0x7FF}});
      listen(std::chrono::milliseconds(1));  // two of them begin no request either
      if constexpr (!std::is_same_v<Item, CanFrame>) return send({'\r'});
    }
    one(trial, *find_command(unit_, Verb::read), {});
    port_.hasty = flaws_.hasty;
    const Command* memory = find_command(unit_, Verb::memory_read);
    for (const std::int64_t page : {1, 0}) {
      if (memory != nullptr) one(trial, *memory, role_arguments(*memory, {{Role::page, page}, {Role::address, 3}}));
    }
    port_.hasty = flaws_.early;
  }

  void run(const Command& command, Arguments arguments) {
    host::Session<Item> session(unit_, address_.options, port_, storage_, host::EchoMode::off, 1);
    static_cast<void>(session.run(command, arguments));
  }
  void one(HostTrial& trial, const Command& command, Arguments arguments) {
    if (stopped_ || trial.over()) return;
    const HostTrial::Fault fault = trial.look(answered(), counts());
    sim::FaultRates rates;
    if (fault != HostTrial::Fault::none) rates[require_fault(fmt::format("{}=1", name_of(fault))).kind] = 1;
    device_.set_faults(rates);
    const bool stops = fault == HostTrial::Fault::silence  ? flaws_.stops_at_silence
                       : fault == HostTrial::Fault::damage ? flaws_.stops_at_damage
                                                           : false;
    port_.requests_left = stops ? 1 : UINT_MAX;
    try {
      run(command, arguments);
    } catch (const Stopped&) {
      stopped_ = true;
    }
    stopped_ = stopped_ || stops;
    trial.look(answered(), counts());
  }

  // What the encoder is told by itself: what it does then is nobody's to wait for.
  void send_all() {
    listen(std::chrono::milliseconds(50));
    for (const Sent& one : flaws_.sends) {
      listen(one.pause);
      send(items(one));
    }
    listen(std::chrono::milliseconds(50));
  }
  [[nodiscard]] std::vector<Item> items(const Sent& one) const {
    WireFrame wire;
    const Command* const command = find_command(unit_, one.what);
    std::vector<std::uint8_t> bytes(300);
    if (command == nullptr) {
      wire = parse_wire_text(unit_.link, "sent", one.what);
    } else {
      const auto arguments = complete_arguments(*command, one.arguments.empty() ? given(*command) : one.arguments);
      const auto size = unit_.encode(address_.options, *command, arguments, bytes);
      bytes.resize(size ? *size : 0);
      wire.bytes = bytes;
    }
    if constexpr (std::is_same_v<Item, CanFrame>) {
      if (command != nullptr)
        wire = parse_wire_text(unit_.link, "sent", {reinterpret_cast<char*>(bytes.data()), bytes.size()});
      return {*wire.can};
    } else {
      return wire.bytes;
    }
  }
  static std::vector<std::int64_t> given(const Command& command) {
    std::vector<std::int64_t> values;
    for (const Argument& one : command.arguments) {
      if (one.required) values.push_back(std::max<std::int64_t>(one.minimum, 1));
    }
    return values;
  }
  void send(const std::vector<Item>& items) {
    if (items.empty()) return;
    Step<Item> step{.kind = Step<Item>::Kind::transfer};
    step.out = items;
    line_->begin(step);
    while (line_->wait({.at = never}).kind != Event<Item>::Kind::sent) {
    }
  }
  void listen(Time time) {
    const Step<Item> step{.at = line_->now() + time};
    while (line_->now() < step.at && line_->wait(step).kind != Event<Item>::Kind::timer) {
    }
  }

  const EncoderAddress& address_;
  const Unit& unit_;
  Flaws flaws_;
  RuleCounter rules_;
  VirtualDevice device_;
  std::shared_ptr<ControllerPort> controller_;  // of spi and clocked links
  std::shared_ptr<Port<Item>> line_;
  HastyPort<Item> port_;
  std::vector<std::byte> storage_;
  bool stopped_ = false;
};

/// What breaks a clause that two commands in a row do not.
std::vector<Flaws> scripts_for(std::string_view unit) {
  using std::chrono::microseconds;
  using std::chrono::milliseconds;
  const auto times = [](unsigned count, Sent sent) { return std::vector<Sent>(count, sent); };
  if (unit == "tformat") {
    std::vector<Sent> nine = times(9, {microseconds(100), "zero"});
    nine.push_back({microseconds(100), "position"});
    return {{.sends = nine},
            {.sends = {{{}, "memory-write", {1, 5}}, {milliseconds(5), "memory-write", {2, 5}}}},
            {.sends = {{{}, "memory-write", {1, 5}},
                       {milliseconds(5), "memory-read", {1}},
                       {milliseconds(20), "memory-read", {2}}}}};
  }
  if (unit == "esl") {
    std::vector<Sent> seven = times(7, {microseconds(100), "clear-alarms"});
    seven.push_back({microseconds(100), "position"});
    const Sent page{milliseconds(20), "select-page", {0}};
    return {{.sends = seven},
            {.sends = {page, {milliseconds(20), "memory-write", {1, 5}}, {milliseconds(5), "memory-write", {2, 5}}}},
            {.sends = {page, {milliseconds(20), "memory-read", {1}}, {milliseconds(20), "memory-read", {2}}}}};
  }
  if (unit.starts_with("biss")) {
    return {{.rate = 12'500'000, .bytes = 40},
            {.rate = 20'000},
            {.early = milliseconds(1)},
            {.bytes = -3},
            {.other_mode = true}};
  }
  if (unit == "ssi") {
    return {{.rate = 300'000}, {.early = milliseconds(1)}, {.bytes = -1}, {.other_mode = true}};
  }
  if (unit.starts_with("encolink")) {
    // A whole access, and the keys of the next before its answer has come.
    constexpr std::array bytes{"00 00", "00 cd", "00 ef", "00 89", "00 ab", "00 59", "00 00", "00 02",
                               "00 00", "00 00", "00 00", "00 10", "00 00", "00 00", "00 cd"};
    std::vector<Sent> two;
    for (const char* const frame : bytes) two.push_back({milliseconds(1), frame});
    return {
        {.sends = two}, {.rate = 5'000'000}, {.early = milliseconds(1)}, {.other_mode = true}, {.without_lead = true}};
  }
  if (unit == "e201") return {{.sends = {{{}, "78"}}}, {.sends = {{{}, "4d 0d"}}}};
  if (unit == "raa38-modbus") {
    return {{.sends = {{{}, "01 cc 03 35 01"}}}, {.sends = times(12, {milliseconds(20), "set-direction"})}};
  }
  if (unit == "raa38-can") {
    const Sent enter{milliseconds(1), "7e5:0401000000000000"};
    return {{.sends = {{{}, "220:8020"}}},
            {.sends = {{{}, "220:8021000000000000"}}},
            {.sends = {{{}, "220:7020000000000000"}}},
            {.sends = {{{}, "7e5:1121000000000000"}}},
            {.sends = {enter, {milliseconds(1), "7e5:4400000000000000"}}},
            {.sends = {enter, {milliseconds(1), "7e5:1100000000000000"}}},
            {.sends = {enter, {milliseconds(1), "7e5:1300010000000000"}}}};
  }
  return {};
}

/// What our own host does not, though it may.
Flaws polite(std::string_view unit) {
  using std::chrono::milliseconds;
  if (unit == "raa38-can") {
    return {.sends = {{{}, "7e5:0401000000000000"}, {milliseconds(1), "7e5:1300030000000000"}}};
  }
  if (unit != "tformat") return {};
  return {.sends = {{{}, "memory-write", {1, 5}},
                    {milliseconds(5), "memory-read", {1}},
                    {milliseconds(20), "memory-read", {1}}}};
}

std::vector<Flaws> flaws_for(const EncoderAddress& address) {
  std::vector<Flaws> all{{.babbles = true}, {.stops_at_silence = true}, {.stops_at_damage = true}};
  for (const Time hasty : {Time(100'000), Time(1'000'000), Time(19'000'000), Time(100'000'000)}) {
    all.push_back({.hasty = hasty});
  }
  for (const Flaws& script : scripts_for(address.unit->id)) all.push_back(script);
  const Time character = address.line.with_some_rate().character();
  for (const Command& first : address.unit->commands) {
    for (const Command& then : address.unit->commands) {
      const auto add = [&](Time distance) {
        Flaws flaws{.sends = {{{}, first.name}}};
        flaws.sends.insert(flaws.sends.end(), 10, {distance, then.name});
        all.push_back(flaws);
      };
      for (int halves = 0; halves <= 60; halves += 4) add(character * halves / 2);
      for (const int us : {45, 100, 150}) add(std::chrono::microseconds(us));
    }
  }
  return all;
}

Conformance judged(const EncoderAddress& address, const Flaws& flaws, bool all = false) {
  if (address.unit->link == LinkKind::can) return Host<CanFrame>(address, flaws).judged(all);
  return Host<std::uint8_t>(address, flaws).judged(all);
}

std::vector<std::string> with_verdict(const Conformance& conformance, Verdict verdict) {
  std::vector<std::string> ids;
  for (const ClauseResult& one : conformance.clauses) {
    if (one.verdict == verdict) ids.emplace_back(one.id);
  }
  return ids;
}

// One that sends by itself asks nothing of its host. What is sent while its frame is on the line is garbled: there is
// time before it.
EncoderAddress address_of_unit(const Unit& unit, std::string_view motion) {
  const std::string text = fmt::format("sim:{}?motion={}", unit.id, motion);
  const EncoderAddress usual = parse_address(text);
  const bool streams = unit.streams != nullptr && unit.streams(usual.options);
  return streams ? parse_address(text + "&mode=bus&acquisition_us=20000") : usual;
}

class HostClauses : public ::testing::TestWithParam<const Unit*> {};

TEST_P(HostClauses, EachIsBrokenByAMutantAlone) {
  const Unit& unit = *GetParam();
  std::size_t tried = 0;
  std::vector<std::string> found;
  for (const char* const motion : {"still", "rpm=60"}) {
    const EncoderAddress address = address_of_unit(unit, motion);
    const Conformance own = judged(address, polite(unit.id), true);
    EXPECT_TRUE(own.good()) << own.report();
    if (std::string_view(motion) == "still") {
      EXPECT_EQ(with_verdict(own, Verdict::untested), std::vector<std::string>{}) << own.report();
    }
    for (const Flaws& flaws : flaws_for(address)) {
      if (found.size() == host_clauses_of(unit).size()) break;
      ++tried;
      const std::vector<std::string> broken = with_verdict(judged(address, flaws), Verdict::broken);
      if (broken.size() == 1 && std::find(found.begin(), found.end(), broken[0]) == found.end()) {
        found.push_back(broken[0]);
      }
    }
  }
  for (const HostClause& clause : host_clauses_of(unit)) {
    EXPECT_NE(std::find(found.begin(), found.end(), clause.id), found.end()) << clause.id;
  }
  std::printf("%s: %zu clauses of a host, %zu mutants\n", std::string(unit.id).c_str(), host_clauses_of(unit).size(),
              tried);
}

// A host that never does what a rule is about has not kept it.
TEST_P(HostClauses, WhatAHostNeverDidIsUntested) {
  const EncoderAddress address = address_of_unit(*GetParam(), "still");
  const Conformance babbled = judged(address, {.babbles = true});
  for (const ClauseResult& one : babbled.clauses) {
    EXPECT_EQ(one.verdict, one.id == "asks" ? Verdict::broken : Verdict::untested) << babbled.report();
  }
  // Of one that only reads positions and memory: what is about resets, writes and settings.
  const Conformance read = judged(address, {});
  EXPECT_TRUE(read.good()) << read.report();
  for (const ClauseResult& one : read.clauses) {
    const bool needs_more = one.id.starts_with("reset") || one.id == "write-busy" || one.id == "parameter" ||
                            one.id == "rate" || one.id == "clock" || one.id == "access";
    if (needs_more) {
      EXPECT_EQ(one.verdict, Verdict::untested) << read.report();
    }
    if (one.id == "turn") {
      EXPECT_NE(one.evidence.find("looked at "), std::string::npos) << one.evidence;
    }
  }
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
