// SPDX-License-Identifier: Apache-2.0
// A virtual AksIM-2 on UART or SPI: three channels, registers, lock, busy times, and the rules that its host breaks.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/procedures.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/encolink/timing.hpp"
#include "absenc/protocol/interruption.hpp"

namespace absenc::encolink {

/// What a virtual encoder that is asked for its own format has.
inline constexpr Format virtual_format{.resolution = 20, .multiturn_bits = 16};

/// How a virtual encoder is built and where it stands.
struct Build {
  Offset offset{};
  std::uint32_t stream_rate = 0;   // frames a second that it sends by itself; 0: it answers requests
  std::int16_t temperature = 350;  // tenths of degC
  bool busy_for_ever = false;      // register accesses never end
  bool channel2_disagrees = false;
  std::uint8_t protocol_version = version::aksim2;
  std::size_t identity_size = identity_bytes;  // or padded_identity_bytes, and the frame before it too (UART)
};

class VirtualEncoder final : public Device<std::uint8_t> {
 public:
  /// Switched off until `power_on`. `shaft` must outlive the encoder. What is unknown of the format is
  /// virtual_format's.
  VirtualEncoder(const Format& format, Wire wire, const Shaft& shaft, const Build& build = {});

  void feed(const Event<std::uint8_t>& event) override;
  Step<std::uint8_t> next(Time now) override;

  void power_on(Time now, PowerOn kind) override;
  void power_off(Time now) override;
  void raise_alarms(std::uint32_t bits) override { alarms_ = static_cast<std::uint16_t>(alarms_ | bits); }
  void lower_alarms(std::uint32_t bits) override { alarms_ = static_cast<std::uint16_t>(alarms_ & ~bits); }
  /// What `save` has stored: offset, preset, lock, turns, filters, range of calibration; 31 bytes.
  [[nodiscard]] MutableBytes memory() override { return memory_; }
  [[nodiscard]] std::uint32_t memory_version() const override { return memory_version_; }
  [[nodiscard]] std::span<const Violation> violations() const override { return violations_; }
  [[nodiscard]] std::uint32_t violation_count() const override { return violation_count_; }
  [[nodiscard]] std::uint64_t answered() const override { return answered_; }

  [[nodiscard]] Build& build() { return build_; }
  [[nodiscard]] const Format& format() const { return format_; }
  /// What a frame would say now.
  [[nodiscard]] Position measure(Time now) const;
  [[nodiscard]] std::uint32_t offset() const { return settings_.offset; }
  [[nodiscard]] std::uint16_t alarms() const { return alarms_; }

 private:
  enum class Power : std::uint8_t { off, starting, on };
  struct Settings {
    std::uint32_t offset = 0;
    std::uint32_t preset = 0;
    std::uint8_t lock = 0;
    std::uint32_t turns = 0;                 // taken off those of the shaft
    std::array<std::uint32_t, 4> filters{};  // kept, without effect
    std::uint16_t calibration_range = 0;     // likewise
  };

  void byte_received(std::uint8_t byte, Time at);
  void selected(Time at);
  void stopped_clocking(const Event<std::uint8_t>& event);
  void make_frame(Time now);
  [[nodiscard]] Identity identity() const;
  void handle(std::uint8_t config, std::uint8_t ra, Time at);
  void reset_channels();
  [[nodiscard]] std::uint8_t next_channel2(const Position& position, Time now);
  [[nodiscard]] std::uint8_t next_channel3(Time now);

  void ra_received(std::uint8_t byte, Time at);
  [[nodiscard]] const Register* find(std::uint32_t address) const;
  void execute(Time at);
  void execute_read(const RegisterRequest& request, Time at);
  void execute_write(const RegisterRequest& request, Time at);
  [[nodiscard]] AccessStatus write(std::size_t index, std::uint64_t value, Time at);
  [[nodiscard]] AccessStatus obey(std::uint8_t command, Time at);
  [[nodiscard]] std::uint64_t number_of(std::size_t index, Time at) const;
  [[nodiscard]] ByteBuffer<20> value_of(std::size_t index, Time at) const;

  void update(Time now);
  void end_calibration(Time now);
  void load();
  void store();
  [[nodiscard]] std::int64_t place(Time now) const;
  void violate(std::string_view rule, Time at);

  Format format_;
  Wire wire_;
  const Shaft* shaft_;
  Build build_;
  Settings settings_{};
  std::array<std::uint8_t, 31> memory_{};
  std::uint32_t memory_version_ = 0;
  std::uint16_t alarms_ = 0;

  Power power_ = Power::off;
  Time ready_at_{};
  Time busy_until_{};
  bool save_pending_ = false;
  bool calibrating_ = false;
  Time calibrated_at_{};
  std::int64_t calibrated_from_ = 0;
  std::uint8_t calibration_status_ = 0;

  bool identity_next_ = false;
  ReplyBytes cycle_;
  Cycle cycle_content_{};
  std::size_t cycle_index_ = 0;
  AccessBytes access_;
  ByteBuffer<access_capacity + 2> answer_;
  std::size_t answered_bytes_ = 0;

  ByteBuffer<request_bytes> request_;
  ReplyBytes frame_;
  bool frame_pending_ = false;
  bool transmitting_ = false;
  Interruption interruption_;
  Time frame_at_{};
  Time next_frame_{};  // of those it sends by itself
  Time pause_since_{};
  bool was_selected_ = false;
  Buffer<Violation, 16> violations_;
  std::uint32_t violation_count_ = 0;
  std::uint64_t answered_ = 0;
};

}  // namespace absenc::encolink
