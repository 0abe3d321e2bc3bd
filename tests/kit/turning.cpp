// SPDX-License-Identifier: Apache-2.0
// Checks a drive's cycles while the shaft accelerates, replies are damaged or late, and services run.
#include <algorithm>
#include <cmath>
#include <optional>

#include "absenc/host/extrapolation.hpp"
#include "absenc/sim/place.hpp"
#include "tests/kit/changes.hpp"
#include "tests/kit/drives.hpp"
#include "tests/kit/exchanges_without_faults.hpp"
#include "tests/kit/kit.hpp"

namespace absenc::kit {
namespace {

constexpr unsigned cycle_count = 1200;  // number of cycles of one run
constexpr double two_to_32 = 4294967296.0;

double seconds_of(Time time) { return std::chrono::duration<double>(time).count(); }

/// A shaft that accelerates, brakes, and does the same in the other direction. It stores the times at which it was
/// looked at, because the encoder needed its position.
class TurningShaft final : public Shaft {
 public:
  /// Starts the motion at `begin`: four parts of `quarter`, with an acceleration in revolutions/s^2.
  void start(Time begin, Time quarter, double acceleration) {
    begin_ = begin;
    quarter_ = quarter;
    acceleration_ = acceleration;
  }
  [[nodiscard]] double acceleration() const { return acceleration_; }
  /// Returns the greatest speed of the motion, in revolutions per second.
  [[nodiscard]] double top_speed() const { return acceleration_ * seconds_of(quarter_); }
  /// Returns the position in 2^-32 revolution.
  [[nodiscard]] std::int64_t position(Time time) const {
    const double quarter = seconds_of(quarter_);
    const double t = std::clamp(seconds_of(time - begin_), 0.0, 4 * quarter);
    const double half = acceleration_ / 2;
    const auto way = [&] {
      if (t < quarter) return half * t * t;
      if (t < 3 * quarter) return 2 * half * quarter * quarter - half * (t - 2 * quarter) * (t - 2 * quarter);
      return half * (4 * quarter - t) * (4 * quarter - t);
    };
    return (std::int64_t{1000} << 32) + static_cast<std::int64_t>(std::floor(way() * two_to_32));
  }
  [[nodiscard]] ShaftState at(Time time) const override {
    looked_at_.push_back(time);
    return {.position = position(time)};
  }
  /// Returns the last time between `begin` and the end of the reply at which the shaft was looked at and was where the
  /// reading says; no value if there is none.
  [[nodiscard]] std::optional<Time> true_instant(const Reading& reading, Time begin) const {
    const auto shows = [&](Time time) {
      return time >= begin && time <= reading.received && sim::is_at(reading, position(time));
    };
    const auto found = std::find_if(looked_at_.rbegin(), looked_at_.rend(), shows);
    return found == looked_at_.rend() ? std::nullopt : std::optional(*found);
  }
  /// Forgets at which times before `time` the shaft was looked at.
  void forget_before(Time time) {
    std::erase_if(looked_at_, [&](Time one) { return one < time; });
  }

 private:
  Time begin_ = never;
  Time quarter_{};
  double acceleration_ = 0;
  mutable std::vector<Time> looked_at_;
};

/// Stands between a virtual encoder and its line: of a hundred replies one has a wrong bit, is late or is missing.
template <class Item>
class RoughDevice final : public Machine<Item> {
 public:
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;

  /// `late`: additional time of a late reply. `checked`: numbers of the bits that may be inverted, in replies that have
  /// as many bytes as `size`.
  RoughDevice(Machine<Item>& device, LinkKind link, Time late, std::vector<std::size_t> checked, std::size_t size)
      : device_(device), link_(link), late_(late), checked_(std::move(checked)), size_(size) {}

  void feed(const Event<Item>& event) override { device_.feed(event); }
  Step<Item> next(Time now) override {
    for (;;) {
      Step<Item> step = device_.next(now);
      if (step.kind != Step<Item>::Kind::transfer || step.out.empty() || !random_.chance(0.01)) return step;
      const bool can_flip = !checked_.empty() && step.out.size() == size_;
      if (host_clocks(link_)) {  // the host clocks every reply, so none is late or missing
        return can_flip ? flipped(step) : step;
      }
      ++faults_;
      switch (random_.below(can_flip ? 3 : 2)) {
        case 0:
          step.at = std::max(step.at, now) + late_;
          return step;
        case 1:
          device_.feed({.kind = Event<Item>::Kind::sent, .at = now});
          break;
        default:
          return flipped(step);
      }
    }
  }
  [[nodiscard]] unsigned faults() const { return faults_; }

