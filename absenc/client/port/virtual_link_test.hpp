// SPDX-License-Identifier: Apache-2.0
// Links in virtual time for tests, with any unit's virtual encoder or another machine.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include "absenc/client/port/link.hpp"
#include "absenc/sim/rough_line.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client {

struct VirtualClock {
  [[nodiscard]] sim::RealTime real_time() {
    return {.now = [this] { return time; }, .sleep_until = [this](Time until) { time = std::max(time, until); }};
  }
  Time time{};
};

/// The properties of the port between the host and the virtual encoder.
struct VirtualPort {
  // whether the simulated adapter sends each request back to the host as an echo
  bool echo = false;
  // seed of the random delays by which requests are sent later; nothing: requests are not delayed
  std::optional<std::uint64_t> pauses{};
  // fault rates of a sim::RoughLine; nothing: the port is a sim::SimPort
  std::optional<sim::RoughRates> rough{};
  std::uint64_t seed = 1;         // seed of the random faults of the line `rough`
  VirtualClock* clock = nullptr;  // clock of the port; null: time begins with the link and jumps from event to event
  std::uint32_t rate = 0;         // baud rate of the host's port in bits per second; 0: that of the encoder
};

/// A port that delays transfers at random.
template <class Item>
class UnevenPort final : public Port<Item> {
 public:
  UnevenPort(std::unique_ptr<sim::SimPort<Item>> port, std::uint64_t seed) : port_(std::move(port)), random_(seed) {}
  Time now() override { return port_->now(); }
  void begin(const Step<Item>& step) override {
    Step<Item> later = step;
    // Delays only transfers that may begin at once: if a later time is set, it may have a meaning, as inside a
    // procedure.
    if (step.kind == Step<Item>::Kind::transfer && step.at <= port_->now()) {
      later.at = port_->now() + Time(std::uniform_int_distribution<std::int64_t>(0, 400'000)(random_));
    }
    port_->begin(later);
  }
  Event<Item> wait(const Step<Item>& step) override { return port_->wait(step); }

 private:
  std::unique_ptr<sim::SimPort<Item>> port_;
  std::mt19937_64 random_;
};

template <class Item, class AnyPort>
void take_port(Link& link, std::shared_ptr<AnyPort> port) {
  if constexpr (std::is_same_v<Item, CanFrame>) {
    link.frames = port.get();
  } else {
    link.bytes = port.get();
  }
  link.owner = std::move(port);
}

/// Puts `device`, which must outlive the link, in the place of the encoder.
template <class Item>
void put_on_line(Link& link, const EncoderAddress& encoder, Machine<Item>& device, const VirtualPort& way = {}) {
  const LinkKind kind = encoder.unit->link;
  const LineSettings settings = encoder.line.with_some_rate();
  link.place = "here";
  if (way.rough) {
    auto line = std::make_shared<sim::RoughLine<Item>>(kind, settings, device, way.seed);
    line->set_rates(*way.rough);
    return take_port<Item>(link, std::move(line));
  }
  const sim::RealTime real_time = way.clock != nullptr ? way.clock->real_time() : sim::RealTime{};
  auto line = std::make_unique<sim::SimPort<Item>>(kind, settings, device, real_time);
  if (way.echo) line->set_echo(true);
  if (way.rate != 0 && way.rate != settings.rate) {
    line->begin({.kind = Step<Item>::Kind::configure, .rate = way.rate});
  }
  if (way.pauses) return take_port<Item>(link, std::make_shared<UnevenPort<Item>>(std::move(line), *way.pauses));
  take_port<Item>(link, std::shared_ptr<sim::SimPort<Item>>(std::move(line)));
}

inline Link virtual_link(const EncoderAddress& encoder, const VirtualPort& way = {}) {
  Link link;
  link.device = std::make_unique<VirtualDevice>(*encoder.unit, encoder.options, encoder.device);
  link.device->power_on(Time{});
  if (link.device->bytes() != nullptr) {
    put_on_line(link, encoder, *link.device->bytes(), way);
  } else {
    put_on_line(link, encoder, *link.device->frames(), way);
  }
  return link;
}

}  // namespace absenc::client
