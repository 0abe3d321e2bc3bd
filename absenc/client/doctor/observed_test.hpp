// SPDX-License-Identifier: Apache-2.0
// Invented observations, and lines that are interrupted, for tests of doctor.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/doctor/lines_test.hpp"
#include "absenc/client/doctor/observations.hpp"

namespace absenc::client {

using ByteList = std::vector<std::uint8_t>;

constexpr const char* serial = "tformat:/dev/ttyABSENC";

inline std::vector<std::string> ids(const Examination& examination) {
  std::vector<std::string> all;
  for (const Finding& one : examination.findings) all.emplace_back(one.id);
  return all;
}

/// Returns a T-format reply without alarms.
inline const ByteList& good_reply() {
  static const ByteList reply{0x1A, 0, 0, 0, 0, 0x11, 0, 0, 0, 0, 0x0B};
  return reply;
}

/// Returns 200 good readings, one every millisecond.
inline Observations positions(const std::function<std::uint64_t(std::size_t)>& place, unsigned bits = 17) {
  Observations seen;
  for (std::size_t i = 0; i < 200; ++i) {
    Attempted one{.heard = true};
    one.reading = Reading{.singleturn = place(i) & low_mask(bits),
                          .singleturn_bits = bits,
                          .singleturn_valid_bits = bits,
                          .latched = static_cast<std::int64_t>(i) * 1ms};
    seen.readings.push_back(one);
  }
  return seen;
}

inline Examination judged(const Observations& seen) {
  static const EncoderAddress address = parse_address("sim:tformat");
  return judge(*address.unit, address.options, seen);
}

/// Sets valid turns of 16 bits in these readings.
inline void set_turns(std::vector<Attempted>& readings, const std::function<std::int64_t(std::size_t)>& turns) {
  for (std::size_t i = 0; i < readings.size(); ++i) {
    Reading& reading = *readings[i].reading;
    reading.multiturn = static_cast<std::uint64_t>(turns(i)) & low_mask(16);
    reading.multiturn_bits = 16;
    reading.multiturn_valid = true;
  }
}

inline Observations turned_by_hand(const std::function<std::uint64_t(std::size_t)>& place,
                                   const std::function<std::int64_t(std::size_t)>& turns) {
  Observations seen = positions([](std::size_t) { return 5; });
  seen.turned = positions(place).readings;
  set_turns(seen.turned, turns);
  return seen;
}

// speed of a shaft at 550 rpm, in counts per millisecond of an encoder with 17 bits
constexpr std::uint64_t hand_counts = 1201;

/// Examines a line on which an encoder replies to no request while `dead(now)` is true.
inline Examination examine_contact(Time time, const std::function<bool(Time)>& dead) {
  const Surroundings surroundings{[&](const EncoderAddress&) {
                                    auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
                                    port->answer = [&dead, &port = *port](const ByteList&) {
                                      return dead(port.now()) ? ByteList{} : good_reply();
                                    };
                                    return link_to(std::move(port));
                                  },
                                  [](const std::string&) { return os::PortFacts{}; }};
  return examine(parse_address(serial), {.limit = time}, surroundings);
}

}  // namespace absenc::client
