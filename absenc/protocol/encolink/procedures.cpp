// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/procedures.hpp"

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

using author::done;
using author::Part;
using author::Procedure;
using Fate = Line::Answer::Fate;

namespace {

constexpr unsigned cycle_attempts = 3;
constexpr unsigned write_attempts = 3;
constexpr std::string_view size_needed = "this address is not in the table of registers: say how many bytes it has";

bool is_near(const Line& line, std::uint32_t singleturn) {
  return author::is_near(line.position().singleturn, singleturn, line.format().resolution);
}

// ---- Parts

// A write whose answer is lost is repeated only if reading back shows that it was not executed.
Part<bool> write(Line& line, std::uint32_t address, std::uint16_t size, std::uint64_t value) {
  constexpr std::string_view in_the_middle =
      "the encoder stopped answering in the middle of a register write: read it to see whether it was written";
  for (unsigned left = write_attempts; left > 0; --left) {
    const Line::Answer written = co_await line.attempt_write(address, size, value);
    if (written.fate == Fate::refused) co_await line.stop(written.why);
    if (written.fate == Fate::gone && !line.was_asked()) co_await line.stop(written.why);
    if (written.fate == Fate::gone) co_await line.stop({written.why.error, in_the_middle});
    const Line::Answer back = co_await line.attempt_read(address, size);
    if (back.fate == Fate::gone) co_await line.stop({back.why.error, in_the_middle});
    if (back.fate != Fate::good) {
      co_await line.stop({back.why.error, "the register may be written: it could not be read back"});
    }
    if (load_big_endian(line.data()) == value) co_return true;
  }
  co_await line.stop({Error::cross_check_failed, "reading back gave another value: the write has failed"});
  co_return false;
}

Part<bool> write(Line& line, RegisterIndex index, std::uint64_t value) {
  return write(line, registers[index].address, registers[index].size, value);
}

Part<bool> send(Line& line, std::uint8_t command) {
  const Line::Answer answer = co_await line.attempt_write(registers[command_register].address, 1, command);
  const bool untouched = answer.fate == Fate::gone && !line.was_asked();
  if (answer.fate == Fate::refused || untouched) co_await line.stop(answer.why);
  if (answer.fate == Fate::gone) {
    co_await line.stop({answer.why.error, "the encoder stopped answering: the command may have been executed"});
  }
  if (answer.fate == Fate::lost) {
    co_await line.stop({answer.why.error, "the answer to the command was lost: it may have been executed"});
  }
  co_return true;
}

Part<bool> stands_still(Line& line) {
  const Position first = co_await line.frame();
  const Time looked = line.received_at();
  while (line.received_at() - looked < author::between_looks) co_await line.frame();
  co_return is_near(line, first.singleturn);
}

}  // namespace

// ---- What is read

Procedure read_alarms(Line& line, FoundAlarms&) {
  Error error = Error::none;
  for (unsigned left = cycle_attempts; left > 0; --left) {
    const Result<Cycle> cycle = co_await line.cycle();
    if (cycle) co_return done;
    error = cycle.error();
  }
  co_return {error, error == Error::cross_check_failed ? channels_disagree : std::string_view{}};
}

Procedure read_identity(Line& line, FoundIdentity& found) {
  found.identity = co_await line.identity(true);
  co_return done;
}

Procedure read_info(Line& line, FoundIdentity& found) {
  found.identity = co_await line.identity(true);
  if (!line.format().has_ch2 || found.identity.protocol_version == version::aksim4) {
    co_await line.frame();
    co_return done;
  }
  for (std::size_t i = 0; i < registers.size(); ++i) {
    if (!registers[i].in_info) continue;
    const Line::Answer answer = co_await line.attempt_read(registers[i].address, registers[i].size);
    if (answer.why.error == Error::request_rejected) continue;
    if (answer.fate != Fate::good) co_return answer.why;
    found.has[i] = true;
    found.data.append(line.data());
  }
  co_return done;
}

Procedure read_register(Line& line, FoundRegister& found, std::size_t index) {
  line.emit_frames();
  co_await line.read(registers[index]);
  found.address = registers[index].address;
  co_return done;
}

