// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/device.hpp"

namespace absenc::biss {

void Encoder::sample(Time at, Time period, Samples& samples) {
  samples.clear();
  // The half of a period without an edge that is longer than the timeout ends the frame: SLO is idle again.
  if (period / 2 >= behaviour_.timeout) {
    samples.append(~std::uint64_t{0}, 64);
    return;
  }
  const unsigned ack = ack_bits(behaviour_.latency, period);
  const Reply reply{.ack_bits = ack, .word = word(at), .life_counter = life_counter_};
  if (!encode(format_, reply, samples)) {  // not ready within all the clocks that anybody gives
    samples.clear();
    samples.append(low_mask(idle_bits), idle_bits);
    while (samples.size() < Samples::capacity()) samples.append(0, 1);
  }
  life_counter_ = (life_counter_ + 1u) & low_mask(life_counter_bits);
  delay(period, samples);
  while (samples.size() % 8 != 0) samples.append(0, 1);
}

// SLO arrives later than the host samples it: by whole clocks, and by chance where an edge falls on a sample.
void Encoder::delay(Time period, Samples& samples) {
  if (behaviour_.line_delay == Time{}) return;
  const auto late = static_cast<unsigned>(behaviour_.line_delay / period);
  const Time rest = behaviour_.line_delay % period;
  const bool just_late = late > 0 && rest < behaviour_.edge_noise;
  const bool nearly_late = period - rest < behaviour_.edge_noise;
  if (late == 0 && !nearly_late) return;
  const BitBuffer driven = samples;
  samples.clear();
  const auto bit = [&driven](std::size_t index, unsigned by) {
    if (index < by) return true;  // still idle
    return index - by < driven.size() && driven.view()[index - by];
  };
  for (std::size_t i = 0; i < driven.size() + late && i < Samples::capacity(); ++i) {
    noise_ = noise_ * 1'664'525 + 1'013'904'223;
    const bool other = (noise_ >> 31) != 0;
    unsigned by = late;
    if (just_late && other) --by;
    if (nearly_late && other) ++by;
    samples.append(bit(i, by) ? 1 : 0, 1);
  }
}

VirtualEncoder::VirtualEncoder(const Format& format, const Shaft& shaft)
    : VirtualEncoder(format, shaft,
                     {.latency = format.ready > 0ns ? format.ready : std::min(format.latency, Behaviour{}.latency),
                      .line_delay = format.line_delay}) {}

void VirtualEncoder::selected(Time at, Time period, Samples& samples) {
  const Time timeout = encoder_.behaviour().timeout;
  if (period == Time{}) period = line_settings.bits(1);
  if (period < shortest_period) violate("MA faster than 10 MHz", at);
  needed_ = 0;
  if (at < free_at_) {  // SLO is still low
    violate("clocked before the BiSS timeout has passed", at);
    samples.append(0, 64);
    return;
  }
  if (period / 2 >= timeout) violate("MA slower than the BiSS timeout allows", at);
  encoder_.set_alarms(raised());
  encoder_.sample(at, period, samples);
  needed_ = clocks(encoder_.format(), encoder_.behaviour().latency, period);
}

void VirtualEncoder::clocked(Time at, std::size_t clocks) {
  if (clocks < needed_) violate("fewer clocks than the frame has bits", at);
  if (needed_ > 0) count_answer();
  free_at_ = at + encoder_.behaviour().timeout;
}

}  // namespace absenc::biss
