// SPDX-License-Identifier: Apache-2.0
// Adapters and other devices on a line in virtual time, for tests of doctor.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/identify/probe_settings.hpp"
#include "absenc/client/port/link.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client::path_faults {

using namespace std::chrono_literals;
using ByteList = std::vector<std::uint8_t>;

/// A function that returns the reply to a request with the changes that an adapter makes to its bytes.
using Change = std::function<ByteList(const ByteList& request, ByteList reply)>;

/// A machine that changes, delays or drops replies of a device.
class Adapter final : public Machine<std::uint8_t> {
 public:
  Adapter(Machine<std::uint8_t>& device, Change change, std::function<bool(Time)> is_cut, Time delay)
      : device_(device), change_(std::move(change)), is_cut_(std::move(is_cut)), delay_(delay) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::received) {
      request_.insert(request_.end(), event.items.begin(), event.items.end());
    }
    device_.feed(event);
  }
  Step<std::uint8_t> next(Time now) override {
    for (;;) {
      Step<std::uint8_t> step = device_.next(now);
      if (step.kind != Step<std::uint8_t>::Kind::transfer || step.out.empty()) return step;
      const ByteList reply(step.out.begin(), step.out.end());
      const ByteList request = std::exchange(request_, {});
      out_ = change_ ? change_(request, reply) : reply;
      if (is_cut_ && is_cut_(now)) out_.clear();
      changed_ += out_ != reply ? 1 : 0;
      if (!out_.empty()) {
        step.out = out_;
        step.at += delay_;
        return step;
      }
      device_.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = std::max(step.at, now)});
    }
  }
  [[nodiscard]] std::size_t changed() const { return changed_; }

 private:
  Machine<std::uint8_t>& device_;
  Change change_;
  std::function<bool(Time)> is_cut_;
  Time delay_;
  ByteList request_;
  ByteList out_;
  std::size_t changed_ = 0;
};

/// A device that sends the same text periodically, or when it receives bytes.
class Talker final : public Machine<std::uint8_t> {
 public:
  Talker(ByteList text, Time period, bool answers) : text_(std::move(text)), period_(period), answers_(answers) {}
  void feed(const Event<std::uint8_t>& event) override {
    using Kind = Event<std::uint8_t>::Kind;
    if (event.kind == Kind::sent) busy_ = false;
    if (event.kind == Kind::timer && !answers_) due_ = true;
    if (event.kind == Kind::received && answers_) due_ = true;
  }
  Step<std::uint8_t> next(Time now) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (due_ && !busy_) {
      due_ = false;
      busy_ = true;
      return {.kind = Kind::transfer, .out = text_, .at = now + 20us};
    }
    if (answers_) return {};
    if (at_ <= now) at_ = now + period_;
    return {.at = at_};
  }

 private:
  ByteList text_;
  Time period_;
  bool answers_;
  bool due_ = false;
  bool busy_ = false;
  Time at_{};
};

/// Description of what is connected at the other end of the port: encoder, line and adapter.
struct Far {
  EncoderAddress encoder;  // address of the virtual encoder, "sim:tformat?model=23-bit"
  std::uint32_t rate = 0;  // rate of the encoder's line in bits per second; 0: the rate of the user's address
  Change change{};         // change that the adapter makes to the bytes of a reply; empty: the adapter changes nothing
  std::optional<EncoderAddress> second{};  // second encoder on the same line; nothing: there is none
  std::function<bool(Time now)> is_cut{};  // returns true while a contact of the line is open; empty: never
  Time delay{};                            // time by which the line delays the encoder's replies
  bool goes_on = false;                    // whether the time of the encoder continues when the port is opened again
  // makes another device instead of the encoder; empty: the encoder is connected
  std::function<std::unique_ptr<Talker>()> other{};
};

/// Opens links to the devices that `Far` describes: each time to new devices, or with `goes_on` always to the same
/// ones.
class Opener {
 public:
  explicit Opener(Far far) : far_(std::move(far)) {}

  Link open(const EncoderAddress& asked) {
    if (far_.goes_on && !ends_.empty()) return link_to(ends_.front(), asked.line.with_some_rate().rate);
    auto end = std::make_shared<End>();
    LineSettings line = asked.line.with_some_rate();
    const std::uint32_t host_rate = line.rate;
    if (far_.rate != 0) line.rate = far_.rate;
    Machine<std::uint8_t>* machine = nullptr;
    if (far_.other) {
      end->talker = far_.other();
      machine = end->talker.get();
    } else {
      machine = device(*end, far_.encoder);
    }
    end->port = std::make_unique<sim::SimPort<std::uint8_t>>(asked.unit->link, line, *machine);
    if (far_.second) end->port->line().attach(sim::NodeRole::device, *device(*end, *far_.second));
    ends_.push_back(end);
    return link_to(end, host_rate);
  }
  /// Returns the number of replies that the adapters changed or dropped.
  [[nodiscard]] std::size_t changed() const {
    std::size_t sum = 0;
    for (const auto& end : ends_) {
      for (const auto& adapter : end->adapters) sum += adapter->changed();
    }
    return sum;
  }

 private:
  struct End {
    std::vector<std::unique_ptr<VirtualDevice>> devices;
    std::vector<std::unique_ptr<Adapter>> adapters;
    std::unique_ptr<Talker> talker;
    std::unique_ptr<sim::SimPort<std::uint8_t>> port;
  };

