// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/procedures.hpp"

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

using author::done;
using author::Outcome;
using author::Part;
using author::Procedure;

namespace {

constexpr unsigned frame_attempts = 3;
constexpr unsigned cycle_attempts = 3;
// Greatest number of attempts of a register access. It is larger than that of a frame, because one access takes many
// valid frames.
constexpr unsigned access_attempts = 5;
constexpr unsigned write_attempts = 3;
// Greatest number of cycles of channel 2 in which channel 3 may be idle between the last byte of a register access and
// the encoder's answer.
constexpr unsigned idle_cycles_allowed = 8;

constexpr std::string_view channel2_damaged = "channel 2 is damaged: positions go on, but registers cannot be reached";
constexpr std::string_view no_channel2 = "without channel 2 (has_ch2=false) there is neither status nor register";
constexpr std::string_view busy_too_long =
    "the register access was answered with busy for more than 2 s: positions go on";
constexpr std::string_view size_needed = "this address is not in the table of registers: say how many bytes it has";

// ---- Frames

// Requests one frame and returns its error. After an invalid frame the host no longer knows which byte of its cycle the
// next channel 2 byte is.
Part<Error> ask_frame(Dialog& dialog, ProcedureState& found, Frames::Request request) {
  if (found.emits && found.is_new) dialog.emit();
  found.is_new = false;
  found.ended.reset();
  const Result<Position> position = co_await dialog.attempt(request).after(Frames::pause(dialog.format()));
  if (!position) {
    found.in_step = false;
    ++found.lost;
    co_return position.error();
  }
  if (request.ask != Ask::identify) found.lost = 0;
  if (request.ask != Ask::position && request.ask != Ask::reset) co_return Error::none;
  found.take(dialog);
  found.is_new = true;
  co_return Error::none;
}

bool is_lost(const Dialog& dialog, const ProcedureState& found) {
  return found.lost >= frame_attempts || dialog.is_noisy();
}

Outcome stopped(const ProcedureState& found, Error error) {
  const bool in_access = error == Error::timeout && !found.access.empty();
  return {error, in_access ? "the encoder stopped answering during a register access" : std::string_view{}};
}

// Reads the identity. If `trusted`, its resolution and turns replace those of the options; otherwise they must agree.
Part<Identity> identify(Dialog& dialog, ProcedureState& found, bool trusted) {
  for (;;) {
    Error error = co_await ask_frame(dialog, found, {Ask::identify});
    if (error == Error::none) error = co_await ask_frame(dialog, found, {Ask::identity});
    if (error == Error::none) break;
    if (is_lost(dialog, found)) co_await dialog.stop(stopped(found, error));
  }
  found.in_step = false;
  const Identity identity = *decode_identity(dialog.reply());
  const Result<Format> known = trusted ? as_identified(dialog.format(), identity) : complete(dialog.format(), identity);
  if (!known) co_await dialog.stop({known.error()});
  dialog.set_format(*known);
  found.protocol_version = identity.protocol_version;
  co_return identity;
}

// Reads the next valid frame. If the host does not know where cycles of channel 2 begin, the request is `ask`,
// otherwise a position request.
Part<bool> next_frame(Dialog& dialog, ProcedureState& found, Ask ask = Ask::position) {
  if (!dialog.format().known()) co_await identify(dialog, found, false);
  for (;;) {
    const Error error = co_await ask_frame(dialog, found, {found.in_step ? Ask::position : ask});
    if (error == Error::none) co_return true;
    if (is_lost(dialog, found)) co_await dialog.stop({error});
  }
}

// ---- Register accesses

// Returns `error`, the error of the last frame; if that is none, the error of the cycle that the frame completed.
Error frame_or_cycle_error(const ProcedureState& found, Error error) {
  return error == Error::none ? found.ended.value_or(Error::none) : error;
}

// Sends the bytes of the present register access as the second bytes (`ra`) of successive requests.
Part<Error> send(Dialog& dialog, ProcedureState& found) {
  found.was_sent = false;
  for (std::size_t sent = 0; !found.was_sent;) {
    Frames::Request request{Ask::reset};
    if (found.in_step) request = {Ask::position, found.access[sent++]};
    found.was_sent = sent == found.access.size();
    if (found.was_sent && found.writes) dialog.changes();
    const Error error = co_await ask_frame(dialog, found, request);
    if (frame_or_cycle_error(found, error) != Error::none) co_return frame_or_cycle_error(found, error);
  }
  co_return Error::none;
}

// Requests frames until a cycle of channel 2 ends or a frame is invalid.
Part<Error> receive(Dialog& dialog, ProcedureState& found) {
  do {
    const Error error = co_await ask_frame(dialog, found, {});
    if (frame_or_cycle_error(found, error) != Error::none) co_return frame_or_cycle_error(found, error);
  } while (!found.ended);
  co_return Error::none;
}

// Ends an attempt of a register access that got no valid answer. A write that may have been executed is not repeated.
AccessOutcome lost(ProcedureState& found, Error error, std::string_view detail = {}) {
  if (found.ended.value_or(Error::none) != Error::none) {
    detail = *found.ended == Error::cross_check_failed ? channels_disagree : channel2_damaged;
  }
  return found.end(AccessOutcome::lost, {error, detail}, !found.writes || !found.was_sent);
}

Part<AccessOutcome> try_to_execute(Dialog& dialog, ProcedureState& found) {
  found.data.clear();
  const Error send_error = co_await send(dialog, found);
  if (send_error != Error::none) co_return lost(found, send_error);
  const Time sent_at = dialog.received_at();
  const std::uint8_t ready = found.writes ? channel3::write_ready : channel3::read_ready;
  unsigned idle = 0;
  do {
    const Error error = co_await receive(dialog, found);
    if (error != Error::none) co_return lost(found, error);
    const bool is_idle = found.channel3 == channel3::idle;
    const bool is_busy = found.channel3 == channel3::busy;
    if (!is_idle && !is_busy && found.channel3 != ready) {
      co_return lost(found, Error::unexpected_reply, "channel 3 says neither idle nor busy nor ready");
    }
    if (is_idle && ++idle > idle_cycles_allowed) {
      co_return lost(found, Error::timeout, "the encoder ignores register accesses: positions go on");
    }
    if (is_busy && dialog.received_at() - sent_at > busy_limit) {
      co_return found.end(AccessOutcome::refused, {Error::busy, busy_too_long});
    }
  } while (found.channel3 != ready);
  const Error status_error = co_await receive(dialog, found);
  if (status_error != Error::none) co_return lost(found, status_error);
  const auto status = static_cast<AccessStatus>(found.channel3);
  if (status != AccessStatus::ok) {
    co_return found.end(AccessOutcome::refused, {Error::request_rejected, text_of(status)}, is_damaged(status));
  }
  while (!found.writes && found.data.size() < found.length) {
    const Error error = co_await receive(dialog, found);
    if (error != Error::none) co_return lost(found, error);
    found.data.push_back(found.channel3);
  }
  co_return found.end(AccessOutcome::good, done);
}

// Reads the identity first, because registers of an AksIM-4 must not be accessed.
Part<AccessOutcome> execute(Dialog& dialog, ProcedureState& found) {
  if (!dialog.format().has_ch2) co_await dialog.stop({Error::unsupported, no_channel2});
  if (found.protocol_version == 0) co_await identify(dialog, found, false);
  if (found.protocol_version == version::aksim4) co_await dialog.stop({Error::unsupported, not_described});
  for (unsigned left = access_attempts - 1;; --left) {
    const AccessOutcome access_outcome = co_await try_to_execute(dialog, found);
    // If the access got no valid answer, the encoder may still be sending an answer, so the next request must reset the
    // channels.
    if (access_outcome != AccessOutcome::good) found.in_step = false;
    if (is_lost(dialog, found)) co_return found.end(AccessOutcome::gone, stopped(found, found.why.error));
    if (!found.again || left == 0) co_return access_outcome;
  }
}

}  // namespace

