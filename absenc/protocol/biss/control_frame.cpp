// SPDX-License-Identifier: Apache-2.0
// Decodes a control frame from its recorded bits, and makes the CDM bits of a request.
#include "absenc/protocol/biss/control.hpp"

#include "absenc/protocol/biss/control_bits.hpp"

namespace absenc::biss {

using namespace control_bits;

namespace {

// The bits of one control frame from its start bit on; `[]` gives 0 beyond the end.
struct ControlBits {
  BitView bits;
  std::size_t start;

  [[nodiscard]] bool operator[](unsigned at) const { return start + at < bits.size && bits[start + at]; }
  [[nodiscard]] bool has(unsigned at) const { return start + at < bits.size; }
  [[nodiscard]] std::uint16_t load(unsigned at, unsigned count) const {
    return static_cast<std::uint16_t>(bits.load(start + at, count));
  }
};

void decode_lock_bits(ControlFrame& frame, const ControlBits& cds) {
  for (unsigned i = 0; i < control_slaves && cds[lock_bits_at + i]; ++i)
    frame.slaves = static_cast<std::uint8_t>(i + 1);
  frame.more_slaves = cds[more_slaves_at];
}

// Decodes the bytes of a register access. For a read, their values are taken from `cds` alone.
Error decode_bytes(const ControlBits& cdm, const ControlBits& cds, bool write, ControlFrame& frame) {
  // The encoder refused the next register by P = 1; some encoders send that register nevertheless.
  bool refused = false;
  for (unsigned due = direction_at + 3;; due += byte_bits + 2) {
    unsigned at = due;
    for (unsigned zeros = 0; !cds[at]; ++at) {
      zeros = cdm[at] ? 0 : zeros + 1;
      if (zeros == control_pause) return refused ? Error::request_rejected : Error::timeout;
    }
    const bool first = due == direction_at + 3;
    if (first && write && at != due) return Error::bad_framing;  // an encoder never delays the first written byte
    if (!cds.has(at + byte_bits + 1) || !cdm.has(at + byte_bits)) return Error::truncated;
    const std::uint16_t cds_bits = cds.load(at + 1, byte_bits);
    const std::uint16_t sent = write ? cdm.load(at, byte_bits) : cds_bits;
    if (!is_good_byte(cds_bits) || !is_good_byte(sent)) return Error::bad_checksum;
    if (cds_bits != sent) return Error::unexpected_reply;
    if (!frame.data.push_back(static_cast<std::uint8_t>(sent >> 4))) return Error::wrong_length;
    frame.start_delay.push_back(static_cast<std::uint16_t>(at - due));
    frame.next_address_accepted = !cds[at + byte_bits + 1];
    if (!cdm[at + byte_bits + 1]) return Error::none;
    refused = !frame.next_address_accepted;
    due = at;
  }
}

// Decodes the written bytes from CDM alone, in which the host repeats its start bit while an encoder is not ready.
Error decode_written(const ControlBits& cdm, ControlFrame& frame) {
  for (unsigned at = direction_at + 3;; at += byte_bits + 2) {
    while (!frame.data.empty() && cdm.has(at + byte_bits) && cdm[at] && !is_good_byte(cdm.load(at, byte_bits))) ++at;
    if (!cdm.has(at + byte_bits - 1)) return Error::truncated;
    const std::uint16_t sent = cdm.load(at, byte_bits);
    if (!is_good_byte(sent)) return Error::bad_checksum;
    if (!frame.data.push_back(static_cast<std::uint8_t>(sent >> 4))) return Error::wrong_length;
    if (!cdm[at + byte_bits + 1]) return Error::none;
  }
}

Error decode_register_access(const ControlBits& cdm, const ControlBits& cds, ControlFrame& frame) {
  const bool write = frame.request.operation == Operation::write;
  if (!cds.has(direction_at + 2)) return Error::truncated;
  if (frame.request.slave >= frame.slaves) return Error::timeout;
  const bool first = cds[direction_at + 1];
  const bool second = cds[direction_at + 2];
  if (first == write) return write ? Error::unexpected_reply : Error::timeout;
  // A slave that accepts the access sends the inverted first direction bit as the second.
  if (second != write) return Error::request_rejected;
  if (!cdm[direction_at + 2]) return Error::timeout;
  return decode_bytes(cdm, cds, write, frame);
}

Error decode_command(const ControlBits& cdm, const ControlBits& cds, ControlFrame& frame) {
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

Error decode_request(const ControlBits& cdm, ControlFrame& frame) {
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
  const ControlBits cdm_bits{cdm, start};
  ControlFrame frame;
  Error error = decode_request(cdm_bits, frame);
  if (error != Error::none) return error;
  if (cds.size == 0) {
    if (frame.request.operation == Operation::write) error = decode_written(cdm_bits, frame);
    return error == Error::none ? Result(frame) : error;
  }
  const ControlBits cds_bits{cds, start};
  decode_lock_bits(frame, cds_bits);
  error = frame.request.is_command() ? decode_command(cdm_bits, cds_bits, frame)
                                     : decode_register_access(cdm_bits, cds_bits, frame);
  return error == Error::none ? Result(frame) : error;
}

namespace {

struct AcceptingTarget final : ControlTarget {
  [[nodiscard]] bool allows(unsigned, unsigned, bool) const override { return true; }
  [[nodiscard]] std::uint8_t read(unsigned, unsigned) override { return 0; }
  void write(unsigned, unsigned, std::uint8_t) override {}
  [[nodiscard]] bool is_ready() const override { return true; }
  [[nodiscard]] bool obeys(unsigned, unsigned) const override { return true; }
  void execute(std::uint8_t, unsigned) override {}
};

}  // namespace

void append_cdm(ControlMaster master, unsigned slaves, BitBuffer<1024>& out) {
  AcceptingTarget target;
  ControlSlaves answering(slaves);
  const auto add = [&](bool cdm) {
    answering.take(cdm, target);
    out.append(cdm ? 1 : 0, 1);
  };
  while (!master.is_over()) add(master.next(answering.cds()));
  for (unsigned i = 0; i < control_pause; ++i) add(false);
}

}  // namespace absenc::biss
