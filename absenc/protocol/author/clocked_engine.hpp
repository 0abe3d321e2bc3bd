// SPDX-License-Identifier: Apache-2.0
// Host side of a clocked line: lets the clock rest, clocks bits out of the encoder and hands them on. It knows no
// protocol, and is compiled once.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// How an encoder is clocked, as its document has it.
struct ClockedHostTimes {
  std::uint32_t rate = 0;  ///< of the clock, Hz, which is set first; 0: it stays as the line has it
  Time rest{};             ///< of the clock before each transfer, after which the encoder takes a new position
};

/// One transfer after the other; a subclass says how many clocks each has, and what becomes of its bits. Whoever is the
/// clock never waits for a reply: there is no timeout, and nothing is repeated. It rests before the first transfer too,
/// because somebody may have clocked just before.
class ClockedEngine : public Conversation<std::uint8_t> {
 public:
  /// Takes an event of the port.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step of the port.
  Step<std::uint8_t> next(Time now) override;
  [[nodiscard]] Error error() const final { return error_; }
  /// Nothing: see Engine.
  void report(FieldSink&) const override {}
  /// Returns the items of the last exchange.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final {
    return {{}, Bytes(storage_).first(size_), sent_at_, received_at_};
  }

  /// The first edge of the clock in the last transfer: when it was due, or, where the rate is known, by its end.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// Returns when the last item was received.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Never: nothing comes but what is clocked out.
  [[nodiscard]] bool is_noisy() const { return false; }

 protected:
  /// `storage`: for the bits of the longest transfer.
  ClockedEngine(const ClockedHostTimes& times, MutableBytes storage) : times_(times), storage_(storage) {}
  ~ClockedEngine() = default;

  /// Gives so many clocks, when the clock has rested: at its idle level, or held low. More than there is storage for
  /// end the conversation: invalid_argument.
  void clock(unsigned count, bool hold_low = false);
  /// The conversation is over.
  void finish(Error error);

  /// All bits of the transfer are there. Calls `clock` or `finish`.
  virtual void clocked(BitView bits) = 0;

 private:
  enum class State : std::uint8_t { ready, clocking, over };
  void received(const Event<std::uint8_t>& event);

  ClockedHostTimes times_;
  MutableBytes storage_;
  std::size_t size_ = 0;
  unsigned count_ = 0;  // clocks of this transfer
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
