// SPDX-License-Identifier: Apache-2.0
// What the host makes of the bytes beside the positions: cycles of channel 2, and the register access in channel 3.
#pragma once

#include <cstdint>
#include <optional>

#include "absenc/core/time.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/registers.hpp"

namespace absenc::encolink {

/// Collects a cycle, a byte a frame. In step only after a reset of the channels, until a frame is lost.
class CycleReader {
 public:
  constexpr void restart() { bytes_.clear(), in_step_ = true; }
  constexpr void lose_step() { in_step_ = false; }
  [[nodiscard]] constexpr bool in_step() const { return in_step_; }

  /// The next frame. Nothing while the cycle is incomplete; then the cycle, bad_checksum, out_of_range or
  /// cross_check_failed (its position is not that of the frame with which it began). An error ends the step.
  constexpr std::optional<Result<Cycle>> feed(const Format& format, const Position& frame) {
    if (!in_step_) return std::nullopt;
    if (bytes_.empty()) first_ = frame;
    bytes_.push_back(frame.channel2);
    if (bytes_.size() < format.cycle_bytes()) return std::nullopt;
    Result<Cycle> cycle = decode_cycle(format, bytes_);
    if (cycle && !same_place(cycle->position, first_)) cycle = Error::cross_check_failed;
    bytes_.clear();
    in_step_ = cycle.has_value();
    return cycle;
  }

 private:
  ReplyBytes bytes_;
  Position first_{};
  bool in_step_ = false;
};

/// One register access, a byte at a time in both directions.
class RegisterAccess {
 public:
  enum class State : std::uint8_t {
    none,
    asking,   // request bytes go out
    waiting,  // all are out: idle or busy comes back
    status,   // the status comes next
    data,     // then the data
    done,
    ignored,  // the encoder stays idle
    nonsense  // a byte that cannot be
  };

  constexpr void start(const RegisterRequest& request) {
    request_ = request;
    restart();
  }
  /// The same request from its first byte; the channels must have been reset.
  constexpr void restart() {
    bytes_ = encode_access(request_);
    sent_ = idle_cycles_ = 0;
    data_.clear();
    busy_ = false;
    state_ = State::asking;
  }
  constexpr void stop() { state_ = State::none; }

  /// The `ra` byte of the next frame.
  constexpr std::uint8_t next_byte(Time now) {
    if (state_ != State::asking) return 0;
    const std::uint8_t byte = bytes_[sent_++];
    if (sent_ == bytes_.size()) state_ = State::waiting, asked_ = now;
    return byte;
  }

  /// The channel 3 byte of a good cycle.
  constexpr void feed(std::uint8_t byte) {
    switch (state_) {
      case State::waiting:
        wait(byte);
        break;
      case State::status:
        status_ = static_cast<AccessStatus>(byte);
        state_ = reads() && status_ == AccessStatus::ok ? State::data : State::done;
        break;
      case State::data:
        data_.push_back(byte);
        if (data_.size() == request_.length) state_ = State::done;
        break;
      default:
        break;
    }
  }

  [[nodiscard]] constexpr State state() const { return state_; }
  [[nodiscard]] constexpr bool active() const { return state_ >= State::asking && state_ <= State::data; }
  [[nodiscard]] constexpr bool reads() const { return request_.operation == RegisterRequest::Operation::read; }
  /// Whether the encoder may have executed the request.
  [[nodiscard]] constexpr bool was_asked() const { return sent_ == bytes_.size(); }
  [[nodiscard]] constexpr bool busy() const { return busy_; }
  [[nodiscard]] constexpr Time asked() const { return asked_; }
  [[nodiscard]] constexpr AccessStatus status() const { return status_; }
  [[nodiscard]] constexpr const RegisterRequest& request() const { return request_; }
  [[nodiscard]] constexpr Bytes data() const { return data_; }

 private:
  constexpr void wait(std::uint8_t byte) {
    busy_ = byte == channel3::busy;
    if (busy_) return;
    if (byte == channel3::idle) {
      // The cycle under way when the last byte went out may still say idle, and a few more while the encoder thinks.
      if (++idle_cycles_ > idle_cycles_allowed) state_ = State::ignored;
    } else {
      state_ = byte == (reads() ? channel3::read_ready : channel3::write_ready) ? State::status : State::nonsense;
    }
  }

  static constexpr unsigned idle_cycles_allowed = 8;

  RegisterRequest request_{};
  AccessBytes bytes_;
  std::size_t sent_ = 0;
  ByteBuffer<access_capacity> data_;
  State state_ = State::none;
  AccessStatus status_{};
  unsigned idle_cycles_ = 0;
  bool busy_ = false;
  Time asked_{};
};

}  // namespace absenc::encolink