 private:
  Step<Item> flipped(Step<Item> step) {
    if constexpr (!is_can) {
      if (host_clocks(link_)) ++faults_;
      out_.assign(step.out.begin(), step.out.end());
      const std::size_t bit = checked_[random_.below(checked_.size())];
      const unsigned from_right = link_ == LinkKind::clocked ? 7 - bit % 8 : bit % 8;
      out_[bit / 8] ^= static_cast<std::uint8_t>(1u << from_right);
      step.out = out_;
    }
    return step;
  }

  Machine<Item>& device_;
  LinkKind link_;
  Time late_;
  std::vector<std::size_t> checked_;
  std::size_t size_;
  sim::Random random_{1};
  std::vector<Item> out_;
  unsigned faults_ = 0;
};

/// Runs commands as services of a cyclic host, one after the other. None of them may take a cycle.
template <class Item>
class Services {
 public:
  Services(const Unit& unit, const Options& options)
      : unit_(unit), options_(options), write_(find_command(unit, Verb::memory_write)), storage_(unit.host_storage) {
    for (const Command& command : unit.commands) {
      const bool is_other = command.verb == Verb::read || command.verb == Verb::scan;
      if (!is_other && !command.changes_encoder) commands_.push_back(&command);
    }
    const auto is_free = [](const MemoryArea& one) { return one.writable && one.protection.empty(); };
    const auto area = std::ranges::find_if(unit.memory, is_free);
    if (write_ == nullptr || area == unit.memory.end()) return;
    area_ = &*area;
    commands_.push_back(write_);
    commands_.push_back(find_command(unit, Verb::memory_read));
  }
  /// Adds the next service if none runs.
  template <class Host>
  void go_on(Host& host) {
    if (service_ && !service_->is_over()) return;
    if (service_) conclude();
    if (commands_.empty()) return;
    command_ = commands_[number_++ % commands_.size()];
    const bool is_of_memory = command_ == write_ || (area_ != nullptr && command_->verb == Verb::memory_read);
    const auto value = static_cast<std::uint8_t>(number_ * 37);
    const Values values =
        is_of_memory ? memory_arguments(*command_, *area_, area_->first, value) : least_arguments(*command_);
    if (command_ == write_) written_ = value;
    service_.reset();
    conversation_ = unit_.host(options_, *command_, values, storage_).template of<Item>();
    if (conversation_ == nullptr || conversation_->streams()) return;
    service_.emplace(*conversation_);
    host.add(*service_);
  }
  unsigned done = 0;     // number of services that ended without an error
  unsigned refused = 0;  // number of services with a request that does not fit between two positions
  unsigned failed = 0;   // number of services that ended with an error
  unsigned wrong = 0;    // number of bytes that were not read as they had been written

 private:
  void conclude() {
    if (service_->state() == host::Service<Item>::State::refused) {
      ++refused;
      known_ = {};
      return;
    }
    const Error error = conversation_->error();
    if (error == Error::unsupported) {  // this model has no such command
      std::erase(commands_, command_);
      return;
    }
    if (error != Error::none) {
      ++failed;
      known_ = {};
      return;
    }
    ++done;
    if (command_ == write_) known_ = written_;
    if (command_->verb != Verb::memory_read || !known_) return;
    ReportedFields seen;
    conversation_->report(seen);
    const bool is = std::ranges::any_of(seen.fields, [&](const auto& field) {
      const Value& value = field.second;
      return (value.role == Role::data && value.bytes == std::string(1, static_cast<char>(*known_))) ||
             (value.role == Role::value && value.number == *known_);
    });
    if (!is) ++wrong;
    known_ = {};
  }

  const Unit& unit_;
  const Options& options_;
  const Command* write_;
  const MemoryArea* area_ = nullptr;
  std::vector<const Command*> commands_;
  std::size_t number_ = 0;
  const Command* command_ = nullptr;
  std::vector<std::byte> storage_;
  Conversation<Item>* conversation_ = nullptr;
  std::optional<host::Service<Item>> service_;
  std::uint8_t written_ = 0;
  std::optional<std::uint8_t> known_{};  // byte that the memory certainly has: the write before succeeded
};

/// A drive with one encoder.
template <class Item>
class Drive {
 public:
  Drive(const Unit& unit, const Configuration& configuration, Findings& findings)
      : unit_(unit), configuration_(configuration), findings_(findings), read_(*find_command(unit, Verb::read)) {}

