// SPDX-License-Identifier: Apache-2.0
// Procedures that access the registers of a BiSS encoder or send it commands.
#pragma once

#include <algorithm>

#include "absenc/protocol/author/memory_map.hpp"
#include "absenc/protocol/biss/control_results.hpp"
#include "absenc/protocol/biss/dialog.hpp"

namespace absenc::biss {

using author::done;
using author::only;
using author::Outcome;
using author::Part;
using author::Procedure;

/// Longest time that the document permits an encoder for the start bit of a register; the host waits twice as long.
inline constexpr Time start_limit = 20ms;
/// Greatest number of attempts of a control frame that may be repeated.
inline constexpr unsigned control_attempts = 4;

/// Detail of the error of a control frame that no encoder answers.
inline constexpr std::string_view no_registers =
    "no encoder answers: it has no registers (or a line that only goes one way), or another ID (slave)";
/// Detail of an error that means that the encoder refused the access to a register.
inline constexpr std::string_view refused =
    "the encoder refuses this register: it does not have it, or it is read only";

/// Exchanges the control frame that `master` has begun, and returns its error.
template <class F>
Part<Error> run_control_frame(ControlDialog<F>& dialog, ControlMaster& master) {
  Time waits_since{};
  while (!master.is_over()) {
    const Result<typename ControlDialog<F>::Reply> reply = co_await dialog.frame();
    if (!reply) {
      dialog.set_cdm(false);
      master.fail(reply.error());
      break;
    }
    const bool waited = master.is_waiting();
    dialog.set_cdm(master.next(reply->cds));
    if (!waited) waits_since = dialog.now();
    if (master.is_waiting() && dialog.now() - waits_since > 2 * start_limit) {
      dialog.set_cdm(false);
      master.fail(Error::busy);
    }
  }
  co_return master.error();
}

/// Returns detail and advice for the error of a control frame.
[[nodiscard]] constexpr Outcome failure_of(Error error) {
  if (error == Error::timeout) return only(error, no_registers, "read positions without them, or say slave=N");
  if (error == Error::request_rejected) return only(error, refused);
  if (error == Error::busy) return only(error, "the encoder does not begin to answer within 40 ms");
  return {.error = error, .detail = "the registers were not read"};
}

/// Returns whether repeating a control frame with this error may help.
[[nodiscard]] constexpr bool is_repeatable(Error error) {
  return error != Error::request_rejected && error != Error::busy && error != Error::invalid_argument;
}

/// Returns whether a data byte of the control frame arrived late, because the encoder delayed it or because its start
/// bit was lost.
[[nodiscard]] constexpr bool was_late(const ControlFrame& frame) {
  const auto delays = frame.start_delay.view();
  return std::any_of(delays.begin(), delays.end(), [](std::uint16_t delay) { return delay != 0; });
}

/// Reads `count` registers, 64 at most, appends their values to `bytes` and returns the error.
template <class F>
Part<Error> read_registers(ControlDialog<F>& dialog, ControlMaster& master, ByteBuffer<control_most>& bytes,
                           unsigned first, std::size_t count) {
  Error error = Error::none;
  const unsigned slave = dialog.format().slave;
  ByteBuffer<control_most> before;
  for (unsigned attempts = control_attempts; attempts > 0; --attempts) {
    master.read(slave, first, count);
    error = co_await run_control_frame(dialog, master);
    const Bytes data = master.frame().data;
    const bool stopped = error == Error::request_rejected && !data.empty();
    if (!stopped && !is_repeatable(error)) break;
    if (!stopped && error != Error::none) continue;
    const bool confirmed = std::equal(data.begin(), data.end(), before.view().begin(), before.view().end());
    if (!confirmed && was_late(master.frame())) {
      before = master.frame().data;
      error = Error::cross_check_failed;
      continue;
    }
    bytes.append(data);
    if (!stopped) co_return Error::none;
    first += static_cast<unsigned>(data.size());
    count -= data.size();
    attempts = control_attempts + 1;  // for the remaining registers the attempts are counted anew
    before = {};
  }
  co_return error;
}

/// Writes a register and reads it back; the value read back decides whether the write failed. A refused write is not
/// read back.
template <class F>
Part<Error> write_register(ControlDialog<F>& dialog, ControlMaster& master, unsigned address, std::uint8_t value) {
  const std::array<std::uint8_t, 1> bytes{value};
  master.write(dialog.format().slave, address, bytes);
  const Error error = co_await run_control_frame(dialog, master);
  if (error == Error::request_rejected) co_return error;
  ByteBuffer<control_most> now;
  const Error read = co_await read_registers(dialog, master, now, address, 1);
  if (read != Error::none) co_return error != Error::none ? error : read;
  if (now[0] == value) co_return Error::none;
  co_return error != Error::none ? error : Error::cross_check_failed;
}

/// Writes a register, and records whether the encoder may have changed.
template <class F>
Part<Error> change_register(ControlDialog<F>& dialog, ControlMaster& master, unsigned address, std::uint8_t value) {
  dialog.changes();
  const Error error = co_await write_register(dialog, master, address, value);
  if (error == Error::request_rejected) dialog.refused();
  co_return error;
}

/// Selects `bank`, unless `address` belongs to no bank, and returns the error.
template <class F>
Part<Error> select_bank(ControlDialog<F>& dialog, ControlMaster& master, unsigned bank, unsigned address) {
  if (address >= registers::bank_size) co_return Error::none;
  ByteBuffer<control_most> selected;
  const Error error = co_await read_registers(dialog, master, selected, registers::bank_select, 1);
  // An encoder with a single bank may lack a bank select register.
  if (error == Error::request_rejected && bank == 0) co_return Error::none;
  if (error != Error::none || selected[0] == bank) co_return error;
  const Error written =
      co_await write_register(dialog, master, registers::bank_select, static_cast<std::uint8_t>(bank));
  co_return written;
}

/// Reads registers. Arguments: address, bank, count.
template <class F>
Procedure read_memory(ControlDialog<F>& dialog, ControlResults& found, Arguments arguments) {
  const auto address = static_cast<unsigned>(arguments[0]);
  const auto bank = static_cast<unsigned>(arguments[1]);
  const auto count = static_cast<unsigned>(arguments[2]);
  const unsigned limit = address < registers::bank_size ? registers::bank_size : registers::end;
  if (address + count > limit) {
    co_return only(Error::invalid_argument, "a bank ends at address 63, the registers after it at 127");
  }
  if (address >= registers::bank_size && bank != 0) {
    co_return only(Error::invalid_argument, "registers outside the banks are on bank 0");
  }
  ControlMaster master;
  Error error = co_await select_bank(dialog, master, bank, address);
  if (error == Error::none) error = co_await read_registers(dialog, master, found.bytes, address, count);
  if (error != Error::none) co_return failure_of(error);
  found.slave_id = dialog.format().slave;
  found.bank = static_cast<std::uint8_t>(bank);
  found.address = static_cast<std::uint8_t>(address);
  found.value = found.bytes[0];
  found.has_data = count > 1;
  co_return done;
}

/// Writes a register; without force only if its value differs. Arguments: address, value, bank, force.
template <class F>
Procedure write_memory(ControlDialog<F>& dialog, ControlResults& found, Arguments arguments) {
  const auto address = static_cast<unsigned>(arguments[0]);
  const auto value = static_cast<std::uint8_t>(arguments[1]);
  const auto bank = static_cast<unsigned>(arguments[2]);
  const bool force = arguments[3] != 0;
  const MemoryArea* const area = author::find_area(registers::areas, bank, address);
  if (address >= registers::bank_size && bank != 0) {
    co_return only(Error::invalid_argument, "registers outside the banks are on bank 0");
  }
  if (area != nullptr && !area->writable) co_return only(Error::invalid_argument, "this register is read only");
  if (!force && (area == nullptr || !area->protection.empty())) {
    co_return only(Error::invalid_argument, "this register is defined by the maker: force=1 writes it");
  }
  ControlMaster master;
  Error error = co_await select_bank(dialog, master, bank, address);
  if (error != Error::none) co_return failure_of(error);
  ByteBuffer<control_most> before;
  error = co_await read_registers(dialog, master, before, address, 1);
  if (error != Error::none) co_return failure_of(error);
  found.written = before[0] != value || force;
  if (*found.written) error = co_await change_register(dialog, master, address, value);
  if (error == Error::cross_check_failed) {
    co_return only(error, "reading back gave another value: the write has failed");
  }
  if (error != Error::none) co_return failure_of(error);
  found.slave_id = dialog.format().slave;
  found.bank = static_cast<std::uint8_t>(bank);
  found.address = static_cast<std::uint8_t>(address);
  found.value = value;
  co_return done;
}

/// Reads the named register at `address`. If the encoder refuses that, the procedure succeeds with the result
/// `missing`.
template <class F>
Procedure read_setting(ControlDialog<F>& dialog, ControlResults& found, unsigned address) {
  ControlMaster master;
  ByteBuffer<control_most> bytes;
  const Error error = co_await read_registers(dialog, master, bytes, address, registers::size_of(address));
  if (error != Error::none && error != Error::request_rejected) co_return failure_of(error);
  found.slave_id = dialog.format().slave;
  if (error == Error::none) {
    store_register(found, dialog.format().register_order, address, bytes);
  } else {
    found.missing = true;
  }
  co_return done;
}

/// Selects the bank that is the first argument.
template <class F>
Procedure write_bank(ControlDialog<F>& dialog, ControlResults& found, Arguments arguments) {
  ControlMaster master;
  const auto bank = static_cast<std::uint8_t>(arguments[0]);
  const Error error = co_await change_register(dialog, master, registers::bank_select, bank);
  if (error == Error::cross_check_failed) co_return only(error, "another bank is still selected");
  if (error != Error::none) co_return failure_of(error);
  found.slave_id = dialog.format().slave;
  found.bank = bank;
  co_return done;
}

/// Reads the two groups of registers that identify the encoder; one of them may be refused.
template <class F>
Procedure read_info(ControlDialog<F>& dialog, ControlResults& found) {
  ControlMaster master;
  ByteBuffer<control_most> sheet;
  Error error =
      co_await read_registers(dialog, master, sheet, registers::eds_bank, registers::device - registers::eds_bank);
  if (error != Error::none && error != Error::request_rejected) co_return failure_of(error);
  found.slave_id = dialog.format().slave;
  found.slaves = master.frame().slaves;
  found.more_slaves = master.frame().more_slaves;
  const RegisterOrder order = dialog.format().register_order;
  if (error == Error::none) {
    for (const unsigned address : {registers::eds_bank, registers::profile, registers::serial_number}) {
      store_register(found, order, address,
                     sheet.view().subspan(address - registers::eds_bank, registers::size_of(address)));
    }
  }
  ByteBuffer<control_most> names;
  error = co_await read_registers(dialog, master, names, registers::device_id, registers::end - registers::device_id);
  if (error != Error::none && error != Error::request_rejected) co_return failure_of(error);
  if (error == Error::request_rejected && !found.eds_bank) {
    co_return only(error, "the encoder has none of the registers that identify it");
  }
  if (error == Error::none) {
    for (const unsigned address : {registers::device_id, registers::manufacturer}) {
      store_register(found, order, address,
                     names.view().subspan(address - registers::device_id, registers::size_of(address)));
    }
  }
  co_return done;
}

/// Sends a command to the slaves of a mask; 0: to all slaves. Then reads one more frame, because slaves take the last
/// CDM bit only when the next frame begins.
template <class F>
Procedure send_command(ControlDialog<F>& dialog, ControlResults& found, Arguments arguments) {
  ControlMaster master;
  dialog.accept_empty_frames();
  master.command(static_cast<std::uint8_t>(arguments[0]), static_cast<unsigned>(arguments[1]));
  dialog.changes();
  const Error error = co_await run_control_frame(dialog, master);
  const Result<typename ControlDialog<F>::Reply> last = co_await dialog.frame();
  if (error == Error::request_rejected) dialog.refused();
  if (error == Error::request_rejected) co_return only(error, "not every encoder acknowledged: nothing was executed");
  if (error != Error::none) co_return failure_of(error);
  if (!last) co_return only(last.error(), "it is unknown whether the encoders executed the command");
  found = results_of(master.frame(), true);
  co_return done;
}

}  // namespace absenc::biss
