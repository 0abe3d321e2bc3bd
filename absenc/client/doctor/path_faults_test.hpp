// SPDX-License-Identifier: Apache-2.0
// Faults with their expected findings, for tests of doctor.
#pragma once

#include <set>

#include "absenc/capture/search/evidence.hpp"
#include "absenc/client/doctor/path_test.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::client::path_faults {

using Ids = std::set<std::string>;

/// Result of examining one unit with one fault.
struct Outcome {
  Seen seen{};
  Ids causes{};  // ids of the findings that doctor may name first
};

struct PathFault {
  std::string name;
  std::function<std::optional<Outcome>(const Unit& unit, const std::string& mode, const std::string& rate)> examine;
};

// ---- Changes of bytes by adapters

inline ByteList without(const ByteList& bytes, std::initializer_list<std::uint8_t> values) {
  ByteList rest;
  for (const std::uint8_t byte : bytes) {
    if (std::find(values.begin(), values.end(), byte) == values.end()) rest.push_back(byte);
  }
  return rest;
}

inline ByteList with_before(const ByteList& bytes, std::uint8_t value, std::uint8_t before) {
  ByteList all;
  for (const std::uint8_t byte : bytes) {
    if (byte == value) all.push_back(before);
    all.push_back(byte);
  }
  return all;
}

inline std::vector<std::string> positions_with(const Unit& unit, const Options& options,
                                               const std::vector<std::uint64_t>& values) {
  std::vector<std::string> all;
  const unsigned bits = unit.resolution(options).singleturn_bits;
  for (const std::uint64_t value : values) {
    for (unsigned shift = bits > 8 ? bits - 8 : 0; shift >= 1; --shift) {
      all.push_back(fmt::format("singleturn={}", value << shift | std::uint64_t{1} << (shift - 1)));
    }
  }
  return all;
}

/// Returns whether the unit accepts more than 5 % of random replies.
inline bool has_weak_check(const Pair& pair) {
  Opener opener(pair.far);
  const EncoderAddress asked = parse_address(pair.asked);
  const Attempted one = read_once(asked, opener);
  return capture::acceptance(*asked.unit, asked.options, one.exchange, 1u << 10) > 0.05;
}

inline PathFault of_bytes(const std::string& name, const std::vector<std::uint64_t>& values, const Change& change,
                          Ids causes = {}) {
  causes.insert(name);
  return {name, [=](const Unit& unit, const std::string& mode, const std::string& rate) {
            constexpr std::size_t probed = 20;
            std::optional<Outcome> outcome;
            const Pair usual = pair_of(unit, mode, rate);
            if (has_weak_check(usual) || unit.line.data_bits > 8) return outcome;
            for (const std::string& place : positions_with(unit, usual.far.encoder.options, values)) {
              Pair pair = pair_of(unit, mode, rate, {place, "motion=sine=0.2,20"});
              pair.far.change = change;
              Opener opener(pair.far);
              const EncoderAddress asked = parse_address(pair.asked);
              for (std::size_t i = 0; i < probed; ++i) static_cast<void>(read_once(asked, opener));
              if (opener.changed() * 2 < probed) continue;
              const Outcome one{examined(pair.asked, pair.far), causes};
              // Tries the next position if fewer than half of the replies were changed: readings on a slow line take
              // many seconds, in which the shaft may leave the positions whose replies the fault changes.
              if (one.seen.changed * 2 < one.seen.examination.tried) continue;
              outcome = one;
              break;
            }
            return outcome;
          }};
}

inline std::vector<PathFault> faults_of_bytes() {
  std::vector<PathFault> faults;
  faults.push_back(of_bytes("byte_before", {0x67}, [](const ByteList&, ByteList reply) {
    reply.insert(reply.begin(), 0x00);
    return reply;
  }));
  faults.push_back(of_bytes("byte_after", {0x67}, [](const ByteList&, ByteList reply) {
    reply.push_back(0xFE);
    return reply;
  }));
  faults.push_back(of_bytes("flow_control", {0x11, 0x13}, [](const ByteList&, const ByteList& reply) {
    return without(reply, {0x11, 0x13});
  }));
  faults.push_back(of_bytes("newline_translated", {0x0A},
                            [](const ByteList&, const ByteList& reply) { return with_before(reply, 0x0A, 0x0D); }));
  faults.push_back({"seven_bits", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      std::optional<Outcome> outcome;
                      Pair pair = pair_of(unit, mode, rate, {"motion=rpm=60"});
                      if (has_weak_check(pair) || unit.line.data_bits > 8) return outcome;
                      pair.far.change = [](const ByteList&, ByteList reply) {
                        for (std::uint8_t& byte : reply) byte &= 0x7F;
                        return reply;
                      };
                      Outcome one{examined(pair.asked, pair.far), {"seven_bits"}};
                      if (one.seen.changed != 0) outcome = one;
                      return outcome;
                    }});
  // Without its 00 bytes, a frame may look as if its end were cut off.
  faults.push_back(of_bytes("nul_lost", {0x00},
                            [](const ByteList&, const ByteList& reply) { return without(reply, {0x00}); },
                            {"bytes_missing"}));
  faults.push_back(of_bytes("telnet_doubled", {0xFF},
                            [](const ByteList&, const ByteList& reply) { return with_before(reply, 0xFF, 0xFF); }));
  return faults;
}

