// SPDX-License-Identifier: Apache-2.0
// A drive with a BiSS-C encoder, at a clock of 5 MHz and 32 000 cycles per second: every frame has the position and one
// bit of the register access that runs beside it.
#include <utility>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/biss/host.hpp"
#include "absenc/protocol/biss/unit.hpp"
#include "firmware/cycles.hpp"

namespace absenc::firmware {
namespace {

constexpr biss::Format format{.ma_khz = 5000, .timeout = biss::Timeout::adaptive(), .latency = 1us};
constexpr Time period = 31'250ns;
constexpr Time clock_period = format.period();

struct Read {
  Conversation<std::uint8_t>& operator()() { return *new (memory) biss::ReadPosition(format); }
  alignas(biss::ReadPosition) std::byte memory[sizeof(biss::ReadPosition)];
};

/// The line between drive and encoder: the drive gives the clocks of a transfer, the encoder drives the bits.
class Bench {
 public:
  Bench(const Options& options, Time begin)
      : device_(*biss::unit.device(options, shaft_, device_memory_).bytes),
        axis_(read_,
              {.period = firmware::period, .line = biss::line_settings, .carried = biss::unit.services_carry_position},
              begin + period),
        drive_(drive_end_) {
    device_.power_on(begin, Device<std::uint8_t>::PowerOn::skip);
    drive_.start(axis_, begin);
  }

  void add(host::Service<std::uint8_t>& service) {
    axis_.add(service);
    drive_.wake(machine::now());
    run_line(*this);
  }
  [[nodiscard]] Time next() const { return std::min(drive_.due(), end_); }
  void pass(Time time) {
    if (time < end_) return drive_.tick(machine::now());
    end_ = never;
    device_.feed({.kind = ByteEvent::Kind::sent, .at = time, .bits = bits_});
    damage();
    drive_.sent(time);
    drive_.received(samples_.view(), time);
  }
  [[nodiscard]] CycleCheck& check() { return check_; }
  [[nodiscard]] Device<std::uint8_t>& device() { return device_; }
  [[nodiscard]] const Unit& unit() const { return biss::unit; }
  [[nodiscard]] std::uint32_t faults() const { return faults_; }

 private:
  struct DriveEnd {
    void hold_clock(bool low) { bench.is_held_low_ = low; }
    void begin(const ByteStep& step) {
      if (step.kind == ByteStep::Kind::transfer) bench.clock(step);
    }
    void result(bool) { bench.check_.take(bench.axis_.cycle(), bench.axis_.cycle().begun + period); }
    Bench& bench;
  };

  // Gives the clocks of a transfer. The encoder decides all its bits at the first clock edge.
  void clock(const ByteStep& step) {
    const Time begin = std::max(step.at, machine::now());
    bits_ = step.bits;
    device_.feed({.kind = ByteEvent::Kind::selected,
                  .at = begin,
                  .held_low = std::exchange(is_held_low_, false),
                  .width = clock_period});
    const ByteStep driven = device_.next(begin);
    samples_.clear();
    for (std::size_t i = 0; i < (bits_ + 7) / 8; ++i) {
      samples_.push_back(i < driven.out.size() ? driven.out[i] : driven.behind_out());
    }
    end_ = begin + static_cast<int>(bits_) * clock_period;
  }
  // One of a hundred frames has a flipped bit, or is missing.
  void damage() {
    if (random_.below(100) != 0) return;
    ++faults_;
    if (random_.below(4) == 0) {
      for (std::size_t i = 0; i < samples_.size(); ++i) samples_[i] = 0xFF;
      return;
    }
    const std::uint32_t bit = random_.below(static_cast<std::uint32_t>(bits_));
    samples_[bit / 8] ^= static_cast<std::uint8_t>(0x80u >> bit % 8);
  }

  AcceleratingShaft shaft_{};
  alignas(std::max_align_t) std::array<std::byte, 4096> device_memory_;
  Device<std::uint8_t>& device_;
  Read read_{};
  host::CyclicHost<std::uint8_t, Read&> axis_;
  DriveEnd drive_end_{*this};
  host::Carrier<std::uint8_t, DriveEnd> drive_;
  ByteBuffer<64> samples_{};
  std::size_t bits_ = 0;
  bool is_held_low_ = false;
  Time end_ = never;
  Random random_{};
  std::uint32_t faults_ = 0;
  CycleCheck check_{1us, true};
};

}  // namespace
}  // namespace absenc::firmware

void absenc::machine::on_alarm() { firmware::run_line(*firmware::bench<firmware::Bench>); }

int main() {
  using namespace absenc;
  constexpr std::array<OptionText, 3> settings{{{"ma_khz", "5000"}, {"adaptive_timeout", "true"}, {"latency_us", "1"}}};
  firmware::run_program<firmware::Bench>(
      biss::unit, {}, settings,
      {.period = firmware::period, .alarm = word_warning, .page = 0, .addresses = 64, .bytes = 256});
}
