// SPDX-License-Identifier: Apache-2.0
// A virtual BiSS-C encoder: its samples on SLO, its registers, and checks of the host's timing.
#pragma once

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/clocked_device.hpp"
#include "absenc/protocol/biss/chain.hpp"
#include "absenc/protocol/biss/control.hpp"
#include "absenc/protocol/biss/host.hpp"
#include "absenc/protocol/biss/registers.hpp"

namespace absenc::biss {

/// Times of a virtual encoder and of the line between it and the host.
struct Behaviour {
  Time latency = 10us;  ///< Time that the encoder needs for a position, from the second rising edge of MA.
  /// Delay of the line, there and back.
  Time line_delay{};
  /// A sample that is taken less than this time from a delayed edge may read the old or the new bit.
  Time edge_noise = 20ns;
  /// Time from the host's request for a register until the virtual encoder can send or take the register's value.
  Time register_delay{};
  /// Whether SLO stays idle after power on until the host has sent the start sequence (two pulses of MA between pauses
  /// of 40 us).
  bool start_sequence = false;
};

/// Samples of SLO, one per clock of MA.
using Samples = author::DrivenBits;

/// Delays the samples of SLO as the line between encoder and host does.
class LineDelay {
 public:
  /// Delays `samples` by `behaviour.line_delay`; `period` is the period of MA at which they were taken.
  void apply(const Behaviour& behaviour, Time period, Samples& samples);

 private:
  std::uint32_t noise_ = 1;
};

/// A virtual encoder without its line: makes the samples of SLO.
template <class F>
class EncoderOf {
 public:
  /// Creates an encoder that follows `shaft`, which must outlive it.
  EncoderOf(const F& format, const Shaft& shaft, const Behaviour& behaviour)
      : format_(format), shaft_(&shaft), behaviour_(behaviour) {}

  /// Fills `samples` with SLO for a frame whose first falling edge of MA is at `at`.
  void sample(Time at, Time period, Samples& samples, bool cds = false) {
    samples.clear();
    // If half a period of MA is as long as the BiSS timeout or longer, the frame ends at once and SLO is idle.
    if (period / 2 >= format_.timeout.of_encoder(period)) {
      samples.append(~std::uint64_t{0}, 64);
      return;
    }
    typename ProtocolOf<F>::Reply reply;
    reply.ack_bits = head_bits(format_, behaviour_.latency, period);
    reply.cds = cds;
    show(format_, shaft_->at(at), alarms_, life_counter_, reply);
    // an encoded frame for which `samples` has no room is sent without a start bit
    if (!encode(format_, reply, samples, data_off_)) {
      samples.clear();
      samples.append(low_mask(idle_bits), idle_bits);
      while (samples.size() < Samples::capacity()) samples.append(0, 1);
    }
    life_counter_ = static_cast<std::uint8_t>((life_counter_ + 1u) & low_mask(life_counter_bits));
    const std::size_t whole = std::min<std::size_t>(clocks(format_, behaviour_.latency, period), Samples::capacity());
    // Zeros at the end of the frame take the place of position words that are switched off.
    while (samples.size() < whole) samples.append(0, 1);
    delay_.apply(behaviour_, period, samples);
    while (samples.size() % 8 != 0) samples.append(0, 1);
  }

  /// Returns the format of the encoder.
  [[nodiscard]] const F& format() const { return format_; }
  /// Returns the times of the encoder and of its line.
  [[nodiscard]] const Behaviour& behaviour() const { return behaviour_; }
  /// Returns the position word at the time `at`.
  [[nodiscard]] Word word(Time at) const { return word_of(format_.word, shaft_->at(at), alarms_); }
  /// Returns whether the encoder is switched on.
  [[nodiscard]] bool is_powered() const { return powered_; }
  /// Sets whether the encoder is switched on; `sample` does not check that.
  void set_power(bool on) { powered_ = on; }
  /// Sets which alarms are raised, one bit each.
  void set_alarms(std::uint32_t alarms) { alarms_ = alarms; }
  /// Sets the slaves whose process data are switched off: bit n is slave n.
  void set_silent(std::uint8_t slaves) { data_off_ = slaves; }

