// SPDX-License-Identifier: Apache-2.0
// The procedures of EncoLink. Positions go on meanwhile; most hand each out.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::encolink {

using Dialog = author::DialogOf<Frames>;

/// How a register access ended.
enum class Fate : std::uint8_t {
  good,     // the encoder executed it
  refused,  // it did not
  lost,     // frames come, but not the answer: it may have been executed
  gone,     // not even frames come; `was_asked` tells whether it may have been executed
};

/// What a procedure knows of its encoder, and what it tells of it: the position, if nothing else.
struct Found : Channels {
  struct Value {
    std::size_t index;  // of the register
    ByteBuffer<largest_register> bytes;
  };
  std::optional<Identity> identity{};      // told in place of the position, with the values
  std::optional<std::uint32_t> address{};  // told in place of the position: of the register whose bytes are `data`
  Buffer<Value, 8> values{};               // of registers of the table
  std::optional<bool> running{};           // a self-calibration
  bool tells_status = false;

  bool emits = false;                  // each position is handed out
  bool is_new = false;                 // the position was not yet
  std::uint8_t protocol_version = 0;   // 0: not asked yet
  unsigned lost = 0;                   // frames in a row
  AccessBytes access{};                // the register access under way
  bool writes = false;                 // it does
  bool was_asked = false;              // all of it went out: the encoder may have executed it
  bool changed = false;                // a register was written, and read back
  std::uint16_t length = 0;            // bytes it reads
  ByteBuffer<access_capacity> data{};  // that it has read
  author::Outcome why{};               // it did not go well
  bool again = false;                  // asking once more can help, and does no harm

  void begin(const RegisterRequest& request) {
    access = encode_access(request);
    writes = request.operation == RegisterRequest::Operation::write;
    length = request.length;
  }
  Fate end(Fate fate, const author::Outcome& outcome, bool can_help = false) {
    why = outcome;
    again = can_help;
    return fate;
  }
  void tell(std::size_t index, Bytes bytes) {
    values.push_back({index, {}});
    values[values.size() - 1].bytes.append(bytes);
  }
};

/// One access while positions go on. Ends the procedure where the encoder has no registers, or others.
author::Part<Fate> attempt_read(Dialog& dialog, Found& found, std::uint32_t address, std::uint16_t size);
author::Part<Fate> attempt_write(Dialog& dialog, Found& found, std::uint32_t address, std::uint16_t size,
                                 std::uint64_t value);

/// A cycle of channel 2, checked against channel 1.
author::Procedure read_alarms(Dialog& dialog, Found& found);
author::Procedure read_identity(Dialog& dialog, Found& found);
/// The identity and every register of the table that is in_info. One that the encoder does not have is left out.
author::Procedure read_info(Dialog& dialog, Found& found);

/// Errors of these: request_rejected (the detail has the encoder's words), busy, timeout, cross_check_failed (channel 2
/// disagrees with channel 1), unsupported (no channel 2, or other registers), or that of a frame.
author::Procedure read_register(Dialog& dialog, Found& found, std::size_t index);
/// Arguments: address, length (0: as the table says). Error also: invalid_argument (a length is needed).
author::Procedure read_memory(Dialog& dialog, Found& found, Arguments arguments);

/// Errors of these also: cross_check_failed (another value is there now).
author::Procedure write_register(Dialog& dialog, Found& found, std::size_t index, Arguments arguments);
/// Arguments: address, value, size (0: as the table says). The command register cannot be read back: `save` and others
/// write it.
author::Procedure write_memory(Dialog& dialog, Found& found, Arguments arguments);
/// Writes a command: only its status tells whether it was executed, so it is not repeated.
author::Procedure send_command(Dialog& dialog, Found& found, std::uint8_t command);

/// Makes this position the zero of the turn, by the position offset. Argument: 1: saved. Errors also: invalid_argument
/// (the shaft turns, or the position is not valid), cross_check_failed (it is not zero afterwards; the old offset is
/// back).
author::Procedure zero(Dialog& dialog, Found& found, Arguments arguments);
/// Sets the turn counter. Arguments: turns, 1: saved. Error also: unsupported (the encoder has none).
author::Procedure preset_multiturn(Dialog& dialog, Found& found, Arguments arguments);
/// Starts the self-calibration and watches it while the shaft is turned; emits whenever its status was read. Errors
/// also: cross_check_failed (it failed; the detail says how), timeout (it does not end).
author::Procedure self_calibrate(Dialog& dialog, Found& found);

/// How many bytes an access has: `wanted`, or where that is 0 what the table says; 0: nobody knows.
[[nodiscard]] std::uint16_t size_of(std::uint32_t address, std::int64_t wanted);

}  // namespace absenc::encolink
