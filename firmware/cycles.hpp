// SPDX-License-Identifier: Apache-2.0
// A drive and its encoder in one program. The drive reads a position in every cycle, and runs commands at the same
// time. A timer simulates the line: it delivers characters, or the bits of a transfer, at the times at which a line
// would.
//
//   cycles-... CYCLES: number of cycles
//
// The shaft accelerates to 6000 rpm and back, in both directions. One of a hundred replies is damaged, late or missing.
// Every position is compared with the shaft at its instant.
#pragma once

#include <algorithm>
#include <array>
#include <new>

#include "absenc/host/carrier.hpp"
#include "absenc/host/cyclic_host.hpp"
#include "absenc/host/extrapolation.hpp"
#include "absenc/host/first_reading.hpp"
#include "absenc/protocol/unit.hpp"
#include "firmware/machine/machine.hpp"

namespace absenc::firmware {

using namespace std::chrono_literals;
using machine::print;

inline void print_count(std::string_view name, std::uint64_t number) {
  print(name);
  print(" ");
  print(number);
  print("\n");
}

/// A generator of pseudo-random numbers, the same in each run.
class Random {
 public:
  std::uint32_t below(std::uint32_t limit) {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return state_ % limit;
  }

 private:
  std::uint32_t state_ = 0x2545'F491;
};

/// A shaft that accelerates for a second at 100 revolutions/s^2, brakes, does the same in the other direction, and
/// rests for a second.
class AcceleratingShaft final : public Shaft {
 public:
  static constexpr Time period = 5s;         ///< Duration of one motion: both directions and the rest.
  static constexpr Time begin_of_rest = 4s;  ///< Time in each period at which the shaft begins to rest.

  /// Returns the position of the shaft at `time`, in 2^-32 revolution.
  [[nodiscard]] static std::int64_t position(Time time) {
    constexpr std::int64_t second = 1'000'000'000;
    const auto phase = static_cast<std::int64_t>(time.count() % period.count());
    if (phase < second) return start + curve(phase);
    if (phase < 3 * second) return start + 2 * curve(second) - curve(phase - 2 * second);
    return start + (phase < 4 * second ? curve(phase - 4 * second) : 0);
  }
  [[nodiscard]] ShaftState at(Time time) const override { return {.position = position(time)}; }

 private:
  static constexpr std::int64_t start = (std::int64_t{1000} << 32) + (std::int64_t{1} << 30);
  // Returns the way 50 revolutions/s^2 * t^2 in 2^-32 revolution. The time t is `ns`, from -1 s to 1 s, in nanoseconds.
  [[nodiscard]] static constexpr std::int64_t curve(std::int64_t ns) {
    constexpr std::int64_t factor = 944'473;  // 50 revolutions/s^2 in 2^-32 revolution per ns^2, times 2^42, rounded
    return (ns * ns >> 20) * factor >> 22;
  }
};

/// Compares the result of each cycle with the position of the shaft, and counts the cycles of each kind.
class CycleCheck {
 public:
  /// Makes a check. `jitter`: greatest time by which the machine may note the time of an event too late.
  /// `compares_speed`: whether the drive also refuses positions that the speed of its last two readings contradicts; it
  /// needs that where single wrong bits may pass the check of the frame.
  CycleCheck(Time jitter, bool compares_speed) : jitter_(jitter), compares_speed_(compares_speed) {}

