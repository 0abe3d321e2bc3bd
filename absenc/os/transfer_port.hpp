// SPDX-License-Identifier: Apache-2.0
// Steps and events (link/step.hpp) on ports whose host clocks every item, and which carry out a transfer at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/os/waiting.hpp"

namespace absenc::os {

/// Base class of ports for encoders with SPI and for clocked encoders. `begin` and `wait` throw Failure, Interrupted or
/// Ended.
class TransferPort : public Port<std::uint8_t> {
 public:
  /// `kind`: a link whose host clocks, else throws invalid_argument.
  explicit TransferPort(LinkKind kind);
  TransferPort(const TransferPort&) = delete;
  TransferPort& operator=(const TransferPort&) = delete;
  virtual ~TransferPort() = default;

  [[nodiscard]] Time now() final;
  void begin(const Step<std::uint8_t>& step) final;
  [[nodiscard]] Event<std::uint8_t> wait(const Step<std::uint8_t>& step) final;

  /// Returns the clock rate of the last transfer in Hz; before the first one, that which is set.
  [[nodiscard]] std::uint32_t clock_rate() const { return used_rate_ != 0 ? used_rate_ : set_rate(); }

 protected:
  /// Result of a transfer. Its content is the items of an SPI link, or the bits of a clocked link, packed MSB first.
  struct TransferResult {
    std::vector<std::uint8_t> items{};
    std::size_t bits = 0;   // number of bits of a clocked link
    bool idle_low = false;  // whether the data line was low in all idle clocks; false if there were none
    // bidirectional clocked link: time from the edge at which the encoder changes a bit until it is sampled; 0: half a
    // period
    Time sampled_after{};
    Time at{};  // time at which the transfer ended; it may have ended up to `late` earlier
    Time late{};
  };

  [[nodiscard]] LinkKind kind() const { return kind_; }
  /// Carries out a transfer, not before `step.at`. Leaves `received` empty if nothing was clocked.
  virtual void exchange(const Step<std::uint8_t>& step, TransferResult& received) = 0;
  /// Returns the clock rate in Hz that the port makes with its present settings.
  [[nodiscard]] virtual std::uint32_t set_rate() const = 0;
  /// Switches to another clock rate, in Hz.
  virtual void change_rate(std::uint32_t rate) = 0;

  /// Moves `bits` samples behind the first `idle` ones out of `samples` into `received`.
  static void extract(Bytes samples, std::size_t idle, std::size_t bits, TransferResult& received);

 private:
  LinkKind kind_;
  std::uint32_t used_rate_ = 0;  // clock rate of the last transfer in Hz; 0: there was none
  TransferResult received_{};
  Waiting<std::uint8_t> waiting_;
  bool sent_pending_ = false;      // whether the event `sent` is still to be reported
  bool received_pending_ = false;  // whether the event `received` is still to be reported, after `sent`
};

}  // namespace absenc::os
