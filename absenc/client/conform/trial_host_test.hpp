// SPDX-License-Identifier: Apache-2.0
// Hosts in virtual time, for conformance tests of hosts.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <climits>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "absenc/client/conform/host_stage.hpp"
#include "absenc/client/conform/host_trial.hpp"
#include "absenc/client/emulation/request_watch.hpp"
#include "absenc/client/emulation/rule_counter.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/host/session.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client {

/// Defects of a host; by default the host has none.
struct Flaws {
  bool is_silent = false;
  // number of requests without a reply after which the host stops at the latest; 0: it never stops
  unsigned stops_at_silence = 0;
  // number of damaged replies after which the host stops at the latest; 0: it never stops
  unsigned stops_at_damage = 0;
  // number of damaged requests after which the host stops at the latest; 0: it never stops
  unsigned stops_at_refusal = 0;
  // while the host reads the memory: longest prescribed wait that it leaves out; 0: it leaves none out
  Time skipped_wait{};
  std::vector<HostStep> sends{};
  // Defects of an SPI controller:
  Time too_early_by{};     // time by which a transfer begins before the time that the protocol demands
  std::uint32_t rate = 0;  // clock rate in Hz; 0: the rate that the host requests
  int bytes = 0;           // number of bytes added to each transfer, negative: removed; at least one byte remains
  bool other_mode = false;
  bool without_lead = false;
};

struct Stopped {};

/// A port that throws Stopped when its host wants to send more requests than `requests_left`, and can skip waits.
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
    if (!sending_ && step.at != never && left > Time{} && left <= skipped_wait) {
      return {.kind = Event<Item>::Kind::timer, .at = step.at};
    }
    const Event<Item> event = port_.wait(step);
    if (event.kind == Event<Item>::Kind::sent) sending_ = false;
    return event;
  }

  Time skipped_wait{};
  unsigned requests_left = UINT_MAX;

 private:
  Port<Item>& port_;
  bool sending_ = false;
};

