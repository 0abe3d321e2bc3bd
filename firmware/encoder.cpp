// SPDX-License-Identifier: Apache-2.0
// A T-format encoder, which runs in the interrupts of the UART. It measures a shaft that stands still or turns evenly.
//
//   encoder SINGLETURN MULTITURN RPM LATENCY_MS: position at the start, speed, and the latency of the
//   line
//
// It runs until the emulator ends, and prints rules that its host violates.
#include <new>

#include "absenc/core/bytes.hpp"
#include "absenc/host/carrier.hpp"
#include "absenc/protocol/tformat/device.hpp"
#include "firmware/machine/machine.hpp"

namespace absenc::firmware {
namespace {

using namespace std::chrono_literals;

// The clock's tick is slow because the main program reads the clock itself: a tick that the emulator delivers late
// would be lost.
constexpr Time tick_period = 500ms;
constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};

class TurningShaft final : public Shaft {
 public:
  TurningShaft(std::int64_t position, std::uint32_t rpm) : position_(position), rpm_(rpm) {}

  [[nodiscard]] ShaftState at(Time time) const override {
    constexpr std::uint64_t minute = 60'000'000;  // number of microseconds in a minute
    const std::uint64_t turned = static_cast<std::uint64_t>(time / 1us) * rpm_;
    const std::uint64_t turns = turned / minute << 32 | (turned % minute << 32) / minute;
    return {.position = position_ + static_cast<std::int64_t>(turns),
            .speed_millirpm = static_cast<std::int32_t>(rpm_ * 1000)};
  }

 private:
  std::int64_t position_;
  std::uint32_t rpm_;
};

class Encoder {
 public:
  Encoder(std::int64_t position, std::uint32_t rpm, Time latency)
      : shaft_(position, rpm), device_(format, shaft_), carrier_(*this, latency) {
    device_.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    device_.raise_alarms(tformat::alarms::over_heat);
  }

  // ---- Functions called by interrupts, or with interrupts disabled

  void start(Time now) { carrier_.start(device_, now); }
  void tick(Time now) { carrier_.tick(now); }
  void received(std::uint8_t byte, Time now) { carrier_.received({&byte, 1}, now); }
  void sent(Time now) { carrier_.sent(now); }

  // ---- Functions called by the carrier

  // Sends a copy of the reply, because the device may overwrite its buffer while the reply is sent.
  void begin(const ByteStep& step) {
    reply_.clear();
    reply_.append(step.out);
    machine::send(reply_.view());
  }
  void result(bool) {}

  // ---- Functions called by the main program

  [[nodiscard]] bool is_at_rest() const { return carrier_.due() == never; }
  [[nodiscard]] std::uint32_t broken_rules() const { return device_.violation_count(); }
  [[nodiscard]] std::string_view last_rule() const { return device_.violations().back().rule; }

 private:
  TurningShaft shaft_;
  tformat::VirtualEncoder device_;
  host::Carrier<std::uint8_t, Encoder> carrier_;
  ByteBuffer<64> reply_;
};

alignas(Encoder) std::byte encoder_memory[sizeof(Encoder)];
Encoder* encoder = nullptr;

}  // namespace
}  // namespace absenc::firmware

// All interrupts have one priority, so the functions that they call never interrupt each other.
namespace absenc::machine {
void on_tick() {}
void on_received(std::uint8_t byte) { firmware::encoder->received(byte, now()); }
void on_sent() { firmware::encoder->sent(now()); }
}  // namespace absenc::machine

int main() {
  using namespace absenc;
  using namespace absenc::firmware;
  const std::uint64_t counts =
      std::uint64_t{machine::argument(1, 0)} << format.singleturn_bits | machine::argument(0, 0);
  encoder = new (encoder_memory) Encoder(static_cast<std::int64_t>(counts << (32 - format.singleturn_bits)),
                                         machine::argument(2, 0), std::chrono::milliseconds(machine::argument(3, 20)));
  machine::start_clock(tick_period);
  {
    const machine::InterruptLock lock;
    encoder->start(machine::now());
  }
  machine::start_uart();
  for (std::uint32_t reported = 0;;) {
    const machine::InterruptLock lock;
    encoder->tick(machine::now());
    // Waits for an interrupt, because a busy loop would keep the emulator from serving its socket.
    if (encoder->is_at_rest()) asm volatile("wfi");
    if (encoder->broken_rules() == reported) continue;
    reported = encoder->broken_rules();
    machine::print("broken rule: ");
    machine::print(encoder->last_rule());
    machine::print("\n");
  }
}
