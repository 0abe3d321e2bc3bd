// SPDX-License-Identifier: Apache-2.0
// The parts of an Encoder that only this library uses.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "absenc/client/encoder.hpp"
#include "absenc/client/encoder/connection.hpp"
#include "absenc/host/latch_time.hpp"
#include "absenc/host/statistics.hpp"
#include "absenc/host/unwrap.hpp"
#include "absenc/host/velocity.hpp"

namespace absenc::client {

struct Encoder::Parts {
  Parts(const EncoderAddress& address, Time reading_period, OpenLink open);
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  [[nodiscard]] static Encoder make(std::unique_ptr<Parts> parts) { return Encoder(std::move(parts)); }
  [[nodiscard]] static Parts& of(Encoder& encoder) { return *encoder.parts_; }
  [[nodiscard]] static const Parts& of(const Encoder& encoder) { return *encoder.parts_; }

  void connect();
  void disconnect();
  Sample next();
  /// Waits until `time`. Throws Cancelled, os::Interrupted, os::Failure.
  void wait_until(Time time) const;
  void forget_position();
  /// Returns whether `Encoder::cancel` was called, or the function `over` returns true.
  [[nodiscard]] bool must_end() const;

  std::atomic<bool> cancelled = false;
  std::function<bool()> over{};
  std::unique_ptr<Connection> connection;
  Time period;  // intended time between two readings; 0: as short as the line allows
  host::Rate rate;
  Time offset{};  // offset from the clock of the port to os::now
  std::uint64_t readings = 0;
  std::uint64_t losses = 0;
  std::uint64_t restarts = 0;

 private:
  Sample search();
  Sample sample_of(Reading reading);
  [[nodiscard]] JointAngles angles_of(const Sample& sample) const;
  void note_restart(Sample& sample, bool jumped, Time pause);

  host::Unwrapper unwrapper_;
  host::Velocity velocity_;
  std::optional<Time> lost_at_{};  // time at which the port was lost; nothing while it is open, or after `disconnect`
  Time next_try_{};
  Time unwrapped_at_{};  // lower bound of the time at which the last valid position was latched
};

/// Makes an encoder. `period` is the intended time between two readings; 0: no period is intended.
[[nodiscard]] Encoder make_encoder(const EncoderAddress& address, Time period, OpenLink open = {});

/// Returns a connection that stays the same if the encoder is moved.
[[nodiscard]] inline Connection& connection_of(Encoder& encoder) { return *Encoder::Parts::of(encoder).connection; }
[[nodiscard]] inline const Connection& connection_of(const Encoder& encoder) {
  return *Encoder::Parts::of(encoder).connection;
}

}  // namespace absenc::client