/// The port of an SPI controller in virtual time, with the defects of `Flaws`.
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
    now_ = std::max(now_, step.at - flaws_.too_early_by);
    if (device_.timer() <= now_) device_.wake(now_);
    if (step.hold_low) device_.rest(line_.spi_mode & 1u);
    const std::size_t wanted_size =
        step.bits > 0 ? (step.bits + line_.idle_clocks + 7) / 8 : std::max(step.out.size(), step.expect);
    const std::size_t size = static_cast<std::size_t>(std::max(static_cast<int>(wanted_size) + flaws_.bytes, 1));
    std::vector<std::uint8_t> out(step.out.begin(), step.out.end());
    out.resize(size);
    std::vector<std::uint8_t> in(size);
    const auto mode = static_cast<std::uint8_t>(line_.spi_mode ^ (flaws_.other_mode ? 2u : 0u));
    const std::array<os::SpiTransfer, 2> message{
        {{.mode = mode, .delay = flaws_.without_lead ? Time{} : line_.select_lead},
         {.size = size, .out = out, .in = in, .rate = flaws_.rate != 0 ? flaws_.rate : rate_, .mode = mode}}};
    now_ = device_.message(message, now_);
    in.resize(wanted_size, 0xFF);
    const bool idle_low = line_.idle_clocks > 0 && (in[0] & 0x80) == 0;
    for (std::size_t i = 0; i < wanted_size && line_.idle_clocks == 1; ++i) {
      in[i] = static_cast<std::uint8_t>(in[i] << 1 | (i + 1 < wanted_size ? in[i + 1] >> 7 : 0));
    }
    received_ = in;
    events_.push_back({.kind = ByteEvent::Kind::sent, .at = now_});
    events_.push_back({.kind = ByteEvent::Kind::received, .at = now_, .items = received_, .idle_low = idle_low});
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
  std::vector<std::uint8_t> received_;
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
        watch_(*machine(), address),
        line_(make_line()),
        port_(*line_),
        storage_(unit_.host_storage) {
    device_.watch_rules(&rules_);
    device_.power_on(Time{});
    port_.skipped_wait = flaws_.too_early_by;
  }

  /// Returns the verdict on a host that sends `next()` again and again and ignores replies.
  template <class Next>
  Conformance judged_sending(const Next& next) {
    constexpr unsigned most = 60;
    HostTrial trial(unit_, 20);
    for (unsigned i = 0; i < most; ++i) {
      set_fault(trial.look(seen()));
      send(next());
      listen(std::chrono::milliseconds(25));  // a wait longer than the slowest reply of any virtual encoder
    }
    trial.look(seen());
    return trial.judge();
  }

  /// Returns the verdict on a host that reads; with `all` it also runs every command that changes no option.
  Conformance judged(bool all = false) {
    constexpr unsigned most_rounds = 40;
    HostTrial trial(unit_, 20);
    for (unsigned i = 0; i < most_rounds && !stopped_ && !trial.over(); ++i) {
      round(trial);
    }
    device_.set_faults({});
    if (!flaws_.sends.empty()) send_all();
    for (const Command& command : unit_.commands) {
      // Skips commands after which the host would have to change its options.
      const bool moves = !command.changes_option.empty();
      if (all && !moves) run(command, complete_arguments(command, required_arguments(command)));
    }
    trial.look(seen());
    return trial.judge();
  }

 private:
  std::shared_ptr<Port<Item>> make_line() {
    const LineSettings line = address_.line.with_some_rate();
    if constexpr (std::is_same_v<Item, std::uint8_t>) {
      if (host_clocks(unit_.link)) {
        controller_ = std::make_shared<ControllerPort>(unit_.link, line, watch_, flaws_);
        return controller_;
      }
    }
    return std::make_shared<sim::SimPort<Item>>(unit_.link, line, watch_);
  }
  [[nodiscard]] HostTrial::TrialCounts seen() const {
    return {.answered = answered(),
            .missing = count_of(device_, HostTrial::Fault::silence),
            .damaged = count_of(device_, HostTrial::Fault::damage),
            .requests = watch_.counts(),
            .rules = controller_ != nullptr ? with_mode(rules_.counts(), controller_->device()) : rules_.counts()};
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

  void set_fault(HostTrial::Fault fault) {
    sim::FaultRates rates;
    if (fault != HostTrial::Fault::none) rates[require_fault(fmt::format("{}=1", name_of(fault))).kind] = 1;
    device_.set_faults(rates);
  }
  void round(HostTrial& trial) {
    if (flaws_.is_silent) return;
    one(trial, *find_command(unit_, Verb::read), {});
    port_.skipped_wait = flaws_.skipped_wait;
    const Command* memory = find_command(unit_, Verb::memory_read);
    for (const std::int64_t page : {1, 0}) {
      if (memory != nullptr) one(trial, *memory, role_arguments(*memory, {{Role::page, page}, {Role::address, 3}}));
    }
    port_.skipped_wait = flaws_.too_early_by;
  }

  void run(const Command& command, Arguments arguments) {
    host::Session<Item> session(unit_, address_.options, port_, storage_, host::EchoMode::off, 1);
    static_cast<void>(session.run(command, arguments));
  }
  void one(HostTrial& trial, const Command& command, Arguments arguments) {
    if (stopped_ || trial.over()) return;
    const HostTrial::Fault fault = trial.look(seen());
    set_fault(fault);
    const unsigned stops = fault == HostTrial::Fault::silence           ? flaws_.stops_at_silence
                           : fault == HostTrial::Fault::damage          ? flaws_.stops_at_damage
                           : fault == HostTrial::Fault::damaged_request ? flaws_.stops_at_refusal
                                                                        : 0;
    port_.requests_left = stops != 0 ? stops : UINT_MAX;
    try {
      run(command, arguments);
    } catch (const Stopped&) {
      stopped_ = true;
    }
    stopped_ = stopped_ || (stops != 0 && port_.requests_left != stops);
    trial.look(seen());
  }

  // Sends each step of the script without waiting for the reply.
  void send_all() {
    listen(std::chrono::milliseconds(50));
    for (const HostStep& one : flaws_.sends) {
      for (unsigned i = 0; i < one.times; ++i) {
        listen(one.pause);
        send(items(one));
      }
    }
    listen(std::chrono::milliseconds(50));
  }
  [[nodiscard]] std::vector<Item> items(const HostStep& one) const {
    WireFrame wire;
    const Command* const command = find_command(unit_, one.what);
    std::vector<std::uint8_t> bytes(300);
    if (command == nullptr) {
      wire = parse_wire_text(unit_.link, "sent", one.what);
    } else {
      const auto arguments =
          complete_arguments(*command, one.arguments.empty() ? Arguments(required_arguments(*command)) : one.arguments);
      const auto size = unit_.encode(address_.options, *command, arguments, bytes);
      if (!size) return {};
      bytes.resize(*size);
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
  static std::vector<std::int64_t> required_arguments(const Command& command) {
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
  RequestWatch<Item> watch_;
  std::shared_ptr<ControllerPort> controller_;  // port of the SPI controller; null unless the link is SPI or clocked
  std::shared_ptr<Port<Item>> line_;
  HastyPort<Item> port_;
  std::vector<std::byte> storage_;
  bool stopped_ = false;
};

}  // namespace absenc::client
