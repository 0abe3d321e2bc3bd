// SPDX-License-Identifier: Apache-2.0
// A virtual QS35: answers as the ESL document says, computes both channels independently, and lists the rules its host
// breaks. Several of them share a line.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/esl/frame.hpp"
#include "absenc/protocol/esl/timing.hpp"
#include "absenc/protocol/interruption.hpp"

namespace absenc::esl {

/// Of the virtual encoder's environment; the defaults are those of a healthy installation.
struct Environment {
  std::int32_t supply_millivolts = 3300;  // as Table 8 measures it
  std::int32_t temperature = 35;          // degC
  std::int32_t warning_above = 105;       // degC: the document gives no limit
  bool forced_test_passed = false;
  Time start_up = 100ms;             // until ready; the document gives none
  bool d_clears_singleturn = false;  // ID D as the change log of rev 1.4 has it
};

/// What is wrong inside one channel. Its CRC is right all the same.
struct ChannelFault {
  std::optional<std::uint32_t> singleturn{};  // stuck position: ABS, or what RS is made of, 24 bits
  std::optional<std::uint8_t> sequence{};     // stuck sequence counter
  std::uint32_t redundant_offset = 0;         // channel two: wrong RS, 1/512 turn
  std::uint8_t alarms = 0;                    // raised in this channel only
  std::uint8_t status_set = 0;                // bits of SF stuck at 1
  std::uint8_t status_clear = 0;              // and at 0
};

class VirtualEncoder final : public Device<std::uint8_t> {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder.
  VirtualEncoder(const Profile& profile, const Shaft& shaft);

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
  void set_fault(Channel channel, const ChannelFault& fault) { faults_[static_cast<std::size_t>(channel)] = fault; }
  /// Which of the two is behind led_or_lissajous_error when it is raised: LED by default.
  void set_lissajous(bool lissajous) { lissajous_ = lissajous; }
  void set_turns(std::uint16_t turns, Time now);
  /// EEPROM and MTP writes since it was made: of 1 000 000 and 100 000 in a life.
  [[nodiscard]] std::uint32_t writes() const { return writes_; }
  /// What a reply to `id` would say now.
  [[nodiscard]] Reply reply_to(DataId id, Time now) const;
  /// The byte of a page in the EEPROM or MTP image; null for registers and what does not exist.
  [[nodiscard]] std::uint8_t* stored(std::uint8_t page, std::uint8_t address);

 private:
  static constexpr std::size_t page_size = 0x7F;
  static constexpr std::size_t tables_at = 4 * page_size;  // pages 4 and 5
  static constexpr std::size_t page6_at = 6 * page_size;
  static constexpr std::size_t mtp_at = page6_at + 0x0C;
  static constexpr std::size_t zero_at = mtp_at + 0x20;  // channel one, 4 bytes, little endian
  static constexpr std::size_t zero2_at = zero_at + 4;   // channel two
  static constexpr std::size_t turns_at = zero2_at + 4;  // what is taken off the turns of the shaft, 8 bytes
  static constexpr std::size_t memory_size = turns_at + 8;

  void byte_received(std::uint8_t byte, Time at);
  void request_complete(Time at);
  void frame_set_ended();
  void interrupted(std::uint8_t byte, Time at);
  void ignore() {
    request_.clear();
    ignoring_ = true;
  }
  void ignore_request(std::uint8_t control_field);
  void report_bad_request(std::uint8_t status_bit, Time at);
  void send(const ReplyBytes& reply, Time at);

  void answer(const Request& request, Time at);
  void answer_memory(const Request& request, Time at);
  void read_byte(const Request& request, Reply& reply, Time at);
  void write_byte(const Request& request, Reply& reply, Time at);
  void count_reset(DataId id, Time at);
  void execute_reset(DataId id, Time at);

  void update(Time now);
  [[nodiscard]] bool ready(Time now) const { return now >= ready_at_; }
  [[nodiscard]] std::uint32_t singleturn_one(Time now) const;
  [[nodiscard]] std::uint32_t singleturn_two(Time now) const;
  [[nodiscard]] std::uint16_t turns(Time now) const;
  [[nodiscard]] std::int64_t shaft_turns(Time now) const;
  [[nodiscard]] std::uint8_t alarms_now() const;
  [[nodiscard]] ChannelReply channel_now(Channel channel, Time now) const;
  [[nodiscard]] std::uint8_t error_info() const;
  void violate(std::string_view rule, Time at);

  Profile profile_;
  const Shaft* shaft_;
  Environment environment_{};
  std::array<ChannelFault, 2> faults_{};
  std::array<std::uint8_t, memory_size> memory_{};
  std::array<std::uint8_t, 0x30> page8_{};   // registers are lost at power off
  std::array<std::uint8_t, 0x20> page14_{};  // 20 to 3F
  std::uint32_t memory_version_ = 0;
  std::uint32_t writes_ = 0;

  bool on_ = false;
  Time ready_at_{};
  std::uint8_t latches_ = 0;
  std::uint8_t forced_ = 0;  // voltage alarms raised from outside
  bool lissajous_ = false;
  bool turns_cleared_ = false;  // ID D was done: ID C may clear multiturn_error
  std::array<std::uint8_t, 2> counters_{};

  std::uint8_t page_ = register_page;
  Time page_ready_at_{};
  Time busy_until_{};
  bool byte_pending_ = false;  // an EEPROM byte is on its way into the temporary register
  std::uint8_t pending_address_ = 0;
  Time pending_at_{};

  DataId last_id_{};
  unsigned in_a_row_ = 0;  // requests of `last_id_`
  Time last_reset_{};

  RequestBytes request_;
  ReplyBytes reply_;
  bool ignoring_ = false;          // until the line is idle
  bool stop_wrong_ = false;        // a character of the request had a wrong stop bit: told when the line is idle
  Time heard_at_{};                // the last character
  std::uint64_t heard_ = 0;        // bytes so far
  std::uint64_t foreign_end_ = 0;  // of them, when another encoder's request is over
  Interruption interruption_;
  bool reply_pending_ = false;
  bool transmitting_ = false;
  Time reply_at_{};
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::esl
