// SPDX-License-Identifier: Apache-2.0
// A virtual Smart-Abs: answers like paragraphs 6 to 10 of the specification say, and lists the rules its host breaks.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/tformat/protocol.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::tformat {

enum ConditionIndex : std::size_t { battery_voltage, temperature };
inline constexpr std::array<Condition, 2> conditions{{
    {"battery", "mV", "voltage of the external battery; 0: there is none", 0, 4750, 3600},
    {"temperature", "degC", "of the board", -20, 127, 35},
}};

class VirtualEncoder final : public author::Responder {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder.
  VirtualEncoder(const Format& format, const Shaft& shaft);

  void power_on(Time now, PowerOn kind) override;
  void power_off(Time now) override;
  void raise_alarms(std::uint32_t bits) override;
  void lower_alarms(std::uint32_t bits) override;
  void set_condition(std::size_t index, std::int64_t value, Time now) override;
  [[nodiscard]] MutableBytes memory() override { return memory_; }

  /// EEPROM writes since it was made: of 100 000 in total (6.1.1).
  [[nodiscard]] std::uint32_t writes() const { return writes_; }
  /// What an ID 3 reply would say now.
  [[nodiscard]] Reply everything(Time now) const;

 private:
  // EEPROM: the user's pages, the over-heat threshold, the zero position (4 bytes, little endian).
  static constexpr std::size_t threshold_at = std::size_t{user_pages} * page_addresses;
  static constexpr std::size_t zero_at = threshold_at + 1;
  static constexpr std::size_t memory_size = zero_at + 4;

  [[nodiscard]] std::size_t request_size(Bytes begin) const override { return Protocol::request_size(begin); }
  [[nodiscard]] std::size_t others_reply_size(Bytes) const override { return 0; }
  Answer respond(Bytes request, Time at, ByteBuffer<64>& reply) override;
  bool is_refused(Flaw flaw, Bytes heard) override;
  void refuse(Time at, ByteBuffer<64>& reply) override;
  void started(Time at) override;

  std::optional<Reply> answer(const Request& request, Time at);
  std::optional<Reply> access_memory(const Request& request, Time at);
  [[nodiscard]] std::uint8_t value_at(std::uint8_t address) const;
  void write(std::uint8_t address, std::uint8_t value);
  void changed_memory();
  void count_reset(DataId id, Time at);
  void execute_reset(DataId id, Time at);

  void update(Time now);
  void write_zero();
  void count_on_battery(Time from, Time now);
  [[nodiscard]] std::int64_t counts(Time now) const;
  [[nodiscard]] std::int64_t turns(Time now) const;
  [[nodiscard]] std::int64_t lap(Time now) const;
  void set_turns(std::int64_t turns, Time now);
  [[nodiscard]] std::uint32_t zero() const;
  [[nodiscard]] std::uint8_t alarms_now() const;

  Format format_;
  const Shaft* shaft_;
  std::array<std::int64_t, conditions.size()> conditions_{};
  std::array<std::uint8_t, memory_size> memory_{};
  std::uint32_t writes_ = 0;

  std::optional<Time> off_since_{};  // none: it was never on before, or is
  bool off_ = true;

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
  std::uint8_t refused_status_ = 0;
};

}  // namespace absenc::tformat