// ---- Faults of the virtual encoder and its line

inline PathFault of_encoder_fault(const std::string& name, const std::string& fault, const Ids& causes) {
  return {name, [=](const Unit& unit, const std::string& mode, const std::string& rate) {
            std::optional<Outcome> outcome;
            Pair pair = pair_of(unit, mode, rate, {"singleturn=1383", fault});
            if (fault.starts_with("fault=delay")) {
              const Pair usual = pair_of(unit, mode, rate);
              Opener opener(usual.far);
              const Time limit = read_once(parse_address(usual.asked), opener).limit;
              if (limit == Time{}) return outcome;
              pair.far.encoder.device.delay = limit * 5 / 4;
            }
            Outcome one{examined(pair.asked, pair.far, {.readings = 400, .limit = 60s}), causes};
            // A unit that repeats failed requests within a reading may show nothing of the fault.
            const bool is_spared =
                one.seen.first() == "good" && one.seen.examination.good == one.seen.examination.tried;
            if (!is_spared) outcome = one;
            return outcome;
          }};
}

inline PathFault of_talker(const std::string& name, const std::string& text, Time period, bool answers, Ids causes) {
  return {name, [=](const Unit& unit, const std::string& mode, const std::string& rate) {
            Pair pair = pair_of(unit, mode, rate);
            // With a weak checksum, the other device's text may look like a reply.
            if (has_weak_check(pair)) return std::optional<Outcome>();

            pair.far.other = [=] {
              return std::make_unique<Talker>(ByteList(text.begin(), text.end()), period, answers);
            };
            return std::optional(Outcome{examined(pair.asked, pair.far), causes});
          }};
}

inline std::vector<PathFault> faults_of_line() {
  std::vector<PathFault> faults;
  const Ids damage{"damaged_bits", "damaged_bursts", "sometimes_damaged"};
  faults.push_back(of_encoder_fault("dead", "fault=silence=1", {"no_answer"}));
  faults.push_back(of_encoder_fault("lost 10 %", "fault=silence=0.1", {"sometimes_silent"}));
  faults.push_back(of_encoder_fault("corrupt 2 %", "fault=corrupt=0.02", damage));
  faults.push_back(of_encoder_fault("always late", "fault=delay=1", {"reply_late"}));
  // The finding sometimes_silent is possible because a late reply may come after the host has stopped listening for it.
  faults.push_back(
      of_encoder_fault("randomly late", "fault=delay=0.2", {"reply_late", "sometimes_late", "sometimes_silent"}));
  faults.push_back({"line low", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      Pair pair = pair_of(unit, mode, rate);
                      pair.far.change = [](const ByteList&, ByteList reply) { return ByteList(reply.size(), 0); };
                      return std::optional(Outcome{examined(pair.asked, pair.far), {"line_inverted"}});
                    }});
  faults.push_back(of_talker("chatter", "\x12\xC5\x33\x9A\xE1\x07", 1ms, false, {"never_silent"}));
  faults.push_back(of_talker("login console", "\r\nDebian GNU/Linux 12 cell ttyS0\r\n\r\ncell login: ", 1ms, true,
                             {"modem_answers"}));
  faults.push_back(of_talker("NMEA", "$GPGGA,120000.00,4807.0,N,01131.0,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n", 50ms,
                             false, {"modem_answers"}));
  return faults;
}

// ---- Other encoders than that of the user's settings

/// Returns the setting of each model, "model=23-bit"; "" for the default model.
inline std::vector<std::string> models_of(const Unit& unit) {
  std::vector<std::string> models{""};
  for (const Model& model : unit.models) models.push_back(fmt::format("model={}", model.name));
  return models;
}