  /// Runs the cycles. Returns false if the configuration is not one of a drive.
  bool run() {
    const std::optional<Time> longest = time_of_position<Item>(unit_, configuration_, read_);
    if (!longest) return false;
    World<Item> world(unit_, configuration_.options, 1);
    world.device().power_off(Time{});
    world.run(read_, {});
    const Time period = 5 * *longest;
    lost_cycles_ = 2 + static_cast<unsigned>(world.line().now() / period);
    turn(period, *longest);
    return true;
  }

 private:
  /// A reply to `read`, and the bits of it whose inversion the check must notice.
  struct Checked {
    std::vector<std::size_t> bits{};
    std::size_t size = 0;  // number of bytes of the reply
  };
  [[nodiscard]] Checked checked() const {
    Checked found;
    if (unit_.link == LinkKind::can) return found;  // CAN itself notices wrong bits
    const auto exchanges = exchanges_without_faults<Item>(unit_, configuration_.options, standing_place, read_, {});
    if (exchanges.empty()) return found;
    const auto& [request, reply] = exchanges.back();
    found.size = reply.bytes.size();
    for (std::size_t bit = 0; bit < reply.bit_count(); ++bit) {
      const bool is =
          unit_.is_checked == nullptr || unit_.is_checked(configuration_.options, request.frame(), reply.frame(), bit);
      if (is) found.bits.push_back(bit);
    }
    return found;
  }

  void turn(Time period, Time answer) {
    TurningShaft shaft;
    std::vector<std::byte> device_storage(unit_.device_storage);
    Device<Item>& device = *unit_.device(configuration_.options, shaft, device_storage).template of<Item>();
    device.power_on(Time{}, Device<Item>::PowerOn::skip);
    const Checked bits = checked();
    can_be_faulty_ = !bits.bits.empty() || !host_clocks(unit_.link);
    const LineSettings settings = line_settings(unit_, configuration_.options).with_some_rate();
    RoughDevice<Item> rough(device, unit_.link, settings.byte_time(), bits.bits, bits.size);
    sim::Line<Item> line(unit_.link, settings);
    line.attach(sim::NodeRole::device, rough);
    std::vector<std::byte> storage(unit_.host_storage);
    const auto position = [&]() -> Conversation<Item>& {
      return *unit_.host(configuration_.options, read_, {}, storage).template of<Item>();
    };
    host::CyclePlan plan = plan_for(unit_, configuration_);
    plan.period = period;
    plan.answer = answer;
    const Time first = std::chrono::milliseconds(100);
    host::CyclicHost<Item, decltype(position)> host(position, plan, first);
    // At most 6000 rpm, and at most a sixteenth of a revolution in a cycle.
    const Time quarter = period * (cycle_count / 4);
    const double top_speed = std::min(100.0, 1.0 / 16 / seconds_of(period));
    shaft.start(first, quarter, top_speed / seconds_of(quarter));
    Services<Item> services(unit_, configuration_.options);
    unsigned cycles = 0;
    const auto on_emit = [&] {
      take(host.cycle(), shaft, host.cycle().begun + period);
      services.go_on(host);
      return ++cycles < cycle_count;
    };
    const std::size_t node = line.attach(sim::NodeRole::host, host, on_emit);
    line.run(node, std::chrono::hours(1));
    judge(rough.faults(), cycles, device);
    const auto what = [&] { return configuration_.text + ", turning: "; };
    findings_.require(services.wrong == 0, [&] { return what() + "memory does not read as it was written"; });
    findings_.require(services.failed <= rough.faults(), [&] {
      return what() + std::to_string(services.failed) + " services fail after " + std::to_string(rough.faults()) +
             " faults";
    });
    findings_.note(configuration_.text + ": " + std::to_string(counts_[0]) + " of " + std::to_string(cycles) +
                   " cycles fresh, " + std::to_string(rough.faults()) +
                   " faults, services: " + std::to_string(services.done) + " done, " + std::to_string(services.failed) +
                   " failed, " + std::to_string(services.refused) + " refused");
  }

