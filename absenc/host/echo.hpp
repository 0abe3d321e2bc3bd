// SPDX-License-Identifier: Apache-2.0
// Removes the local echo of an RS-485 adapter from the received bytes. A valid reply may equal its request.
#pragma once

#include <cstdint>

#include "absenc/core/bytes.hpp"
#include "absenc/link/step.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// Whether the adapter echoes, which means that it receives the bytes that it sends.
enum class EchoMode : std::uint8_t {
  automatic,  ///< the first good exchange with a request shows whether the adapter echoes
  on,
  off,
};

/// A filter between a conversation and its port that removes the echo of the adapter.
class EchoFilter final : public Machine<std::uint8_t> {
 public:
  /// Makes a filter; `mode` states whether the adapter echoes.
  explicit EchoFilter(EchoMode mode) : mode_(mode) {}

  /// Sets the unit that decides whether a reply is valid; `unit` and `options` must outlive the filter's use.
  void use_unit(const Unit& unit, const Options& options) {
    unit_ = &unit;
    options_ = &options;
  }
  /// Sets the conversation whose echo is removed from now on.
  void attach(Machine<std::uint8_t>& inner) {
    inner_ = &inner;
    sent_.clear();
    held_.clear();
  }
  /// Ends the exchange; `good`: without an error. Only a good exchange makes the detected echo mode final.
  void conclude(bool good);

  /// Processes an event that the port reports.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns the next step that the port must carry out.
  Step<std::uint8_t> next(Time now) override;

  /// Returns the echo mode; `automatic` while it is not known whether the adapter echoes.
  [[nodiscard]] EchoMode mode() const { return mode_; }
  /// Returns how many of the bytes received after the last request were removed as its echo.
  [[nodiscard]] std::size_t echoed() const { return echoed_; }
  /// Returns whether only the echo of the last request was received.
  [[nodiscard]] bool only_echo() const { return only_echo_; }

 private:
  static constexpr std::size_t capacity = 256;

  void received(const Event<std::uint8_t>& event);
  void strip(const Event<std::uint8_t>& event);
  void hold(const Event<std::uint8_t>& event);
  void decide(Time at);
  void pass(Time at, Bytes bytes);
  [[nodiscard]] bool is_reply(Bytes bytes) const;
  [[nodiscard]] EchoMode working_mode() const { return mode_ == EchoMode::automatic ? detected_ : mode_; }

  EchoMode mode_;
  const Unit* unit_ = nullptr;
  const Options* options_ = nullptr;
  EchoMode detected_ = EchoMode::automatic;  // echo mode detected in this conversation; automatic: not detected yet
  Machine<std::uint8_t>* inner_ = nullptr;
  ByteBuffer<capacity> sent_;
  ByteBuffer<capacity> held_;  // automatic mode: received bytes, stored because they may be the echo
  std::size_t echo_due_ = 0;   // mode on: number of echo bytes still to be received
  std::size_t echoed_ = 0;     // number of echo bytes received after the last request
  std::size_t reply_due_ = 0;  // number of reply bytes that the conversation expects; 0: unknown
  bool passed_ = false;        // true: bytes of the reply have been passed to the conversation
  bool only_echo_ = false;
};

}  // namespace absenc::host