  void take(const host::Cycle& cycle, Time next) {
    ++counts_[static_cast<std::size_t>(cycle.kind)];
    longest_stale_ = std::max(longest_stale_, cycle.stale);
    if (cycle.kind != host::Cycle::Kind::fresh) return;
    const Reading& reading = cycle.reading;
    // A damaged reply may pass its checksum, so the drive refuses a position that the shaft cannot have reached: by the
    // speed limit, and by the speed of the last two readings.
    if (!first_.confirms(reading) || (compares_speed_ && !continues(reading))) {
      ++implausible_;
      return;
    }
    if (reading.alarms != 0) ++alarmed_;
    if (!is_near(counts_of(reading), reading, reading.latched, 1, 1)) ++wrong_;
    if (reading.latched - latched_ > longest_gap) extrapolation_.restart();
    span_ = reading.latched - latched_;
    latched_ = reading.latched;
    step_ = distance(position_, counts_of(reading), reading.singleturn_bits + reading.multiturn_bits);
    position_ = counts_of(reading);
    extrapolation_.add(reading);
    if (!extrapolation_.valid()) return;
    if (extrapolation_.bits() != reading.singleturn_bits + reading.multiturn_bits) return;
    // An extrapolated position has the errors of two readings: for each a count, and the motion within the jitter of
    // its latch time.
    if (!is_near(extrapolation_.at(next), reading, next, 6, 3)) ++far_;
  }
  [[nodiscard]] bool is_right() const { return wrong_ == 0 && far_ == 0; }
  [[nodiscard]] std::uint32_t count(host::Cycle::Kind kind) const { return counts_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] std::uint32_t all() const { return counts_[0] + counts_[1] + counts_[2] + counts_[3]; }
  void print_counts() const {
    constexpr std::array<std::string_view, 4> names{"fresh", "invalid", "missing", "repeated"};
    for (std::size_t i = 0; i < names.size(); ++i) print_count(names[i], counts_[i]);
    print_count("longest_stale", longest_stale_);
    print_count("implausible", implausible_);
    print_count("alarmed", alarmed_);
    print_count("wrong", wrong_);
    print_count("far", far_);
  }

 private:
  // Between readings that are further apart than this, the drive does not extrapolate.
  static constexpr Time longest_gap = 500us;

