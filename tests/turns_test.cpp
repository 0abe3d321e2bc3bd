// SPDX-License-Identifier: Apache-2.0
// Tests the unwrapper: if it continues from the previous reading, the difference between the two positions must be the
// motion of the shaft between them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "absenc/host/session.hpp"
#include "absenc/host/unwrap.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::host {
namespace {

using namespace std::chrono_literals;
using Joined = Unwrapper::Joined;
using Settings = std::vector<OptionText>;

struct Case {
  const Unit* unit;
  std::string_view model{};
  Settings encoder_options{};  // options of the virtual encoder
  Settings host_options{};     // options with which the host reads
  Take take = Take::newest;
  unsigned turn_bits = 0;  // number of bits in which the encoder counts turns
};

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.unit->id << " " << one.model;
  for (const OptionText& setting : one.encoder_options) *out << " " << setting.name << "=" << setting.value;
  if (one.take == Take::every) *out << " every";
}

Options options_of(const Unit& unit, std::string_view model, const Settings& settings) {
  Options options;
  EXPECT_EQ(resolve_options(unit, model, settings, options).kind, OptionError::Kind::none) << unit.id;
  return options;
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Unit* unit : all_units()) {
    for (const Model& model : unit->models) {
      const unsigned turns = unit->resolution(options_of(*unit, model.name, {})).multiturn_bits;
      all.push_back({.unit = unit, .model = model.name, .turn_bits = turns});
    }
  }
  const auto add = [&](std::string_view unit, const Settings& encoder_options, const Settings& host_options,
                       Take take) {
    all.push_back(
        {.unit = find_unit(unit), .encoder_options = encoder_options, .host_options = host_options, .take = take});
  };
  // These EncoLink encoders count no turns; the host learns it from their identity.
  for (const std::string_view unit : {"encolink", "encolink-spi"})
    add(unit, {{"multiturn_bits", "0"}}, {}, Take::newest);
  for (const Take take : {Take::newest, Take::every}) {
    const Settings stream{{"resolution", "20"}, {"multiturn_bits", "0"}, {"stream_rate", "500"}};
    add("encolink", stream, stream, take);
    for (const std::string_view mode : {"timing", "handshake", "bus"})
      add("raa38", {{"mode", mode}}, {{"mode", mode}}, take);
    add("raa38-can", {{"listen", "true"}}, {{"listen", "true"}}, take);
  }
  return all;
}

/// A shaft that begins to turn after 1 ms, at a steady speed: some encoders must be switched on at rest.
struct SpinningShaft final : Shaft {
  explicit SpinningShaft(double speed) : rpm(speed) {}
  [[nodiscard]] ShaftState at(Time time) const override {
    const double turned = rpm / 60 * std::chrono::duration<double>(std::max(time - Time(1ms), Time{})).count();
    const auto position = (std::int64_t{7} << 32) + static_cast<std::int64_t>(std::ldexp(turned, 32));
    return {.position = position, .speed_millirpm = time < 1ms ? 0 : static_cast<std::int32_t>(1000 * rpm)};
  }
  double rpm;
};

/// A turning virtual encoder and the host session that reads it.
template <class Item>
class TurningEncoder {
 public:
  TurningEncoder(const Case& one, double rpm)
      : case_(one),
        shaft_(rpm),
        known_(options_of(*one.unit, one.model, one.host_options)),
        device_storage_(one.unit->device_storage),
        host_storage_(one.unit->host_storage) {
    const Options built = options_of(*one.unit, one.model, one.encoder_options);
    device_ = one.unit->device(built, shaft_, device_storage_).template of<Item>();
    device_->power_on(Time{}, Device<Item>::PowerOn::skip);
    const LineSettings line = line_settings(*one.unit, built);
    port_ = std::make_unique<sim::SimPort<Item>>(one.unit->link, line.with_some_rate(), *device_);
    session_ = std::make_unique<Session<Item>>(*one.unit, known_, *port_, host_storage_);
    unwrapper_ = Unwrapper(speed_limit(known_), sends_unsolicited(*one.unit, known_) ? Times::arrived : Times::latched);
  }

  void pause(Time time) { port_->line().run_until(port_->line().now() + time); }

  /// Reads the position once. Returns whether the unwrapper has continued from the previous reading, started again, or
  /// ignored the reading.
  Joined read() {
    const Conversation<Item>* conversation = session_->read(*find_command(*case_.unit, Verb::read), case_.take);
    EXPECT_EQ(text_of(conversation->error()).name, "none") << conversation->detail();
    const Reading* reading = conversation->reading();
    if (reading == nullptr) return Joined::ignored;
    EXPECT_EQ(reading->multiturn_bits, case_.turn_bits);
    const std::int64_t before = unwrapper_.position();
    const Joined joined = unwrapper_.add(*reading);
    const std::int64_t shaft_position = shaft_.at(reading->latched).position;
    if (joined == Joined::continued) {
      const double distance =
          std::ldexp(static_cast<double>(unwrapper_.position() - before), -int(reading->singleturn_bits));
      const double truth = std::ldexp(static_cast<double>(shaft_position - last_shaft_position_), -32);
      EXPECT_NEAR(distance, truth, 0.45);
    }
    last_shaft_position_ = shaft_position;
    return joined;
  }

 private:
  const Case& case_;
  SpinningShaft shaft_;
  Options known_;
  std::vector<std::byte> device_storage_;
  std::vector<std::byte> host_storage_;
  Device<Item>* device_ = nullptr;
  std::unique_ptr<sim::SimPort<Item>> port_;
  std::unique_ptr<Session<Item>> session_;
  Unwrapper unwrapper_;
  std::int64_t last_shaft_position_ = 0;
};

// Returns the speed of the shaft in rpm. A linear encoder moves at `rpm` mm/s.
double speed_of(const Case& one, double rpm) {
  const Resolution resolution = one.unit->resolution(options_of(*one.unit, one.model, one.host_options));
  if (resolution.unit_um == 0) return rpm;
  return 60 * rpm * 1000 / std::ldexp(resolution.unit_um, static_cast<int>(resolution.singleturn_bits));
}

class Turns : public ::testing::TestWithParam<Case> {
 protected:
  template <class Item>
  void read_across_pauses() {
    for (const double rpm : {60.0, -600.0, 600.0, 6000.0, -6000.0}) {
      TurningEncoder<Item> bench(GetParam(), speed_of(GetParam(), rpm));
      bench.pause(2ms);
      for (const Time pause : {Time(100ms), Time(310ms), Time(1040ms), Time(2500ms), Time(10s)}) {
        SCOPED_TRACE(std::to_string(rpm) + " rpm, " + std::to_string(pause / 1ms) + " ms");
        for (int i = 0; i < 3; ++i) bench.read();
        bench.pause(pause);
        const Joined joined = bench.read();
        // An encoder that counts turns has a known position after the pause, too.
        const bool counts = GetParam().turn_bits > 0;
        if (counts) {
          EXPECT_EQ(joined, Joined::continued);
        } else if (GetParam().take == Take::newest && std::abs(speed_of(GetParam(), rpm)) >= 60) {
          EXPECT_NE(joined, Joined::continued);
        }
      }
    }
  }
};

TEST_P(Turns, ContinuesAcrossPauseOnlyIfCorrect) {
  if (GetParam().unit->link == LinkKind::can) {
    read_across_pauses<CanFrame>();
  } else {
    read_across_pauses<std::uint8_t>();
  }
}

INSTANTIATE_TEST_SUITE_P(Units, Turns, ::testing::ValuesIn(cases()));

}  // namespace
}  // namespace absenc::host