 private:
  F format_;
  const Shaft* shaft_;
  Behaviour behaviour_;
  bool powered_ = false;
  std::uint32_t alarms_ = 0;
  std::uint8_t data_off_ = 0;
  std::uint8_t life_counter_ = 0;
  LineDelay delay_;
};
/// A virtual encoder with one position word.
using Encoder = EncoderOf<Format>;

/// The registers of all virtual slaves on a line.
class VirtualRegisters final : public ControlTarget {
 public:
  static constexpr unsigned banks = 4;  ///< Number of register banks of each slave.
  /// Bytes of memory of each slave.
  static constexpr unsigned slave_size = banks * registers::bank_size + (registers::end - registers::bank_size);
  static constexpr unsigned most_slaves = ChainFormat::most;  ///< Greatest number of slaves.

  /// Creates the registers of `slaves` slaves, 1 to `most_slaves`.
  VirtualRegisters(unsigned slaves, RegisterOrder order, StopBit stop_bit);
  /// Selects bank 0, and switches on process data and control communication of all slaves.
  void power_on();
  /// Sets the present time to `at`; a register that is requested now is ready `delay` later.
  void set_time(Time at, Time delay);
  /// Returns the memory of all slaves, one after the other.
  [[nodiscard]] MutableBytes memory() { return MutableBytes(memory_).first(std::size_t{slaves_} * slave_size); }
  /// Returns how often the host wrote a register since construction, not counting bank select.
  [[nodiscard]] std::uint32_t written() const { return written_; }
  /// Returns the slaves whose process data are switched off: bit n is slave n.
  [[nodiscard]] std::uint8_t silent() const { return data_off_; }

  [[nodiscard]] bool allows(unsigned slave, unsigned address, bool write) const override;
  /// Returns the value of the register of `slave` at `address`.
  [[nodiscard]] std::uint8_t read(unsigned slave, unsigned address) override;
  /// Writes `value` to the register of `slave` at `address`.
  void write(unsigned slave, unsigned address, std::uint8_t value) override;
  [[nodiscard]] bool stop_bit(bool next_allowed) const override;
  [[nodiscard]] bool is_ready() const override;
  [[nodiscard]] bool listens(unsigned slave) const override { return (control_off_ >> slave & 1) == 0; }
  [[nodiscard]] bool obeys(unsigned slave, unsigned command) const override;
  /// Executes command 0 or 1 on the slaves in the mask `slaves`, 0: all; ignores other commands.
  void execute(std::uint8_t slaves, unsigned command) override;

 private:
  [[nodiscard]] std::size_t place(unsigned slave, unsigned address) const;

  std::array<std::uint8_t, most_slaves * slave_size> memory_{};
  std::array<std::uint8_t, most_slaves> bank_{};
  unsigned slaves_;
  StopBit stop_bit_;
  Time now_{};
  Time delay_{};
  mutable Time requested_at_{};
  mutable bool requested_ = false;
  std::uint32_t written_ = 0;
  std::uint8_t data_off_ = 0;     // slaves with process data switched off: bit n is slave n
  std::uint8_t control_off_ = 0;  // slaves with control communication switched off: bit n is slave n
};

/// Returns 1: a frame with one word has one slave.
[[nodiscard]] constexpr unsigned slaves_of(const Format&) { return 1; }
/// Returns the number of slaves: one for each word of BiSS Safety.
[[nodiscard]] constexpr unsigned slaves_of(const SafetyFormat&) { return 2; }
/// Returns the number of slaves in the chain.
[[nodiscard]] constexpr unsigned slaves_of(const ChainFormat& format) { return format.count; }

/// A virtual encoder, or a chain, with registers and checks of the host's timing.
template <class F>
class VirtualEncoderOf final : public author::ClockedDevice {
 public:
  /// Creates an encoder with the times of `format`; it is off. `shaft` must outlive it.
  VirtualEncoderOf(const F& format, const Shaft& shaft)
      : VirtualEncoderOf(format, shaft,
                         {.latency = format.ready > 0ns ? format.ready : std::min(format.latency, Behaviour{}.latency),
                          .line_delay = Time(format.line_delay_ns),
                          .register_delay = std::chrono::microseconds(format.register_delay_us),
                          .start_sequence = format.start_sequence}) {}
  /// Creates an encoder with the times of `behaviour`; it is off. `shaft` must outlive it.
  VirtualEncoderOf(const F& format, const Shaft& shaft, const Behaviour& behaviour)
      : encoder_(format, shaft, behaviour),
        slaves_(slaves_of(format)),
        registers_(slaves_of(format), format.register_order, format.stop_bit) {}