Part<AccessOutcome> attempt_read(Dialog& dialog, ProcedureState& found, std::uint32_t address, std::uint16_t size) {
  found.begin(read_request(address, size));
  return execute(dialog, found);
}

Part<AccessOutcome> attempt_write(Dialog& dialog, ProcedureState& found, std::uint32_t address, std::uint16_t size,
                                  std::uint64_t value) {
  found.begin(write_request(address, size, value));
  return execute(dialog, found);
}

namespace {

// Reads a register into `found.data`. Stops the procedure if that fails.
Part<bool> read(Dialog& dialog, ProcedureState& found, std::uint32_t address, std::uint16_t size) {
  const AccessOutcome access_outcome = co_await attempt_read(dialog, found, address, size);
  if (access_outcome != AccessOutcome::good) co_await dialog.stop(found.why);
  co_return true;
}

Part<bool> read(Dialog& dialog, ProcedureState& found, RegisterIndex index) {
  return read(dialog, found, registers[index].address, registers[index].size);
}

// Records that the encoder refused a write, unless an earlier write of the procedure has changed a register.
void note_refusal(Dialog& dialog, const ProcedureState& found, AccessOutcome access_outcome) {
  if (access_outcome == AccessOutcome::refused && found.why.error == Error::request_rejected && !found.changed)
    dialog.refused();
}

// Writes a register and reads it back. If a write may have been executed, the host repeats it only if the register has
// another value than `value`.
Part<bool> write(Dialog& dialog, ProcedureState& found, std::uint32_t address, std::uint16_t size,
                 std::uint64_t value) {
  constexpr std::string_view in_the_middle =
      "the encoder stopped answering in the middle of a register write: read it to see whether it was written";
  for (unsigned left = write_attempts; left > 0; --left) {
    AccessOutcome access_outcome = co_await attempt_write(dialog, found, address, size, value);
    note_refusal(dialog, found, access_outcome);
    const bool untouched = access_outcome == AccessOutcome::gone && !found.was_sent;
    if (access_outcome == AccessOutcome::refused || untouched) co_await dialog.stop(found.why);
    if (access_outcome != AccessOutcome::gone) access_outcome = co_await attempt_read(dialog, found, address, size);
    if (access_outcome == AccessOutcome::gone) co_await dialog.stop({found.why.error, in_the_middle});
    if (access_outcome != AccessOutcome::good) {
      co_await dialog.stop({found.why.error, "the register may be written: it could not be read back"});
    }
    if (load_big_endian(found.data) == value) {
      found.changed = true;
      co_return true;
    }
  }
  co_await dialog.stop({Error::cross_check_failed, "reading back gave another value: the write has failed",
                        "look whether the configuration is locked, with `absenc config get ... write-lock`"});
  co_return false;
}

Part<bool> write(Dialog& dialog, ProcedureState& found, RegisterIndex index, std::uint64_t value) {
  return write(dialog, found, registers[index].address, registers[index].size, value);
}

Part<bool> run_command(Dialog& dialog, ProcedureState& found, std::uint8_t code) {
  const AccessOutcome access_outcome =
      co_await attempt_write(dialog, found, registers[command_register].address, 1, code);
  note_refusal(dialog, found, access_outcome);
  const bool untouched = access_outcome == AccessOutcome::gone && !found.was_sent;
  if (access_outcome == AccessOutcome::refused || untouched) co_await dialog.stop(found.why);
  if (access_outcome != AccessOutcome::good) {
    co_await dialog.stop({found.why.error, access_outcome == AccessOutcome::gone
                                               ? "the encoder stopped answering: the command may have been executed"
                                               : "the answer to the command was lost: it may have been executed"});
  }
  co_return true;
}

bool is_near(const Dialog& dialog, std::uint32_t singleturn,
             std::uint32_t millidegrees = author::standstill_millidegrees) {
  return author::is_near(dialog.last().singleturn, singleturn, dialog.format().resolution, millidegrees);
}

// Reads the position twice; stops the procedure if it is invalid or the shaft turns, so that the zero must not be set.
Part<bool> may_set_zero(Dialog& dialog, ProcedureState& found) {
  const Reading first = to_reading(dialog.format(), dialog.last(), found.status);
  const Time first_at = dialog.received_at();
  while (dialog.received_at() - first_at < author::between_looks) co_await next_frame(dialog, found);
  const Outcome why_not = author::objection_to_zero(first, to_reading(dialog.format(), dialog.last(), found.status));
  if (why_not.error != Error::none) co_await dialog.stop(why_not);
  co_return true;
}

}  // namespace