  void take(const host::Cycle& cycle, TurningShaft& shaft, Time next) {
    ++counts_[static_cast<std::size_t>(cycle.kind)];
    if (cycle.kind != host::Cycle::Kind::fresh) {
      if (first_error_ == Error::none) first_error_ = cycle.error;
      return;
    }
    const Reading& reading = cycle.reading;
    const std::optional<Time> instant = shaft.true_instant(reading, std::min(cycle.begun, reading.latched));
    if (!instant) {
      ++wrong_;
      extrapolation_.restart();
      readings_ = 0;
      return;
    }
    shaft.forget_before(reading.latched);
    extrapolation_.add(reading);
    // `late`: error of the latch time that the reading states. `span`: time between the latch times of the last two
    // readings. Both are in seconds.
    const double late = std::abs(seconds_of(*instant - reading.latched));
    const double span = seconds_of(reading.latched - latched_);
    latched_ = reading.latched;
    const double latest = std::max(late, std::exchange(late_, late));
    if (readings_++ == 0 || !extrapolation_.valid()) return;
    const double ahead = seconds_of(next - reading.latched);
    const double count = 1 / std::ldexp(1.0, static_cast<int>(reading.singleturn_bits));
    // The limit of the error is that in absenc/host/extrapolation.hpp. The noise of a reading is one count, and the
    // motion of the shaft within the error of the latch time.
    const double noise = count + shaft.top_speed() * latest;
    const double allowed = shaft.acceleration() * (ahead + latest) * (ahead + span + latest) / 2 +
                           noise * (1 + 2 * ahead / span) + 2 * count;
    const std::uint64_t wanted = sim::counts_at(shaft.position(next), reading.singleturn_bits);
    const double off =
        std::abs(static_cast<double>(wrapped_difference(extrapolation_.at(next) & low_mask(reading.singleturn_bits),
                                                        wanted, reading.singleturn_bits))) *
        count;
    ++extrapolated_;
    if (off > allowed) {
      if (far_++ == 0) {
        first_far_ = "the first is off by " + std::to_string(off / count) + " counts of " +
                     std::to_string(allowed / count) + ", ahead " + std::to_string(ahead * 1e6) + " us, span " +
                     std::to_string(span * 1e6) + " us, instants unknown by " + std::to_string(latest * 1e6) + " us";
      }
    }
  }

  void judge(unsigned faults, unsigned cycles, Device<Item>& device) {
    const auto what = [&] { return configuration_.text + ", turning: "; };
    const auto count = [&](host::Cycle::Kind kind) { return counts_[static_cast<std::size_t>(kind)]; };
    using Kind = host::Cycle::Kind;
    findings_.require(cycles == cycle_count, [&] { return what() + "only " + std::to_string(cycles) + " cycles"; });
    findings_.require(wrong_ == 0, [&] {
      return what() + std::to_string(wrong_) + " positions are not the shaft's at any instant between latch and reply";
    });
    findings_.require(far_ == 0, [&] {
      return what() + std::to_string(far_) + " of " + std::to_string(extrapolated_) +
             " extrapolated positions are too far off: " + first_far_;
    });
    findings_.require(count(Kind::repeated) == 0, [&] { return what() + "cycles are repeated"; });
    findings_.require(count(Kind::missing) + count(Kind::invalid) <= lost_cycles_ * faults, [&] {
      return what() + std::to_string(count(Kind::missing)) + " cycles have no position, after " +
             std::to_string(faults) + " faults; the first: " + std::string(text_of(first_error_).name);
    });
    // An SSI encoder's replies have no check, so none of their bits is inverted.
    findings_.require((faults > 0 || !can_be_faulty_) && extrapolated_ > cycle_count / 2,
                      [&] { return what() + "too few faults or extrapolated positions"; });
    findings_.require(device.violation_count() == 0, [&] {
      return what() + "the host broke a rule: " + std::string(device.violations().front().rule);
    });
  }

  const Unit& unit_;
  const Configuration& configuration_;
  Findings& findings_;
  const Command& read_;
  host::Extrapolation extrapolation_{};
  Time latched_{};
  double late_ = 0;
  bool can_be_faulty_ = true;
  // greatest number of cycles without a valid position that one damaged, late or missing reply may cause
  unsigned lost_cycles_ = 0;
  unsigned readings_ = 0;
  std::array<unsigned, 4> counts_{};
  unsigned wrong_ = 0;
  unsigned far_ = 0;
  std::string first_far_{};
  unsigned extrapolated_ = 0;
  Error first_error_ = Error::none;
};

}  // namespace

Findings check_turning(const Unit& unit) {
  Findings findings;
  for_each_drive(unit, [&](const Configuration& configuration) {
    return unit.link == LinkKind::can ? Drive<CanFrame>(unit, configuration, findings).run()
                                      : Drive<std::uint8_t>(unit, configuration, findings).run();
  });
  return findings;
}

}  // namespace absenc::kit