  static Link link_to(const std::shared_ptr<End>& end, std::uint32_t rate) {
    end->port->begin({.kind = Step<std::uint8_t>::Kind::configure, .rate = rate});
    Link link;
    link.place = "here";
    link.bytes = end->port.get();
    link.owner = end;
    return link;
  }

  Machine<std::uint8_t>* device(End& end, const EncoderAddress& encoder) {
    end.devices.push_back(std::make_unique<VirtualDevice>(*encoder.unit, encoder.options, encoder.device));
    VirtualDevice& one = *end.devices.back();
    one.power_on(Time{});
    Machine<std::uint8_t>* machine = one.bytes();
    if (far_.change || far_.is_cut || far_.delay != Time{}) {
      end.adapters.push_back(std::make_unique<Adapter>(*machine, far_.change, far_.is_cut, far_.delay));
      machine = end.adapters.back().get();
    }
    return machine;
  }

  Far far_;
  std::vector<std::shared_ptr<End>> ends_;
};

struct Seen {
  Examination examination{};
  std::size_t changed = 0;
  std::string read_alone{};  // the finding that `read` names for the first reading; "": the reading was good

  [[nodiscard]] std::string first() const {
    const Finding* one = examination.first();
    return one == nullptr ? "good" : std::string(one->id);
  }
};

struct Choices {
  std::size_t readings = 200;
  Time limit = 30s;
  Time turning{};
  os::PortFacts facts{};
};

/// Takes one reading of the address.
inline Attempted read_once(const EncoderAddress& address, Opener& opener, bool* was_late = nullptr) {
  const Link link = opener.open(address);
  Runner<std::uint8_t> runner(address);
  runner.attach(*link.bytes, link.latency);
  Attempted one = runner.once(*find_command(*address.unit, Verb::read));
  if (was_late != nullptr) *was_late = runner.lateness() != Time{};
  return one;
}

inline Seen examined(const std::string& asked, const Far& far, const Choices& choices = {}) {
  const EncoderAddress address = parse_address(asked);
  Opener opener(far);
  const Surroundings surroundings{[&](const EncoderAddress& to) { return opener.open(to); },
                                  [&](const std::string&) { return choices.facts; }};
  Seen seen;
  seen.examination = examine(
      address, {.readings = choices.readings, .limit = choices.limit, .turning = choices.turning}, surroundings);
  seen.changed = opener.changed();
  Opener again(far);
  bool was_late = false;
  const Attempted one = read_once(address, again, &was_late);
  if (one.error != Error::none) {
    seen.read_alone = finding_of(*address.unit, address.options, address.port_kind, one, false, was_late).id;
  }
  return seen;
}

// ---- Units and the settings with which they are tested

inline bool has_characters(const Unit& unit) {
  return unit.link == LinkKind::half_duplex || unit.link == LinkKind::full_duplex;
}

inline std::vector<const Unit*> character_units() {
  std::vector<const Unit*> units;
  for (const Unit* unit : all_units()) {
    if (has_characters(*unit)) units.push_back(unit);
  }
  return units;
}

/// Returns a setting with which the encoder sends no unsolicited frames; "" if it sends none anyway, or if there is no
/// such setting.
inline std::string asked_mode(const Unit& unit) {
  const auto streams = [&](const std::string& mode) {
    const auto address = parse_address(fmt::format("sim:{}{}{}", unit.id, mode.empty() ? "" : "?", mode));
    return unit.streams != nullptr && unit.streams(address.options);
  };
  if (!streams("")) return "";
  for (const Option& option : unit.options) {
    for (const std::string_view choice : option.choices) {
      const std::string mode = fmt::format("{}={}", option.name, choice);
      if (!streams(mode)) return mode;
    }
  }
  return "";
}

inline std::vector<std::string> rates_of(const Unit& unit) {
  std::vector<std::string> rates;
  if (const Option* option = find_role(unit.options, Role::rate)) {
    for (const std::string_view choice : option->choices) rates.push_back(fmt::format("{}={}", option->name, choice));
  }
  if (rates.empty()) {
    if (unit.line.rate != 0) return {fmt::format("{}={}", rate_setting, unit.line.rate)};
    return {"baud=9600", "baud=115200"};
  }
  return rates;
}

inline std::string joined(const std::vector<std::string>& settings) {
  std::string text;
  for (const std::string& one : settings) {
    if (!one.empty()) text += (text.empty() ? "?" : "&") + one;
  }
  return text;
}

/// Returns the setting if it is one of the virtual encoder; "" if it belongs to the line only.
inline std::string of_encoder(const Unit& unit, const std::string& setting) {
  if (setting.empty()) return "";
  const std::string_view name = split_setting(setting).name;
  return name == "model" || find_option(unit, name) != nullptr ? setting : "";
}

struct Pair {
  std::string asked;  // the address under which the user expects the encoder, which may be wrong
  Far far;
};

/// Returns the user's address and what is at the other end of the line. Only the encoder, not the address, has the
/// settings `state`.
inline Pair pair_of(const Unit& unit, const std::string& mode, const std::string& rate,
                    const std::vector<std::string>& state = {}) {
  std::vector<std::string> settings{mode, of_encoder(unit, rate)};
  settings.insert(settings.end(), state.begin(), state.end());
  Pair pair{fmt::format("{}:/dev/ttyABSENC{}", unit.id, joined({mode, rate})), {}};
  pair.far.encoder = parse_address(fmt::format("sim:{}{}", unit.id, joined(settings)));
  pair.far.rate = parse_address(pair.asked).line.with_some_rate().rate;
  return pair;
}

}  // namespace absenc::client::path_faults
