// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/channels.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "absenc/client/error.hpp"
#include "absenc/protocol/options.hpp"

namespace absenc::client {

namespace {

// A name of a wire: the wire's own name, or another name under which captures record it.
struct WireName {
  std::string_view wire;
  std::string_view name;
};
constexpr std::array<WireName, 29> known_names{{
    {"line", "line"},
    {"host", "host"},
    {"host", "tx"},
    {"device", "device"},
    {"device", "rx"},
    {"clock", "clock"},
    {"clock", "clk"},
    {"clock", "sck"},
    {"clock", "sclk"},
    {"clock", "ma"},
    {"data", "data"},
    {"data", "slo"},
    {"data", "sdo"},
    {"cs", "cs"},
    {"cs", "ss"},
    {"cs", "ncs"},
    {"mosi", "mosi"},
    {"miso", "miso"},
    {"line", "rs485"},
    {"bus", "bus"},
    {"bus", "can"},
    {"bus", "can_rx"},
    {"data", "data_in"},
    {"data", "rx"},
    {"data_out", "data_out"},
    {"data_out", "tx"},
    {"direction", "direction"},
    {"direction", "dir"},
    {"direction", "de"},
}};

bool same(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  });
}

bool is_called(std::string_view wire, std::string_view name) {
  return std::any_of(known_names.begin(), known_names.end(),
                     [&](const WireName& one) { return one.wire == wire && same(one.name, name); });
}

std::string list(std::span<const std::string> channels) {
  return channels.empty() ? "none" : fmt::format("{}", fmt::join(channels, ", "));
}

std::vector<std::string_view> split(std::span<const std::string> wanted) {
  std::vector<std::string_view> parts;
  for (std::string_view text : wanted) {
    while (!text.empty()) {
      const std::string_view part = text.substr(0, text.find(','));
      text.remove_prefix(std::min(part.size() + 1, text.size()));
      if (!part.empty()) parts.push_back(part);
    }
  }
  return parts;
}

bool is_needed(LinkKind link, std::string_view wire) {
  // On a full-duplex line no wire is needed by itself: a capture may contain only the host's wire, or only the
  // encoder's.
  if (link == LinkKind::full_duplex) return false;
  return wire != "cs" && wire != "mosi" && wire != "data_out" && wire != "direction";
}

void assign(WireChannels& found, LinkKind link, std::span<const std::string> channels, std::string_view part) {
  const auto wires = wires_of(link);
  const std::size_t equals = part.find('=');
  std::size_t wire = 0;
  if (equals != std::string_view::npos) {
    const std::string_view name = part.substr(0, equals);
    while (wire < wires.size() && !is_called(wires[wire], name)) ++wire;
    if (wire == wires.size()) {
      throw UsageError(
          fmt::format("--channel {}: there is no wire \"{}\"; the wires are {}", part, name, fmt::join(wires, ", ")));
    }
    part.remove_prefix(equals + 1);
  } else {
    while (wire < wires.size() && found.wires[wire]) ++wire;
    if (wire == wires.size()) {
      throw UsageError(fmt::format("--channel {} is one too many: the wires are {}", part, fmt::join(wires, ", ")));
    }
    found.assumed = link == LinkKind::full_duplex;
  }
  found.wires[wire] = find_channel(channels, part);
}

}  // namespace

std::span<const std::string_view> wires_of(LinkKind link) {
  static constexpr std::array<std::string_view, 1> half_duplex{"line"};
  static constexpr std::array<std::string_view, 2> full_duplex{"host", "device"};
  static constexpr std::array<std::string_view, 4> spi{"clock", "miso", "mosi", "cs"};
  static constexpr std::array<std::string_view, 2> clocked{"clock", "data"};
  static constexpr std::array<std::string_view, 4> both_ways{"clock", "data", "data_out", "direction"};
  static constexpr std::array<std::string_view, 1> can{"bus"};
  switch (link) {
    case LinkKind::half_duplex:
      return half_duplex;
    case LinkKind::full_duplex:
      return full_duplex;
    case LinkKind::spi:
      return spi;
    case LinkKind::clocked:
      return clocked;
    case LinkKind::clocked_bidirectional:
      return both_ways;
    case LinkKind::can:
      return can;
  }
  return {};
}

unsigned find_channel(std::span<const std::string> channels, std::string_view name) {
  for (unsigned i = 0; i < channels.size(); ++i) {
    if (same(channels[i], name)) return i;
  }
  const Result<std::int64_t> number = parse_number(name);
  if (number && *number >= 0 && *number < static_cast<std::int64_t>(channels.size())) {
    return static_cast<unsigned>(*number);
  }
  throw UsageError(fmt::format("--channel: there is no channel \"{}\"; the capture has {}", name, list(channels)));
}

WireChannels find_wires(LinkKind link, std::span<const std::string> channels, std::span<const std::string> wanted) {
  const auto wires = wires_of(link);
  WireChannels found;
  found.wires.resize(wires.size());
  for (const std::string_view part : split(wanted)) assign(found, link, channels, part);
  if (wanted.empty()) {
    for (std::size_t wire = 0; wire < wires.size(); ++wire) {
      for (unsigned i = 0; i < channels.size(); ++i) {
        if (!found.wires[wire] && is_called(wires[wire], channels[i])) found.wires[wire] = i;
      }
    }
    // If no channel has the name of a wire, the channels are assumed to be in the order of the wires.
    const bool any =
        std::any_of(found.wires.begin(), found.wires.end(), [](const auto& one) { return one.has_value(); });
    if (!any && !host_clocks(link) && channels.size() <= wires.size()) {
      for (unsigned i = 0; i < channels.size(); ++i) found.wires[i] = i;
      found.assumed = link == LinkKind::full_duplex;
    }
  }
  std::size_t missing = 0;
  while (missing < wires.size() && (found.wires[missing] || !is_needed(link, wires[missing]))) ++missing;
  const bool none =
      std::none_of(found.wires.begin(), found.wires.end(), [](const auto& one) { return one.has_value(); });
  if (none || missing < wires.size()) {
    throw UsageError(fmt::format("which channel is the wire \"{}\"? Say it with --channel {}=NAME; the capture has {}",
                                 wires[missing % wires.size()], wires[missing % wires.size()], list(channels)));
  }
  return found;
}

}  // namespace absenc::client
