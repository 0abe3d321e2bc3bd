// SPDX-License-Identifier: Apache-2.0
// A virtual Smart-Abs: answers like paragraphs 6 to 10 of the specification say, and lists the rules its host breaks.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/interruption.hpp"
#include "absenc/protocol/tformat/frame.hpp"
#include "absenc/protocol/tformat/timing.hpp"

namespace absenc::tformat {

/// Of the virtual encoder's environment; the defaults are those of a healthy installation.
struct Environment {
  std::int32_t battery_millivolts = 3600;  // 0: no battery
  std::int32_t temperature = 35;           // degC, of the board
};

class VirtualEncoder final : public Device<std::uint8_t> {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder.
  VirtualEncoder(const Format& format, const Shaft& shaft);

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

  void power_on(Time now, PowerOn kind) override;
  void power_off(Time now) override;
  void raise_alarms(std::uint32_t bits) override;
  void lower_alarms(std::uint32_t bits) override;
  [[nodiscard]] MutableBytes memory() override { return memory_; }
  [[nodiscard]] std::uint32_t memory_version() const override { return memory_version_; }
  [[nodiscard]] std::span<const Violation> violations() const override { return violations_; }
  [[nodiscard]] std::uint32_t violation_count() const override { return violation_count_; }
  [[nodiscard]] std::uint64_t answered() const override { return answered_; }

  void set_environment(const Environment& environment) { environment_ = environment; }
  /// Turns so that the counter shows `turns` now.
  void set_turns(std::uint32_t turns, Time now);
  /// EEPROM writes since it was made: of 100 000 in total (6.1.1).
  [[nodiscard]] std::uint32_t writes() const { return writes_; }
  /// What an ID 3 reply would say now.
  [[nodiscard]] Reply everything(Time now);

 private:
  enum class Power : std::uint8_t { off, starting, on };
  // EEPROM: the user's pages, the over-heat threshold, the zero position (4 bytes, little endian).
  static constexpr std::size_t threshold_at = std::size_t{user_pages} * page_addresses;
  static constexpr std::size_t zero_at = threshold_at + 1;
  static constexpr std::size_t memory_size = zero_at + 4;

  void byte_received(std::uint8_t byte, Time at);
  void request_complete(Time at);
  void answer(const Request& request, Time at);
  void answer_data(const Request& request, Time at);
  void answer_memory(const Request& request, Time at);
  void interrupted(std::uint8_t byte, Time at);
  void refuse(std::uint8_t status_bits);
  void answer_refused(Time at);
  void send(const Reply& reply, Time at);
  void count_reset(DataId id, Time at);
  void execute_reset(DataId id, Time at);

  void update(Time now);
  void update_power_off(Time now);
  [[nodiscard]] std::int64_t counts(Time now) const;
  [[nodiscard]] std::int64_t turns(Time now) const;
  [[nodiscard]] std::int64_t lap(Time now) const;
  [[nodiscard]] std::uint32_t zero() const;
  [[nodiscard]] std::uint8_t alarms_now() const;
  void violate(std::string_view rule, Time at);

  Format format_;
  const Shaft* shaft_;
  Environment environment_{};
  std::array<std::uint8_t, memory_size> memory_{};
  std::uint32_t memory_version_ = 0;
  std::uint32_t writes_ = 0;

  Power power_ = Power::off;
  Time ready_at_{};
  Time off_since_{};
  bool was_on_ = false;

  std::int64_t turn_offset_ = 0;  // subtracted from the turns of the shaft
  std::int64_t counter_lap_ = 0;  // which lap of the turn counter was seen last
  std::uint8_t latches_ = 0;
  std::uint8_t forced_ = 0;  // unlatched alarms raised from outside
  bool full_absolute_ = false;

  std::uint8_t page_ = 0;
  Time busy_until_{};
  bool page_changing_ = false;
  bool zero_pending_ = false;
  std::int64_t zero_request_ = 0;  // counts to become zero when the EEPROM is written
  std::int64_t zero_turns_ = 0;    // to be kept then

  DataId reset_id_{};
  unsigned reset_count_ = 0;
  Time last_reset_{};

  RequestBytes request_;
  ReplyBytes reply_;
  bool refusing_ = false;  // answered when the line is idle
  std::uint8_t refused_status_ = 0;
  Time heard_at_{};  // the last character
  bool reply_pending_ = false;
  bool transmitting_ = false;
  Interruption interruption_;
  Time reply_at_{};
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::tformat
