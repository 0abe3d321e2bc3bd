// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/procedures.hpp"

#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

namespace {

constexpr unsigned frame_attempts = 3;
constexpr unsigned write_attempts = 3;
constexpr std::string_view size_needed = "this address is not in the table of registers: say how many bytes it has";

// 0.35 degrees: what noise and a servo at rest may do.
constexpr unsigned still_bits = 10;

std::uint16_t size_of(std::uint32_t address, std::uint16_t wanted) {
  const Register* known = find_register(address);
  return wanted == 0 && known != nullptr ? known->size : wanted;
}

void put_text(FieldSink& sink, std::size_t field, std::string_view text) {
  put(sink, field, Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void put_register(FieldSink& sink, std::uint32_t address, Bytes data) {
  const Register* known = find_register(address);
  if (known != nullptr) put_text(sink, field_register, known->name);
  put(sink, field_address, address);
  put(sink, field_length, static_cast<std::int64_t>(data.size()));
  put(sink, field_data, data);
  if (known != nullptr && known->size == data.size()) {
    put_value(sink, static_cast<std::size_t>(known - registers.data()), data);
  } else if (data.size() < 8) {
    put(sink, field_value, static_cast<std::int64_t>(load_big_endian(data)));
  }
}

}  // namespace

// ---- ReadRegister

ReadRegister::ReadRegister(const Format& format, Wire wire, std::uint32_t address, std::uint16_t length)
    : Stream(format, wire, frame_attempts) {
  const std::uint16_t size = size_of(address, length);
  if (size == 0 || size > access_capacity) {
    finish(Error::invalid_argument, size_needed);
    return;
  }
  emit_frames(true);
  submit(read_request(address, size));
}

void ReadRegister::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  if (!is_done()) return put_fields(sink, format(), position());
  put_register(sink, access().request().address, data());
}

// ---- RegisterWriter

RegisterWriter::RegisterWriter(const Format& format, Wire wire) : Stream(format, wire, frame_attempts) {}

void RegisterWriter::write(std::uint32_t address, std::uint16_t size, std::uint64_t value) {
  request_ = write_request(address, size, value);
  phase_ = Phase::write;
  writes_left_ = write_attempts - 1;
  submit(request_);
}

void RegisterWriter::send_command(std::uint8_t command) {
  request_ = write_request(registers[command_register].address, 1, command);
  phase_ = Phase::command;
  submit(request_);
}

void RegisterWriter::read(const Register& one) {
  phase_ = Phase::read;
  submit(read_request(one.address, one.size));
}

std::uint64_t RegisterWriter::value_read() const { return load_big_endian(access().data()); }

void RegisterWriter::on_access(Error error, std::string_view detail) {
  const bool refused = error == Error::request_rejected || error == Error::busy;
  switch (phase_) {
    case Phase::read:
      if (error != Error::none) return finish(error, detail);
      on_read();
      break;
    case Phase::write:  // a lost answer does not tell whether it was executed: reading back does
      if (refused) return finish(error, detail);
      phase_ = Phase::read_back;
      submit(read_request(request_.address, request_.length));
      break;
    case Phase::read_back:
      if (error != Error::none) return finish(error, "the register may be written: it could not be read back");
      compare();
      break;
    case Phase::command:
      if (refused) return finish(error, detail);
      if (error != Error::none) return finish(error, "the answer to the command was lost: it may have been executed");
      on_command();
      break;
  }
}

void RegisterWriter::on_failure(Error error, std::string_view detail) {
  const bool nothing_done = phase_ != Phase::read_back && !access().was_asked();
  if (nothing_done || phase_ == Phase::read) return finish(error, detail);
  if (phase_ == Phase::command) detail = "the encoder stopped answering: the command may have been executed";
  if (phase_ == Phase::write || phase_ == Phase::read_back) {
    detail = "the encoder stopped answering in the middle of a register write: read it to see whether it was written";
  }
  finish(error, detail);
}

void RegisterWriter::compare() {
  const Bytes wanted = request_.data;
  const Bytes found = access().data();
  bool same = wanted.size() == found.size();
  for (std::size_t i = 0; same && i < wanted.size(); ++i) same = wanted[i] == found[i];
  if (same) return on_written();
  if (writes_left_ == 0) {
    return finish(Error::cross_check_failed, "reading back gave another value: the write has failed");
  }
  --writes_left_;
  phase_ = Phase::write;
  submit(request_);
}

// ---- WriteRegister

WriteRegister::WriteRegister(const Format& format, Wire wire, std::uint32_t address, std::uint16_t size,
                             std::uint64_t value)
    : RegisterWriter(format, wire), address_(address), size_(size_of(address, size)) {
  if (size_ == 0 || size_ > 8) {
    finish(Error::invalid_argument, size_needed);
  } else if (value > low_mask(8u * size_)) {
    finish(Error::invalid_argument, "the value does not fit into the register");
  } else if (address == registers[command_register].address) {
    finish(Error::invalid_argument, "the command register is written by save, reset and self-calibrate");
  } else {
    emit_frames(true);
    write(address, size_, value);
  }
}

void WriteRegister::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  if (!is_done()) return put_fields(sink, format(), position());
  put_register(sink, address_, access().data());
}

