// SPDX-License-Identifier: Apache-2.0
// Host side of EncoLink: the conversations with registers. Positions go on meanwhile; each is emitted.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/encolink/host.hpp"

namespace absenc::encolink {

/// Errors: request_rejected (the detail has the encoder's words), busy, timeout, cross_check_failed (channel 2
/// disagrees with channel 1), unsupported (no channel 2), or that of a frame.
class ReadRegister final : public Stream {
 public:
  /// `length`: 1 to 100; 0: as the table says. Error: invalid_argument (a length is needed).
  ReadRegister(const Format& format, Wire wire, std::uint32_t address, std::uint16_t length = 0);
  [[nodiscard]] Bytes data() const { return access().data(); }
  void report(FieldSink& sink) const override;
};

/// Writes a value, reads it back and compares; a write whose answer is lost is repeated only if reading back shows that
/// it was not executed.
class RegisterWriter : public Stream {
 protected:
  RegisterWriter(const Format& format, Wire wire);
  ~RegisterWriter() = default;

  /// `size`: 1 to 8 bytes.
  void write(std::uint32_t address, std::uint16_t size, std::uint64_t value);
  /// Only its status tells whether it was executed: it is not repeated.
  void send_command(std::uint8_t command);
  void read(const Register& one);
  [[nodiscard]] std::uint64_t value_read() const;

  /// The value is in the register.
  virtual void on_written() { finish(); }
  virtual void on_command() { finish(); }
  virtual void on_read() { finish(); }

 private:
  enum class Phase : std::uint8_t { read, write, read_back, command };
  void on_access(Error error, std::string_view detail) final;
  void on_failure(Error error, std::string_view detail) final;
  void compare();

  Phase phase_ = Phase::read;
  unsigned writes_left_ = 0;
  RegisterRequest request_{};
};

/// Errors: as RegisterWriter; cross_check_failed (another value is there now).
class WriteRegister final : public RegisterWriter {
 public:
  /// `size`: 1 to 8; 0: as the table says. The command register cannot be read back: `save` and others write it.
  WriteRegister(const Format& format, Wire wire, std::uint32_t address, std::uint16_t size, std::uint64_t value);
  void report(FieldSink& sink) const override;

 private:
  std::uint32_t address_;
  std::uint16_t size_;
};

/// Whether the position offset is added to what the sensor measures or taken off. The register map does not say.
enum class OffsetSign : std::uint8_t { add, subtract };
/// What the position offset counts. The map does not say it either; the vendor's example shows FFFFFFFF refused.
enum class OffsetUnit : std::uint8_t { counts, turn_fraction };

struct Offset {
  OffsetSign sign = OffsetSign::add;
  OffsetUnit unit = OffsetUnit::counts;

  /// The largest value, of an encoder with this resolution.
  [[nodiscard]] constexpr std::uint32_t largest(unsigned resolution) const {
    return static_cast<std::uint32_t>(low_mask(unit == OffsetUnit::counts ? resolution : 32));
  }
  /// The offset that takes `singleturn` off what the encoder shows with `offset`.
  [[nodiscard]] constexpr std::uint32_t moved(unsigned resolution, std::uint32_t offset,
                                              std::uint32_t singleturn) const {
    const std::uint32_t here = unit == OffsetUnit::counts ? singleturn : singleturn << (32 - resolution);
    return (sign == OffsetSign::add ? offset - here : offset + here) & largest(resolution);
  }
  /// Of a turn, in 2^-32.
  [[nodiscard]] constexpr std::uint32_t fraction(unsigned resolution, std::uint32_t offset) const {
    return unit == OffsetUnit::counts ? offset << (32 - resolution) : offset;
  }
};

enum class Keep : std::uint8_t {
  until_power_off,
  forever,  // save: the flash wears
};

/// Makes this position the zero of the turn, by the position offset. Errors: invalid_argument (the shaft turns, or the
/// position is not valid), cross_check_failed (it is not zero afterwards; the old offset is back), as RegisterWriter.
class Zero final : public RegisterWriter {
 public:
  Zero(const Format& format, Wire wire, const Offset& offset = {}, Keep keep = Keep::forever);
  void report(FieldSink& sink) const override;

 private:
  void on_frame() override;
  void on_read() override;
  void on_written() override;
  void on_command() override;
  [[nodiscard]] bool is_near(std::uint32_t singleturn) const;

  Offset unit_;
  Keep keep_;
  bool begun_ = false;
  bool restoring_ = false;
  std::uint32_t first_position_ = 0;
  std::uint32_t old_offset_ = 0;
  std::uint32_t offset_ = 0;
};

/// Sets the turn counter. Errors: unsupported (the encoder has none), cross_check_failed, as RegisterWriter.
class PresetMultiturn final : public RegisterWriter {
 public:
  PresetMultiturn(const Format& format, Wire wire, std::uint16_t turns = 0, Keep keep = Keep::forever);
  void report(FieldSink& sink) const override;

 private:
  void begin();
  void on_identity(const Identity&) override { begin(); }
  void on_written() override;

  std::uint16_t turns_;
  Keep keep_;
};

/// Save (into the flash) or reset (to the values at shipping, until power off unless saved).
class SendCommand final : public RegisterWriter {
 public:
  SendCommand(const Format& format, Wire wire, std::uint8_t command);
  void report(FieldSink& sink) const override;
};

/// Starts the self-calibration and watches it while the shaft is turned; emits whenever its status was read. Errors:
/// cross_check_failed (it failed; the detail says how), timeout (it does not end), as RegisterWriter.
class SelfCalibrate final : public RegisterWriter {
 public:
  SelfCalibrate(const Format& format, Wire wire);
  void report(FieldSink& sink) const override;

 private:
  void on_frame() override;
  void on_read() override;
  void on_command() override;

  bool running_ = false;
  std::uint8_t before_ = 0;
  std::uint8_t status_ = 0;
  Time started_{};
  Time next_look_{};
};

/// The identity and every register of the table that is in_info. A register that the encoder does not have is left out.
class ReadInfo final : public Stream {
 public:
  ReadInfo(const Format& format, Wire wire);
  void report(FieldSink& sink) const override;

 private:
  void on_identity(const Identity& identity) override;
  void on_frame() override;
  void on_access(Error error, std::string_view detail) override;
  void ask_from(std::size_t index);

  Identity identity_{};
  bool only_identity_ = false;
  std::size_t index_ = 0;
  ByteBuffer<80> data_;
  std::array<bool, registers.size()> has_{};
};

}  // namespace absenc::encolink
