// SPDX-License-Identifier: Apache-2.0
#include "tests/kit/frames.hpp"
#include "tests/kit/kit.hpp"
#include "tests/kit/player.hpp"

namespace absenc::kit {
namespace {

// What a command says when every request of it meets silence.
template <class Item>
void meet_silence(const Unit& unit, const Configuration& way, const Command& command, Findings& findings) {
  std::vector<std::byte> storage(unit.host_storage);
  Conversation<Item>* conversation =
      unit.host(way.options, command, least_arguments(command), storage).template of<Item>();
  if (conversation == nullptr) return;
  Player<Item> player;
  constexpr unsigned every_address = 100'000;  // steps
  const bool ended = player.run(
      *conversation, {}, [](std::size_t) { return typename Player<Item>::Pieces{}; }, [] {}, every_address);
  if (ended && player.sent() == 0) return;  // a command that this encoder does not have
  const auto where = [&] { return std::string(command.name) + " of \"" + way.text + "\" in silence: "; };
  findings.require(ended, [&] { return where() + "does not end"; });
  // Some commands have no reply, and what ends a stream succeeds when nothing comes.
  const bool wants_none = command.verb == Verb::run && conversation->reading() == nullptr;
  const Error error = conversation->error();
  findings.require(!ended || error == Error::timeout || (wants_none && error == Error::none),
                   [&] { return where() + "ends with " + std::string(text_of(conversation->error()).name); });
}

}  // namespace

Findings check_silence(const Unit& unit) {
  Findings findings;
  // Elsewhere the host's clock reads the level of the line, whoever is on it.
  const bool can_be_silent = unit.link != LinkKind::clocked && unit.link != LinkKind::spi;
  if (!can_be_silent) return findings;
  for (const Configuration& way : configurations(unit)) {
    for (const Command& command : unit.commands) {
      if (unit.link == LinkKind::can) {
        meet_silence<CanFrame>(unit, way, command, findings);
      } else {
        meet_silence<std::uint8_t>(unit, way, command, findings);
      }
    }
  }
  return findings;
}

}  // namespace absenc::kit
