// SPDX-License-Identifier: Apache-2.0
// Records the frames of a command's exchanges on a line without faults.
#pragma once

#include <utility>
#include <vector>

#include "tests/kit/world.hpp"

namespace absenc::kit {

/// A reply with its request. The request is empty if the encoder sent without one, or on a clocked link.
struct Exchange {
  OwnedFrame request{};
  OwnedFrame reply{};
};

/// Returns the last exchanges of the command, at most four, on a line without faults, with the shaft at `position`.
template <class Item>
[[nodiscard]] std::vector<Exchange> exchanges_without_faults(const Unit& unit, const Options& options,
                                                             std::int64_t position, const Command& command,
                                                             Arguments arguments) {
  World<Item> world(unit, options, 1);
  world.move(position);
  std::vector<Exchange> exchanges;
  bool answering = true;
  const auto next = [&](bool by_host) {
    const Exchange empty{{.link = unit.link}, {.link = unit.link}};
    if (by_host && std::exchange(answering, false)) exchanges.push_back(empty);
    if (!by_host && exchanges.empty()) exchanges.push_back(empty);
    if (!by_host) answering = true;
  };
  world.line().observe([&](std::size_t sender, Time, Time, const Item& item) {
    const bool by_host = world.line().role(sender) == sim::NodeRole::host;
    next(by_host);
    OwnedFrame& frame = by_host ? exchanges.back().request : exchanges.back().reply;
    if constexpr (World<Item>::is_can) {
      frame.can = item;
    } else {
      frame.bytes.push_back(item);
    }
  });
  world.line().observe_transfers([&](const typename World<Item>::Line::Transfer& transfer) {
    if constexpr (!World<Item>::is_can) {
      if (unit.link == LinkKind::clocked_bidirectional) {
        if (transfer.goes_on_from == never) exchanges.push_back({{.link = unit.link}, {.link = unit.link}});
        exchanges.back().request.append({transfer.out, transfer.out_bits});
        exchanges.back().reply.append({transfer.in, transfer.bits - transfer.out_bits});
        return;
      }
      const bool clocked = unit.link == LinkKind::clocked;
      OwnedFrame reply{.link = unit.link, .bytes = Wire(transfer.in.begin(), transfer.in.end())};
      if (clocked) reply.bits = transfer.bits;
      OwnedFrame request{.link = unit.link};
      if (!clocked) request.bytes.assign(transfer.out.begin(), transfer.out.end());
      exchanges.push_back({request, reply});
    }
  });
  (void)world.run(command, arguments);
  std::erase_if(exchanges, [](const Exchange& one) { return one.reply.empty(); });
  if (exchanges.size() > 4) exchanges.erase(exchanges.begin(), exchanges.end() - 4);
  return exchanges;
}

}  // namespace absenc::kit