  [[nodiscard]] MutableBytes memory() override { return registers_.memory(); }

 private:
  void selected(Time at, Time period, bool held_low, Samples& samples) override {
    const Behaviour& behaviour = encoder_.behaviour();
    if (period == Time{}) period = line_settings.bits(1);
    expect(period >= shortest_period, "MA faster than 10 MHz", at);
    needed_ = 0;
    timeout_ = encoder_.format().timeout.of_encoder(period);
    period_ = period;
    if (period / 2 < timeout_) hold_low(timeout_);
    // Before the BiSS timeout has passed, SLO is still low after the previous frame.
    if (!expect(at >= free_at_, "clocked before the BiSS timeout has passed", at)) {
      samples.append(0, 64);
      return;
    }
    expect(period / 2 < timeout_, "MA slower than the BiSS timeout allows", at);
    if (behaviour.start_sequence && !start_sequence_received_) return hold_low({});
    registers_.set_time(at, behaviour.register_delay);
    const std::uint32_t written = registers_.written();
    if (clocked_before_) slaves_.take(held_low, registers_);
    if (registers_.written() != written) change_memory();
    encoder_.set_alarms(raised());
    encoder_.set_silent(registers_.silent());
    encoder_.sample(at, period, samples, slaves_.cds());
    needed_ = clocks(encoder_.format(), behaviour.latency, period);
  }
  void clocked(Time at, std::size_t clocks) override {
    // A host cannot know whether the encoder needs the start sequence, so it is always accepted.
    if (is_start_sequence(clocks)) {
      start_sequence_received_ = true;
    } else if (needed_ > 0) {
      expect(clocks >= needed_, "fewer clocks than the frame has bits", at);
      count_answer();
    }
    clocked_before_ = true;
    free_at_ = at - period_ / 2 + timeout_;  // the BiSS timeout begins at the last rising edge of MA
  }
  void started(Time) override {
    registers_.power_on();
    slaves_.reset();
    clocked_before_ = false;
    start_sequence_received_ = false;
  }
  // Returns whether the host has sent the start sequence. Eight clocks count, too, because many SPI controllers only
  // clock whole bytes.
  static bool is_start_sequence(std::size_t clocks) { return clocks == start_pulses || clocks == 8; }

  EncoderOf<F> encoder_;
  ControlSlaves slaves_;
  VirtualRegisters registers_;
  unsigned needed_ = 0;  // number of clocks that the present frame needs; 0: the host has not clocked a frame
  Time timeout_{};       // BiSS timeout after the present frame
  Time period_{};
  Time free_at_{};  // earliest time of the next frame: the BiSS timeout after the last rising edge
  bool clocked_before_ = false;
  bool start_sequence_received_ = false;  // whether the host has sent the start sequence since power on
};
/// A virtual BiSS-C encoder with one position word.
using VirtualEncoder = VirtualEncoderOf<Format>;

}  // namespace absenc::biss
