// SPDX-License-Identifier: Apache-2.0
// Checks the bounds of latch times in virtual time.
#include "absenc/client/encoder/latch_times.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/encoder/connection.hpp"
#include "absenc/client/port/virtual_link_test.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/unwrap.hpp"
#include "absenc/host/velocity.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

using namespace std::chrono_literals;

/// A shaft that records the times at which the encoder measured it.
struct WatchedShaft final : Shaft {
  explicit WatchedShaft(std::function<double(double)> motion) : turns(std::move(motion)) {}
  [[nodiscard]] double place(Time at) const { return turns(std::chrono::duration<double>(at).count()); }
  [[nodiscard]] ShaftState at(Time time) const override {
    looked_at.push_back(time);
    return {.position = (std::int64_t{7} << 32) + static_cast<std::int64_t>(std::floor(std::ldexp(place(time), 32)))};
  }
  std::function<double(double)> turns;
  mutable std::vector<Time> looked_at;
};

/// A port on a busy computer, which is often late.
template <class Item>
class BusyPort final : public Port<Item> {
 public:
  BusyPort(std::unique_ptr<sim::SimPort<Item>> port, Time most, std::uint64_t seed)
      : port_(std::move(port)), most_(most), random_(seed) {}

  Time now() override { return time_ = std::max(time_, port_->now()); }
  void begin(const Step<Item>& step) override {
    Step<Item> later = step;
    const bool sends = step.kind == Step<Item>::Kind::transfer || step.kind == Step<Item>::Kind::pulse;
    if (sends) later.at = std::max(step.at, time_ + (step.at <= time_ ? lateness() : Time{}));
    port_->begin(later);
  }
  Event<Item> wait(const Step<Item>& step) override {
    Step<Item> patient = step;
    if (step.answer != Time{}) patient.answer += 3 * most_;
    if (step.gap != Time{}) patient.gap += 3 * most_;
    Event<Item> event = port_->wait(patient);
    const Time true_end = event.at;
    const bool may_be_late = event.kind == Event<Item>::Kind::received || event.kind == Event<Item>::Kind::sent;
    time_ = event.at = std::max(time_, event.at + (may_be_late ? lateness() : Time{}));
    if (event.kind == Event<Item>::Kind::sent) event.late = event.at - true_end;
    return event;
  }

 private:
  // Returns a random delay of the computer. Most are short: seven of eight are at most 1/50 of the longest possible.
  Time lateness() {
    const Time most = random_() % 8 == 0 ? most_ : most_ / 50;
    return Time(std::uniform_int_distribution<Time::rep>(0, most.count())(random_));
  }

  std::unique_ptr<sim::SimPort<Item>> port_;
  Time most_;
  std::mt19937_64 random_;
  Time time_{};
};

struct Case {
  std::string address;
  host::Take take = host::Take::newest;
};

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.address << (one.take == host::Take::every ? " every" : "");
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Unit* unit : all_units()) {
    for (const Model& model : unit->models) {
      all.push_back({"sim:" + std::string(unit->id) + "?model=" + std::string(model.name)});
    }
  }
  all.push_back({"sim:raa38?mode=handshake"});
  all.push_back({"sim:raa38?mode=bus"});
  for (const host::Take take : {host::Take::newest, host::Take::every}) {
    all.push_back({"sim:encolink?resolution=20&multiturn_bits=0&stream_rate=500", take});
    all.push_back({"sim:raa38?mode=timing", take});
    all.push_back({"sim:raa38-can?listen=true", take});
  }
  return all;
}

// Returns the speed of the simulated shaft. One revolution moves a linear encoder over its whole range, so the shaft of
// a linear encoder turns more slowly.
double revolutions_a_second(const Case& one) {
  const EncoderAddress address = parse_address(one.address);
  return address.unit->resolution(address.options).unit_um > 0 ? 0.05 : 0.5;
}

