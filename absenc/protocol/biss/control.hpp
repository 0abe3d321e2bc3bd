// SPDX-License-Identifier: Apache-2.0
// BiSS control communication. Each frame carries one bit of the host (CDM, after the frame) and one of the encoders
// (CDS, in the next frame). This file has the content of a control frame and both sides of it. README.md draws it.
// Source: BiSS C Protocol Description rev D2.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/biss/check.hpp"

namespace absenc::biss {

inline constexpr unsigned control_pause =
    14;  ///< zeros before a start bit; within a control frame, as many zeros end it
inline constexpr unsigned control_slaves = 8;    ///< the most slaves that can have an ID
inline constexpr std::size_t control_most = 64;  ///< the most bytes of one control frame

/// CRC of control frames: x^4 + x + 1, inverted; over CTS and the ten bits after it, and over each byte.
inline constexpr Check crc4{4, 0x3};

/// Returns the CRC of 4 bits.
[[nodiscard]] constexpr std::uint8_t crc4_of(std::uint64_t bits, unsigned count) {
  return static_cast<std::uint8_t>(detail::crc_bit_by_bit(crc4, BitNumber{bits, count}, 0, count));
}

/// The request of a control frame.
struct ControlRequest {
  /// Kind of the request.
  enum class Operation : std::uint8_t { read, write, command };
  Operation operation = Operation::read;  ///< Kind of the request.
  std::uint8_t slave = 0;                 ///< slave whose register is accessed, 0 to 7
  std::uint8_t address = 0;               ///< address of the first register, 0 to 127
  std::uint8_t slaves = 0;  ///< slaves that receive a command: bit n is slave n; 0: all slaves, without acknowledgement
  std::uint8_t command = 0;  ///< number of a command, 0 to 3

  /// Returns whether the request is a command.
  [[nodiscard]] constexpr bool is_command() const { return operation == Operation::command; }
  /// Compares all members.
  friend constexpr bool operator==(const ControlRequest&, const ControlRequest&) = default;
};

inline constexpr unsigned header_bits = 15;  ///< bits after the start bit: CTS, ten bits, CRC

/// Returns the header of a control frame.
[[nodiscard]] constexpr std::uint16_t header_of(const ControlRequest& request) {
  std::uint32_t bits = 0;
  if (request.is_command()) {
    for (unsigned i = 0; i < 8; ++i) bits = bits << 1 | (request.slaves >> i & 1u);
    bits = bits << 2 | (request.command & 3u);
  } else {
    bits = 1u << 10 | (request.slave & 7u) << 7 | (request.address & 0x7Fu);
  }
  return static_cast<std::uint16_t>(bits << 4 | crc4_of(bits, 11));
}

/// Decodes a header. Whether a register is read or written is sent after the header. Error: bad_checksum.
[[nodiscard]] constexpr Result<ControlRequest> request_of_header(std::uint16_t header) {
  const std::uint32_t bits = header >> 4;
  if (crc4_of(bits, 11) != (header & 0xF)) return Error::bad_checksum;
  ControlRequest request;
  if ((bits >> 10 & 1) != 0) {
    request.slave = static_cast<std::uint8_t>(bits >> 7 & 7);
    request.address = static_cast<std::uint8_t>(bits & 0x7F);
  } else {
    request.operation = ControlRequest::Operation::command;
    for (unsigned i = 0; i < 8; ++i) request.slaves |= static_cast<std::uint8_t>((bits >> (9 - i) & 1) << i);
    request.command = static_cast<std::uint8_t>(bits & 3);
  }
  return request;
}

/// A control frame with the answer of the encoders.
struct ControlFrame {
  ControlRequest request{};                         ///< Request of the frame.
  std::uint8_t slaves = 0;                          ///< number of slaves with an ID, from the lock bits
  bool more_slaves = false;                         ///< there are slaves without an ID
  ByteBuffer<control_most> data;                    ///< Data bytes of the frame.
  Buffer<std::uint16_t, control_most> start_delay;  ///< number of frames by which each byte was delayed
  bool next_address_accepted = false;               ///< Whether the next register may be accessed too (P = 0).
  std::uint8_t acknowledged = 0;                    ///< slaves that acknowledged a command: bit n is slave n
  bool executed = false;                            ///< Whether the host had the command executed.
};

/// Decodes a control frame from the bits of CDM and CDS, one of each per frame. Before the start bit may be zeros or
/// nothing. Without CDS bits only the request is decoded: written data is taken from CDM, and repeated start bits are
/// separated from data by the CRC. Errors: wrong_length (no bits), bad_framing (no start bit, too few zeros before it,
/// or neither read nor write), truncated, bad_checksum (header or a byte), timeout (no slave has this ID, or it does
/// not answer), unexpected_reply (written data is returned with another value), request_rejected.
[[nodiscard]] Result<ControlFrame> decode_control(BitView cdm, BitView cds);

/// The host's side of one control frame. It owns no line: the caller passes the CDS of each frame and sends the CDM
/// that it returns.
class ControlMaster {
 public:
  /// Construct once and use for several control frames: it counts the zeros before the next start bit across them.
  ControlMaster() = default;

