// SPDX-License-Identifier: Apache-2.0
// The wires of sim::Line: characters, SPI transfers, clocked bits, CAN frames, pulses.
#include <algorithm>
#include <stdexcept>
#include <type_traits>

#include "absenc/core/bit_view.hpp"
#include "absenc/sim/can_bits.hpp"
#include "absenc/sim/line.hpp"
#include "absenc/sim/line_state.hpp"

namespace absenc::sim {

namespace {

// Returns whether a UART with settings `a` receives characters sent with settings `b`. The UART samples the stop bit in
// its middle, so the rates may differ by 5 %.
bool compatible(const LineSettings& a, const LineSettings& b) {
  const std::uint64_t larger = std::max(a.rate, b.rate);
  const std::uint64_t difference = larger - std::min(a.rate, b.rate);
  return difference * 20 <= larger && a.parity == b.parity && a.data_bits == b.data_bits;
}

// Returns the number that decides the arbitration of a CAN frame: the lowest wins.
std::uint32_t arbitration_field(const CanFrame& frame) {
  const std::uint32_t remote = frame.remote ? 1 : 0;
  if (!frame.extended) return frame.id << 21 | remote << 20;
  return (frame.id >> 18) << 21 | 3u << 19 | (frame.id & 0x3FFFF) << 1 | remote;
}

std::size_t frame_bits(const CanFrame& frame) { return can_bit_count(frame) + can_intermission_bits; }

}  // namespace

template <class Item>
void Line<Item>::begin(Node node) {
  State& state = *nodes_[node];
  state.begun = true;
  state.start = now_;
  state.index = 0;
  if (state.active_step == Step<Item>::Kind::pulse) {
    schedule(ScheduledEvent::Kind::finished, now_ + state.width, node);
    if (pulse_observer_) pulse_observer_(state.pulse_wire, now_, now_ + state.width);
    for (Node other = 0; other < nodes_.size(); ++other) {
      if (other == node) continue;
      feed(other, {.kind = Event<Item>::Kind::triggered, .at = now_, .wire = state.pulse_wire, .width = state.width});
    }
  } else if (host_clocks(kind_)) {
    begin_transfer(node);
  } else if (state.out.empty()) {
    schedule(ScheduledEvent::Kind::finished, now_, node);
  } else if (kind_ == LinkKind::can) {
    schedule(ScheduledEvent::Kind::arbitrate, now_, node);
  } else {
    begin_characters(node);
  }
}

template <class Item>
bool Line<Item>::receives_from(const State& receiver, const State& sender) const {
  if (&receiver == &sender) return sender.echo;
  return kind_ != LinkKind::full_duplex || receiver.role != sender.role;
}

template <class Item>
bool Line<Item>::busy_towards(const State& node) const {
  return std::any_of(nodes_.begin(), nodes_.end(), [&](const auto& other) {
    return other.get() != &node && other->on_wire > 0 && other->active_step == Step<Item>::Kind::transfer &&
           receives_from(node, *other);
  });
}

template <class Item>
void Line<Item>::begin_characters(Node node) {
  State& state = *nodes_[node];
  state.each = state.settings.byte_time();
  state.on_wire = state.frame == 0 ? state.out.size() : std::min(state.frame, state.out.size());
  schedule(ScheduledEvent::Kind::character, now_ + state.each, node);
  frame_character(node);
}

template <class Item>
void Line<Item>::frame_character(Node sender) {
  for (const auto& receiver : nodes_) {
    if (!receives_from(*receiver, *nodes_[sender]) || now_ < receiver->framed_until) continue;
    receiver->framed_sender = sender;
    receiver->framed_from = now_;
    receiver->framed_until = now_ + nodes_[sender]->each;
  }
}

template <class Item>
void Line<Item>::end_character(Node node) {
  State& sender = *nodes_[node];
  Item item = sender.out[sender.index];
  const Time from = now_ - sender.each;
  for (const auto& other : nodes_) {
    const bool same_pair = kind_ == LinkKind::half_duplex || other->role == sender.role;
    if (other.get() != &sender && same_pair) item = other->overlaid(item, from, now_);
  }
  if (observer_) observer_(node, from, now_, item);
  const std::uint64_t generation = sender.begin_generation;
  const bool last = ++sender.index == sender.on_wire;
  if (last && sender.on_wire < sender.out.size()) {
    sender.out.erase(sender.out.begin(), sender.out.begin() + static_cast<std::ptrdiff_t>(sender.on_wire));
    sender.on_wire = 0;
    sender.begun = false;
    schedule(ScheduledEvent::Kind::begin, now_ + sender.width, node);
  } else if (last) {
    schedule(ScheduledEvent::Kind::finished, now_, node);
  } else {
    schedule(ScheduledEvent::Kind::character, now_ + sender.each, node);
  }
  for (Node other = 0; other < nodes_.size(); ++other) {
    State& receiver = *nodes_[other];
    if (!receives_from(receiver, sender)) continue;
    if (receiver.framed_sender == node && receiver.framed_from == from) {
      deliver(other, node, item, false);
    } else {  // a receiver synchronised to another sender's character only notices that the line is not silent
      receiver.silence.busy(now_);
      if (!receiver.done) arm(receiver);
    }
  }
  if (!last && generation == sender.begin_generation) frame_character(node);
}

template <class Item>
void Line<Item>::deliver(Node node, Node sender, const Item& item, bool garbled) {
  State& state = *nodes_[node];
  state.silence.received(now_);
  if (garbled || !compatible(state.settings, nodes_[sender]->settings)) {
    feed(node, {.kind = Event<Item>::Kind::line_error, .at = now_});
  } else {
    feed(node, {.kind = Event<Item>::Kind::received, .at = now_, .items = {&item, 1}});
  }
}

// All items of an SPI or clocked transfer are exchanged at its end; in between only its duration is simulated.
template <class Item>
void Line<Item>::begin_transfer(Node node) {
  State& host = *nodes_[node];
  const bool turns = kind_ == LinkKind::clocked_bidirectional;
  host.expect = carries_bits(kind_) ? (host.bits - host.out_bits + 7) / 8 : std::max(host.out.size(), host.expect);
  if (kind_ == LinkKind::spi) host.bits = host.expect * 8;
  if (turns && host.out_bits > 0) {
    schedule(ScheduledEvent::Kind::turned, now_ + host.settings.bits(host.out_bits), node);
  }
  if (turns && host.goes_on_from != never) {
    schedule(ScheduledEvent::Kind::transferred, now_ + host.settings.bits(host.bits), node);
    return;
  }
  host.clocks_before = 0;
  for (Node other = 0; other < nodes_.size(); ++other) {
    if (nodes_[other]->role == NodeRole::host) continue;
    nodes_[other]->active_step = Step<Item>::Kind::wait;
    nodes_[other]->out.clear();
    nodes_[other]->width = {};
    nodes_[other]->behind_out = 0xFF;
    nodes_[other]->driven_from = 0;
    const Time period = carries_bits(kind_) ? host.settings.bits(1) : Time{};
    feed(other, {.kind = Event<Item>::Kind::selected, .at = now_, .held_low = host.hold_low, .width = period});
  }
  if (kind_ == LinkKind::spi) host.lead = host.settings.select_lead;
  schedule(ScheduledEvent::Kind::transferred, now_ + host.lead + host.settings.bits(host.bits), node);
}

// Passes the bits that the host has sent on to the devices. The next bits that a device sends follow them on the line.
template <class Item>
void Line<Item>::turn_data_line(Node node) {
  const State& host = *nodes_[node];
  for (Node other = 0; other < nodes_.size(); ++other) {
    if (nodes_[other]->role == NodeRole::host) continue;
    nodes_[other]->out.clear();
    nodes_[other]->driven_from = host.clocks_before + host.out_bits;
    feed(other, {.kind = Event<Item>::Kind::received,
                 .at = now_,
                 .items = host.out,
                 .bits = host.out_bits,
                 .clocks_before = host.clocks_before});
  }
}

// Combines the bits of all devices in the clocks that the host does not drive.
template <class Item>
void Line<Item>::read_driven_bits(const State& host, std::vector<Item>& in) const {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    // index of the first bit of `in`, counted in clocks of the whole exchange
    const std::size_t first = host.clocks_before + host.out_bits;
    for (const auto& other : nodes_) {
      if (other->role == NodeRole::host) continue;
      const BitView driven{other->out, 8 * other->out.size()};
      for (std::size_t bit = 0; bit < 8 * in.size(); ++bit) {
        const std::size_t place = first + bit - other->driven_from;
        const bool level = place < driven.size ? driven[place] : other->behind_out != 0;
        if (!level) in[bit / 8] = static_cast<Item>(in[bit / 8] & ~(0x80u >> bit % 8));
      }
    }
  }
}