  // Returns whether the position is where the last two readings lead, with a tolerance for their errors: a count each,
  // and the motion within the jitter of their times. Both grow with the extrapolated time.
  [[nodiscard]] bool continues(const Reading& reading) const {
    const Time gap = reading.latched - latched_;
    if (!extrapolation_.valid() || gap > longest_gap) return true;
    const unsigned bits = extrapolation_.bits();
    if (bits != reading.singleturn_bits + (reading.multiturn_valid ? reading.multiturn_bits : 0)) return true;
    // The times have 32 bits, because a processor without a division instruction divides numbers of 64 bits slowly.
    const auto gap_ns = static_cast<std::uint32_t>(gap.count());
    const auto span_ns = static_cast<std::uint32_t>(span_.count());
    // counts of 2^-19 revolution by which an acceleration of 100 revolutions/s^2 moves the shaft in `longest_gap`,
    // rounded up
    constexpr std::uint32_t by_acceleration = 8;
    const std::uint32_t error = 1 + step_ * (static_cast<std::uint32_t>(jitter_.count()) / 100) / (span_ns / 100);
    const std::uint32_t allowed = by_acceleration + 2 * error * (1 + gap_ns / span_ns);
    return distance(extrapolation_.at(reading.latched), counts_of(reading), bits) <= allowed;
  }
  // Returns the distance in counts between two positions of `bits` bits, at most 100 000.
  [[nodiscard]] static std::uint32_t distance(std::uint64_t from, std::uint64_t to, unsigned bits) {
    const std::int64_t counts = with_sign(to - from, bits);
    return static_cast<std::uint32_t>(std::min<std::int64_t>(counts < 0 ? -counts : counts, 100'000));
  }
  [[nodiscard]] static std::uint64_t counts_of(const Reading& reading) {
    return (reading.multiturn_valid ? reading.multiturn << reading.singleturn_bits : 0) | reading.singleturn;
  }
  // Returns whether the shaft was at `position`, with a tolerance of `counts` counts, at some time that differs from
  // `time` by at most `jitters` times the jitter.
  [[nodiscard]] bool is_near(std::uint64_t position, const Reading& reading, Time time, std::int64_t counts,
                             int jitters) const {
    const unsigned bits = reading.singleturn_bits + (reading.multiturn_valid ? reading.multiturn_bits : 0);
    const auto apart = [&](Time at) {
      const std::int64_t wanted = AcceleratingShaft::position(at) >> (32 - reading.singleturn_bits);
      return with_sign(position - static_cast<std::uint64_t>(wanted), bits);
    };
    const std::int64_t before = apart(time - jitters * jitter_);
    const std::int64_t behind = apart(time + (jitters - 1) * jitter_);
    return std::min(before, behind) <= counts && std::max(before, behind) >= -counts;
  }

  Time jitter_;
  bool compares_speed_;
  host::Extrapolation extrapolation_{};
  Time latched_{};              // time at which the last new and plausible reading was latched
  Time span_{};                 // time between the latches of the last two such readings
  std::uint64_t position_ = 0;  // position of the last such reading
  std::uint32_t step_ = 0;      // distance of the positions of the last two such readings, in counts
  std::array<std::uint32_t, 4> counts_{};
  host::FirstReading first_{6000};
  std::uint32_t longest_stale_ = 0;
  // number of new readings whose position the shaft cannot have reached since the readings before
  std::uint32_t implausible_ = 0;
  std::uint32_t alarmed_ = 0;  // number of good positions with an alarm
  std::uint32_t wrong_ = 0;
  // number of extrapolated positions that are farther from the true position of the shaft than allowed
  std::uint32_t far_ = 0;
};

/// Handles the events of the line that are due, in the order of time, and sets the alarm of the timer to the next one.
/// `Wire` has `next()`, the time of its next event, and `pass(Time)`, which handles that event.
template <class Wire>
void run_line(Wire& wire) {
  Time next = wire.next();
  while (next <= machine::now()) {
    wire.pass(next);
    next = wire.next();
  }
  machine::set_alarm(std::max(next - machine::now(), Time{}));
}

/// Runs commands of the unit beside the cycles.
class ServiceRunner {
 public:
  explicit ServiceRunner(const Unit& unit, const Options& options) : unit_(unit), options_(options) {}

  /// Runs the command `name` to its end and returns its error. `add` queues the service that executes the command.
  template <class Add>
  Error run(std::string_view name, Arguments arguments, bool takes_cycles, const Add& add) {
    auto* const conversation = unit_.host(options_, *find_command(unit_, name), arguments, storage_).bytes;
    if (conversation == nullptr) return Error::invalid_argument;
    host::Service<std::uint8_t> service(*conversation, takes_cycles);
    {
      const machine::InterruptLock lock;
      add(service);
    }
    for (bool over = false; !over;) {
      asm volatile("wfi");
      const machine::InterruptLock lock;
      over = service.is_over();
    }
    if (service.state() == host::Service<std::uint8_t>::State::refused) return Error::busy;
    struct Value final : FieldSink {
      void put(const FieldValue& value) override {
        if (value.info->role == Role::value) number = value.number;
      }
      std::int64_t number = -1;
    } value;
    if (conversation->error() == Error::none) conversation->report(value);
    value_ = value.number;
    return conversation->error();
  }
  /// Returns the value that the last command reported; -1 if it reported none.
  [[nodiscard]] std::int64_t value() const { return value_; }

 private:
  const Unit& unit_;
  const Options& options_;
  std::int64_t value_ = -1;
  alignas(std::max_align_t) std::array<std::byte, 3072> storage_;
};

/// The values in which the programs cycles_tformat and cycles_biss differ.
struct Plan {
  Time period{};                   ///< time from one cycle to the next
  std::string_view temperature{};  ///< command that is run every second; "": none
  std::uint32_t alarm = 0;         ///< alarm that the encoder raises once in each motion of the shaft
  std::string_view clear{};        ///< command that clears the alarm; "": the encoder itself ends it after 100 ms
  std::int64_t page = 0;           ///< page of the encoder's memory that is written and read
  std::int64_t addresses = 0;      ///< number of addresses on each page of the memory
  std::int64_t bytes = 0;          ///< number of bytes of the encoder's memory that are written and read
  /// whether a command may use a cycle for itself, so that this cycle reads no position
  bool takes_cycles = false;
};

/// Runs commands until `cycles` cycles are over. `Bench` has the members `axis()`, which is the CyclicHost, `device()`
/// and `check()`.
template <class Bench>
bool run_commands(Bench& bench, ServiceRunner& command, const Plan& plan, std::uint32_t cycles) {
  const auto add = [&](host::Service<std::uint8_t>& service) { bench.add(service); };
  std::uint32_t written = 0;
  std::uint32_t failed = 0;
  std::uint32_t temperatures = 0;
  std::uint32_t cleared = 0;
  Time second = 1s;
  // An alarm that a command clears is raised while the shaft rests, because the encoder refuses the command otherwise.
  Time alarm_at = (plan.clear.empty() ? Time{} : AcceleratingShaft::begin_of_rest) + 100ms;
  Time alarm_ends = never;
  const auto is_running = [&] {
    const machine::InterruptLock lock;
    return bench.check().all() < cycles;
  };
  const auto run = [&](std::string_view name, Arguments arguments) {
    const Error error = command.run(name, arguments, plan.takes_cycles, add);
    if (error != Error::none) ++failed;
    return error == Error::none;
  };
  const auto do_regular_work = [&] {
    if (!plan.temperature.empty() && machine::now() >= second) {
      second += 1s;
      if (run(plan.temperature, {})) ++temperatures;
    }
    if (machine::now() >= alarm_ends) {
      alarm_ends = never;
      const machine::InterruptLock lock;
      bench.device().lower_alarms(plan.alarm);
    }
    if (machine::now() < alarm_at) return;
    alarm_at += AcceleratingShaft::period;
    {
      const machine::InterruptLock lock;
      bench.device().raise_alarms(plan.alarm);
    }
    if (plan.clear.empty()) {
      alarm_ends = machine::now() + 100ms;
    } else if (run(plan.clear, {})) {
      ++cleared;
    }
  };
  for (std::int64_t i = 0; is_running(); ++i) {
    do_regular_work();
    if (i >= plan.bytes) {
      asm volatile("wfi");
      continue;
    }
    const std::int64_t address = i % plan.addresses;
    const std::int64_t page = plan.page + i / plan.addresses;
    const std::int64_t value = (i * 37 + 11) & 0xFF;
    // the last argument, 1, forces the write, because BiSS writes most banks only then
    const std::array<std::int64_t, 4> write{address, value, page, 1};
    const std::array<std::int64_t, 3> read{address, page, 1};
    const std::size_t write_count = find_command(bench.unit(), "memory-write")->arguments.size();
    // If a damaged reply ends a command, the command is run again: writing the same byte twice does no harm.
    for (unsigned attempt = 0; attempt < 20 && is_running(); ++attempt) {
      if (!run("memory-write", Arguments(write).first(write_count))) continue;
      if (!run("memory-read", read)) continue;
      if (command.value() == value) ++written;
      break;
    }
  }
  const machine::InterruptLock lock;
  // Up to two results may be missing: the first cycle begins only after one period, and the result of the last cycle
  // may come in the next one.
  const std::int64_t left_out = machine::now() / plan.period - bench.check().all();
  bench.check().print_counts();
  print_count("bytes", written);
  print_count("temperatures", temperatures);
  print_count("cleared", cleared);
  print_count("failed", failed);
  print_count("faults", bench.faults());
  print_count("rules", bench.device().violation_count());
  print_count("stack", machine::stack_used());
  print_count("left_out", static_cast<std::uint64_t>(std::max<std::int64_t>(left_out - 2, 0)));
  return bench.check().is_right() && bench.device().violation_count() == 0 && left_out <= 2;
}

/// Bench of the program, which `on_alarm` uses.
template <class Bench>
inline Bench* bench = nullptr;

/// Makes a Bench for an encoder of `model` with `settings`, runs it with the commands of `plan`, and ends the program.
template <class Bench>
[[noreturn]] void run_program(const Unit& unit, std::string_view model, std::span<const OptionText> settings,
                              const Plan& plan) {
  static Options options;
  if (resolve_options(unit, model, settings, options).kind != OptionError::Kind::none) machine::end(false);
  machine::start_clock(500ms);
  alignas(Bench) static std::array<std::byte, sizeof(Bench)> memory;
  bench<Bench> = new (memory.data()) Bench(options, machine::now());
  {
    const machine::InterruptLock lock;
    run_line(*bench<Bench>);
  }
  static ServiceRunner command(unit, options);
  machine::end(run_commands(*bench<Bench>, command, plan, machine::argument(0, 100'000)));
}

}  // namespace absenc::firmware
