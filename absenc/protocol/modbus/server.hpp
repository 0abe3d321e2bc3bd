// SPDX-License-Identifier: Apache-2.0
// Server side of a Modbus RTU line: finds frames by their silence, answers in time, and lists the rules of the line
// that its client breaks. What the frames say is the subclass's.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/host_rules.hpp"
#include "absenc/protocol/modbus/frame.hpp"
#include "absenc/protocol/modbus/timing.hpp"

namespace absenc::modbus {

class Server : public Device<std::uint8_t> {
 public:
  void feed(const Event<std::uint8_t>& event) final;
  Step<std::uint8_t> next(Time now) final;

  void power_on(Time now, PowerOn kind) final;
  void power_off(Time now) final;
  [[nodiscard]] std::span<const Violation> violations() const final { return rules_.violations(); }
  [[nodiscard]] std::uint32_t violation_count() const final { return rules_.violation_count(); }
  void watch_rules(RuleWatch* watch) final { rules_.watch(watch); }
  [[nodiscard]] std::uint64_t answer_count() const final { return answer_count_; }

 protected:
  explicit Server(const LineSettings& line) : line_(line) {}
  ~Server() = default;

  /// Power has come: `set_rate` says at which rate it listens.
  virtual void started() = 0;
  /// A frame with a good CRC, which `body` no longer has, came for whomever. Appends the reply without its CRC, or
  /// nothing. `heed_line` tells that the frame was meant for this server.
  virtual void request(Bytes body, Time at, FrameBytes& reply) = 0;

  /// Once what is being sent has left.
  void set_rate(std::uint32_t rate);
  /// The host did what a rule of the document is about: whether it kept it, which is returned.
  bool expect(bool kept, std::string_view rule, Time at) { return rules_.expect(kept, rule, at); }
  /// The rules of the line, of this frame: of frames for others they say nothing.
  void heed_line(Time at);
  /// The request that is being answered may be answered by others at the same time.
  void expect_company() { company_ = true; }
  /// Of the reply to this request: low_first, if this is not called, or high_first.
  void order_crc(CrcOrder order) { crc_order_ = order; }
  /// Appends a refusal.
  static void refuse(FrameBytes& reply, std::uint8_t address, std::uint8_t function, Exception exception);

 private:
  void hear(const Event<std::uint8_t>& event);
  void frame_ended(Time at);
  void forget_frame();

  LineSettings line_;
  bool on_ = false;
  bool setting_rate_ = false;
  std::uint32_t next_rate_ = 0;

  FrameBytes frame_;
  bool damaged_ = false;  // a wrong character, or too many
  bool follows_ = false;  // something was before it
  bool early_ = false;    // it began too soon after that
  bool gappy_ = false;    // too much time between two of its characters
  bool heard_ = false;    // anything, since power on
  bool late_ = false;     // it ended so long ago that its client need not wait for the reply any more
  bool company_ = false;
  Time quiet_since_{};
  FrameBytes reply_;
  CrcOrder crc_order_ = CrcOrder::low_first;
  bool reply_pending_ = false;
  bool transmitting_ = false;
  bool interrupted_ = false;  // something came while it was
  Time reply_at_{};
  HostRules rules_;
  std::uint64_t answer_count_ = 0;
};

}  // namespace absenc::modbus
