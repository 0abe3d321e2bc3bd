// SPDX-License-Identifier: Apache-2.0
// An FTDI chip (FT232H, FT2232H, FT4232H) as a clock for encoders: BiSS, SSI, EnDat, SPI in modes 0 and 2.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absenc/os/ftdi_usb.hpp"
#include "absenc/os/mpsse.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/spi_choice.hpp"
#include "absenc/os/transfer_port.hpp"

namespace absenc::os {

/// Greatest clock rate of a bidirectional line (EnDat), in Hz. Data of the encoder are sampled one period after the
/// edge at which it changes them; EnDat encoders need up to 0.2 us for that, and a cable of 25 m both ways 0.25 us.
inline constexpr std::uint32_t highest_turning_rate = 2'000'000;

/// A port on a channel of an FTDI chip, which is closed to other programs. A transfer is one USB transfer each way. On
/// a clocked line the chip samples a bit at the falling edge, half a period after the encoder has changed it, because
/// an MPSSE samples at the first edge of its pulses (AN 114). Without idle clocks (BiSS) a transfer has up to seven
/// additional clocks.
class FtdiPort final : public TransferPort {
 public:
  /// Opens the channel at `place`, "SERIAL/B". The clock is the nearest that the chip's divider makes. Throws Failure.
  FtdiPort(const std::string& place, LinkKind kind, const LineSettings& settings, const SpiChoice& choice = {},
           FtdiUsb& usb = system_ftdi());
  ~FtdiPort() override = default;

  /// Returns the settings that the chip uses, with its clock rate.
  [[nodiscard]] const LineSettings& settings() const { return settings_; }
  /// Returns the adapter in words, as "FT232H (serial number FT1ABC)".
  [[nodiscard]] const std::string& name() const { return name_; }

  /// State of the data pin while the clock rests.
  struct DataPin {
    bool high = false;    // whether the pin rests high
    bool driven = false;  // whether a transceiver drives the pin: it does not keep the level that the chip left there
  };
  /// Looks whether something drives the data pin: the chip pulls the pin to the other level for less than a
  /// microsecond, releases it and reads it. Without a transceiver the pin keeps that level for longer than the chip
  /// needs to read.
  [[nodiscard]] DataPin look_at_data();

 private:
  void exchange(const Step<std::uint8_t>& step, TransferResult& received) override;
  [[nodiscard]] DataPin look_once();
  [[nodiscard]] std::uint32_t set_rate() const override { return settings_.rate; }
  void change_rate(std::uint32_t rate) override;

  void clock_in(const Step<std::uint8_t>& step, TransferResult& received);
  void turn(const Step<std::uint8_t>& step, TransferResult& received);
  void exchange_bytes(const Step<std::uint8_t>& step, TransferResult& received);
  void hold_low(Time until);

  void synchronise();
  void apply(LineSettings settings);
  /// Sends `commands_` and reads the replies into `replies_`. `clocks`: number of clocks that they take.
  void send(std::size_t clocks, TransferResult* received = nullptr);
  [[nodiscard]] std::uint8_t rest() const;
  void pause(Time least, std::uint8_t levels);

  std::string name_;
  SpiChoice choice_;
  std::uint32_t base_;  // base clock of the chip in Hz
  std::unique_ptr<FtdiChannel> channel_;
  LineSettings settings_{};
  std::uint16_t divisor_ = 0;
  std::optional<std::uint16_t> sent_divisor_{};  // the divisor that the chip has; nothing: not known
  MpsseCommands commands_;
  std::vector<std::uint8_t> replies_;
  Time end_ = os::now();    // time at which the last transfer was known to have ended
  bool rests_low_ = false;  // whether the clock rests low, because the exchange goes on
};

}  // namespace absenc::os
