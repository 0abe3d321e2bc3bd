// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/control.hpp"

#include <algorithm>
#include <bit>

#include "absenc/protocol/biss/control_bits.hpp"

namespace absenc::biss {

using namespace control_bits;

// ---- The host

void ControlMaster::begin(const ControlRequest& request) {
  frame_ = {};
  frame_.request = request;
  header_ = header_of(request);
  at_ = 0;
  delay_ = 0;
  state_ = State::header;
  only_counts_slaves_ = false;
  over_ = false;
  answered_ = false;
  error_ = Error::none;
}

void ControlMaster::read(unsigned slave, unsigned address, std::size_t count) {
  count_ = count;
  begin({.slave = static_cast<std::uint8_t>(slave), .address = static_cast<std::uint8_t>(address)});
}

void ControlMaster::write(unsigned slave, unsigned address, Bytes bytes) {
  written_ = {};
  static_cast<void>(written_.append(bytes));
  count_ = written_.size();
  begin({Operation::write, static_cast<std::uint8_t>(slave), static_cast<std::uint8_t>(address)});
}

void ControlMaster::command(std::uint8_t slaves, unsigned command) {
  begin({.operation = Operation::command, .slaves = slaves, .command = static_cast<std::uint8_t>(command)});
}

void ControlMaster::count_slaves() {
  read(0, 0, 1);
  only_counts_slaves_ = true;
}

bool ControlMaster::next(bool cds) {
  const bool cdm = step(cds);
  zeros_ = cdm ? 0 : std::min(zeros_ + 1, control_pause);
  return cdm;
}

void ControlMaster::fail(Error error) {
  // Slaves that missed this position frame begin to count the zeros of CDM with the next frame, so the host does too.
  zeros_ = 0;
  end(error);
}

bool ControlMaster::end(Error error) {
  over_ = true;
  error_ = error;
  return false;
}

bool ControlMaster::step(bool cds) {
  if (over_) return false;
  switch (state_) {
    case State::header:
      return header(cds);
    case State::direction:
      return direction(cds);
    case State::start:
      return started(cds);
    case State::byte:
      return byte(cds);
    case State::acknowledge:
      return acknowledge(cds);
  }
  return false;
}

bool ControlMaster::header(bool cds) {
  if (at_ == 0) {
    if (zeros_ < control_pause) return false;
    if (cds) return end(Error::bad_framing);  // this CDS bit is 1 although the host has sent no request
    at_ = 1;
    return true;
  }
  if (at_ < more_slaves_at && cds && frame_.slaves == at_ - 1) frame_.slaves = static_cast<std::uint8_t>(at_);
  if (at_ == more_slaves_at) {
    frame_.more_slaves = cds;
    if (only_counts_slaves_) return end(Error::none);
  }
  const bool cdm = (header_ >> (header_bits - at_) & 1) != 0;
  if (at_++ == header_bits) state_ = frame_.request.is_command() ? State::acknowledge : State::direction;
  return cdm;
}

bool ControlMaster::direction(bool cds) {
  const bool write = frame_.request.operation == Operation::write;
  switch (at_++ - direction_at) {
    case 0:
      return !write;
    case 1:
      answered_ = cds;
      return write;
    default:
      if (answered_ == write) return end(write ? Error::unexpected_reply : Error::timeout);
      if (cds == write) {
        state_ = State::start;
        return true;
      }
      // The lock bits show whether a slave with the ID of the request exists. If one exists, it refused the access.
      return end(frame_.request.slave < frame_.slaves ? Error::request_rejected : Error::timeout);
  }
}

// Handles the wait for the encoder's start bit. Before the first written byte the encoder must not be late.
bool ControlMaster::started(bool cds) {
  const bool write = frame_.request.operation == Operation::write;
  if (!cds) {
    if (write && frame_.data.empty()) return end(Error::timeout);
    ++delay_;
    return true;
  }
  frame_.start_delay.push_back(static_cast<std::uint16_t>(std::min(delay_, 0xFFFFu)));
  delay_ = 0;
  if (write) {
    const std::uint8_t value = written_[frame_.data.size()];
    out_ = static_cast<std::uint16_t>(value << 4 | crc4_of(value, 8));
  }
  in_ = 0;
  at_ = 0;
  state_ = State::byte;
  return write && (out_ >> (byte_bits - 1) & 1) != 0;
}

bool ControlMaster::byte(bool cds) {
  const bool write = frame_.request.operation == Operation::write;
  if (++at_ == byte_bits + 1) return end_byte(cds);
  in_ = static_cast<std::uint16_t>(in_ << 1 | (cds ? 1 : 0));
  return write && at_ < byte_bits && (out_ >> (byte_bits - 1 - at_) & 1) != 0;
}

bool ControlMaster::end_byte(bool is_last) {
  const bool write = frame_.request.operation == Operation::write;
  if (!is_good_byte(in_)) return end(Error::bad_checksum);
  if (write && in_ != out_) return end(Error::unexpected_reply);
  frame_.data.push_back(static_cast<std::uint8_t>(in_ >> 4));
  frame_.next_address_accepted = !is_last;
  if (frame_.data.size() == count_) return end(Error::none);
  if (is_last) return end(Error::request_rejected);
  state_ = State::start;
  return true;
}

bool ControlMaster::acknowledge(bool cds) {
  const unsigned at = at_++;
  if (at == direction_at) return true;  // this 1 is the host's start bit S
  if (frame_.request.slaves == 0) {
    frame_.executed = true;
    end(Error::none);
    return true;
  }
  if (cds) frame_.acknowledged |= static_cast<std::uint8_t>(1u << (at - acknowledge_at));
  if (at < acknowledge_at + 7) return false;
  frame_.executed = frame_.acknowledged == frame_.request.slaves;
  const bool known = std::bit_width(frame_.request.slaves) <= frame_.slaves;
  const bool executed = frame_.executed;
  end(executed ? Error::none : known ? Error::request_rejected : Error::timeout);
  return executed;
}

// ---- The encoders

void ControlSlaves::take(bool cdm, ControlTarget& target) {
  const unsigned zeros = zeros_;
  zeros_ = cdm ? 0 : std::min(zeros_ + 1, control_pause);
  if (zeros_ == control_pause) {
    state_ = State::idle;
    cds_ = false;
  } else if (state_ == State::idle) {
    cds_ = false;
    if (!cdm || zeros < control_pause) return;
    state_ = State::header;
    at_ = 1;
    bits_ = 0;
    bytes_ = 0;
    cds_ = count_ > 0;
  } else {
    cds_ = step(cdm, target);
  }
}

bool ControlSlaves::end(bool cds) {
  state_ = State::idle;
  return cds;
}

bool ControlSlaves::step(bool cdm, ControlTarget& target) {
  switch (state_) {
    case State::header:
      bits_ = static_cast<std::uint16_t>(bits_ << 1 | (cdm ? 1 : 0));
      if (at_++ == header_bits) return end_header(target);
      return at_ <= more_slaves_at && at_ - 1 < count_;
    case State::direction:
      return direction(cdm, target);
    case State::start:
      return begin_byte(target);
    case State::read:
      return read(cdm, target);
    case State::write:
      return write(cdm, target);
    case State::command:
      return command(cdm, target);
    case State::idle:
      break;
  }
  return false;
}

// A slave that receives a damaged header does not answer.
bool ControlSlaves::end_header(const ControlTarget& target) {
  const Result<ControlRequest> request = request_of_header(bits_);
  if (!request) return end();
  request_ = *request;
  if (request_.is_command()) {
    state_ = State::command;
  } else if (is_there(request_.slave, target)) {
    state_ = State::direction;
  } else {
    return end();
  }
  return false;
}

bool ControlSlaves::direction(bool cdm, ControlTarget& target) {
  switch (at_++ - direction_at) {
    case 0:
      request_.operation = cdm ? Operation::read : Operation::write;
      return cdm;
    case 1: {
      const bool write = request_.operation == Operation::write;
      if (cdm != write) return end();
      if (target.allows(request_.slave, request_.address, write)) return write;
      return end(!write);
    }
    default:
      return cdm ? begin_byte(target) : end();
  }
}

// Begins a data byte, or awaits another start bit if the register of `target` is not ready. The first written byte
// must not be delayed.
bool ControlSlaves::begin_byte(ControlTarget& target) {
  const bool write = request_.operation == Operation::write;
  const bool may_wait = !write || bytes_ > 0;
  if (may_wait && !target.is_ready()) {
    state_ = State::start;
    return false;
  }
  at_ = 0;
  bits_ = 0;
  if (!write) {
    const std::uint8_t value = target.read(request_.slave, request_.address);
    bits_ = static_cast<std::uint16_t>(value << 4 | crc4_of(value, 8));
  }
  state_ = write ? State::write : State::read;
  return true;
}

bool ControlSlaves::next_allowed(const ControlTarget& target) const {
  const unsigned next = request_.address + 1u;
  return next < 128 && bytes_ + 1 < control_most &&
         target.allows(request_.slave, next, request_.operation == Operation::write);
}

// After the bit P, a 1 from the host is a start bit that asks for the next register.
bool ControlSlaves::read(bool cdm, ControlTarget& target) {
  const unsigned at = at_++;
  if (at < byte_bits) return (bits_ >> (byte_bits - 1 - at) & 1) != 0;
  if (at == byte_bits) return target.stop_bit(next_allowed(target));
  if (!cdm || !next_allowed(target)) return end();
  ++bytes_;
  ++request_.address;
  return begin_byte(target);
}

// The encoder does not store a written byte whose CRC is wrong.
bool ControlSlaves::write(bool cdm, ControlTarget& target) {
  const unsigned at = at_++;
  if (at < byte_bits) {
    bits_ = static_cast<std::uint16_t>(bits_ << 1 | (cdm ? 1 : 0));
    if (at + 1 == byte_bits && is_good_byte(bits_)) {
      target.write(request_.slave, request_.address, static_cast<std::uint8_t>(bits_ >> 4));
    }
    return cdm;
  }
  if (at == byte_bits) return target.stop_bit(next_allowed(target));
  if (!cdm || !next_allowed(target)) return end();
  ++bytes_;
  ++request_.address;
  return begin_byte(target);
}

bool ControlSlaves::command(bool cdm, ControlTarget& target) {
  const bool broadcast = request_.slaves == 0;
  const unsigned at = at_++;
  const unsigned executed_at = broadcast ? acknowledge_at : acknowledge_at + 7;
  if (at == direction_at && !cdm) return end();
  if (at == executed_at) {
    if (cdm) target.execute(request_.slaves, request_.command);
    return end();
  }
  const unsigned slave = at - direction_at;
  const bool mine = is_there(slave, target) && (request_.slaves >> slave & 1) != 0;
  return mine && target.obeys(slave, request_.command);
}

}  // namespace absenc::biss