Procedure read_memory(Line& line, FoundRegister& found, Arguments arguments) {
  const auto address = static_cast<std::uint32_t>(arguments[0]);
  const std::uint16_t size = size_of(address, arguments[1]);
  if (size == 0 || size > access_capacity) co_return {Error::invalid_argument, size_needed};
  line.emit_frames();
  co_await line.read(address, size);
  found.address = address;
  co_return done;
}

// ---- What is written

Procedure write_register(Line& line, FoundRegister& found, std::size_t index, Arguments arguments) {
  line.emit_frames();
  co_await write(line, static_cast<RegisterIndex>(index), static_cast<std::uint64_t>(arguments[0]));
  found.address = registers[index].address;
  co_return done;
}

Procedure write_memory(Line& line, FoundRegister& found, Arguments arguments) {
  const auto address = static_cast<std::uint32_t>(arguments[0]);
  const auto value = static_cast<std::uint64_t>(arguments[1]);
  const std::uint16_t size = size_of(address, arguments[2]);
  if (size == 0 || size > 8) co_return {Error::invalid_argument, size_needed};
  if (value > low_mask(8u * size)) {
    co_return {Error::invalid_argument, "the value does not fit into the register"};
  }
  if (address == registers[command_register].address) {
    co_return {Error::invalid_argument, "the command register is written by save, reset and self-calibrate"};
  }
  line.emit_frames();
  co_await write(line, address, size, value);
  found.address = address;
  co_return done;
}

Procedure send_command(Line& line, Nothing&, std::uint8_t command) {
  line.emit_frames();
  co_await send(line, command);
  co_return done;
}

Procedure zero(Line& line, FoundZero& found, Arguments arguments) {
  line.emit_frames();
  const Bytes stored = co_await line.read(registers[position_offset]);
  const auto old = static_cast<std::uint32_t>(load_big_endian(stored));
  const bool still = co_await stands_still(line);
  if (line.position().error) {
    co_return {Error::invalid_argument, "the position is not valid: read the alarms, mend their cause"};
  }
  if (!still) co_return {Error::invalid_argument, "the shaft turns: hold it still"};
  const std::uint32_t offset = line.format().moved_offset(old, line.position().singleturn);
  co_await write(line, position_offset, offset);
  if (!is_near(line, 0)) {
    co_await write(line, position_offset, old);
    co_return {Error::cross_check_failed,
               "the position did not become zero, the old offset is back: hold the shaft still, or change the option "
               "offset_sign or offset_unit"};
  }
  if (arguments[0] != 0) co_await send(line, commands::save);
  found.offset = offset;
  co_return done;
}

Procedure preset_multiturn(Line& line, Nothing&, Arguments arguments) {
  line.emit_frames();
  co_await line.identity();
  const auto bits = static_cast<unsigned>(line.format().multiturn_bits);
  const auto turns = static_cast<std::uint64_t>(arguments[0]);
  if (bits == 0) co_return {Error::unsupported, "this encoder counts no turns"};
  if (turns > low_mask(bits)) co_return {Error::invalid_argument, "the turn counter has not so many bits"};
  co_await write(line, multiturn_preset, turns);
  if (line.position().multiturn != turns) {
    co_return {Error::cross_check_failed, "the preset is written, but the turns are others: hold the shaft still"};
  }
  if (arguments[1] != 0) co_await send(line, commands::save);
  co_return done;
}

