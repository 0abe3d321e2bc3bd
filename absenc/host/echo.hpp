// SPDX-License-Identifier: Apache-2.0
// Takes the local echo of an RS-485 adapter out of what a conversation hears: by count, never by comparing, because a
// good reply may equal its request byte for byte. The removed bytes are compared to find a disturbed line. Whether
// there is an echo is decided here alone: by the number of bytes, and where that leaves both by which is a good reply.
#pragma once

#include <cstdint>

#include "absenc/core/bytes.hpp"
#include "absenc/link/step.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// Whether the adapter receives what it sends.
enum class EchoMode : std::uint8_t {
  automatic,  ///< found out from the first good exchange
  on,
  off,
};

/// Stands between a conversation and its port.
class EchoFilter final : public Machine<std::uint8_t> {
 public:
  /// Handles the echo of the adapter as `mode` says.
  explicit EchoFilter(EchoMode mode) : mode_(mode) {}

  /// By whose rules replies are judged from now on; both must outlive that. Without, by their number of bytes alone.
  void judge_by(const Unit& unit, const Options& options) {
    unit_ = &unit;
    options_ = &options;
  }
  /// The conversation to serve from now on.
  void attach(Machine<std::uint8_t>& inner) {
    inner_ = &inner;
    sent_.clear();
    held_.clear();
  }
  /// How the conversation ended. In automatic mode only a good one makes what was found final: a reply that is one byte
  /// too long looks like an echo at first.
  void conclude(bool good);

  /// Takes an event of the port.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns the next step of the port.
  Step<std::uint8_t> next(Time now) override;

  /// What is known: `automatic` while nothing is.
  [[nodiscard]] EchoMode mode() const { return mode_; }
  /// So many bytes of what came behind the last request were its echo.
  [[nodiscard]] std::size_t echoed() const { return echoed_; }
  /// Whether the echo of the last request came back and nothing else.
  [[nodiscard]] bool only_echo() const { return only_echo_; }

 private:
  static constexpr std::size_t capacity = 256;

  void received(const Event<std::uint8_t>& event);
  void strip(const Event<std::uint8_t>& event);
  void hold(const Event<std::uint8_t>& event);
  void decide(Time at);
  void pass(Time at, Bytes bytes);
  [[nodiscard]] bool is_reply(Bytes bytes) const;
  [[nodiscard]] EchoMode working_mode() const { return mode_ == EchoMode::automatic ? found_ : mode_; }

  EchoMode mode_;
  const Unit* unit_ = nullptr;
  const Options* options_ = nullptr;
  EchoMode found_ = EchoMode::automatic;  // in this conversation
  Machine<std::uint8_t>* inner_ = nullptr;
  ByteBuffer<capacity> sent_;
  ByteBuffer<capacity> held_;  // automatic: heard before it is known what is echo
  std::size_t echo_due_ = 0;   // on: echo bytes still to come
  std::size_t echoed_ = 0;     // of the last request
  std::size_t reply_due_ = 0;  // items the conversation expects
  bool passed_ = false;        // something of the reply went to the conversation
  bool only_echo_ = false;
};

}  // namespace absenc::host
