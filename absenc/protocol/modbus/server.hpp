// SPDX-License-Identifier: Apache-2.0
// Server side of a Modbus RTU line, for virtual encoders. A subclass decodes the frames.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/host_rules.hpp"
#include "absenc/protocol/modbus/frame.hpp"
#include "absenc/protocol/modbus/timing.hpp"

namespace absenc::modbus {

/// A virtual Modbus RTU server. Subclasses answer the requests.
class Server : public Device<std::uint8_t> {
 public:
  /// Processes an event of the port, such as received data or silence.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns what the port must do next, such as send or wait.
  Step<std::uint8_t> next(Time now) final;

  /// Switches the encoder on.
  void power_on(Time now, PowerOn kind) final;
  /// Switches the encoder off.
  void power_off(Time now) final;
  [[nodiscard]] std::span<const Violation> violations() const final { return rules_.violations(); }
  /// Returns how often the host broke a rule that the server checks.
  [[nodiscard]] std::uint32_t violation_count() const final { return rules_.violation_count(); }
  void watch_rules(RuleWatch* watch) final { rules_.watch(watch); }
  [[nodiscard]] std::uint64_t answer_count() const final { return answer_count_; }

 protected:
  /// Creates a server on a line with these settings.
  explicit Server(const LineSettings& line) : line_(line) {}
  ~Server() = default;

  /// Called at power on; the subclass calls `set_rate` if the rate may have changed.
  virtual void started() = 0;
  /// Called for a frame with a valid CRC and any address. `body` and `reply` are without CRC; an empty `reply` is not
  /// sent.
  virtual void request(Bytes body, Time at, FrameBytes& reply) = 0;

  /// Sets that the baud rate changes to `rate` as soon as this server transmits nothing.
  void set_rate(std::uint32_t rate);
  /// Records whether the host kept `rule`, as `satisfied` states. Returns `satisfied`.
  bool expect(bool satisfied, std::string_view rule, Time at) { return rules_.expect(satisfied, rule, at); }
  /// Checks the timing of the frame that is being handled. Call it for frames to this server.
  void check_line_rules(Time at);
  /// Announces that other servers may answer the present request, so a collision breaks no rule.
  void expect_collision() { expects_collision_ = true; }
  /// Sets the byte order of the CRC in the present reply; without a call it is low_first.
  void set_crc_order(CrcOrder order) { crc_order_ = order; }
  /// Appends the refusal of `function` to `reply`, without a CRC.
  static void refuse(FrameBytes& reply, std::uint8_t address, std::uint8_t function, Exception exception);

 private:
  void receive(const Event<std::uint8_t>& event);
  void frame_ended(Time at);
  void clear_frame();

  LineSettings line_;
  bool on_ = false;
  bool setting_rate_ = false;
  std::uint32_t next_rate_ = 0;

  FrameBytes frame_;
  bool damaged_ = false;          // the present frame has a damaged character, or too many characters
  bool follows_traffic_ = false;  // the length of the silence before the present frame is known, so it is checked
  bool began_too_soon_ = false;   // the silence before the present frame was shorter than 3.5 characters
  bool has_gap_ = false;          // two characters of the present frame were further apart than `character_gap`
  bool line_was_used_ = false;    // this server has received or sent something since power on
  // The silence after the last frame was reported so late that the client may have timed out.
  bool ended_late_ = false;
  bool expects_collision_ = false;
  Time quiet_since_{};
  FrameBytes reply_;
  CrcOrder crc_order_ = CrcOrder::low_first;
  bool reply_pending_ = false;
  bool transmitting_ = false;
  bool interrupted_ = false;  // the client sent something during the server's present transmission
  Time reply_at_{};
  HostRules rules_;
  std::uint64_t answer_count_ = 0;
};

}  // namespace absenc::modbus
