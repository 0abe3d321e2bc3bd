// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/device.hpp"

#include <utility>

namespace absenc::raa38::can {

namespace {

using namespace std::chrono_literals;
using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;

// The document gives neither an answer time nor a start-up time, so both are assumed.
constexpr Time answer_time = 200us;
constexpr Time start_up_time = 100ms;

constexpr std::uint8_t refused = 1;  // error code "value not supported" of CiA 305

}  // namespace

Time VirtualNode::period() const { return Time(1s) / readings_per_s_; }

void VirtualNode::start_cyclic(std::uint8_t readings_per_s, Time from) {
  readings_per_s_ = readings_per_s;
  next_cyclic_ = readings_per_s == 0 ? never : from + period();
}

void VirtualNode::power_on(Time now, PowerOn kind) {
  // The stored node number or bit rate may be one that this encoder cannot use; the format's value then replaces it.
  if (node() == 0) memory()[Settings::number_at] = format_.node;
  if (rate_of_index(settings_.rate()) == nullptr) memory()[Settings::rate_at] = rates[format_.rate].index;
  powered_ = true;
  configuring_ = false;
  start_cyclic(format_.cyclic, now);
  if (kind == PowerOn::real && format_.cyclic != 0) next_cyclic_ = now + start_up_time;
  rate_changed_ = rate() != format_.bit_rate();
}

void VirtualNode::power_off(Time) {
  powered_ = sending_ = switch_rate_ = false;
  next_cyclic_ = never;
  pending_.clear();
}

// ---- The line

FrameStep VirtualNode::next(Time now) {
  FrameStep step{.at = never};
  if (sending_) return step;
  if (std::exchange(rate_changed_, false)) return {.kind = FrameStep::Kind::configure, .rate = rate()};
  if (!pending_.empty()) {
    out_ = pending_[0].frame;
    step.at = pending_[0].at;
    const Buffer<Pending, 8> rest = pending_;
    pending_.clear();
    pending_.append(rest.view().subspan(1));
  } else if (now >= next_cyclic_) {
    // If the node was delayed by more than one period, it skips cyclic frames instead of sending two at once.
    next_cyclic_ += period() * (1 + (now - next_cyclic_) / period());
    out_ = encode_position(node(), settings_.position(now));
    step.at = now;
  } else {
    step.at = next_cyclic_;
    return step;
  }
  step.kind = FrameStep::Kind::transfer;
  step.out = {&out_, 1};
  sending_ = true;
  return step;
}

void VirtualNode::feed(const FrameEvent& event) {
  if (event.kind == FrameEvent::Kind::sent) {
    sending_ = false;
    if (pending_.empty() && switch_rate_) {
      switch_rate_ = false;
      rate_changed_ = true;
    }
  } else if (event.kind == FrameEvent::Kind::received && powered_) {
    for (const CanFrame& frame : event.items) receive(frame, event.at);
  }
}

void VirtualNode::receive(const CanFrame& frame, Time at) {
  const Function function = function_of(frame);
  const OrderInfo* const info = order_of(frame);
  const bool for_all = function == Function::configuration;
  if (!for_all && (function != Function::command || node_of(frame) != node())) return;
  const bool sets = for_all && info != nullptr && info->answer == Answer::error;
  // Identifier 7E5 also carries the answers of other nodes. An answer without an error has the same bytes as a setting
  // with value 0, so outside configuration mode the node ignores a frame with these bytes.
  if (sets && is_zero_from(frame, 1) && !configuring_) return;
  if (!rules_.expect(!frame.remote && frame.size == frame_size, "a frame without its 8 bytes of data", at)) return;
  if (!for_all && !rules_.expect(frame.data[1] == node(), "the second byte is not the node's number", at)) return;
  if (for_all && (info == nullptr || sets) &&
      !rules_.expect(configuring_, "a setting without configuration mode", at)) {
    return;
  }
  const std::string_view unknown = for_all ? "an unknown configuration command" : "an unknown command";
  if (!rules_.expect(info != nullptr, unknown, at)) return;
  // Byte 1 of the order that sets the bit rate selects a table of rates; the document only has table 0.
  const bool is_other_table = info->order == Order::rate && frame.data[1] != 0;
  const std::uint8_t value = frame.data[info->value_at];
  if (sets) return configure(*info, is_other_table ? std::uint8_t{0xFF} : value, at);
  execute(*info, value, at);
}

void VirtualNode::answer(const CanFrame& frame, Time at) {
  const bool room = pending_.push_back({frame, at + answer_time});
  if (rules_.expect(room, "more requests than it can keep answers for", at)) ++answer_count_;
}

void VirtualNode::execute(const OrderInfo& info, std::uint8_t value, Time at) {
  const bool changes = info.order == Order::zero || info.order == Order::direction;
  // The answers to the orders zero and direction look like a cyclic position to the host.
  if (changes) rules_.expect(readings_per_s_ == 0, "a setting changed while the node sends by itself", at);
  if (info.order == Order::enter) configuring_ = value == 1;
  if (info.order == Order::start && readings_per_s_ == 0) start_cyclic(format_.cyclic, at);
  if (info.order == Order::cyclic) start_cyclic(value, at);
  if (info.order == Order::zero) wrote(settings_.write_zero(at), at);
  if (info.order == Order::direction) {
    const std::uint8_t negative = value == format_.negative ? 1 : 0;
    const bool known = negative != 0 || value == format_.positive;
    if (rules_.expect(known, "an unknown counting direction", at))
      wrote(settings_.write(Settings::direction_at, {&negative, 1}), at);
  }
  if (info.answer == Answer::position) answer(encode_position(node(), settings_.position(at)), at);
  if (info.answer == Answer::code) answer(encode_answer(node(), info.order), at);
}

// Stores the value of a setting if the document defines this value. A new bit rate becomes active after the answer to
// the setting.
void VirtualNode::configure(const OrderInfo& info, std::uint8_t value, Time at) {
  const bool known = meaning_of(info, value).has_value();
  const bool is_rate = info.order == Order::rate;
  if (rules_.expect(known, is_rate ? "an unknown bit rate" : "a node number of 0", at))
    wrote(settings_.write(is_rate ? Settings::rate_at : Settings::number_at, {&value, 1}), at);
  switch_rate_ = switch_rate_ || (known && is_rate);
  answer(encode_configuration_answer(format_.answer_id(), info.order, known ? std::uint8_t{0} : refused), at);
}

void VirtualNode::wrote(bool changed, Time at) {
  rules_.expect(changed, "a setting written that was set already: it wears out", at);
}

}  // namespace absenc::raa38::can
