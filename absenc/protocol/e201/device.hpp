// SPDX-License-Identifier: Apache-2.0
// A virtual E201-9S with a BiSS or SSI encoder behind it: every command, the encoder's supply and the MA clock.
#pragma once

#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/e201/frame.hpp"
#include "absenc/protocol/e201/timing.hpp"

namespace absenc::e201 {

struct AdapterSettings {
  Version firmware{1, 16};
  unsigned clock = 4;  // 280 kHz
  biss::Behaviour behaviour{};
};

class VirtualAdapter final : public Device<std::uint8_t> {
 public:
  VirtualAdapter(const Format& format, const Shaft& shaft, const AdapterSettings& settings = {});

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

  /// The interface and the encoder's supply.
  void power_on(Time now, PowerOn kind) override;
  void power_off(Time now) override;
  void raise_alarms(std::uint32_t bits) override { encoder_.set_alarms(encoder_.alarms() | bits); }
  void lower_alarms(std::uint32_t bits) override { encoder_.set_alarms(encoder_.alarms() & ~bits); }
  [[nodiscard]] MutableBytes memory() override { return {}; }
  [[nodiscard]] std::uint32_t memory_version() const override { return 0; }
  [[nodiscard]] std::span<const Violation> violations() const override { return violations_; }
  [[nodiscard]] std::uint32_t violation_count() const override { return violation_count_; }
  [[nodiscard]] std::uint64_t answered() const override { return answered_; }

  [[nodiscard]] Word word(Time at) const;
  [[nodiscard]] unsigned clock() const { return clock_; }
  [[nodiscard]] bool supplies() const { return encoder_.is_powered(); }

 private:
  static constexpr Time usb_time = 200us;
  static constexpr Time stream_period = 10ms;

  void work(Time at);
  void parse(std::uint8_t byte, Time at);
  void execute(std::uint8_t letter, unsigned value, Time at);
  bool change(std::uint8_t letter, unsigned value, Time at);
  void answer(std::string_view text, Time at);
  void answer_version(Time at);
  void answer_samples(Time at);
  void answer_position(std::uint8_t letter, Time at);
  void append_number(std::uint64_t number, unsigned base);
  void end_line(Time at);
  [[nodiscard]] std::uint64_t counts(Time at) const;
  void violate(std::string_view rule, Time at);

  Format format_;
  const Shaft* shaft_;
  biss::Encoder encoder_;  // with SSI only its supply and alarms
  Version firmware_;
  bool on_ = false;
  unsigned clock_;
  unsigned width_;
  std::uint64_t zero_ = 0;
  bool streaming_ = false;
  Time stream_at_{};

  ByteBuffer<64> input_;     // what came while it answered
  std::uint8_t letter_ = 0;  // M or B, whose digits are still to come
  unsigned digits_ = 0;
  unsigned value_ = 0;
  ReplyText reply_;
  Time reply_at_{};
  bool reply_pending_ = false;
  bool transmitting_ = false;
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::e201