inline std::vector<PathFault> faults_of_others() {
  std::vector<PathFault> faults;
  faults.push_back({"another protocol", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      std::optional<Outcome> last;
                      // Takes the first other protocol whose unit states a usual baud rate, so that `identify` can find
                      // it.
                      for (const Unit* other : character_units()) {
                        if (other == &unit || other->line.rate == 0) continue;
                        Pair pair = pair_of(unit, mode, rate);
                        pair.far = pair_of(*other, asked_mode(*other),
                                           fmt::format("{}={}", rate_setting, other->line.rate), {"motion=rpm=20"})
                                       .far;
                        last = Outcome{examined(pair.asked, pair.far), {"other_protocol"}};
                        break;
                      }
                      return last;
                    }});
  faults.push_back({"another address", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      std::optional<Outcome> none;
                      const Option* option = find_role(unit.options, Role::encoder);
                      if (option == nullptr) return none;
                      const std::int64_t there = option->default_value == option->minimum + 3 * option->step
                                                     ? option->minimum + 2 * option->step
                                                     : option->minimum + 3 * option->step;
                      Pair pair = pair_of(unit, mode, rate, {fmt::format("{}={}", option->name, there)});
                      return std::optional(Outcome{examined(pair.asked, pair.far), {"wrong_address"}});
                    }});
  faults.push_back({"two of one address", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      std::optional<Outcome> none;
                      if (unit.link != LinkKind::half_duplex) return none;
                      Pair pair = pair_of(unit, mode, rate, {"singleturn=1383"});
                      pair.far.second = pair_of(unit, mode, rate, {"singleturn=700"}).far.encoder;
                      return std::optional(
                          Outcome{examined(pair.asked, pair.far), {"same_address", "always_damaged", "two_answer"}});
                    }});
  return faults;
}

// ---- States of an encoder that replies to requests

inline std::vector<PathFault> faults_of_state() {
  std::vector<PathFault> faults;
  faults.push_back({"frozen", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      const Pair pair = pair_of(unit, mode, rate, {"singleturn=1383"});
                      Opener opener(pair.far);
                      const Attempted usual = read_once(parse_address(pair.asked), opener);
                      const Time turning = pair.far.rate >= 1'000'000 ? 100ms : std::max(Time(5s), 150 * usual.after);
                      return std::optional(Outcome{examined(pair.asked, pair.far, {.readings = 40, .turning = turning}),
                                                   {"position_frozen"}});
                    }});
  faults.push_back({"loose contact", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      Pair pair = pair_of(unit, mode, rate, {"singleturn=1383"});
                      Opener opener(pair.far);
                      const Attempted usual = read_once(parse_address(pair.asked), opener);
                      const Time period = std::max({300 * usual.after, 200 * usual.limit, Time(50ms)});
                      pair.far.is_cut = [period](Time now) { return now % period > period * 7 / 10; };
                      const Choices choices{.readings = 100'000, .limit = 5 * period};
                      return std::optional(Outcome{examined(pair.asked, pair.far, choices), {"comes_and_goes"}});
                    }});
  faults.push_back({"starting", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      Pair pair = pair_of(unit, mode, rate, {"singleturn=1383"});
                      pair.far.goes_on = true;
                      Opener opener(pair_of(unit, mode, rate).far);
                      // The encoder is silent at first, for several timeouts of a reading that repeats each request.
                      const Time start = std::max(Time(900ms), 20 * read_once(parse_address(pair.asked), opener).limit);
                      pair.far.is_cut = [start](Time now) { return now < start; };
                      return std::optional(Outcome{examined(pair.asked, pair.far), {"starting"}});
                    }});
  faults.push_back({"battery empty", [](const Unit& unit, const std::string& mode, const std::string& rate) {
                      std::optional<Outcome> none;
                      for (const Condition& condition : unit.conditions) {
                        if (condition.name != "battery") continue;
                        const Pair pair = pair_of(unit, mode, rate, {"condition=battery=0"});
                        Outcome outcome{examined(pair.asked, pair.far), {"alarm", "status", "position_invalid"}};
                        // Skips units without alarms, whose replies cannot report the battery.
                        if (unit.alarms == nullptr) return none;
                        return std::optional(outcome);
                      }
                      return none;
                    }});
  return faults;
}

inline std::vector<PathFault> all_path_faults() {
  std::vector<PathFault> all = faults_of_bytes();
  for (const auto& more : {faults_of_line(), faults_of_others(), faults_of_state()}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

inline std::string path_fault_table() {
  const std::vector<PathFault> faults = all_path_faults();
  std::string table = "| protocol |";
  for (const PathFault& fault : faults) table += fmt::format(" {} |", fault.name);
  table += "\n|---|";
  for (std::size_t i = 0; i < faults.size(); ++i) table += "---|";
  table += "\n";
  for (const Unit* unit : character_units()) {
    table += fmt::format("| {} |", unit->id);
    for (const PathFault& fault : faults) {
      const std::optional<Outcome> outcome = fault.examine(*unit, asked_mode(*unit), rates_of(*unit).front());
      table += fmt::format(" {} |", outcome ? outcome->seen.first() : "-");
    }
    table += "\n";
  }
  return table;
}

}  // namespace absenc::client::path_faults
