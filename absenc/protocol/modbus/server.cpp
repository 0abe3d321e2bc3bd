// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/modbus/server.hpp"

namespace absenc::modbus {

namespace {

// Time between the silence that ends a request and the reply; the standard states none.
constexpr Time answer_time = 200us;
// If the silence after a request is reported to the server later than this, the client may have timed out, so the
// client's next request breaks no timing rule.
constexpr Time late = 20ms;
constexpr std::string_view turn_rule = "something was sent during the encoder's transmission";

}  // namespace

void Server::power_on(Time now, PowerOn) {
  on_ = true;
  line_was_used_ = transmitting_ = reply_pending_ = false;
  quiet_since_ = now;
  clear_frame();
  started();
}

void Server::power_off(Time) { on_ = false; }

void Server::set_rate(std::uint32_t rate) {
  next_rate_ = rate;
  setting_rate_ = true;
}

ByteStep Server::next(Time) {
  if (setting_rate_ && !transmitting_) {
    setting_rate_ = false;
    line_.rate = next_rate_;
    return {.kind = ByteStep::Kind::configure, .rate = line_.rate};
  }
  if (reply_pending_) {
    reply_pending_ = false;
    return {.kind = ByteStep::Kind::transfer, .out = reply_, .at = reply_at_};
  }
  ByteStep step{.at = never};
  if (!frame_.empty() || damaged_) step.gap = frame_silence(line_);
  // A frame whose last two bytes are not its CRC is not complete, so the server waits for more bytes.
  if (!frame_.empty() && crc_order(frame_) != CrcOrder::low_first) step.expect = 1;
  return step;
}

void Server::feed(const ByteEvent& event) {
  switch (event.kind) {
    case ByteEvent::Kind::received:
      if (on_) receive(event);
      break;
    case ByteEvent::Kind::line_error:
      damaged_ = on_ && !transmitting_;
      quiet_since_ = event.at;
      line_was_used_ = true;
      break;
    case ByteEvent::Kind::sent:
      transmitting_ = interrupted_ = false;
      quiet_since_ = event.at;
      line_was_used_ = true;
      break;
    case ByteEvent::Kind::silence:
      if (on_ && !transmitting_) frame_ended(event.at);
      break;
    default:
      break;
  }
}

void Server::receive(const ByteEvent& event) {
  if (transmitting_) {
    // Bytes that are received during one transmission of this server break `turn_rule` at most once, not once for each
    // byte.
    if (!expects_collision_ && !interrupted_ && !ended_late_) expect(false, turn_rule, event.at);
    interrupted_ = true;
    return;
  }
  // A pseudo-terminal may deliver several bytes at once, so when the first one began is unknown.
  const Time begun = event.items.size() == 1 ? event.at - line_.character() : event.at;
  const Time idle = begun - quiet_since_;
  if (frame_.empty()) {
    follows_traffic_ = line_was_used_ && !ended_late_;
    began_too_soon_ = follows_traffic_ && idle < line_.character() * 7 / 2;
  } else if (idle > character_gap(line_)) {
    has_gap_ = true;
  }
  line_was_used_ = true;
  quiet_since_ = event.at;
  if (!frame_.append(event.items)) damaged_ = true;
}

void Server::frame_ended(Time at) {
  // On a pseudo-terminal the silence may be reported late.
  ended_late_ = at - quiet_since_ > frame_silence(line_) + late;
  if (!damaged_ && crc_order(frame_) == CrcOrder::low_first) {
    reply_.clear();
    expects_collision_ = false;
    crc_order_ = CrcOrder::low_first;
    request(frame_.view().first(frame_.size() - crc_size), at, reply_);
    if (!reply_.empty()) {
      append_crc(reply_, crc_order_);
      reply_at_ = at + answer_time;
      reply_pending_ = transmitting_ = true;
      ++answer_count_;
    }
  }
  clear_frame();
}

void Server::clear_frame() {
  frame_.clear();
  damaged_ = follows_traffic_ = began_too_soon_ = has_gap_ = false;
}

void Server::check_line_rules(Time at) {
  if (answer_count_ > 0) expect(true, turn_rule, at);
  if (follows_traffic_) expect(!began_too_soon_, "less than 3.5 characters of silence before a request", at);
  expect(!has_gap_, "more than 1.5 characters of silence inside a request", at);
}

void Server::refuse(FrameBytes& reply, std::uint8_t address, std::uint8_t function, Exception exception) {
  reply.push_back(address);
  reply.push_back(function | refusal_bit);
  reply.push_back(static_cast<std::uint8_t>(exception));
}

}  // namespace absenc::modbus
