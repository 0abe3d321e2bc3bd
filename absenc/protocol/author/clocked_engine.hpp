// SPDX-License-Identifier: Apache-2.0
// Host side of a clocked line: lets the clock rest, clocks bits out of the encoder and delivers them. It knows no
// protocol, and is compiled once.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// Times of the clock, as the encoder's document has them.
struct ClockedHostTimes {
  std::uint32_t rate = 0;  ///< rate of the clock in Hz, set first; 0: the line keeps its rate
  Time rest{};             ///< rest of the clock before each transfer, after which the encoder latches a new position
};

/// Clocks one transfer after the other; a subclass decides the number of clocks and handles the bits. The host drives
/// the clock, so there is no timeout and nothing is repeated. It rests before the first transfer too, because another
/// host may have clocked just before.
class ClockedEngine : public Conversation<std::uint8_t> {
 public:
  /// Takes an event of the port.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step of the port.
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] Error error() const final { return error_; }
  /// Puts nothing: see Engine.
  void report(FieldSink&) const override {}
  /// Returns the items of the last exchange.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final {
    return {{}, Bytes(storage_).first(size_), sent_at_, received_at_};
  }

  /// Returns the first edge of the clock in the last transfer: when it was due, or computed from the end if the rate is
  /// known.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// Returns when the last item was received.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Returns false: an encoder sends nothing but clocked bits.
  [[nodiscard]] bool is_noisy() const { return false; }

 protected:
  /// `storage`: for the bits of the longest transfer.
  ClockedEngine(const ClockedHostTimes& times, MutableBytes storage) : times_(times), storage_(storage) {}
  ~ClockedEngine() = default;

  /// Gives `count` clocks after a rest of the clock line, at its idle level or held low. If `storage` is too small, the
  /// conversation ends with invalid_argument.
  void clock(unsigned count, bool hold_low = false);
  /// Ends the conversation.
  void finish(Error error);

  /// Handles the bits of a complete transfer. Calls `clock` or `finish`.
  virtual void clocked(BitView bits) = 0;

 private:
  enum class State : std::uint8_t { ready, clocking, over };
  void received(const Event<std::uint8_t>& event);

  ClockedHostTimes times_;
  MutableBytes storage_;
  std::size_t size_ = 0;
  unsigned count_ = 0;  // clocks of the present transfer
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
