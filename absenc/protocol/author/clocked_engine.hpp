// SPDX-License-Identifier: Apache-2.0
// Host side of a clocked line: waits until the clock has rested, clocks bits out of the encoder, and delivers them. It
// knows no protocol, and is compiled once.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// Rate and pause of the clock, which the options of the encoder select.
struct ClockedHostTimes {
  std::uint32_t rate = 0;  ///< rate of the clock in Hz, set before the first transfer; 0: the line keeps its rate
  Time rest{};  ///< shortest pause of the clock before each transfer, after which the encoder latches a new position
};

/// Conversation that clocks one transfer after the other; a subclass decides the number of clocks and handles the bits.
/// The host drives the clock, so the engine has no timeout and repeats nothing. The clock rests before every transfer,
/// even the first, because another host may have clocked just before.
class ClockedEngine : public Conversation<std::uint8_t> {
 public:
  /// Not copyable: requests and replies are views into the conversation itself.
  ClockedEngine(const ClockedEngine&) = delete;
  ClockedEngine& operator=(const ClockedEngine&) = delete;

  /// Handles an event that the port reports.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step that the port must take.
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] Error error() const final { return error_; }
  /// Puts nothing, so that the names and texts of fields are linked only where Reported (command.hpp) is used.
  void report(FieldSink&) const override {}
  /// Returns the bits of the last transfer, as bytes, and its times.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final {
    return {{}, Bytes(storage_).first(size_), sent_at_, received_at_};
  }

  /// Returns the time of the first clock edge of the last transfer: computed from the end of the transfer if the rate
  /// is known, otherwise the time at which the transfer was due.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// Returns the time at which the last transfer was received completely.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Returns false: an encoder on a clocked line cannot send without a clock.
  [[nodiscard]] bool is_noisy() const { return false; }

 protected:
  /// Constructs an engine. `storage` must have room for the bits of the longest transfer, and outlive the engine.
  ClockedEngine(const ClockedHostTimes& times, MutableBytes storage) : times_(times), storage_(storage) {}
  ~ClockedEngine() = default;

  /// Sets that a transfer of `count` clocks follows after a pause of the clock, in which the clock line is idle (high)
  /// or, with `hold_low`, held low. If the storage is too small, the conversation ends with invalid_argument.
  void clock(unsigned count, bool hold_low = false);
  /// Ends the conversation with `error`; `Error::none`: with success.
  void finish(Error error);

  /// Handles the bits of a complete transfer. Calls `clock` for another transfer, or `finish`.
  virtual void clocked(BitView bits) = 0;

 private:
  enum class State : std::uint8_t { ready, clocking, over };
  void received(const Event<std::uint8_t>& event);

  ClockedHostTimes times_;
  MutableBytes storage_;
  std::size_t size_ = 0;
  unsigned count_ = 0;  // number of clocks of the present transfer
  State state_ = State::over;
  bool begun_ = false;
  bool hold_low_ = false;
  Error error_ = Error::none;
  Time rested_at_{};
  Time begun_at_{};
  Time sent_at_{};
  Time received_at_{};
};

}  // namespace absenc::author
