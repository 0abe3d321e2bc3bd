// SPDX-License-Identifier: Apache-2.0
#include "tests/kit/frames.hpp"
#include "tests/kit/kit.hpp"
#include "tests/kit/player.hpp"

namespace absenc::kit {
namespace {

// Runs a command on a line without an encoder; it must end.
template <class Item>
void meet_silence(const Unit& unit, const Configuration& configuration, const Command& command, Findings& findings) {
  std::vector<std::byte> storage(unit.host_storage);
  Conversation<Item>* conversation =
      unit.host(configuration.options, command, least_arguments(command), storage).template of<Item>();
  if (conversation == nullptr) return;
  Player<Item> player;
  constexpr unsigned every_address = 100'000;  // limit of simulator steps, enough for a scan of every address
  const bool ended = player.run(
      *conversation, {}, [](std::size_t) { return typename Player<Item>::Pieces{}; }, [] {}, every_address);
  // A command that sends no request is unsupported with these options, or waits for unsolicited frames: it need not
  // fail.
  if (ended && player.request_count() == 0) return;
  const auto where = [&] {
    return std::string(command.name) + " of \"" + configuration.text + "\" without an encoder: ";
  };
  findings.require(ended, [&] { return where() + "does not end"; });
  // A command that expects no reply, or stops a stream, may succeed.
  const bool wants_none = command.verb == Verb::run && conversation->reading() == nullptr;
  const Error error = conversation->error();
  findings.require(!ended || error == Error::timeout || (wants_none && error == Error::none),
                   [&] { return where() + "ends with " + std::string(text_of(conversation->error()).name); });
}

}  // namespace

Findings check_silence(const Unit& unit) {
  Findings findings;
  // Links without silence are left out: on a clocked or SPI link the host always reads some level, even without an
  // encoder.
  const bool can_be_silent = !host_clocks(unit.link);
  if (!can_be_silent) return findings;
  for (const Configuration& configuration : configurations(unit)) {
    for (const Command& command : unit.commands) {
      if (unit.link == LinkKind::can) {
        meet_silence<CanFrame>(unit, configuration, command, findings);
      } else {
        meet_silence<std::uint8_t>(unit, configuration, command, findings);
      }
    }
  }
  return findings;
}

}  // namespace absenc::kit
