// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/control.hpp"

#include <algorithm>
#include <bit>

namespace absenc::biss {

namespace {

using Operation = ControlRequest::Operation;

// Frames, counted from that of the start bit, whose CDM or CDS these are.
constexpr unsigned lock_bits_at = 1;
constexpr unsigned more_slaves_at = 9;
constexpr unsigned direction_at = 16;    // CDM: R, W, then S. CDS: one later
constexpr unsigned acknowledge_at = 17;  // CDS: IDA0 to IDA7
constexpr unsigned byte_bits = 12;       // and their CRC

// The bits of one control frame, from its start bit on.
struct ControlBits {
  BitView bits;
  std::size_t start;

  [[nodiscard]] bool operator[](unsigned at) const { return start + at < bits.size && bits[start + at]; }
  [[nodiscard]] bool has(unsigned at) const { return start + at < bits.size; }
  [[nodiscard]] std::uint16_t load(unsigned at, unsigned count) const {
    return static_cast<std::uint16_t>(bits.load(start + at, count));
  }
};

bool is_good_byte(std::uint16_t bits) { return crc4_of(bits >> 4, 8) == (bits & 0xF); }

void put_locks(ControlFrame& frame, const ControlBits& cds) {
  for (unsigned i = 0; i < control_slaves && cds[lock_bits_at + i]; ++i)
    frame.slaves = static_cast<std::uint8_t>(i + 1);
  frame.more_slaves = cds[more_slaves_at];
}

// Byte after byte; `cdm` of a read only says how many.
Error take_bytes(const ControlBits& cdm, const ControlBits& cds, bool write, ControlFrame& frame) {
  for (unsigned due = direction_at + 3;; due += byte_bits + 2) {
    unsigned at = due;
    for (unsigned zeros = 0; !cds[at]; ++at) {
      zeros = cdm[at] ? 0 : zeros + 1;
      if (zeros == control_pause) return Error::timeout;
    }
    const bool first = due == direction_at + 3;
    if (first && write && at != due) return Error::bad_framing;  // the first byte that is written is not delayed
    if (!cds.has(at + byte_bits + 1) || !cdm.has(at + byte_bits)) return Error::truncated;
    const std::uint16_t answered = cds.load(at + 1, byte_bits);
    const std::uint16_t sent = write ? cdm.load(at, byte_bits) : answered;
    if (!is_good_byte(answered) || !is_good_byte(sent)) return Error::bad_checksum;
    if (answered != sent) return Error::unexpected_reply;
    if (!frame.data.push_back(static_cast<std::uint8_t>(sent >> 4))) return Error::wrong_length;
    frame.start_delay.push_back(static_cast<std::uint16_t>(at - due));
    frame.next_address_accepted = !cds[at + byte_bits + 1];
    if (!cdm[at + byte_bits + 1]) return Error::none;
    if (!frame.next_address_accepted) return Error::request_rejected;
    due = at;
  }
}

// What the host writes, by CDM alone. While an encoder is not ready the host repeats its start bit.
Error take_written(const ControlBits& cdm, ControlFrame& frame) {
  for (unsigned at = direction_at + 3;; at += byte_bits + 2) {
    while (!frame.data.empty() && cdm.has(at + byte_bits) && cdm[at] && !is_good_byte(cdm.load(at, byte_bits))) ++at;
    if (!cdm.has(at + byte_bits - 1)) return Error::truncated;
    const std::uint16_t sent = cdm.load(at, byte_bits);
    if (!is_good_byte(sent)) return Error::bad_checksum;
    if (!frame.data.push_back(static_cast<std::uint8_t>(sent >> 4))) return Error::wrong_length;
    if (!cdm[at + byte_bits + 1]) return Error::none;
  }
}

Error take_register(const ControlBits& cdm, const ControlBits& cds, ControlFrame& frame) {
  const bool write = frame.request.operation == Operation::write;
  if (!cds.has(direction_at + 2)) return Error::truncated;
  if (frame.request.slave >= frame.slaves) return Error::timeout;
  const bool first = cds[direction_at + 1];
  const bool second = cds[direction_at + 2];
  if (first == write) return write ? Error::unexpected_reply : Error::timeout;
  if (second != write) return Error::request_rejected;  // the second is inverted
  if (!cdm[direction_at + 2]) return Error::timeout;
  return take_bytes(cdm, cds, write, frame);
}

Error take_command(const ControlBits& cdm, const ControlBits& cds, ControlFrame& frame) {
  const bool broadcast = frame.request.slaves == 0;
  const unsigned executed_at = broadcast ? acknowledge_at : acknowledge_at + 7;
  if (!cdm.has(executed_at) || !cds.has(executed_at)) return Error::truncated;
  if (!cdm[direction_at]) return Error::bad_framing;
  frame.executed = cdm[executed_at];
  if (broadcast) return Error::none;
  for (unsigned i = 0; i < control_slaves; ++i) {
    if (cds[acknowledge_at + i]) frame.acknowledged |= static_cast<std::uint8_t>(1u << i);
  }
  if ((frame.acknowledged & ~frame.request.slaves) != 0) return Error::unexpected_reply;
  return frame.executed && frame.acknowledged != frame.request.slaves ? Error::request_rejected : Error::none;
}

Error take_request(const ControlBits& cdm, ControlFrame& frame) {
  if (!cdm.has(header_bits)) return Error::truncated;
  const Result<ControlRequest> request = request_of_header(cdm.load(1, header_bits));
  if (!request) return request.error();
  frame.request = *request;
  if (request->is_command()) return cdm.has(direction_at) ? Error::none : Error::truncated;
  if (!cdm.has(direction_at + 2)) return Error::truncated;
  if (cdm[direction_at] == cdm[direction_at + 1]) return Error::bad_framing;
  if (cdm[direction_at + 1]) frame.request.operation = Operation::write;
  return Error::none;
}

}  // namespace

Result<ControlFrame> decode_control(BitView cdm, BitView cds) {
  if (cdm.size == 0) return Error::wrong_length;
  const std::size_t start = cdm[0] ? 0 : cdm.end_of_run(0);
  if (start == cdm.size || (start != 0 && start < control_pause)) return Error::bad_framing;
  const ControlBits asked{cdm, start};
  ControlFrame frame;
  Error error = take_request(asked, frame);
  if (error != Error::none) return error;
  if (cds.size == 0) {
    if (frame.request.operation == Operation::write) error = take_written(asked, frame);
    return error == Error::none ? Result(frame) : error;
  }
  const ControlBits answered{cds, start};
  put_locks(frame, answered);
  error = frame.request.is_command() ? take_command(asked, answered, frame) : take_register(asked, answered, frame);
  return error == Error::none ? Result(frame) : error;
}

// ---- The host

void ControlMaster::begin(const ControlRequest& request) {
  frame_ = {};
  frame_.request = request;
  header_ = header_of(request);
  at_ = 0;
  delay_ = 0;
  state_ = State::header;
  look_ = false;
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

void ControlMaster::look() {
  read(0, 0, 1);
  look_ = true;
}

bool ControlMaster::next(bool cds) {
  const bool cdm = step(cds);
  zeros_ = cdm ? 0 : std::min(zeros_ + 1, control_pause);
  return cdm;
}

void ControlMaster::fail(Error error) {
  zeros_ = 0;  // whoever has not seen this frame counts from the next
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
    if (cds) return end(Error::bad_framing);  // nobody has been asked
    at_ = 1;
    return true;
  }
  if (at_ < more_slaves_at && cds && frame_.slaves == at_ - 1) frame_.slaves = static_cast<std::uint8_t>(at_);
  if (at_ == more_slaves_at) {
    frame_.more_slaves = cds;
    if (look_) return end(Error::none);
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
      // Of a write that nobody answers the lock bit tells whether somebody refuses.
      return end(frame_.request.slave < frame_.slaves ? Error::request_rejected : Error::timeout);
  }
}

// The start bit goes on until the encoder's comes: it may need 20 ms.
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
  if (at == direction_at) return true;  // S
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
      if (at_++ == header_bits) return end_header();
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

// Who receives a wrong one is silent.
bool ControlSlaves::end_header() {
  const Result<ControlRequest> request = request_of_header(bits_);
  const unsigned known = std::min(count_, control_slaves);
  if (!request) return end();
  request_ = *request;
  if (request_.is_command()) {
    state_ = State::command;
  } else if (request_.slave < known) {
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

// The host's start bit, which goes on while the encoder is not ready; `bits_` of a read are then what goes out.
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

// CDM is looked at in the frame of P only.
bool ControlSlaves::read(bool cdm, ControlTarget& target) {
  const unsigned at = at_++;
  if (at < byte_bits) return (bits_ >> (byte_bits - 1 - at) & 1) != 0;
  if (at == byte_bits) return !next_allowed(target);
  if (!cdm || !next_allowed(target)) return end();
  ++bytes_;
  ++request_.address;
  return begin_byte(target);
}

// A byte whose CRC is wrong comes back as it was sent, and is not stored.
bool ControlSlaves::write(bool cdm, ControlTarget& target) {
  const unsigned at = at_++;
  if (at < byte_bits) {
    bits_ = static_cast<std::uint16_t>(bits_ << 1 | (cdm ? 1 : 0));
    if (at + 1 == byte_bits && is_good_byte(bits_)) {
      target.write(request_.slave, request_.address, static_cast<std::uint8_t>(bits_ >> 4));
    }
    return cdm;
  }
  if (at == byte_bits) return !next_allowed(target);
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
  const bool mine = slave < std::min(count_, control_slaves) && (request_.slaves >> slave & 1) != 0;
  return mine && target.obeys(slave, request_.command);
}

namespace {

struct Willing final : ControlTarget {
  [[nodiscard]] bool allows(unsigned, unsigned, bool) const override { return true; }
  [[nodiscard]] std::uint8_t read(unsigned, unsigned) override { return 0; }
  void write(unsigned, unsigned, std::uint8_t) override {}
  [[nodiscard]] bool is_ready() const override { return true; }
  [[nodiscard]] bool obeys(unsigned, unsigned) const override { return true; }
  void execute(std::uint8_t, unsigned) override {}
};

}  // namespace

void append_cdm(ControlMaster master, unsigned slaves, BitBuffer<1024>& out) {
  Willing target;
  ControlSlaves answering(slaves);
  const auto add = [&](bool cdm) {
    answering.take(cdm, target);
    out.append(cdm ? 1 : 0, 1);
  };
  while (!master.is_over()) add(master.next(answering.cds()));
  for (unsigned i = 0; i < control_pause; ++i) add(false);
}

}  // namespace absenc::biss