// ---- Reading commands

Procedure read_alarms(Dialog& dialog, ProcedureState& found) {
  if (!dialog.format().has_ch2) co_return {Error::unsupported, no_channel2};
  found.reports_status = true;
  for (unsigned left = cycle_attempts; left > 0; --left) {
    found.in_step = false;
    do {
      co_await next_frame(dialog, found, Ask::reset);
    } while (!found.ended);
    if (*found.ended == Error::none) co_return done;
  }
  const Error error = *found.ended;
  co_return {error, error == Error::cross_check_failed ? channels_disagree : std::string_view{}};
}

Procedure read_identity(Dialog& dialog, ProcedureState& found) {
  const Identity identity = co_await identify(dialog, found, true);
  found.identity = identity;
  co_return done;
}

Procedure read_info(Dialog& dialog, ProcedureState& found) {
  const Identity identity = co_await identify(dialog, found, true);
  found.identity = identity;
  if (!dialog.format().has_ch2 || identity.protocol_version == version::aksim4) {
    co_await next_frame(dialog, found);
    co_return done;
  }
  for (std::size_t i = 0; i < registers.size(); ++i) {
    if (!registers[i].in_info) continue;
    const AccessOutcome access_outcome = co_await attempt_read(dialog, found, registers[i].address, registers[i].size);
    if (found.why.error == Error::request_rejected) continue;
    if (access_outcome != AccessOutcome::good) co_return found.why;
    found.add_value(i, found.data);
  }
  co_return done;
}

