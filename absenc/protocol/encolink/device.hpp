// SPDX-License-Identifier: Apache-2.0
// A virtual AksIM-2 on UART or SPI, with registers and checks of the host's timing.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

/// Conditions of the virtual encoder that a user can set.
inline constexpr std::array<Condition, 3> conditions{{
    {"temperature", "degC", "of the readhead", -100, 200, 35},
    {"busy", "", "a register access never ends", 0, 1, 0},
    {"channels_disagree", "", "channel 2 has another position than channel 1", 0, 1, 0},
}};
/// Indices of the conditions in the table `conditions`.
enum ConditionIndex : std::size_t { condition_temperature, condition_busy, condition_channels_disagree };

/// A virtual AksIM-2 encoder, or an AksIM-4 without registers.
class VirtualEncoder final : public author::Responder {
 public:
  /// Creates an encoder that is off. Members of `format` that are unknown get the values of `virtual_format`. `shaft`
  /// must outlive the encoder.
  VirtualEncoder(const Format& format, const Shaft& shaft);

  /// Processes an event of the port, such as received data or silence.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns what the port must do next, such as send or wait.
  Step<std::uint8_t> next(Time now) override;

  /// Switches the encoder on.
  void power_on(Time now, PowerOn kind) override;
  void set_condition(std::size_t index, std::int64_t value, Time) override { conditions_[index] = value; }
  /// Returns the memory: the 31 bytes that the command `save` stores.
  [[nodiscard]] MutableBytes memory() override { return memory_; }

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the position that a frame sent at `now`, after the start-up, would carry.
  [[nodiscard]] Position measure(Time now) const;
  /// Returns the value of the register position_offset.
  [[nodiscard]] std::uint32_t offset() const { return values_[position_offset]; }
  /// Returns the raised alarms as bits of the detailed status.
  [[nodiscard]] std::uint16_t alarms() const { return static_cast<std::uint16_t>(raised()); }

 private:
  [[nodiscard]] std::size_t request_size(Bytes) const override { return request_bytes; }
  [[nodiscard]] std::size_t others_reply_size(Bytes) const override { return 0; }
  Answer respond(Bytes request, Time at, ByteBuffer<64>& reply) override;
  void stopped(Time now) override;

  void selected(Time at);
  void stopped_clocking(const Event<std::uint8_t>& event);
  [[nodiscard]] ReplyBytes make_frame(Time now);
  [[nodiscard]] Identity identity() const;
  void handle(Bytes request, Time at);
  void reset_channels();
  [[nodiscard]] std::uint8_t next_channel2(const Position& position, Time now);
  [[nodiscard]] std::uint8_t next_channel3(Time now);

  void ra_received(std::uint8_t byte, Time at);
  void execute(Time at);
  [[nodiscard]] AccessStatus check_access(const RegisterRequest& request, const Register* found) const;
  [[nodiscard]] AccessStatus write(std::size_t index, std::uint64_t value, Time at);
  [[nodiscard]] AccessStatus execute_command(std::uint8_t command, Time at);
  [[nodiscard]] ByteBuffer<largest_register> value_of(std::size_t index, Time at) const;

  void update(Time now);
  void end_calibration(Time now);
  void load();
  void save();
  [[nodiscard]] std::int64_t offset_position(Time now) const;

  Format format_;
  const Shaft* shaft_;
  std::array<std::int64_t, conditions.size()> conditions_{};
  // Values of the numeric registers, by index in the table, and behind them the value at index `turns_taken`.
  std::array<std::uint32_t, registers.size() + 1> values_{};
  std::array<std::uint8_t, 31> memory_{};

  Time zeros_until_{};
  Time busy_until_{};
  bool save_pending_ = false;
  bool calibrating_ = false;
  Time calibrated_at_{};
  std::int64_t calibrated_from_ = 0;

  bool identity_next_ = false;
  ReplyBytes cycle_;
  ChannelCycle cycle_content_{};
  std::size_t cycle_index_ = 0;
  AccessBytes access_;
  ByteBuffer<access_capacity + 2> answer_;
  std::size_t sent_answer_bytes_ = 0;

  Time next_frame_{};  // time of the next frame of an encoder that sends without requests
  Time pause_since_{};
  bool was_selected_ = false;
};

}  // namespace absenc::encolink
