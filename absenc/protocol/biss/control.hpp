// SPDX-License-Identifier: Apache-2.0
// BiSS control communication: one bit of the host (CDM) behind each frame, one of the encoders (CDS) in the next. What
// a whole control frame says, and the two sides of it. README.md draws it. Source: BiSS C Protocol Description rev D2.
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

inline constexpr unsigned control_pause = 14;    // zeros before a start bit; anywhere they end the control frame
inline constexpr unsigned control_slaves = 8;    // that can have an ID
inline constexpr std::size_t control_most = 64;  // bytes in one go

/// x^4 + x + 1, inverted: over CTS and the ten bits behind it, and over each byte.
inline constexpr Check crc4{4, 0x3};

[[nodiscard]] constexpr std::uint8_t crc4_of(std::uint64_t bits, unsigned count) {
  return static_cast<std::uint8_t>(detail::crc_bit_by_bit(crc4, BitNumber{bits, count}, 0, count));
}

struct ControlRequest {
  enum class Operation : std::uint8_t { read, write, command } operation = Operation::read;
  std::uint8_t slave = 0;    // of a register: 0 to 7
  std::uint8_t address = 0;  // of the first register: 0 to 127
  std::uint8_t slaves = 0;   // of a command: bit n is slave n; none: all of them, who do not answer
  std::uint8_t command = 0;  // 0 to 3

  [[nodiscard]] constexpr bool is_command() const { return operation == Operation::command; }
  friend constexpr bool operator==(const ControlRequest&, const ControlRequest&) = default;
};

inline constexpr unsigned header_bits = 15;  // behind the start bit: CTS, ten bits, CRC

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

/// What the header says; whether a register is read or written follows it. Error: bad_checksum.
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

/// A control frame with what was answered.
struct ControlFrame {
  ControlRequest request{};
  std::uint8_t slaves = 0;   // that have an ID, as the lock bits say
  bool more_slaves = false;  // there are some without
  ByteBuffer<control_most> data;
  Buffer<std::uint16_t, control_most> start_delay;  // of each byte, in frames
  bool next_address_accepted = false;
  std::uint8_t acknowledged = 0;  // of a command: bit n is slave n
  bool executed = false;
};

/// Of the bits of CDM and CDS, one each for every frame; without those of CDS what is asked. What is before the start
/// bit are zeros, or nothing. What is written is taken from CDM alone where there are no bits of CDS; a start bit that
/// was repeated is then told from data by the CRC. Errors: wrong_length (no bits), bad_framing (no start bit, or not
/// enough zeros before it, or neither a read nor a write), truncated, bad_checksum (of the header or a byte), timeout
/// (nobody has this ID, or it does not answer), unexpected_reply (what is written comes back otherwise),
/// request_rejected.
[[nodiscard]] Result<ControlFrame> decode_control(BitView cdm, BitView cds);

/// The host's side of one control frame. It owns no line: each frame of the encoder brings a CDS, and asks for a CDM.
class ControlMaster {
 public:
  /// The zeros before the next start bit are counted over several of them.
  ControlMaster() = default;

  /// Reads `count` registers, 1 to 64.
  void read(unsigned slave, unsigned address, std::size_t count);
  void write(unsigned slave, unsigned address, Bytes bytes);
  /// To the slaves of this mask; of none to all.
  void command(std::uint8_t slaves, unsigned command);
  /// Only looks who is there: `frame().slaves`.
  void look();

  /// A frame came with this CDS: the CDM behind it.
  bool next(bool cds);
  /// A frame was lost, and with it a CDS: what was asked ends with this error.
  void fail(Error error);

  [[nodiscard]] bool is_over() const { return over_; }
  /// Whether it waits for a start bit of the encoder, which may take 20 ms.
  [[nodiscard]] bool is_waiting() const { return !over_ && state_ == State::start; }
  [[nodiscard]] Error error() const { return error_; }
  /// What was found; of several bytes those before the error.
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
  std::uint16_t in_ = 0;  // bits of this byte and its CRC
  std::uint16_t out_ = 0;
  std::size_t count_ = 0;  // bytes wanted
  unsigned at_ = 0;        // the frame since the start bit; since that of the byte
  unsigned zeros_ = 0;
  unsigned delay_ = 0;
  State state_ = State::header;
  bool look_ = false;
  bool over_ = true;
  bool answered_ = false;  // the first of the two bits of direction
  Error error_ = Error::none;
};

/// Appends what the host says for what `master` has begun: a bit of CDM for each frame, from the zeros before the start
/// bit to those behind, as encoders that do all of it at once would be told. `slaves` of them have an ID.
void append_cdm(ControlMaster master, unsigned slaves, BitBuffer<1024>& out);

/// What the encoders do with what is asked of them: `slave` is one of theirs.
struct ControlTarget {
  /// Whether the register may be read, or written.
  [[nodiscard]] virtual bool allows(unsigned slave, unsigned address, bool write) const = 0;
  [[nodiscard]] virtual std::uint8_t read(unsigned slave, unsigned address) = 0;
  virtual void write(unsigned slave, unsigned address, std::uint8_t value) = 0;
  /// The bit P behind a register, where the one behind it may be accessed so or not.
  [[nodiscard]] virtual bool stop_bit(bool next_allowed) const { return !next_allowed; }
  /// Whether the byte can begin now: the encoder has it, or can take it.
  [[nodiscard]] virtual bool is_ready() const = 0;
  /// Whether the slave takes part: the command that ends that is taken back by another, which all hear.
  [[nodiscard]] virtual bool listens(unsigned) const { return true; }
  /// Whether the slave does this.
  [[nodiscard]] virtual bool obeys(unsigned slave, unsigned command) const = 0;
  virtual void execute(std::uint8_t slaves, unsigned command) = 0;

 protected:
  ~ControlTarget() = default;
};

/// The encoders' side, of all that are on the line.
class ControlSlaves {
 public:
  explicit ControlSlaves(unsigned count) : count_(count) {}

  /// The host's CDM behind the last frame: what the CDS of the next is, see `cds`.
  void take(bool cdm, ControlTarget& target);
  [[nodiscard]] bool cds() const { return cds_; }
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
  unsigned bytes_ = 0;  // of this control frame
  unsigned zeros_ = 0;
  bool cds_ = false;
};

}  // namespace absenc::biss
