// SPDX-License-Identifier: Apache-2.0
// A virtual BiSS-C encoder: what it puts on SLO at any clock, and the rules of timing that its host breaks.
#pragma once

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/clocked_device.hpp"
#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// The encoder and the line to it.
struct Behaviour {
  Time latency = 10us;
  Time line_delay{};       // there and back; SLO is sampled one period of MA after the edge that drives it
  Time edge_noise = 20ns;  // a sample so near to a delayed edge is the old bit or the new one
  Time timeout = 20us;
};

using Samples = author::DrivenBits;

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

class VirtualEncoder final : public author::ClockedDevice {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder.
  VirtualEncoder(const Format& format, const Shaft& shaft);
  VirtualEncoder(const Format& format, const Shaft& shaft, const Behaviour& behaviour)
      : encoder_(format, shaft, behaviour) {}

 private:
  void selected(Time at, Time period, Samples& samples) override;
  void clocked(Time at, std::size_t clocks) override;

  Encoder encoder_;
  unsigned needed_ = 0;  // clocks of this frame; 0: there is none
  Time free_at_{};       // the timeout after the last clock
};

}  // namespace absenc::biss