template <class Item>
void Line<Item>::end_transfer(Node node) {
  if constexpr (std::is_same_v<Item, std::uint8_t>) {
    State& host = *nodes_[node];
    std::vector<Item>& in = transferred_in_;
    in.assign(host.expect, 0xFF);  // a data line that no device drives is pulled up to 1
    Time low_after{};
    for (const auto& other : nodes_) {
      if (other->role == NodeRole::host) continue;
      low_after = std::max(low_after, other->width);
      if (kind_ == LinkKind::clocked_bidirectional) continue;
      const std::size_t driven = std::min(in.size(), other->out.size());
      for (std::size_t i = 0; i < in.size(); ++i) in[i] &= i < driven ? other->out[i] : other->behind_out;
    }
    if (kind_ == LinkKind::clocked_bidirectional) read_driven_bits(host, in);
    const std::size_t bits = host.bits;
    const std::size_t unclocked = in.size() * 8 - (bits - host.out_bits);
    if (unclocked != 0) in.back() = static_cast<Item>(in.back() >> unclocked << unclocked);
    std::vector<Item>& out = transferred_out_;
    out.assign(host.out.begin(), host.out.end());
    if (host.out_bits == 0) out.resize(host.expect, 0);
    if (transfer_observer_ && bits > 0) {
      transfer_observer_({host.start, now_, bits, out, in, host.lead, host.hold_low ? host.accepted_at : never,
                          low_after, host.out_bits, host.goes_on_from, host.goes_on});
    }
    host.clocks_before += bits;
    host.goes_on_from = host.goes_on ? now_ : never;
    const std::size_t clocks = host.clocks_before;
    const std::size_t received_bits = kind_ == LinkKind::clocked_bidirectional ? bits - host.out_bits : 0;
    for (Node other = 0; other < nodes_.size(); ++other) {
      if (nodes_[other]->role == NodeRole::host || host.goes_on) continue;
      nodes_[other]->active_step = Step<Item>::Kind::wait;
      if (kind_ == LinkKind::spi) {
        feed(other, {.kind = Event<Item>::Kind::received, .at = now_, .items = out});
      }
      const Time period = kind_ == LinkKind::spi ? host.settings.bits(1) : Time{};
      feed(other, {.kind = Event<Item>::Kind::sent, .at = now_, .bits = clocks, .width = period, .lead = host.lead});
    }
    finish(node);
    if (kind_ == LinkKind::clocked_bidirectional && received_bits == 0) return;
    host.silence.received(now_);
    feed(node, {.kind = Event<Item>::Kind::received, .at = now_, .items = in, .bits = received_bits});
  }
}

