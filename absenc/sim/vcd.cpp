// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/vcd.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <utility>

#include "absenc/core/bit_view.hpp"

namespace absenc::sim {

namespace {

// Wires, in the order in which the constructor names them.
constexpr std::size_t line = 0;
constexpr std::size_t host = 0, device = 1;
constexpr std::size_t cs = 0, sck = 1, mosi = 2, miso = 3;
constexpr std::size_t clock = 0, data = 1;

// The boundary after `part` of `parts` equal parts, to the nearest nanosecond.
struct Scale {
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

// Identifiers are printable characters from '!' on.
char identifier(std::size_t wire) { return static_cast<char>('!' + wire); }

}  // namespace

Waveform::Waveform(LinkKind kind, const LineSettings& settings) : kind_(kind), settings_(settings) {
  switch (kind) {
    case LinkKind::half_duplex:
      wires_ = {{"line", true}};
      break;
    case LinkKind::full_duplex:
      wires_ = {{"host", true}, {"device", true}};
      break;
    case LinkKind::exchange:
      wires_ = {{"cs", true}, {"sck", (settings.spi_mode & 2) != 0}, {"mosi", false}, {"miso", true}};
      break;
    case LinkKind::clocked:
      wires_ = {{"clock", true}, {"data", true}};
      break;
    case LinkKind::can:
      throw std::invalid_argument("CAN has no waveform");
  }
}

void Waveform::observe(Line<std::uint8_t>& observed) {
  observed.observe([this, &observed](std::size_t sender, Time start, Time end, std::uint8_t byte) {
    character(observed.role(sender), start, end, byte);
  });
  observed.observe_exchanges([this](const Line<std::uint8_t>::Exchange& seen) { exchange(seen); });
}

void Waveform::drive(std::size_t wire, Time from, Time to) {
  if (to <= from) return;
  changes_.push_back({from, wire, 1});
  changes_.push_back({to, wire, -1});
  end_ = std::max(end_, to);
}

void Waveform::character(Role sender, Time start, Time end, std::uint8_t byte) {
  const bool by_host = sender == Role::host;
  const std::size_t wire = kind_ == LinkKind::half_duplex ? line : by_host ? host : device;
  const unsigned bits = settings_.character_bits();
  const Scale edge{start, end - start, bits};
  drive(wire, edge(0), edge(1));
  for (unsigned i = 0; i < 8; ++i) {
    if ((byte >> i & 1) == 0) drive(wire, edge(i + 1), edge(i + 2));
  }
  const bool odd = std::popcount(byte) % 2 != 0;
  const bool parity = settings_.parity == Parity::even ? odd : !odd;
  if (settings_.parity != Parity::none && !parity) drive(wire, edge(9), edge(10));
  comments_.push_back({start, (by_host ? "host " : "device ") + to_hex(Bytes(&byte, 1))});
  end_ = std::max(end_, end);
}

void Waveform::exchange(const Line<std::uint8_t>::Exchange& seen) {
  if (kind_ == LinkKind::clocked) {
    draw_clocked(seen);
    comments_.push_back({seen.start, std::to_string(seen.bits) + " bits " + to_hex(seen.in)});
  } else {
    draw_exchange(seen);
    comments_.push_back({seen.start, "mosi " + to_hex(seen.out) + " miso " + to_hex(seen.in)});
  }
  end_ = std::max(end_, seen.end);
}

void Waveform::draw_clocked(const Line<std::uint8_t>::Exchange& seen) {
  const auto bits = static_cast<std::int64_t>(seen.bits);
  const std::int64_t idle = settings_.idle_clocks;
  const Scale half{seen.start, seen.end - seen.start, 2 * bits};
  for (std::int64_t i = 0; i < bits + idle; ++i) drive(clock, half(2 * i), half(2 * i + 1));
  for (std::int64_t i = 0; i < bits; ++i) {
    // The first bit of an encoder that answers at once is there before the first edge.
    const Time from = i + idle == 0 ? seen.start : half(2 * (i + idle) - 1);
    if (!BitView{seen.in, seen.bits}[static_cast<std::size_t>(i)]) drive(data, from, half(2 * (i + idle) + 1));
  }
}

// CPHA 0: data stands before the leading edge, which takes it. CPHA 1: it comes with the leading edge.
void Waveform::draw_exchange(const Line<std::uint8_t>::Exchange& seen) {
  const std::int64_t phase = (settings_.spi_mode & 1) != 0 ? 0 : 1;
  const Scale half{seen.start, seen.end - seen.start, static_cast<std::int64_t>(2 * seen.bits)};
  drive(cs, seen.start, seen.end);
  for (std::size_t i = 0; i < seen.bits; ++i) {
    const auto at = static_cast<std::int64_t>(2 * i);
    drive(sck, half(at + phase), half(at + phase + 1));
    if (BitView{seen.out, seen.bits}[i]) drive(mosi, half(at), half(at + 2));
    if (!BitView{seen.in, seen.bits}[i]) drive(miso, half(at), half(at + 2));
  }
}

std::string Waveform::vcd(std::string_view title) const {
  std::string text = "$version absenc $end\n$timescale 1 ns $end\n";
  // Not among the changes, where the standard allows them too: sigrok's reader stops at the first.
  std::vector<Comment> comments = comments_;
  std::stable_sort(comments.begin(), comments.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  for (const Comment& comment : comments) {
    text += "$comment #" + std::to_string(comment.at.count()) + ' ' + comment.words + " $end\n";
  }
  text += "$scope module " + std::string(title) + " $end\n";
  for (std::size_t i = 0; i < wires_.size(); ++i) {
    text += std::string("$var wire 1 ") + identifier(i) + ' ' + std::string(wires_[i].name) + " $end\n";
  }
  return text + "$upscope $end\n$enddefinitions $end\n" + changes();
}

// At 0 all levels, then what has changed; each time once.
std::string Waveform::changes() const {
  std::vector<Change> sorted = changes_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  std::vector<int> drivers(wires_.size());
  std::vector<int> told(wires_.size(), -1);
  std::string text;
  auto change = sorted.begin();
  for (Time at{};; at = change->at) {
    for (; change != sorted.end() && change->at == at; ++change) drivers[change->wire] += change->by;
    std::string levels;
    for (std::size_t i = 0; i < wires_.size(); ++i) {
      const int level = (drivers[i] == 0) == wires_[i].idle ? 1 : 0;
      if (std::exchange(told[i], level) != level) levels += std::to_string(level) + identifier(i) + '\n';
    }
    if (!levels.empty()) text += '#' + std::to_string(at.count()) + '\n' + levels;
    if (change == sorted.end()) break;
  }
  // Viewers and decoders end with the last time: leave room behind the last stop bit.
  constexpr Time margin = std::chrono::microseconds(10);
  return text + '#' + std::to_string((end_ + margin).count()) + '\n';
}

}  // namespace absenc::sim
