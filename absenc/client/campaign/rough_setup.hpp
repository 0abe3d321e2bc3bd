// SPDX-License-Identifier: Apache-2.0
// Connects one unit's host and its virtual encoder by a line with faults, in virtual time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/host/session.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/faulty_node.hpp"
#include "absenc/sim/random.hpp"
#include "absenc/sim/rough_line.hpp"

namespace absenc::client {

/// The rate of each fault, 0 to 1, of the line and of the virtual encoder.
struct Rates {
  sim::RoughRates line;
  sim::FaultRates device;
  bool by_device = false;  // whether any fault of the virtual encoder has a rate above 0

  void set(std::string_view name, double rate) {
    if (double* const own = of_line(name)) {
      *own = rate;
      return;
    }
    const auto found = std::find(sim::fault_names.begin(), sim::fault_names.end(), name);
    device[static_cast<sim::FaultKind>(found - sim::fault_names.begin())] = rate;
    by_device = by_device || rate > 0;
  }

 private:
  double* of_line(std::string_view name) {
    if (name == "bit") return &line.bit;
    if (name == "burst") return &line.burst;
    if (name == "double") return &line.doubled;
    if (name == "talker") return &line.talker;
    if (name == "late") return &line.late;
    return nullptr;
  }
};

template <class Item>
struct RoughBench {
  /// Connects the host and the virtual encoder of the unit `what` with the options `how`; the encoder measures the
  /// shaft `measured`. All three must outlive the object.
  RoughBench(const Unit& what, const Options& how, const Shaft& measured, const Rates& often, std::uint64_t seed)
      : unit(what),
        options(how),
        shaft(measured),
        rates(often),
        random(seed),
        device_storage(unit.device_storage),
        host_storage(unit.host_storage),
        device(make_device()),
        faulty(device, rates.device, seed + 1),
        line(unit.link, line_settings(unit, options).with_some_rate(),
             rates.by_device ? static_cast<Machine<Item>&>(faulty) : device, seed + 2),
        session(unit, options, line, host_storage,
                unit.link == LinkKind::half_duplex ? host::EchoMode::automatic : host::EchoMode::off),
        unsolicited(host::sends_unsolicited(unit, options)) {
    line.set_rates(rates.line);
  }

  Device<Item>& make_device(Time now = {}) {
    Device<Item>* const one = unit.device(options, shaft, device_storage).template of<Item>();
    if (one == nullptr) {
      throw UsageError(std::string(unit.id) + " has no virtual encoder with these options");
    }
    one->power_on(now, Device<Item>::PowerOn::skip);
    return *one;
  }

  /// With `on`, sets the rates of all faults to those given to the constructor; without it, to 0.
  void set_faults(bool on) {
    line.set_rates(on ? rates.line : sim::RoughRates{});
    faulty.set_rates(on ? rates.device : sim::FaultRates{});
  }

  /// Returns the number of requests that were sent after the counts `before` were read; if there were none, the number
  /// of unsolicited frames since then, but at least 1.
  [[nodiscard]] std::uint64_t exchanges_since(const sim::RoughCounts& before) const {
    const std::uint64_t asked = line.counts().requests - before.requests;
    return asked != 0 ? asked : std::max<std::uint64_t>(1, line.counts().replies - before.replies);
  }

  [[nodiscard]] std::uint64_t damaged() const {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      return line.counts().damaged + faulty.damaged_frames();
    } else {
      return line.counts().damaged + faulty.damaged_replies();
    }
  }

  // Returns whether a damaged request has changed the encoder; if so, puts a new encoder in its place.
  template <class IsRight>
  bool was_changed(const Command& read, const IsRight& is_right) {
    using namespace std::chrono_literals;
    if (rates.device[sim::FaultKind::request_corrupt] <= 0) return false;
    set_faults(false);
    line.rest(line.now() + (unsolicited ? 11s : 20s));  // after a wait of this length no late reply is outstanding
    line.drop();
    const Conversation<Item>* now = session.run(read);
    const bool changed = now->error() != Error::none || (now->reading() != nullptr && !is_right(*now->reading()));
    if (changed) (void)make_device(line.now());  // the new encoder has the shaft position of the old one
    set_faults(true);
    return changed;
  }

  // Lets a random time of at most 10 s pass, because without pauses a delayed reply would also delay the replies behind
  // it.
  void pause() {
    const double decades = (unsolicited ? 4 : 6) * static_cast<double>(random.next() >> 11) * 0x1p-53;
    line.rest(line.now() + Time(static_cast<std::int64_t>(1e4 * std::pow(10.0, decades))));
  }

  using Faulty = std::conditional_t<std::is_same_v<Item, CanFrame>, sim::FaultyNode, sim::FaultyDevice>;

  const Unit& unit;
  const Options& options;
  const Shaft& shaft;
  Rates rates;
  sim::Random random;
  std::vector<std::byte> device_storage;
  std::vector<std::byte> host_storage;
  Device<Item>& device;
  Faulty faulty;
  sim::RoughLine<Item> line;
  host::Session<Item> session;
  bool unsolicited;
};

}  // namespace absenc::client