// ---- Zero

Zero::Zero(const Format& format, Wire wire, const Offset& offset, Keep keep)
    : RegisterWriter(format, wire), unit_(offset), keep_(keep) {
  emit_frames(true);
  read(registers[position_offset]);
}

bool Zero::is_near(std::uint32_t singleturn) const {
  const unsigned bits = format().resolution;
  const std::int64_t off = wrapped_difference(position().singleturn, singleturn, bits);
  const std::int64_t tolerance = bits > still_bits ? std::int64_t{1} << (bits - still_bits) : 1;
  return off <= tolerance && -off <= tolerance;
}

void Zero::on_frame() {
  if (!begun_) first_position_ = position().singleturn;
  begun_ = true;
}

void Zero::on_read() {
  if (position().error) {
    return finish(Error::invalid_argument, "the position is not valid: read the alarms, mend their cause");
  }
  if (!is_near(first_position_)) return finish(Error::invalid_argument, "the shaft turns: hold it still");
  old_offset_ = static_cast<std::uint32_t>(value_read());
  offset_ = unit_.moved(format().resolution, old_offset_, position().singleturn);
  write(registers[position_offset].address, registers[position_offset].size, offset_);
}

void Zero::on_written() {
  if (restoring_) {
    return finish(
        Error::cross_check_failed,
        "the position did not become zero, the old offset is back: hold the shaft still, or change the option "
        "offset_sign or offset_unit");
  }
  if (!is_near(0)) {
    restoring_ = true;
    return write(registers[position_offset].address, registers[position_offset].size, old_offset_);
  }
  if (keep_ == Keep::until_power_off) return finish();
  send_command(commands::save);
}

void Zero::on_command() { finish(); }

void Zero::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_fields(sink, format(), position());
  if (is_done()) put(sink, field_registers + std::size_t{position_offset}, offset_);
}

// ---- PresetMultiturn

PresetMultiturn::PresetMultiturn(const Format& format, Wire wire, std::uint16_t turns, Keep keep)
    : RegisterWriter(format, wire), turns_(turns), keep_(keep) {
  emit_frames(true);
  identify();
}

void PresetMultiturn::begin() {
  if (format().multiturn_bits == 0) return finish(Error::unsupported, "this encoder counts no turns");
  if (turns_ > low_mask(static_cast<unsigned>(format().multiturn_bits))) {
    return finish(Error::invalid_argument, "the turn counter has not so many bits");
  }
  write(registers[multiturn_preset].address, registers[multiturn_preset].size, turns_);
}