  /// Begins to read `count` registers, 1 to 64.
  void read(unsigned slave, unsigned address, std::size_t count);
  /// Begins to write `bytes`.
  void write(unsigned slave, unsigned address, Bytes bytes);
  /// Begins a command to the slaves in the mask `slaves`; 0: to all.
  void command(std::uint8_t slaves, unsigned command);
  /// Begins to count the slaves on the line; the result is `frame().slaves`.
  void count_slaves();

  /// Takes the CDS of a received frame and returns the CDM to send after it.
  bool next(bool cds);
  /// Ends the control frame with `error` because a frame, and with it a CDS, was lost.
  void fail(Error error);

  /// Returns whether the control frame has ended.
  [[nodiscard]] bool is_over() const { return over_; }
  /// Returns whether the host waits for a start bit of the encoder, which may take 20 ms.
  [[nodiscard]] bool is_waiting() const { return !over_ && state_ == State::start; }
  /// Returns the error that ended the control frame, or none.
  [[nodiscard]] Error error() const { return error_; }
  /// Returns the control frame; after an error, with the bytes before it.
  [[nodiscard]] const ControlFrame& frame() const { return frame_; }

 private:
  enum class State : std::uint8_t { header, direction, start, byte, acknowledge };
  void begin(const ControlRequest& request);
  bool end(Error error);
  bool step(bool cds);
  bool header(bool cds);
  bool direction(bool cds);
  bool started(bool cds);
  bool byte(bool cds);
  bool end_byte(bool is_last);
  bool acknowledge(bool cds);

  ControlFrame frame_{};
  ByteBuffer<control_most> written_;
  std::uint16_t header_ = 0;
  std::uint16_t in_ = 0;  // received bits of the present byte and its CRC
  std::uint16_t out_ = 0;
  std::size_t count_ = 0;  // number of bytes to transfer
  // Index of the next frame: counted from the start bit of the control frame, or from that of the byte.
  unsigned at_ = 0;
  unsigned zeros_ = 0;
  unsigned delay_ = 0;
  State state_ = State::header;
  bool only_counts_slaves_ = false;
  bool over_ = true;
  bool answered_ = false;  // first of the two direction bits in CDS
  Error error_ = Error::none;
};

/// Appends the CDM bits of the control frame that `master` has begun, one per frame, including the zeros before the
/// start bit and after the end. Assumes encoders that obey at once; `slaves`: number of slaves with an ID.
void append_cdm(ControlMaster master, unsigned slaves, BitBuffer<1024>& out);

/// The encoders as ControlSlaves uses them. `slave` is always the ID of an existing slave.
struct ControlTarget {
  /// Returns whether the register may be read, or written.
  [[nodiscard]] virtual bool allows(unsigned slave, unsigned address, bool write) const = 0;
  /// Returns a register.
  [[nodiscard]] virtual std::uint8_t read(unsigned slave, unsigned address) = 0;
  /// Writes a register.
  virtual void write(unsigned slave, unsigned address, std::uint8_t value) = 0;
  /// Returns the bit P after a register. `next_allowed`: whether the next register may be accessed too.
  [[nodiscard]] virtual bool stop_bit(bool next_allowed) const { return !next_allowed; }
  /// Returns whether the byte can begin now: the encoder has its value, or can take a new one.
  [[nodiscard]] virtual bool is_ready() const = 0;
  /// Returns whether the slave takes part in register accesses. One command switches that off, another on; all slaves
  /// receive both.
  [[nodiscard]] virtual bool listens(unsigned) const { return true; }
  /// Returns whether the slave executes this command.
  [[nodiscard]] virtual bool obeys(unsigned slave, unsigned command) const = 0;
  /// Executes a command on the slaves whose bits are set.
  virtual void execute(std::uint8_t slaves, unsigned command) = 0;

 protected:
  ~ControlTarget() = default;
};

/// The encoders' side of control frames, for all slaves on the line.
class ControlSlaves {
 public:
  /// `count`: number of slaves on the line.
  explicit ControlSlaves(unsigned count) : count_(count) {}

  /// Takes the CDM after the last frame; sets the CDS of the next frame, see `cds`.
  void take(bool cdm, ControlTarget& target);
  /// Returns the bit that the slaves send next.
  [[nodiscard]] bool cds() const { return cds_; }
  /// Restarts as after power on.
  void reset() { *this = ControlSlaves(count_); }

 private:
  enum class State : std::uint8_t { idle, header, direction, start, read, write, command };
  bool step(bool cdm, ControlTarget& target);
  bool end_header(const ControlTarget& target);
  bool direction(bool cdm, ControlTarget& target);
  bool begin_byte(ControlTarget& target);
  bool read(bool cdm, ControlTarget& target);
  bool write(bool cdm, ControlTarget& target);
  bool command(bool cdm, ControlTarget& target);
  bool end(bool cds = false);
  [[nodiscard]] bool next_allowed(const ControlTarget& target) const;
  [[nodiscard]] bool is_there(unsigned slave, const ControlTarget& target) const {
    return slave < count_ && slave < control_slaves && target.listens(slave);
  }

  unsigned count_;
  State state_ = State::idle;
  ControlRequest request_{};
  std::uint16_t bits_ = 0;
  unsigned at_ = 0;
  unsigned bytes_ = 0;  // number of bytes transferred in this control frame
  unsigned zeros_ = 0;
  bool cds_ = false;
};

}  // namespace absenc::biss