namespace {

Procedure read_at(Dialog& dialog, ProcedureState& found, std::uint32_t address, std::uint16_t size) {
  if (size == 0) co_return {Error::invalid_argument, size_needed};
  found.emits = true;
  co_await read(dialog, found, address, size);
  found.address = address;
  co_return done;
}

Procedure write_at(Dialog& dialog, ProcedureState& found, std::uint32_t address, std::uint16_t size,
                   std::int64_t argument) {
  const auto value = static_cast<std::uint64_t>(argument);
  if (size == 0 || size > 8) co_return {Error::invalid_argument, size_needed};
  if (value > low_mask(8u * size)) {
    co_return {Error::invalid_argument, "the value does not fit into the register"};
  }
  if (address == registers[command_register].address) {
    co_return {Error::invalid_argument, "the command register is written by save, reset and self-calibrate"};
  }
  found.emits = true;
  co_await write(dialog, found, address, size, value);
  found.address = address;
  co_return done;
}

}  // namespace

Procedure read_register(Dialog& dialog, ProcedureState& found, std::size_t index) {
  return read_at(dialog, found, registers[index].address, registers[index].size);
}

Procedure read_memory(Dialog& dialog, ProcedureState& found, Arguments arguments) {
  const auto address = static_cast<std::uint32_t>(arguments[0]);
  return read_at(dialog, found, address, register_size(address, arguments[1]));
}

// ---- Writing commands

Procedure write_register(Dialog& dialog, ProcedureState& found, std::size_t index, Arguments arguments) {
  return write_at(dialog, found, registers[index].address, registers[index].size, arguments[0]);
}

