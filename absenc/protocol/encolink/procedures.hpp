// SPDX-License-Identifier: Apache-2.0
// The procedures of EncoLink, and what is told of what they find. Positions go on meanwhile; most hand each out.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/protocol/encolink/line.hpp"
#include "absenc/protocol/field.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

/// What a procedure finds beside the position.
struct Nothing {};
struct FoundAlarms {};  // they are the line's
struct FoundRegister {
  std::optional<std::uint32_t> address{};  // its bytes are the line's
};
struct FoundZero {
  std::optional<std::uint32_t> offset{};
};
struct FoundCalibration {
  std::uint8_t status = 0;
  bool running = false;
};
struct FoundIdentity {
  Identity identity{};
  ByteBuffer<80> data{};  // of the registers that are in_info, one after the other
  std::array<bool, registers.size()> has{};
};

/// A cycle of channel 2, checked against channel 1.
author::Procedure read_alarms(Line& line, FoundAlarms& found);
author::Procedure read_identity(Line& line, FoundIdentity& found);
/// The identity and every register of the table that is in_info. One that the encoder does not have is left out.
author::Procedure read_info(Line& line, FoundIdentity& found);

/// Errors of these: request_rejected (the detail has the encoder's words), busy, timeout, cross_check_failed (channel 2
/// disagrees with channel 1), unsupported (no channel 2, or other registers), or that of a frame.
author::Procedure read_register(Line& line, FoundRegister& found, std::size_t index);
/// Arguments: address, length (0: as the table says). Error also: invalid_argument (a length is needed).
author::Procedure read_memory(Line& line, FoundRegister& found, Arguments arguments);

/// Errors of these also: cross_check_failed (another value is there now).
author::Procedure write_register(Line& line, FoundRegister& found, std::size_t index, Arguments arguments);
/// Arguments: address, value, size (0: as the table says). The command register cannot be read back: `save` and others
/// write it.
author::Procedure write_memory(Line& line, FoundRegister& found, Arguments arguments);
/// Writes a command: only its status tells whether it was executed, so it is not repeated.
author::Procedure send_command(Line& line, Nothing& found, std::uint8_t command);

/// Makes this position the zero of the turn, by the position offset. Argument: 1: saved. Errors also: invalid_argument
/// (the shaft turns, or the position is not valid), cross_check_failed (it is not zero afterwards; the old offset is
/// back).
author::Procedure zero(Line& line, FoundZero& found, Arguments arguments);
/// Sets the turn counter. Arguments: turns, 1: saved. Error also: unsupported (the encoder has none).
author::Procedure preset_multiturn(Line& line, Nothing& found, Arguments arguments);
/// Starts the self-calibration and watches it while the shaft is turned; emits whenever its status was read. Errors
/// also: cross_check_failed (it failed; the detail says how), timeout (it does not end).
author::Procedure self_calibrate(Line& line, FoundCalibration& found);

void put(FieldSink& sink, const Stream& stream);
void put(FieldSink& sink, const Line& line, const Nothing& found);
void put(FieldSink& sink, const Line& line, const FoundAlarms& found);
void put(FieldSink& sink, const Line& line, const FoundRegister& found);
void put(FieldSink& sink, const Line& line, const FoundZero& found);
void put(FieldSink& sink, const Line& line, const FoundCalibration& found);
void put(FieldSink& sink, const Line& line, const FoundIdentity& found);

/// What the last frame says of the error.
[[nodiscard]] Explanation explain(const Stream& stream);

/// How many bytes an access has: `wanted`, or where that is 0 what the table says; 0: nobody knows.
[[nodiscard]] std::uint16_t size_of(std::uint32_t address, std::int64_t wanted);

}  // namespace absenc::encolink