// Gives the idle bus to the pending frame with the lowest arbitration field.
template <class Item>
void Line<Item>::arbitrate() {
  if constexpr (std::is_same_v<Item, CanFrame>) {
    if (frame_on_bus_) return;
    Node winner = nodes_.size();
    std::uint32_t lowest = 0;
    for (Node node = 0; node < nodes_.size(); ++node) {
      const State& state = *nodes_[node];
      if (!state.frame_pending()) continue;
      const std::uint32_t field = arbitration_field(state.out[state.index]);
      if (winner != nodes_.size() && field >= lowest) continue;
      winner = node;
      lowest = field;
    }
    if (winner == nodes_.size()) return;
    frame_on_bus_ = true;
    State& state = *nodes_[winner];
    state.start = now_;
    schedule(ScheduledEvent::Kind::frame, now_ + state.settings.bits(frame_bits(state.out[state.index])), winner);
  }
}

template <class Item>
void Line<Item>::end_frame(Node node) {
  if constexpr (std::is_same_v<Item, CanFrame>) {
    State& sender = *nodes_[node];
    const CanFrame frame = sender.out[sender.index];
    if (observer_) observer_(node, sender.start, now_, frame);
    // CAN frames that began together with the same identifier are all lost if their data differ.
    std::vector<Node>& senders = frame_senders_;
    senders.clear();
    bool clash = false;
    for (Node other = 0; other < nodes_.size(); ++other) {
      const State& state = *nodes_[other];
      if (!state.frame_pending() || state.start > sender.start) continue;
      if (arbitration_field(state.out[state.index]) != arbitration_field(frame)) continue;
      clash = clash || !(state.out[state.index] == frame);
      senders.push_back(other);
    }
    for (const Node other : senders) {
      if (++nodes_[other]->index == nodes_[other]->out.size()) schedule(ScheduledEvent::Kind::finished, now_, other);
    }
    for (Node other = 0; other < nodes_.size(); ++other) {
      const bool sent_it = std::find(senders.begin(), senders.end(), other) != senders.end();
      if (clash || !sent_it || (other == node && sender.echo)) deliver(other, node, frame, clash);
    }
  }
}

// line.cpp instantiates the class; the members in this file must be instantiated explicitly.
template void Line<std::uint8_t>::begin(Node);
template bool Line<std::uint8_t>::receives_from(const State&, const State&) const;
template bool Line<std::uint8_t>::busy_towards(const State&) const;
template void Line<std::uint8_t>::begin_characters(Node);
template void Line<std::uint8_t>::frame_character(Node);
template void Line<std::uint8_t>::end_character(Node);
template void Line<std::uint8_t>::begin_transfer(Node);
template void Line<std::uint8_t>::turn_data_line(Node);
template void Line<std::uint8_t>::read_driven_bits(const State&, std::vector<std::uint8_t>&) const;
template void Line<std::uint8_t>::end_transfer(Node);
template void Line<std::uint8_t>::arbitrate();
template void Line<std::uint8_t>::end_frame(Node);
template void Line<std::uint8_t>::deliver(Node, Node, const std::uint8_t&, bool);
template void Line<CanFrame>::begin(Node);
template bool Line<CanFrame>::receives_from(const State&, const State&) const;
template bool Line<CanFrame>::busy_towards(const State&) const;
template void Line<CanFrame>::begin_characters(Node);
template void Line<CanFrame>::frame_character(Node);
template void Line<CanFrame>::end_character(Node);
template void Line<CanFrame>::begin_transfer(Node);
template void Line<CanFrame>::turn_data_line(Node);
template void Line<CanFrame>::read_driven_bits(const State&, std::vector<CanFrame>&) const;
template void Line<CanFrame>::end_transfer(Node);
template void Line<CanFrame>::arbitrate();
template void Line<CanFrame>::end_frame(Node);
template void Line<CanFrame>::deliver(Node, Node, const CanFrame&, bool);

}  // namespace absenc::sim
