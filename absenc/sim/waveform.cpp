// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/waveform.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "absenc/core/bit_view.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/sim/can_bits.hpp"

namespace absenc::sim {

namespace {

// Indices of the wires of each kind of link, in the order in which the constructor of Waveform lists them.
constexpr std::size_t line = 0;
constexpr std::size_t host = 0, device = 1;
constexpr std::size_t cs = 0, sck = 1, mosi = 2, miso = 3;
constexpr std::size_t clock = 0, data = 1, direction = 2;
constexpr std::size_t can = 0;

// Divides `length` into equal parts; returns the end of the first `part` parts, rounded to ns.
struct EvenDivision {
  Time start;
  Time length;
  std::int64_t parts;

  [[nodiscard]] Time operator()(std::int64_t part) const {
    return start + Time((2 * length.count() * part + parts) / (2 * parts));
  }
};

std::string to_hex(Bytes bytes) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (!text.empty()) text += ' ';
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

}  // namespace

Waveform::Waveform(LinkKind kind, const LineSettings& settings, Sink& sink)
    : kind_(kind), settings_(settings), sink_(&sink) {
  switch (kind) {
    case LinkKind::half_duplex:
      wires_ = {{"line", true}};
      break;
    case LinkKind::full_duplex:
      wires_ = {{"host", true}, {"device", true}};
      break;
    case LinkKind::spi:
      wires_ = {{"cs", true}, {"sck", (settings.spi_mode & 2) != 0}, {"mosi", false}, {"miso", true}};
      break;
    case LinkKind::clocked:
      wires_ = {{"clock", true}, {"data", true}};
      break;
    case LinkKind::clocked_bidirectional:
      wires_ = {{"clock", true}, {"data", true}, {"direction", false}};
      break;
    case LinkKind::can:
      wires_ = {{"can", true}};
      break;
  }
  drivers_.resize(wires_.size());
}

void Waveform::observe(Line<std::uint8_t>& observed) {
  observed.observe([this, &observed](std::size_t sender, Time start, Time end, std::uint8_t byte) {
    this->byte(observed.role(sender), start, end, byte);
    // A character of two bytes is drawn when its second byte is known. The drawing begins at the begin of the first
    // byte.
    settle(std::min({observed.settled(), first_bytes_[0].start, first_bytes_[1].start}));
  });
  observed.observe_transfers([this, &observed](const Line<std::uint8_t>::Transfer& seen) {
    transfer(seen);
    settle(observed.settled());
  });
  observed.observe_pulses([this](ExtraWire wire, Time start, Time end) { pulse(wire, start, end); });
}

void Waveform::observe(Line<CanFrame>& observed) {
  observed.observe([this, &observed](std::size_t, Time start, Time, const CanFrame& seen) {
    frame(start, seen);
    settle(observed.settled());
  });
}

void Waveform::drive(std::size_t wire, Time from, Time to) {
  if (to <= from) return;
  changes_.push({from, wire, 1});
  changes_.push({to, wire, -1});
  end_ = std::max(end_, to);
}

void Waveform::comment(Time at, std::string words) {
  const auto behind = std::upper_bound(comments_.begin(), comments_.end(), at,
                                       [](Time time, const Comment& other) { return time < other.at; });
  comments_.insert(behind, {at, std::move(words)});
}

std::size_t Waveform::data_wire(NodeRole sender) const {
  return kind_ == LinkKind::half_duplex ? line : sender == NodeRole::host ? host : device;
}

// Draws a byte. If a character carries two bytes, both are drawn when the second one is added.
void Waveform::byte(NodeRole sender, Time start, Time end, std::uint8_t byte) {
  if (settings_.character_bytes() == 1) return character(sender, start, end, byte);
  FirstByte& first = first_bytes_[data_wire(sender)];
  if (first.start != never && first.sender == sender && first.end == start) {
    character(sender, std::exchange(first.start, never), end, static_cast<std::uint16_t>(byte << 8 | first.byte));
    return;
  }
  draw_lone(first);
  first = {sender, start, end, byte};
}

// Draws a character of two bytes whose second byte was never sent: the line rests at 1 in its place.
void Waveform::draw_lone(FirstByte& first) {
  if (first.start == never) return;
  const Time start = std::exchange(first.start, never);
  character(first.sender, start, first.end + (first.end - start), static_cast<std::uint16_t>(0xFF00 | first.byte));
}

void Waveform::finish() {
  for (FirstByte& first : first_bytes_) draw_lone(first);
  settle(never);
}

void Waveform::character(NodeRole sender, Time start, Time end, std::uint16_t value) {
  const bool by_host = sender == NodeRole::host;
  const std::size_t wire = data_wire(sender);
  const unsigned bits = settings_.character_bits();
  const EvenDivision edge{start, end - start, bits};
  drive(wire, edge(0), edge(1));
  const unsigned data_bits = settings_.data_bits;
  for (unsigned i = 0; i < data_bits; ++i) {
    if ((value >> i & 1) == 0) drive(wire, edge(i + 1), edge(i + 2));
  }
  const bool odd = std::popcount(value & low_mask(data_bits)) % 2 != 0;
  const bool parity = settings_.parity == Parity::even ? odd : !odd;
  if (settings_.parity != Parity::none && !parity) drive(wire, edge(data_bits + 1), edge(data_bits + 2));
  const std::array<std::uint8_t, 2> bytes{static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8)};
  comment(start, (by_host ? "host " : "device ") + to_hex(Bytes(bytes).first(settings_.character_bytes())));
  end_ = std::max(end_, end);
}