Procedure write_memory(Dialog& dialog, ProcedureState& found, Arguments arguments) {
  const auto address = static_cast<std::uint32_t>(arguments[0]);
  return write_at(dialog, found, address, register_size(address, arguments[2]), arguments[1]);
}

Procedure send_command(Dialog& dialog, ProcedureState& found, std::uint8_t code) {
  found.emits = true;
  co_await run_command(dialog, found, code);
  co_return done;
}

Procedure zero(Dialog& dialog, ProcedureState& found, Arguments arguments) {
  found.emits = true;
  co_await read(dialog, found, position_offset);
  const auto old = static_cast<std::uint32_t>(load_big_endian(found.data));
  co_await may_set_zero(dialog, found);
  const std::uint32_t offset = dialog.format().moved_offset(old, dialog.last().singleturn);
  co_await write(dialog, found, position_offset, offset);
  if (!is_near(dialog, 0, author::zero_millidegrees)) {
    co_await write(dialog, found, position_offset, old);
    dialog.refused();
    co_return {Error::cross_check_failed, "the position did not become zero, the old offset is back",
               "hold the shaft still, or change the option offset_sign or offset_unit"};
  }
  found.add_value(position_offset, found.data);
  if (arguments[0] != 0) co_await run_command(dialog, found, commands::save);
  co_return done;
}

Procedure preset_multiturn(Dialog& dialog, ProcedureState& found, Arguments arguments) {
  found.emits = true;
  co_await identify(dialog, found, false);
  const auto bits = static_cast<unsigned>(dialog.format().multiturn_bits);
  const auto turns = static_cast<std::uint64_t>(arguments[0]);
  if (bits == 0) co_return {Error::unsupported, "this encoder counts no turns"};
  if (turns > low_mask(bits)) co_return {Error::invalid_argument, "the turn counter has not so many bits"};
  co_await write(dialog, found, multiturn_preset, turns);
  if (dialog.last().multiturn != turns) {
    co_return {Error::cross_check_failed, "the preset is written, but the turns are others",
               "hold the shaft still, then `absenc reset-multiturn` again"};
  }
  if (arguments[1] != 0) co_await run_command(dialog, found, commands::save);
  co_return done;
}

// The self-calibration has ended when its counter has changed or the encoder reports a failure that it did not report
// before.
Procedure self_calibrate(Dialog& dialog, ProcedureState& found) {
  co_await read(dialog, found, calibration_status);
  const std::uint8_t before = found.data[0];
  co_await run_command(dialog, found, commands::self_calibrate);
  found.running = true;
  std::uint8_t status = before;
  const Time started = dialog.received_at();
  for (Time next_poll = started + calibration_poll; *found.running;) {
    while (dialog.received_at() < next_poll) co_await next_frame(dialog, found);
    next_poll = dialog.received_at() + calibration_poll;
    co_await read(dialog, found, calibration_status);
    status = found.data[0];
    found.values.clear();
    found.add_value(calibration_status, found.data);
    const unsigned failures = calibration::timed_out | calibration::out_of_range;
    found.running = ((status ^ before) & calibration::count) == 0 && (status & ~before & failures) == 0;
    if (*found.running && dialog.received_at() - started > calibration_limit) {
      co_return {Error::timeout, "the self-calibration does not end: positions go on"};
    }
    if (*found.running) dialog.emit();
  }
  if ((status & calibration::timed_out) != 0) {
    co_return {Error::cross_check_failed, "the self-calibration gave up: the shaft did not turn far enough in time",
               "turn it evenly, more than one turn, then `absenc run ... self-calibrate` again"};
  }
  if ((status & calibration::out_of_range) != 0) {
    co_return {Error::cross_check_failed, "the ring is too eccentric to be calibrated",
               "mount it again, then `absenc run ... self-calibrate` again"};
  }
  co_return done;
}

std::uint16_t register_size(std::uint32_t address, std::int64_t wanted) {
  const Register* known = find_register(address);
  return wanted == 0 && known != nullptr ? known->size : static_cast<std::uint16_t>(wanted);
}

}  // namespace absenc::encolink
