// SPDX-License-Identifier: Apache-2.0
// Both sides of BiSS control frames, which README.md draws. Source: BiSS C Protocol Description rev D2.
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

/// Number of zeros of CDM before the start bit of a control frame; as many zeros within a control frame end it.
inline constexpr unsigned control_pause = 14;
inline constexpr unsigned control_slaves = 8;    ///< Greatest number of slaves that can have an ID.
inline constexpr std::size_t control_most = 64;  ///< Greatest number of data bytes of one control frame.

/// CRC of control frames: x^4 + x + 1, inverted.
inline constexpr Check crc4{4, 0x3};

/// Returns the CRC of 4 bits over the lowest `count` bits of a number.
[[nodiscard]] constexpr std::uint8_t crc4_of(std::uint64_t bits, unsigned count) {
  return static_cast<std::uint8_t>(detail::crc_bit_by_bit(crc4, BitNumber{bits, count}, 0, count));
}

/// The request of a control frame: access registers of one slave, or send a command.
struct ControlRequest {
  /// Kinds of requests.
  enum class Operation : std::uint8_t { read, write, command };
  Operation operation = Operation::read;  ///< Whether registers are read or written, or a command is sent.
  std::uint8_t slave = 0;                 ///< ID of the slave whose registers are accessed, 0 to 7.
  std::uint8_t address = 0;               ///< Address of the first register, 0 to 127.
  /// Slaves that receive a command: bit n is slave n; 0: all slaves, without acknowledgement.
  std::uint8_t slaves = 0;
  std::uint8_t command = 0;  ///< Number of the command, 0 to 3.

  /// Returns whether the request is a command.
  [[nodiscard]] constexpr bool is_command() const { return operation == Operation::command; }
  /// Returns whether two requests are equal in all members.
  friend constexpr bool operator==(const ControlRequest&, const ControlRequest&) = default;
};

inline constexpr unsigned header_bits = 15;  ///< Number of header bits after the start bit: CTS, ten bits, CRC.

/// Returns the header bits of a control frame with this request.
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

/// Decodes the header of a control frame, which does not show whether registers are read or written. Error:
/// bad_checksum.
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

/// A control frame: the request of the host and the answer of the encoders.
struct ControlFrame {
  ControlRequest request{};       ///< Request of the host.
  std::uint8_t slaves = 0;        ///< Number of slaves with an ID, from the lock bits.
  bool more_slaves = false;       ///< Whether there are also slaves without an ID on the line.
  ByteBuffer<control_most> data;  ///< Values of the registers that were read or written.
  /// For each byte, the number of frames by which the encoder delayed it; empty if decoded without CDS bits.
  Buffer<std::uint16_t, control_most> start_delay;
  /// Whether the encoder permits access to the register after the last one (P = 0).
  bool next_address_accepted = false;
  std::uint8_t acknowledged = 0;  ///< Slaves that acknowledged a command: bit n is slave n.
  bool executed = false;          ///< Whether the host let the slaves execute the command (bit EX).
};

/// Decodes a control frame from the bits of CDM and CDS, one of each per position frame. The start bit is the first
/// bit, or follows at least 14 zeros. Without CDS bits only the request and written bytes are decoded.
[[nodiscard]] Result<ControlFrame> decode_control(BitView cdm, BitView cds);

/// The host's side of control frames, without a line.
class ControlMaster {
 public:
  /// Construct once: the object counts the zeros before the next start bit across control frames.
  ControlMaster() = default;

  /// Begins to read `count` registers (1 to 64) of `slave` from `address` on.
  void read(unsigned slave, unsigned address, std::size_t count);
  /// Begins to write `bytes`, 1 to 64, to the registers of `slave` from `address` on.
  void write(unsigned slave, unsigned address, Bytes bytes);
  /// Begins to send a command to the slaves in the mask `slaves`; 0: to all slaves.
  void command(std::uint8_t slaves, unsigned command);
  /// Begins to count the slaves with an ID on the line; the result will be `frame().slaves`.
  void count_slaves();

  /// Processes the CDS of a received frame and returns the CDM to send after that frame.
  bool next(bool cds);
  /// Ends the control frame with `error`, for example because a position frame was lost.
  void fail(Error error);

  /// Returns whether no control frame is in progress.
  [[nodiscard]] bool is_over() const { return over_; }
  /// Returns whether the host waits for the encoder's start bit of a data byte.
  [[nodiscard]] bool is_waiting() const { return !over_ && state_ == State::start; }
  /// Returns the error that ended the control frame; `none` while it runs or after success.
  [[nodiscard]] Error error() const { return error_; }
  /// Returns the control frame as received so far.
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
  std::uint16_t in_ = 0;  // Bits of the present data byte and its CRC that were received so far.
  std::uint16_t out_ = 0;
  std::size_t count_ = 0;  // Number of data bytes to transfer in this control frame.
  // Number of frames since the start bit of the control frame or, while a data byte is transferred, of this byte.
  unsigned at_ = 0;
  unsigned zeros_ = 0;
  unsigned delay_ = 0;
  State state_ = State::header;
  bool only_counts_slaves_ = false;
  bool over_ = true;
  bool answered_ = false;  // Value of the first of the two direction bits in CDS.
  Error error_ = Error::none;
};

/// Appends to `out` the CDM bits of the control frame that `master` has begun, for `slaves` encoders that answer at
/// once.
void append_cdm(ControlMaster master, unsigned slaves, BitBuffer<1024>& out);

/// Registers and commands of virtual encoders. Its functions are called only with the ID `slave` of an existing slave.
struct ControlTarget {
  /// Returns whether the register of `slave` at `address` may be read, or written if `write`.
  [[nodiscard]] virtual bool allows(unsigned slave, unsigned address, bool write) const = 0;
  /// Returns the value of the register of `slave` at `address`.
  [[nodiscard]] virtual std::uint8_t read(unsigned slave, unsigned address) = 0;
  /// Writes `value` to the register of `slave` at `address`.
  virtual void write(unsigned slave, unsigned address, std::uint8_t value) = 0;
  /// Returns the bit P that an encoder sends after a register. `next_allowed`: whether the next register may be
  /// accessed.
  [[nodiscard]] virtual bool stop_bit(bool next_allowed) const { return !next_allowed; }
  /// Returns whether the next data byte can begin now.
  [[nodiscard]] virtual bool is_ready() const = 0;
  /// Returns whether control communication of `slave` is on.
  [[nodiscard]] virtual bool listens(unsigned) const { return true; }
  /// Returns whether `slave` acknowledges the command with number `command`.
  [[nodiscard]] virtual bool obeys(unsigned slave, unsigned command) const = 0;
  /// Executes a command on all slaves whose bit is set in `slaves`; 0: on all slaves.
  virtual void execute(std::uint8_t slaves, unsigned command) = 0;

 protected:
  ~ControlTarget() = default;
};

/// The encoders' side of control frames, for all slaves on one line.
class ControlSlaves {
 public:
  /// Creates the encoders' side of a line with `count` slaves.
  explicit ControlSlaves(unsigned count) : count_(count) {}

  /// Processes the CDM that the host sent after the last frame, and sets `cds()`.
  void take(bool cdm, ControlTarget& target);
  /// Returns the CDS that the slaves send in the next frame.
  [[nodiscard]] bool cds() const { return cds_; }
  /// Resets control communication to its state after power on.
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
  unsigned bytes_ = 0;  // Number of data bytes before the present one in this control frame.
  unsigned zeros_ = 0;
  bool cds_ = false;
};

}  // namespace absenc::biss
