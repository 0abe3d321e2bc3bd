// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/device.hpp"

#include <algorithm>

namespace absenc::raa38::can {

namespace {

using namespace std::chrono_literals;
using FrameStep = Step<CanFrame>;
using FrameEvent = Event<CanFrame>;

// The document gives neither.
constexpr Time answer_time = 200us;
constexpr Time start_up_time = 100ms;

constexpr std::size_t memory_node = 0;
constexpr std::size_t memory_rate = 1;
constexpr std::size_t memory_direction = 2;
constexpr std::size_t memory_zero = 3;
constexpr std::size_t memory_wear = 7;
constexpr std::uint8_t refused = 1;  // CiA 305: value not supported

}  // namespace

VirtualNode::VirtualNode(const Format& format, const Shaft& shaft) : format_(format), shaft_(&shaft) {
  memory_[memory_node] = format.node;
  memory_[memory_rate] = rates[format.rate].index;
}

std::uint32_t VirtualNode::wear() const {
  return static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(memory_wear)));
}

std::uint32_t VirtualNode::zero() const {
  return static_cast<std::uint32_t>(load_little_endian(Bytes(memory_).subspan(memory_zero, 4)));
}

// As it would be without a zero.
std::uint32_t VirtualNode::raw(Time at) const {
  const auto turn = static_cast<std::uint32_t>(shaft_->at(at).position);
  const std::uint32_t counts = turn >> (32 - format_.bits);
  return static_cast<std::uint32_t>((is_negative() ? 0 - counts : counts) & low_mask(format_.bits));
}

std::uint32_t VirtualNode::position(Time at) const {
  return static_cast<std::uint32_t>((raw(at) - zero()) & low_mask(format_.bits));
}

Time VirtualNode::period() const { return Time(1s) / readings_per_s_; }

void VirtualNode::send_by_itself(std::uint8_t readings_per_s, Time from) {
  readings_per_s_ = readings_per_s;
  next_cyclic_ = readings_per_s == 0 ? never : from + period();
}

void VirtualNode::power_on(Time now, PowerOn kind) {
  // What a file of another encoder may have brought.
  if (memory_[memory_node] == 0) memory_[memory_node] = format_.node;
  if (rate_of_index(memory_[memory_rate]) == nullptr) memory_[memory_rate] = rates[format_.rate].index;
  powered_ = true;
  configuring_ = false;
  send_by_itself(format_.cyclic, now);
  if (kind == PowerOn::real && format_.cyclic != 0) next_cyclic_ = now + start_up_time;
  tell_rate_ = rate() != format_.bit_rate();
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
  if (tell_rate_) {
    tell_rate_ = false;
    step.kind = FrameStep::Kind::configure;
    step.settings = {.rate = rate()};
    return step;
  }
  if (!pending_.empty()) {
    out_ = pending_[0].frame;
    step.at = pending_[0].at;
    const Buffer<Pending, 8> rest = pending_;
    pending_.clear();
    pending_.append(rest.view().subspan(1));
  } else if (now >= next_cyclic_) {
    // Skips what it could not send: it never sends two at once.
    next_cyclic_ += period() * (1 + (now - next_cyclic_) / period());
    out_ = encode_position(node(), position(now));
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
      tell_rate_ = true;
    }
  } else if (event.kind == FrameEvent::Kind::received && powered_) {
    for (const CanFrame& frame : event.items) hear(frame, event.at);
  }
}

void VirtualNode::hear(const CanFrame& frame, Time at) {
  const Function function = function_of(frame);
  const OrderInfo* const info = order_of(frame);
  const bool for_all = function == Function::configuration;
  if (!for_all && (function != Function::command || node_of(frame) != node())) return;
  const bool sets = for_all && info != nullptr && info->answer == Answer::error;
  // What nodes answer on 7E5 is heard there by the others.
  if (sets && is_zero_from(frame, 1) && !configuring_) return;
  if (frame.remote || frame.size != frame_size) return violate("a frame without its 8 bytes of data", at);
  if (!for_all && frame.data[1] != node()) return violate("the second byte is not the node's number", at);
  if (for_all && !configuring_ && (info == nullptr || sets)) return violate("a setting without configuration mode", at);
  if (info == nullptr) return violate(for_all ? "an unknown configuration command" : "an unknown command", at);
  // The rate's first byte is another table of rates, which the document does not have.
  const bool is_other_table = info->order == Order::rate && frame.data[1] != 0;
  const std::uint8_t value = frame.data[info->value_at];
  if (sets) return configure(*info, is_other_table ? std::uint8_t{0xFF} : value, at);
  obey(*info, value, at);
}

void VirtualNode::answer(const CanFrame& frame, Time at) {
  if (!pending_.push_back({frame, at + answer_time})) return violate("more requests than it can keep answers for", at);
  ++answered_;
}

void VirtualNode::obey(const OrderInfo& info, std::uint8_t value, Time at) {
  const bool changes = info.order == Order::zero || info.order == Order::direction;
  // Its answer could be taken for a position, and the other way round.
  if (changes && readings_per_s_ != 0) violate("a setting changed while the node sends by itself", at);
  if (info.order == Order::enter) configuring_ = value == 1;
  if (info.order == Order::start && readings_per_s_ == 0) send_by_itself(format_.cyclic, at);
  if (info.order == Order::cyclic) send_by_itself(value, at);
  if (info.order == Order::direction) set_direction(value, at);
  if (info.order == Order::zero) {
    std::array<std::uint8_t, 4> zero{};
    store_little_endian(zero, raw(at));
    write(memory_zero, zero, at);
  }
  if (info.answer == Answer::position) answer(encode_position(node(), position(at)), at);
  if (info.answer == Answer::code) answer(encode_answer(node(), info.order), at);
}

// A new rate holds when the answer is out.
void VirtualNode::configure(const OrderInfo& info, std::uint8_t value, Time at) {
  const bool known = meaning_of(info, value).has_value();
  const bool is_rate = info.order == Order::rate;
  if (!known) violate(is_rate ? "an unknown bit rate" : "a node number of 0", at);
  if (known) write(is_rate ? memory_rate : memory_node, {&value, 1}, at);
  switch_rate_ = switch_rate_ || (known && is_rate);
  answer(encode_configuration_answer(format_.answer_id(), info.order, known ? std::uint8_t{0} : refused), at);
}

// The zero stays where it is: the position becomes its mirror image.
void VirtualNode::set_direction(std::uint8_t value, Time at) {
  if (value != format_.positive && value != format_.negative) return violate("an unknown counting direction", at);
  const std::uint8_t negative = value == format_.negative ? 1 : 0;
  if (negative == memory_[memory_direction]) return write(memory_direction, {&negative, 1}, at);
  std::array<std::uint8_t, 5> bytes{negative};
  store_little_endian(MutableBytes(bytes).subspan(1), (0 - std::uint64_t{zero()}) & low_mask(format_.bits));
  write(memory_direction, bytes, at);
}

void VirtualNode::write(std::size_t first, Bytes bytes, Time at) {
  const auto place = memory_.begin() + static_cast<std::ptrdiff_t>(first);
  if (std::equal(bytes.begin(), bytes.end(), place))
    violate("a setting written that was set already: it wears out", at);
  std::copy(bytes.begin(), bytes.end(), place);
  store_little_endian(MutableBytes(memory_).subspan(memory_wear), std::uint64_t{wear()} + 1);
  ++memory_version_;
}

void VirtualNode::violate(std::string_view rule, Time at) {
  violations_.push_back({rule, at});
  ++violation_count_;
}

}  // namespace absenc::raa38::can