// It has ended when its counter moved on, or it shows a failure that was not there before.
Procedure self_calibrate(Line& line, FoundCalibration& found) {
  const Register& status = registers[calibration_status];
  const Bytes first = co_await line.read(status);
  const std::uint8_t before = found.status = first[0];
  co_await send(line, commands::self_calibrate);
  found.running = true;
  const Time started = line.received_at();
  for (Time look = started + calibration_poll; found.running;) {
    while (line.received_at() < look) co_await line.frame();
    look = line.received_at() + calibration_poll;
    const Bytes now = co_await line.read(status);
    found.status = now[0];
    const unsigned failures = calibration::timed_out | calibration::out_of_range;
    found.running = ((found.status ^ before) & calibration::count) == 0 && (found.status & ~before & failures) == 0;
    if (found.running && line.received_at() - started > calibration_limit) {
      co_return {Error::timeout, "the self-calibration does not end: positions go on"};
    }
    if (found.running) line.emit();
  }
  if ((found.status & calibration::timed_out) != 0) {
    co_return {Error::cross_check_failed, "the self-calibration gave up: turn the shaft evenly, more than one turn"};
  }
  if ((found.status & calibration::out_of_range) != 0) {
    co_return {Error::cross_check_failed, "the ring is too eccentric to be calibrated: mount it again"};
  }
  co_return done;
}

// ---- What is told

namespace {

void put_register(FieldSink& sink, std::uint32_t address, Bytes data) {
  const Register* known = find_register(address);
  const bool in_table = known != nullptr && known->size == data.size();
  Values values{.address = address, .length = data.size(), .data = data};
  if (known != nullptr) values.name = known->name;
  if (!in_table && data.size() < 8) values.value = load_big_endian(data);
  frame_fields.put(sink, values);
  if (in_table) put_value(sink, static_cast<std::size_t>(known - registers.data()), data);
}

void put_position(FieldSink& sink, const Line& line) { put_position(sink, line.format(), line.position()); }

}  // namespace

void put(FieldSink& sink, const Stream& stream) {
  put_position(sink, stream.format(), stream.position(), stream.detailed_status());
}

void put(FieldSink& sink, const Line& line, const Nothing&) { put_position(sink, line); }

void put(FieldSink& sink, const Line& line, const FoundAlarms&) { put(sink, line); }

void put(FieldSink& sink, const Line& line, const FoundRegister& found) {
  if (!found.address) return put_position(sink, line);
  put_register(sink, *found.address, line.data());
}

void put(FieldSink& sink, const Line& line, const FoundZero& found) {
  put_position(sink, line);
  if (found.offset) sink.put({&register_fields[position_offset], *found.offset});
}

void put(FieldSink& sink, const Line& line, const FoundCalibration& found) {
  put_position(sink, line);
  put_value(sink, calibration_status, Bytes(&found.status, 1));
  sink.put({&running_field, found.running ? 1 : 0});
}

void put(FieldSink& sink, const Line&, const FoundIdentity& found) {
  put_identity(sink, found.identity);
  if (found.identity.protocol_version == version::aksim4) {
    const Bytes why(reinterpret_cast<const std::uint8_t*>(not_described.data()), not_described.size());
    sink.put({.info = &not_described_field, .bytes = why});
  }
  std::size_t at = 0;
  for (std::size_t i = 0; i < registers.size(); ++i) {
    if (!found.has[i]) continue;
    put_value(sink, i, found.data.view().subspan(at, registers[i].size));
    at += registers[i].size;
  }
}

Explanation explain(const Stream& stream) {
  const Bytes reply = stream.reply();
  switch (stream.error()) {
    case Error::unexpected_reply:
      if (!stream.asked_identity() || !decode_identity(reply)) return {};
      return {
          "the identity says another resolution than the options, or disagrees on whether there are turns: "
          "leave resolution and multiturn_bits out, and it is asked"};
    case Error::wrong_length:
      if (stream.asked_identity()) {
        return {"the encoder did not identify itself: it is starting, or resolution and multiturn_bits must be set"};
      }
      if (stream.is_disturbed() || reply.size() > stream.format().frame_bytes()) {
        return {"more came than one frame: other turns, or more than one sender"};
      }
      return {"the reply ended early"};
    case Error::out_of_range:
      return {stream.asked_identity() ? std::string_view{} : wrong_resolution};
    case Error::line_stuck:
      return {reply[0] == 0 ? "MISO stayed low" : "MISO stayed high"};
    default:
      return {};
  }
}

std::uint16_t size_of(std::uint32_t address, std::int64_t wanted) {
  const Register* known = find_register(address);
  return wanted == 0 && known != nullptr ? known->size : static_cast<std::uint16_t>(wanted);
}

}  // namespace absenc::encolink
