// SPDX-License-Identifier: Apache-2.0
// A virtual BiSS-C encoder: what it puts on SLO at any clock, and the rules of timing that its host breaks.
#pragma once

#include "absenc/protocol/biss/timing.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::biss {

/// The encoder and the line to it.
struct Behaviour {
  Time latency = 10us;
  Time line_delay{};       // there and back; SLO is sampled one period of MA after the edge that drives it
  Time edge_noise = 20ns;  // a sample so near to a delayed edge is the old bit or the new one
  Time timeout = 20us;
};

inline constexpr std::size_t sample_capacity = 512;
using Samples = BitBuffer<sample_capacity>;

/// The encoder without its line: also what stands behind an adapter.
class Encoder {
 public:
  Encoder(const Format& format, const Shaft& shaft, const Behaviour& behaviour)
      : format_(format), shaft_(&shaft), behaviour_(behaviour) {}

  /// What the host samples when its first falling edge of MA comes `at`: the whole frame, then 0 up to a full byte.
  void sample(Time at, Time period, Samples& samples);

  [[nodiscard]] const Format& format() const { return format_; }
  [[nodiscard]] const Behaviour& behaviour() const { return behaviour_; }
  [[nodiscard]] Word word(Time at) const { return word_of(format_.word, shaft_->at(at), alarms_); }
  [[nodiscard]] bool is_powered() const { return powered_; }
  void set_power(bool on) { powered_ = on; }
  void set_alarms(std::uint32_t alarms) { alarms_ = alarms; }
  [[nodiscard]] std::uint32_t alarms() const { return alarms_; }

 private:
  void delay(Time period, Samples& samples);

  Format format_;
  const Shaft* shaft_;
  Behaviour behaviour_;
  bool powered_ = false;
  std::uint32_t alarms_ = 0;
  std::uint8_t life_counter_ = 0;
  std::uint32_t noise_ = 1;
};

class VirtualEncoder final : public Device<std::uint8_t> {
 public:
  VirtualEncoder(const Format& format, const Shaft& shaft, const Behaviour& behaviour = {})
      : encoder_(format, shaft, behaviour) {}

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

  void power_on(Time, PowerOn) override { encoder_.set_power(true); }
  void power_off(Time) override { encoder_.set_power(false); }
  void raise_alarms(std::uint32_t bits) override { encoder_.set_alarms(encoder_.alarms() | bits); }
  void lower_alarms(std::uint32_t bits) override { encoder_.set_alarms(encoder_.alarms() & ~bits); }
  [[nodiscard]] MutableBytes memory() override { return {}; }
  [[nodiscard]] std::uint32_t memory_version() const override { return 0; }
  [[nodiscard]] std::span<const Violation> violations() const override { return violations_; }
  [[nodiscard]] std::uint32_t violation_count() const override { return violation_count_; }
  [[nodiscard]] std::uint64_t answered() const override { return answered_; }

  [[nodiscard]] Encoder& encoder() { return encoder_; }

 private:
  void selected(Time at, Time period);
  void violate(std::string_view rule, Time at);

  Encoder encoder_;
  Samples samples_;
  bool driving_ = false;
  unsigned needed_ = 0;  // clocks of this frame; 0: there is none
  Time free_at_{};       // the timeout after the last clock
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::biss
