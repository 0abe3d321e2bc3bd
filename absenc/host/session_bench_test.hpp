// SPDX-License-Identifier: Apache-2.0
// A session with a virtual encoder, of T-format or another unit, in virtual time, for tests.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string_view>
#include <vector>

#include "absenc/host/session.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/faults.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::host {

using namespace std::chrono_literals;
using Wire = std::vector<std::uint8_t>;

struct Still final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override {
    return {.position = device != nullptr && device->answer_count() == wrong_answer ? wrong_position : position};
  }
  std::int64_t position = 0;
  const Device<std::uint8_t>* device = nullptr;
  // Index, from 0, of the encoder's answer that gets `wrong_position`; UINT64_MAX: no answer.
  std::uint64_t wrong_answer = UINT64_MAX;
  std::int64_t wrong_position = 0;
};

/// A virtual encoder with faults at given rates, by default none, a port to it, and a session.
struct Bench {
  explicit Bench(EchoMode mode, sim::FaultRates rates = {}, unsigned attempts = 3,
                 const std::vector<OptionText>& settings = {}, std::string_view id = "tformat")
      : unit(*find_unit(id)) {
    EXPECT_EQ(resolve_options(unit, {}, settings, options).kind, OptionError::Kind::none);
    device_storage.resize(unit.device_storage);
    host_storage.resize(unit.host_storage);
    device = unit.device(options, shaft, device_storage).bytes;
    device->power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    shaft.device = device;
    faulty = std::make_unique<sim::FaultyDevice>(*device, rates, 1);
    port = std::make_unique<sim::SimPort<std::uint8_t>>(unit.link, line_settings(unit, options), *faulty);
    session = std::make_unique<Session<std::uint8_t>>(unit, options, *port, host_storage, mode, attempts);
  }
  const Conversation<std::uint8_t>& read() { return *session->read(*find_command(unit, Verb::read)); }
  /// Reads once, expects no error, and returns the number of answers that the reading took.
  std::uint64_t answers_of_a_reading() {
    const std::uint64_t before = device->answer_count();
    EXPECT_EQ(read().error(), Error::none);
    return device->answer_count() - before;
  }
  /// Makes the position of the encoder's next answer wrong by `turned`, in 2^-32 of a turn.
  void answer_wrong(std::int64_t turned) {
    shaft.wrong_answer = device->answer_count();
    shaft.wrong_position = shaft.position + turned;
  }
  void pause(Time time) { port->line().run_until(port->line().now() + time); }
  [[nodiscard]] std::uint64_t refused() const {
    return session->counters().errors[static_cast<std::size_t>(Error::cross_check_failed)];
  }

  const Unit& unit;
  Options options;
  Still shaft;
  std::vector<std::byte> device_storage;
  std::vector<std::byte> host_storage;
  Device<std::uint8_t>* device = nullptr;
  std::unique_ptr<sim::FaultyDevice> faulty;
  std::unique_ptr<sim::SimPort<std::uint8_t>> port;
  std::unique_ptr<Session<std::uint8_t>> session;
};

inline sim::FaultRates always(sim::FaultKind kind) {
  sim::FaultRates rates;
  rates[kind] = 1;
  return rates;
}

}  // namespace absenc::host