/// An encoder that is read over the port of a busy computer.
class Busy {
 public:
  Busy(const Case& one, std::function<double(double)> motion, Time most, std::uint64_t seed)
      : address_(parse_address(one.address)),
        take_(one.take),
        shaft_(std::move(motion)),
        storage_(std::make_unique<std::byte[]>(address_.unit->device_storage)),
        connection_(
            Connection::make(address_, [&, most, seed](const EncoderAddress& to) { return link(to, most, seed); })),
        unwrapper_({.rpm = 60, .mm_s = 20'000}, is_unsolicited() ? host::Times::arrived : host::Times::latched) {
    device_ = address_.unit->device(address_.options, shaft_, {storage_.get(), address_.unit->device_storage});
    each([](auto& device) { device.power_on(Time{}, std::decay_t<decltype(device)>::PowerOn::skip); });
    connection_->connect();
  }

  [[nodiscard]] bool is_unsolicited() const { return host::sends_unsolicited(*address_.unit, address_.options); }

  template <class Use>
  std::size_t read(std::size_t count, Time pause, const Use& use) {
    std::size_t good = 0;
    for (std::size_t i = 0; i < count; ++i) {
      rest(pause);
      shaft_.looked_at.clear();
      const Outcome outcome = connection_->read(take_);
      if (outcome.error != Error::none || outcome.reading == nullptr || !outcome.reading->singleturn_valid()) continue;
      ++good;
      use(*outcome.reading, connection_->latch_time());
      if (::testing::Test::HasFatalFailure()) break;
    }
    return good;
  }

  [[nodiscard]] const host::Velocity& measured(const Reading& reading, const host::LatchTime& at) {
    if (unwrapper_.add(reading, at) != host::Unwrapper::Joined::continued) velocity_.restart();
    velocity_.add(unwrapper_.position(), at);
    return velocity_;
  }
  [[nodiscard]] const WatchedShaft& shaft() const { return shaft_; }

 private:
  template <class Use>
  void each(const Use& use) {
    if (device_.bytes != nullptr) use(*device_.bytes);
    if (device_.frames != nullptr) use(*device_.frames);
  }
  Link link(const EncoderAddress& to, Time most, std::uint64_t seed) {
    Link link;
    link.place = "here";
    each([&]<class Item>(Device<Item>& device) {
      auto line = std::make_unique<sim::SimPort<Item>>(to.unit->link, to.line.with_some_rate(), device);
      rest_ = [port = line.get()](Time time) { port->line().run_until(port->line().now() + time); };
      take_port<Item>(link, std::make_shared<BusyPort<Item>>(std::move(line), most, seed));
    });
    return link;
  }
  void rest(Time pause) {
    if (pause > Time{}) rest_(pause);
  }

  EncoderAddress address_;
  host::Take take_;
  WatchedShaft shaft_;
  std::unique_ptr<std::byte[]> storage_;
  Any<Device> device_{};
  std::function<void(Time)> rest_;
  std::unique_ptr<Connection> connection_;
  host::Unwrapper unwrapper_;
  host::Velocity velocity_;
};

constexpr std::array most_late{0us, 400us, 8'000us};

class LatchTimes : public ::testing::TestWithParam<Case> {};

std::optional<Time> true_instant(const WatchedShaft& shaft, const Reading& reading, const host::LatchTime& at) {
  const std::vector<Time> all = shaft.looked_at;
  const auto shows = [&](Time time) {
    const double turns = shaft.place(time) - std::floor(shaft.place(time));
    const double counts = std::ldexp(turns, static_cast<int>(reading.singleturn_bits));
    return at.earliest <= time && time <= at.latest && std::abs(counts - double(reading.singleturn)) <= 1.001;
  };
  const auto found = std::find_if(all.rbegin(), all.rend(), shows);
  return found == all.rend() ? std::nullopt : std::optional(*found);
}

TEST_P(LatchTimes, HoldTheTrueInstant) {
  const double rate = revolutions_a_second(GetParam());
  for (const Time most : most_late) {
    Busy busy(
        GetParam(), [=](double seconds) { return rate * seconds; }, most, 1);
    if (busy.is_unsolicited()) GTEST_SKIP() << "it sends by itself: only its arrival is known";
    const std::size_t good = busy.read(200, 1ms, [&](const Reading& reading, const host::LatchTime& at) {
      ASSERT_TRUE(true_instant(busy.shaft(), reading, at).has_value())
          << to_text(at.width()) << " from " << at.earliest.count() << ", late by up to " << to_text(most);
    });
    EXPECT_GE(good, 150u);
  }
}

TEST_P(LatchTimes, MakeNoSpeedThatIsFartherOffThanItSays) {
  const double rate = revolutions_a_second(GetParam());
  for (const Time most : most_late) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      for (const Time pause : {0ms, 3ms}) {
        Busy busy(
            GetParam(), [=](double seconds) { return rate * seconds; }, most, seed);
        std::size_t valid = 0;
        const std::size_t good = busy.read(600, pause, [&](const Reading& reading, const host::LatchTime& at) {
          const host::Velocity& velocity = busy.measured(reading, at);
          if (!velocity.valid()) return;
          ++valid;
          const double truth = std::ldexp(rate, static_cast<int>(reading.singleturn_bits));
          ASSERT_LE(std::abs(velocity.counts_per_second() - truth), velocity.uncertainty() * (1 + 1e-9))
              << "of " << truth << ", late by up to " << to_text(most) << ", seed " << seed;
        });
        EXPECT_GE(good, 300u);
        if (most <= 400us && pause > 0ms) {
          EXPECT_GE(valid, good / 2) << "late by up to " << to_text(most);
        }
      }
    }
  }
}

// The measured speed is the mean between two latch times, even if the shaft accelerates.
TEST_P(LatchTimes, MakeTheMeanSpeedOfAShaftThatSwings) {
  const double swing = revolutions_a_second(GetParam()) / 5;
  for (const Time most : most_late) {
    Busy busy(
        GetParam(), [=](double seconds) { return swing * std::sin(2 * M_PI * seconds); }, most, 1);
    if (busy.is_unsolicited()) GTEST_SKIP() << "it sends by itself: only its arrival is known";
    // true latch time of each reading; the key is the lower bound of the latch time that was computed for the reading
    std::map<Time, Time> truths;
    std::size_t compared = 0;
    busy.read(600, 3ms, [&](const Reading& reading, const host::LatchTime& at) {
      const std::optional<Time> instant = true_instant(busy.shaft(), reading, at);
      if (instant) truths[at.earliest] = *instant;
      const host::Velocity& velocity = busy.measured(reading, at);
      if (!velocity.valid() || !instant || !truths.contains(velocity.since().earliest)) return;
      const Time since = truths.at(velocity.since().earliest);
      const double turns = busy.shaft().place(*instant) - busy.shaft().place(since);
      const double seconds = std::chrono::duration<double>(*instant - since).count();
      const double truth = std::ldexp(turns / seconds, static_cast<int>(reading.singleturn_bits));
      ASSERT_LE(std::abs(velocity.counts_per_second() - truth), velocity.uncertainty() * (1 + 1e-9));
      ++compared;
    });
    if (most <= 400us) {
      EXPECT_GE(compared, 200u);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Encoders, LatchTimes, ::testing::ValuesIn(cases()), [](const auto& one) {
  std::string name = one.param.address.substr(4);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name + (one.param.take == host::Take::every ? "_every" : "");
});

}  // namespace
}  // namespace absenc::client
