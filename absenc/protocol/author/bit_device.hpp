// SPDX-License-Identifier: Apache-2.0
// Device side of a bidirectional clocked line: the virtual encoder receives bits of the host, then drives its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/author/encoder.hpp"

namespace absenc::author {

/// Texts of the rules that the host must not drive the data line while the encoder drives it. Each text describes the
/// breach of its rule.
struct DirectionRules {
  /// The host sends more bits than its request has, while the encoder already drives its reply.
  std::string_view request;
  /// The host sends again before the encoder has driven the last bit of its reply.
  std::string_view supplement;
};

/// A virtual encoder on a bidirectional clocked link; a subclass provides the bits. A bit that the host does not drive
/// is 1 for it.
class BitDevice : public EncoderOn<std::uint8_t> {
 public:
  /// Handles an event that the port reports.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step that the port must take.
  Step<std::uint8_t> next(Time now) final;
  /// Switches the encoder off at `now`.
  void power_off(Time now) override;

 protected:
  /// Bits of a request, or of a supplement, which the host sends behind the reply. There is room for 16 bits of data
  /// behind command and address.
  using ReceivedBits = BitBuffer<96>;
  /// Bits that the encoder drives: zeros until it is ready, the reply, and bits behind the reply, if any.
  using AnswerBits = BitBuffer<2048>;

  /// Constructs an encoder that is off. `start_time`: duration of its start-up. `rules` must outlive it.
  BitDevice(Time start_time, const DirectionRules& rules) : EncoderOn(start_time), directions_(&rules) {}
  ~BitDevice() = default;

  /// Is called at the first falling edge of the clock. `period`: of the clock; 0: unknown.
  virtual void selected(Time at, Time period) = 0;
  /// Returns the number of bits of the request that begins with `begin`, including those of its command. If `begin`
  /// does not show this number, returns that of a command alone.
  [[nodiscard]] virtual std::size_t request_size(BitView begin) const = 0;
  /// Puts the bits that the encoder drives behind `request` into `bits`. `at`: end of the last bit of `request`.
  virtual void respond(BitView request, Time at, AnswerBits& bits) = 0;
  /// Handles the bits that the host sends behind the reply.
  virtual void supplemented(BitView /*bits*/, Time /*at*/) {}
  /// Is called when the host has stopped the clock after `clocks` clocks.
  virtual void clocked(Time at, std::size_t clocks) = 0;

  /// Sets how many of the driven bits hosts read, counted from the first; by default all. Until these are over, a host
  /// must not drive the line, and faults of the line change only these bits. Call it from `respond`.
  void hosts_take(std::size_t bits) { taken_ = bits; }
  /// Returns the number of clocks from the first one to the end of the reply.
  [[nodiscard]] std::size_t reply_end() const { return driven_from_ + taken_; }

 private:
  void received(const Event<std::uint8_t>& event);

  const DirectionRules* directions_;
  AnswerBits bits_;
  std::size_t driven_from_ = 0;  // number of clocks of the exchange before the first driven bit
  std::size_t taken_ = 0;
  bool pending_ = false;   // the step that drives `bits_` has not been returned yet
  bool selected_ = false;  // an exchange is in progress, and the encoder was on at its begin
  bool responded_ = false;
};

}  // namespace absenc::author