void PresetMultiturn::on_written() {
  if (position().multiturn != turns_) {
    return finish(Error::cross_check_failed, "the preset is written, but the turns are others: hold the shaft still");
  }
  if (keep_ == Keep::until_power_off) return finish();
  send_command(commands::save);
}

void PresetMultiturn::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, format(), position());
}

// ---- SendCommand

SendCommand::SendCommand(const Format& format, Wire wire, std::uint8_t command) : RegisterWriter(format, wire) {
  emit_frames(true);
  send_command(command);
}

void SendCommand::report(FieldSink& sink) const {
  if (error() == Error::none) put_fields(sink, format(), position());
}

// ---- SelfCalibrate

SelfCalibrate::SelfCalibrate(const Format& format, Wire wire) : RegisterWriter(format, wire) {
  read(registers[calibration_status]);
}

void SelfCalibrate::on_command() {
  running_ = true;
  started_ = received_at();
  next_look_ = started_ + calibration_poll;
}

void SelfCalibrate::on_frame() {
  if (!running_ || access().active() || received_at() < next_look_) return;
  next_look_ = received_at() + calibration_poll;
  read(registers[calibration_status]);
}

void SelfCalibrate::on_read() {
  status_ = static_cast<std::uint8_t>(value_read());
  if (!running_) {
    before_ = status_;
    return send_command(commands::self_calibrate);
  }
  const unsigned failures = calibration::timed_out | calibration::out_of_range;
  const bool ended = ((status_ ^ before_) & calibration::count) != 0 || (status_ & ~before_ & failures) != 0;
  if (!ended) {
    if (received_at() - started_ > calibration_limit) {
      return finish(Error::timeout, "the self-calibration does not end: positions go on");
    }
    return emit_once();
  }
  running_ = false;
  if ((status_ & calibration::timed_out) != 0) {
    return finish(Error::cross_check_failed, "the self-calibration gave up: turn the shaft evenly, more than one turn");
  }
  if ((status_ & calibration::out_of_range) != 0) {
    return finish(Error::cross_check_failed, "the ring is too eccentric to be calibrated: mount it again");
  }
  finish();
}

void SelfCalibrate::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_fields(sink, format(), position());
  const std::array<std::uint8_t, 1> data{status_};
  put_value(sink, calibration_status, data);
  put(sink, field_running, running_ ? 1 : 0);
}

// ---- ReadInfo

ReadInfo::ReadInfo(const Format& format, Wire wire) : Stream(format, wire, frame_attempts) {
  trust_identity();
  identify();
}

void ReadInfo::on_identity(const Identity& identity) {
  identity_ = identity;
  only_identity_ = !format().has_ch2 || identity.protocol_version == version::aksim4;
  if (!only_identity_) ask_from(0);
}

void ReadInfo::on_frame() {
  if (only_identity_) finish();
}

void ReadInfo::ask_from(std::size_t index) {
  while (index < registers.size() && !registers[index].in_info) ++index;
  index_ = index;
  if (index == registers.size()) return finish();
  submit(read_request(registers[index].address, registers[index].size));
}

void ReadInfo::on_access(Error error, std::string_view detail) {
  if (error != Error::none && error != Error::request_rejected) return finish(error, detail);
  has_[index_] = error == Error::none;
  if (has_[index_]) data_.append(access().data());
  ask_from(index_ + 1);
}

void ReadInfo::report(FieldSink& sink) const {
  if (error() != Error::none) return;
  put_fields(sink, identity_);
  if (identity_.protocol_version == version::aksim4) put_text(sink, field_not_described, not_described);
  std::size_t at = 0;
  for (std::size_t i = 0; i < registers.size(); ++i) {
    if (!has_[i]) continue;
    put_value(sink, i, data_.view().subspan(at, registers[i].size));
    at += registers[i].size;
  }
}

}  // namespace absenc::encolink