void Waveform::transfer(const Line<std::uint8_t>::Transfer& seen) {
  if (kind_ == LinkKind::clocked_bidirectional) {
    draw_both_ways(seen);
    if (seen.out_bits > 0) comment(seen.start, "host " + std::to_string(seen.out_bits) + " bits " + to_hex(seen.out));
    const std::size_t in_bits = seen.bits - seen.out_bits;
    const EvenDivision bit{seen.start, seen.end - seen.start, static_cast<std::int64_t>(seen.bits)};
    const Time turned = bit(static_cast<std::int64_t>(seen.out_bits));
    if (in_bits > 0) comment(turned, "device " + std::to_string(in_bits) + " bits " + to_hex(seen.in));
  } else if (kind_ == LinkKind::clocked) {
    draw_clocked(seen);
    comment(seen.start, std::to_string(seen.bits) + " bits " + to_hex(seen.in));
  } else {
    draw_spi(seen);
    comment(seen.start, "mosi " + to_hex(seen.out) + " miso " + to_hex(seen.in));
  }
  end_ = std::max(end_, seen.end);
}

void Waveform::draw_clocked(const Line<std::uint8_t>::Transfer& seen) {
  const auto bits = static_cast<std::int64_t>(seen.bits);
  const std::int64_t idle = settings_.idle_clocks;
  const EvenDivision half{seen.start, seen.end - seen.start, 2 * bits};
  // If the host held the clock line low, it rises half a period before the first clock edge.
  if (seen.held_low != never) drive(clock, seen.held_low + half(1) - half(0), half(-1));
  for (std::int64_t i = 0; i < bits + idle; ++i) drive(clock, half(2 * i), half(2 * i + 1));
  for (std::int64_t i = 0; i < bits; ++i) {
    // Without idle clocks, the encoder's first bit is on the line from the first clock edge on.
    const Time from = i + idle == 0 ? seen.start : half(2 * (i + idle) - 1);
    if (!BitView{seen.in, seen.bits}[static_cast<std::size_t>(i)]) drive(data, from, half(2 * (i + idle) + 1));
  }
  const Time last_edge = half(2 * (bits + idle) - 1);
  drive(data, last_edge, last_edge + seen.low_after);
}

