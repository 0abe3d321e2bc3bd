// SPDX-License-Identifier: Apache-2.0
// Host side of a clocked line: clocks bits out of the encoder and delivers them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// Rate and pause of the clock, which the options of the encoder select.
struct ClockedHostTimes {
  std::uint32_t rate = 0;  ///< rate of the clock in Hz, set before the first transfer; 0: the line keeps its rate
  Time rest{};             ///< shortest pause of the clock before each transfer
};

/// Conversation that clocks one transfer after the other; a subclass handles the bits.
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
  /// Puts no fields of a result; the subclass Reported (command.hpp) overrides this function and puts them.
  void report(FieldSink&) const override {}
  /// Returns the bits of the last transfer, as bytes, and its times.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final {
    return {{}, Bytes(storage_).first(size_), sent_at_, received_at_};
  }

  /// Returns the time of the first clock edge of the last transfer; if the clock rate is not known, the earliest time
  /// at which this edge is possible.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// Returns the time at which the last transfer was received completely.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Returns false: an encoder on a clocked line cannot send without a clock.
  [[nodiscard]] bool is_noisy() const { return false; }

 protected:
  /// Constructs an engine. `storage`: room for the longest transfer, which must outlive the engine.
  ClockedEngine(const ClockedHostTimes& times, MutableBytes storage) : times_(times), storage_(storage) {}
  ~ClockedEngine() = default;

  /// Sets that a transfer of `count` clocks follows after a pause, in which the clock line is high or, with `hold_low`,
  /// low. Ends the conversation with invalid_argument if the storage is too small.
  void clock(unsigned count, bool hold_low = false);
  /// Ends the conversation with `error`; `Error::none`: with success.
  void finish(Error error);

  /// Handles the bits of a complete transfer. The conversation then ends, unless this function calls `clock`.
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
