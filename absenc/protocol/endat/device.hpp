// SPDX-License-Identifier: Apache-2.0
// A virtual EnDat encoder with its memory, additional information, datum shift and checks of the host.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/bit_device.hpp"
#include "absenc/protocol/endat/protocol.hpp"

namespace absenc::endat {

/// Conditions of the virtual encoder's environment that users can set.
inline constexpr auto conditions = std::array{
    Condition{"temperature", "degC", "inside the encoder", -40, 125, 30},
};

/// Rules for hosts that the virtual encoder checks.
namespace rules {
/// Pause that the encoder needs after an exchange.
inline constexpr std::string_view recovery = "clocked before the recovery time has passed";
/// Highest rate of the clock.
inline constexpr std::string_view fastest = "clock faster than the encoder's version allows";
/// Lowest rate of the clock.
inline constexpr std::string_view slowest = "clock slower than 100 kHz";
/// Highest rate of the clock for parameters.
inline constexpr std::string_view parameter_clock = "parameters clocked faster than 2 MHz";
/// Clocks that a reply needs.
inline constexpr std::string_view few_clocks = "fewer clocks than the reply has bits";
/// Parameters only after the reply.
inline constexpr std::string_view collision = "the host drives parameters while the encoder drives its reply";
/// Supplement only after the reply.
inline constexpr std::string_view early_supplement = "the host drives a supplement while the encoder drives its reply";
/// Memory only while it is not busy.
inline constexpr std::string_view busy = "the memory accessed while BUSY is set";
}  // namespace rules

/// Times of the virtual encoder: within the limits of the sources, which state no others.
struct EncoderTimes {
  Time latency = 4us;         ///< Time from the first falling edge until the position is calculated.
  Time read_time = 200us;     ///< Duration of a read access to the memory.
  Time write_time = 900us;    ///< Duration of a write access to the memory.
  Time long_recovery = 20us;  ///< Recovery time after commands of EnDat 2.1.
  Time short_recovery = 3us;  ///< Short recovery time after commands of EnDat 2.2.
  Time reset_time = 30ms;     ///< Duration of a reset.
};

/// A virtual EnDat encoder.
class VirtualEncoder final : public author::BitDevice {
 public:
  /// Constructs an encoder with the properties of `format`; it is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Format& format, const Shaft& shaft) : VirtualEncoder(format, shaft, times_for(format)) {}
  /// Constructs an encoder with the times of `times`; it is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Format& format, const Shaft& shaft, const EncoderTimes& times);

  [[nodiscard]] MutableBytes memory() override { return memory_; }
  /// Raises the alarms `bits`. They end when a host clears them, or with a reset.
  void raise_alarms(std::uint32_t bits) override { latched_ |= bits; }
  /// Ends the alarms `bits`.
  void lower_alarms(std::uint32_t bits) override { latched_ &= ~bits; }
  void set_condition(std::size_t, std::int64_t value, Time) override { temperature_ = value; }

 private:
  // An access of EnDat 2.2 to the memory, which runs in the background.
  struct Access {
    std::uint8_t address = 0;
    std::uint16_t word = 0;
    Time ready_at{};
  };

  static EncoderTimes times_for(const Format& format);

  void selected(Time at, Time period) override;
  [[nodiscard]] std::size_t request_size(BitView begin) const override;
  void respond(BitView request, Time at, AnswerBits& bits) override;
  void supplemented(BitView bits, Time at) override;
  void clocked(Time at, std::size_t clocks) override;
  void started(Time at) override;

  void respond_position(ModeCommand code, AnswerBits& bits);
  void respond_parameters(const Request& request, Time at, AnswerBits& bits);
  void drive(std::size_t zeros, ModeCommand code, const Reply& reply, AnswerBits& bits);
  void execute(const Request& request, Time at);
  void select(std::uint8_t mrs);
  [[nodiscard]] Info info(std::uint8_t mrs) const;
  [[nodiscard]] std::uint16_t content(std::uint8_t mrs) const;
  [[nodiscard]] std::uint64_t position(Time at) const;
  [[nodiscard]] std::int64_t raw_counts(Time at) const;
  [[nodiscard]] std::int64_t counts_of_period() const;
  [[nodiscard]] std::uint16_t errors() const;
  [[nodiscard]] std::uint16_t warnings() const;
  [[nodiscard]] static std::size_t place(WordPlace word);
  [[nodiscard]] std::uint16_t load(WordPlace word) const;
  void store(WordPlace word, std::uint16_t value);
  [[nodiscard]] bool write(WordPlace word, std::uint16_t value);
  void write_parameters();

  Format format_;
  const Shaft* shaft_;
  EncoderTimes times_;
  std::array<std::uint8_t, 2 * word_count> memory_{};
  std::int64_t temperature_ = conditions[0].normal;
  std::uint32_t latched_ = 0;  // alarms that were raised and not cleared since
  std::int32_t shift_ = 0;     // datum shift that holds since the last start
  std::uint8_t area_ = 0;      // MRS code of the selected memory area; 0: none
  std::uint8_t port_ = 0;      // port of the last test command
  std::uint8_t info1_ = 0;     // MRS code of additional information 1; 0: it is not sent
  std::uint8_t info2_ = 0;
  Access access_{};
  // The present exchange
  Request request_{};
  bool is_valid_ = false;          // the encoder has decoded the request
  std::size_t needed_clocks_ = 0;  // clocks of the exchange up to the end of the position or the parameters
  Time latched_at_{};
  Time period_{};
  std::uint64_t position_ = 0;
  Time now_{};
  Time free_at_{};  // earliest time of the next exchange: the recovery time after the last rising edge
};

}  // namespace absenc::endat
