// SPDX-License-Identifier: Apache-2.0
// A virtual QS35: answers as the ESL document says, computes both channels independently, and lists the rules its host
// breaks. Several of them share a line.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/esl/frame.hpp"
#include "absenc/protocol/esl/timing.hpp"

namespace absenc::esl {

/// What can be set around the virtual encoder, and what can be wrong inside one channel, whose CRC is right all the
/// same. Indexes of `conditions`.
namespace condition {
enum Index : std::size_t {
  supply_voltage,
  temperature,
  forced_test,
  lissajous,
  id_d_clears_singleturn,
  redundant_offset,
  ch1_stuck,  // of channel 2 what follows each
  ch2_stuck,
  ch1_sequence,
  ch2_sequence,
  ch1_alarms,
  ch2_alarms,
  ch1_status_set,
  ch2_status_set,
  ch1_status_clear,
  ch2_status_clear,
};
}  // namespace condition

inline constexpr std::array<Condition, 16> conditions{{
    {"supply_voltage", "mV", "as the encoder measures it: alarms below 2900 and above 3700 (Table 8)", 0, 6000, 3300},
    {"temperature", "degC", "inside the encoder; above 105 it warns (assumed: the document gives no limit)", -128, 127,
     35},
    {"forced_test", "", "the forced test has passed", 0, 1, 0},
    {"lissajous", "", "led_or_lissajous_error is the disc's signals, not the LED", 0, 1, 0},
    {"id_d_clears_singleturn", "", "ID D clears the single-turn position too, as the change log of rev 1.4 has it", 0,
     1, 0},
    {"redundant_offset", "", "RS is so many 1/512 turns off", 0, 511, 0},
    {"ch1_stuck", "counts", "ABS stands still here; -1: it follows the shaft", -1, 0xFFFFFF, -1},
    {"ch2_stuck", "counts", "the position behind RS stands still here; -1: it follows the shaft", -1, 0xFFFFFF, -1},
    {"ch1_sequence", "", "SC1 stands still here; -1: it counts", -1, 255, -1},
    {"ch2_sequence", "", "SC2 stands still here; -1: it counts", -1, 255, -1},
    {"ch1_alarms", "", "bits of ALM that channel 1 alone raises", 0, 255, 0},
    {"ch2_alarms", "", "bits of ALM that channel 2 alone raises", 0, 255, 0},
    {"ch1_status_set", "", "bits of SF of channel 1 that are stuck at 1", 0, 255, 0},
    {"ch2_status_set", "", "bits of SF of channel 2 that are stuck at 1", 0, 255, 0},
    {"ch1_status_clear", "", "bits of SF of channel 1 that are stuck at 0", 0, 255, 0},
    {"ch2_status_clear", "", "bits of SF of channel 2 that are stuck at 0", 0, 255, 0},
}};

class VirtualEncoder final : public author::Responder {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder.
  VirtualEncoder(const Profile& profile, const Shaft& shaft);

  void power_on(Time now, PowerOn kind) override;
  void raise_alarms(std::uint32_t bits) override;
  void lower_alarms(std::uint32_t bits) override;
  void set_condition(std::size_t index, std::int64_t value, Time now) override;
  [[nodiscard]] MutableBytes memory() override { return memory_; }

  /// What a reply to `id` would say now.
  [[nodiscard]] Reply reply_to(DataId id, Time now) const;
  /// The byte of a page; null for what does not exist.
  [[nodiscard]] std::uint8_t* stored(std::uint8_t page, std::uint8_t address);

 private:
  // Behind the EEPROM and the MTP: the zeros of the channels, 4 bytes each, little endian, and what is taken off the
  // turns of the shaft, 8 bytes.
  static constexpr std::size_t zero_at = memory_size(false);
  static constexpr std::size_t turns_at = zero_at + 8;

  [[nodiscard]] std::size_t request_size(Bytes begin) const override;
  [[nodiscard]] std::size_t others_reply_size(Bytes request) const override;
  Answer respond(Bytes bytes, Time at, ByteBuffer<64>& reply) override;
  bool is_refused(Flaw flaw, Bytes heard) override;
  void refuse(Time at, ByteBuffer<64>& reply) override;
  void started(Time at) override;
  void stopped(Time at) override;

  [[nodiscard]] bool is_reported(std::uint8_t field) const;
  Answer report_bad_request(std::uint8_t field, std::uint8_t status_bit, Time at, ByteBuffer<64>& reply);
  void count(DataId id, Time at);
  Answer answer_memory(const Request& request, Time at, ByteBuffer<64>& reply);
  void read_byte(const Request& request, Reply& reply, Time at);
  void write_byte(const Request& request, Reply& reply, Time at);
  void count_reset(DataId id, Time at);
  void execute_reset(DataId id, Time at);

  [[nodiscard]] std::uint32_t zero(Channel channel) const;
  [[nodiscard]] std::uint32_t singleturn(Channel channel, Time now) const;
  [[nodiscard]] std::uint16_t turns(Time now) const;
  [[nodiscard]] std::uint64_t shaft_turns(Time now) const;
  void set_turns(std::uint16_t turns, Time now);
  [[nodiscard]] std::uint8_t alarms_now() const;
  [[nodiscard]] ChannelReply channel_now(Channel channel, Time now) const;
  [[nodiscard]] std::uint8_t error_info() const;
  // Of channel 2 the one behind that of channel 1.
  [[nodiscard]] std::int32_t value_of(std::size_t index, Channel channel = Channel::one) const {
    return condition_[index + (channel == Channel::two ? 1 : 0)];
  }

  Profile profile_;
  const Shaft* shaft_;
  std::array<std::int32_t, conditions.size()> condition_{};
  std::array<std::uint8_t, turns_at + 8> memory_{};
  std::array<std::uint8_t, memory_size(true)> registers_{};  // lost at power off

  Time ready_at_{};
  std::uint8_t latches_ = 0;
  std::uint8_t forced_ = 0;     // voltage alarms raised from outside
  bool turns_cleared_ = false;  // ID D was done: ID C may clear multiturn_error
  std::array<std::uint8_t, 2> counters_{};

  std::uint8_t page_ = register_page;
  Time page_ready_at_{};
  Time busy_until_{};
  bool byte_pending_ = false;  // an EEPROM byte is on its way into the temporary register
  std::uint8_t pending_address_ = 0;
  Time pending_at_{};

  DataId last_id_{};
  unsigned in_a_row_ = 0;           // requests of `last_id_`
  std::uint8_t refused_field_ = 0;  // CF of a damaged request
  Time last_reset_{};
};

}  // namespace absenc::esl