// The host changes the data line at the falling edge of a clock, the encoder half a period later at the rising one.
void Waveform::draw_both_ways(const Line<std::uint8_t>::Transfer& seen) {
  const auto bits = static_cast<std::int64_t>(seen.bits);
  const auto out_bits = static_cast<std::int64_t>(seen.out_bits);
  const EvenDivision half{seen.start, seen.end - seen.start, 2 * bits};
  if (seen.goes_on_from != never) drive(clock, seen.goes_on_from, seen.start);
  for (std::int64_t i = 0; i < bits; ++i) drive(clock, half(2 * i), half(2 * i + 1));
  drive(direction, half(0), half(2 * out_bits));
  for (std::int64_t i = 0; i < out_bits; ++i) {
    if (!BitView{seen.out, seen.out_bits}[static_cast<std::size_t>(i)]) drive(data, half(2 * i), half(2 * i + 2));
  }
  for (std::int64_t i = out_bits; i < bits; ++i) {
    const auto bit = static_cast<std::size_t>(i - out_bits);
    if (!BitView{seen.in, seen.bits - seen.out_bits}[bit]) drive(data, half(2 * i + 1), half(2 * i + 3));
  }
}

// With CPHA 0 the leading edge samples data; with CPHA 1 data changes at it.
void Waveform::draw_spi(const Line<std::uint8_t>::Transfer& seen) {
  const std::int64_t phase = (settings_.spi_mode & 1) != 0 ? 0 : 1;
  const Time first = seen.start + seen.lead;
  const EvenDivision half{first, seen.end - first, static_cast<std::int64_t>(2 * seen.bits)};
  drive(cs, seen.start, seen.end);
  for (std::size_t i = 0; i < seen.bits; ++i) {
    const auto at = static_cast<std::int64_t>(2 * i);
    drive(sck, half(at + phase), half(at + phase + 1));
    if (BitView{seen.out, seen.bits}[i]) drive(mosi, half(at), half(at + 2));
    if (!BitView{seen.in, seen.bits}[i]) drive(miso, half(at), half(at + 2));
  }
}

void Waveform::frame(Time start, const CanFrame& frame) {
  const std::vector<bool> bits = can_bits(frame);
  const auto count = static_cast<std::int64_t>(bits.size());
  const EvenDivision edge{start, settings_.bits(bits.size()), count};
  for (std::int64_t i = 0; i < count; ++i) {
    if (!bits[static_cast<std::size_t>(i)]) drive(can, edge(i), edge(i + 1));
  }
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string id;
  for (unsigned digit = frame.extended ? 8 : 3; digit-- > 0;) id += digits[frame.id >> 4 * digit & 15];
  comment(start, id + (frame.remote ? " remote" : ": " + to_hex(frame.bytes())));
  end_ = std::max(end_, edge(count));
}

void Waveform::pulse(ExtraWire wire, Time start, Time end) {
  drive(pulse_wire(wire == ExtraWire::trigger ? "trigger" : "clear"), start, end);
}

std::size_t Waveform::pulse_wire(std::string_view name) {
  const auto known = std::find_if(wires_.begin(), wires_.end(), [&](const Wire& wire) { return wire.name == name; });
  if (known == wires_.end()) {
    wires_.push_back({name, true});
    drivers_.push_back(0);
    return wires_.size() - 1;
  }
  return static_cast<std::size_t>(known - wires_.begin());
}

void Waveform::settle(Time time) {
  std::vector<int> before;
  while (!changes_.empty() && changes_.top().at < time) {
    const Time at = changes_.top().at;
    before = drivers_;
    for (; !changes_.empty() && changes_.top().at == at; changes_.pop()) {
      drivers_[changes_.top().wire] += changes_.top().by;
    }
    for (std::size_t i = 0; i < drivers_.size(); ++i) {
      if ((before[i] == 0) != (drivers_[i] == 0)) sink_->change(at, i);
    }
  }
  const auto later =
      std::find_if(comments_.begin(), comments_.end(), [&](const Comment& one) { return one.at >= time; });
  for (auto one = comments_.begin(); one != later; ++one) sink_->comment(one->at, one->words);
  comments_.erase(comments_.begin(), later);
}

}  // namespace absenc::sim
