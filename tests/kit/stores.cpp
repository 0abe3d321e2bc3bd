// SPDX-License-Identifier: Apache-2.0
// Checks settings and memory of the virtual encoder, and the storage of hosts and devices.
#include <set>

#include "tests/kit/changes.hpp"
#include "tests/kit/kit.hpp"

namespace absenc::kit {
namespace {

// ---- Commands that change settings, zero, turns or alarms

template <class Item>
void change(const Unit& unit, const Configuration& configuration, const Command& command, Findings& findings) {
  sim::Random random(3);
  unsigned good = 0;
  bool refused = false;
  std::set<std::string> read;
  std::set<std::int64_t> set;
  for (unsigned i = 0; i < 5; ++i) {
    World<Item> world(unit, configuration.options, 1);
    if (!world.made()) return;
    world.move(static_cast<std::int64_t>(random.next()));
    Values values = i == 0   ? least_arguments(command)
                    : i == 1 ? most_arguments(command)
                             : random_arguments(command, random);
    if (std::int64_t* force = argument(command, values, Role::force)) *force = 0;
    const auto what = [&] {
      return configuration.text + ", " + std::string(command.name) + to_text(Arguments(values)) + ": ";
    };
    const std::string before = to_text(read_setting(world, unit, command).fields);
    const ConversationResult result = world.run(command, values);
    if (!result.made) continue;
    findings.require(result.ended, [&] { return what() + "hangs"; });
    refused = refused || result.error == Error::unsupported || result.error == Error::invalid_argument;
    if (!result.good()) continue;
    ++good;
    apply_to_host(world, unit, command, values);
    const std::string broken = broken_promise(world, unit, command, values, result.seen);
    findings.require(broken.empty(), [&] { return what() + broken; });
    // The rules of some encoders forbid to write a value that the setting already has; such a violation is ignored.
    const std::string now = to_text(read_setting(world, unit, command).fields);
    findings.require(world.device().violation_count() == 0 || (command.verb == Verb::config_set && now == before),
                     [&] { return what() + std::string(world.device().violations()[0].rule); });
    if (command.verb != Verb::config_set || command.reads_back.empty()) continue;
    set.insert(values[0]);
    read.insert(now);
  }
  findings.require(good > 0 || refused,
                   [&] { return configuration.text + ", " + std::string(command.name) + ": never ends well"; });
  // If at least two different values were written, at least two different values must have been read back.
  findings.require(set.size() < 2 || read.size() > 1,
                   [&] { return std::string(command.name) + ": the same value is read whatever is set"; });
}

// ---- Memory and registers of the virtual encoder

template <class Item>
void try_memory(const Unit& unit, const Configuration& configuration, Findings& findings) {
  const Command* write = find_command(unit, Verb::memory_write);
  const Command* reads = find_command(unit, Verb::memory_read);
  if (reads == nullptr) return;
  World<Item> world(unit, configuration.options, 1);
  for (const MemoryArea& area : unit.memory) {
    for (const std::uint32_t address : {area.first, area.first + area.count - 1}) {
      const auto what = [&] { return "memory " + std::to_string(area.page) + "/" + std::to_string(address) + " "; };
      const ConversationResult before = world.run(*reads, memory_arguments(*reads, area, address, 0));
      findings.require(before.good(), [&] { return what() + "cannot be read: " + before.detail; });
      if (write == nullptr) continue;
      for (const std::uint8_t byte : {std::uint8_t{0x5A}, std::uint8_t{0x25}}) {
        const Values values = memory_arguments(*write, area, address, byte);
        const ConversationResult written = world.run(*write, values);
        if (!area.writable) {
          findings.require(!written.good(), [&] { return what() + "is written, though it is read-only"; });
          continue;
        }
        findings.require(written.good(), [&] { return what() + "cannot be written: " + written.detail; });
        const std::string broken = broken_promise(world, unit, *write, values, written.seen);
        findings.require(broken.empty() || !written.good(), [&] { return what() + broken; });
      }
    }
    const std::uint32_t outside = area.first + area.count;
    const bool other = std::any_of(unit.memory.begin(), unit.memory.end(),
                                   [&](const MemoryArea& one) { return one.has(area.page, outside); });
    const Values values = memory_arguments(*reads, area, outside, 0);
    if (other || outside > find_role(reads->arguments, Role::address)->maximum) continue;
    findings.require(!world.run(*reads, values).good(), [&] {
      return "memory " + std::to_string(area.page) + "/" + std::to_string(outside) +
             " is readable, though it does not exist";
    });
  }
}

template <class Item>
void try_registers(const Unit& unit, const Configuration& configuration, Findings& findings) {
  const Command* reads = find_command(unit, Verb::memory_read);
  for (const RegisterInfo& one : unit.registers) {
    World<Item> world(unit, configuration.options, 1);
    const MemoryArea place{.page = 0, .first = one.address, .count = 1, .meaning = {}};
    const ConversationResult read = world.run(*reads, memory_arguments(*reads, place, one.address, 0));
    findings.require(read.good() == one.readable, [&] {
      return "register " + std::string(one.name) + (one.readable ? " cannot" : " can") + " be read " + read.detail;
    });
  }
}

// ---- Storage of conversations and devices

constexpr std::byte untouched{0xA5};

/// Storage of a given size, followed by bytes with a known value: if one of these changes, the unit has written
/// beyond its storage.
struct Fenced {
  Fenced(std::size_t size_given, std::size_t behind) : bytes(size_given + behind + 64, untouched), size(size_given) {}
  [[nodiscard]] std::span<std::byte> given() { return std::span(bytes).first(size); }
  [[nodiscard]] bool is_whole() const {
    return std::all_of(bytes.begin() + static_cast<std::ptrdiff_t>(size), bytes.end(),
                       [](std::byte one) { return one == untouched; });
  }
  std::vector<std::byte> bytes;
  std::size_t size;
};

template <class Item>
void store(const Unit& unit, const Configuration& configuration, const Command& command, Findings& findings) {
  const Values values = least_arguments(command);
  const auto made = [&](std::size_t size) {
    Fenced storage(size, unit.host_storage + unit.device_storage);
    const bool is = unit.host(configuration.options, command, values, storage.given()).template of<Item>() != nullptr;
    findings.require(storage.is_whole(),
                     [&] { return std::string(command.name) + ": is constructed beyond its storage"; });
    return is;
  };
  if (!made(unit.host_storage)) {
    findings.require(!made(4 * unit.host_storage),
                     [&] { return std::string(command.name) + ": needs more than host_storage"; });
    return;
  }
  std::size_t none = 0;  // the largest of the tried storage sizes that the unit has refused as too small
  std::size_t needed = unit.host_storage;
  findings.require(!made(0), [&] { return std::string(command.name) + ": needs no storage"; });
  while (needed - none > 1) {
    const std::size_t middle = none + (needed - none) / 2;
    (made(middle) ? needed : none) = middle;
  }
  const auto end = [&](std::size_t size) {
    World<Item> world(unit, configuration.options, 1);
    Fenced storage(size, unit.host_storage + unit.device_storage);
    const ConversationResult result = world.run_in(storage.given(), command, values);
    findings.require(storage.is_whole(), [&] { return std::string(command.name) + ": writes beyond its storage"; });
    return std::pair(result.error, result.seen.fields);
  };
  const auto roomy = end(unit.host_storage);
  // In the smallest storage a procedure may start and later fail, because its later part needs more storage.
  const auto tight = needed == unit.host_storage ? roomy : end(needed);
  findings.require(tight == roomy || tight.first == Error::buffer_too_small,
                   [&] { return std::string(command.name) + ": ends differently in the smallest storage"; });
}

template <class Item>
void store_device(const Unit& unit, const Configuration& configuration, Findings& findings) {
  const SettableShaft shaft;
  const auto made = [&](std::size_t size) {
    Fenced storage(size, unit.host_storage + unit.device_storage);
    const bool is = unit.device(configuration.options, shaft, storage.given()).template of<Item>() != nullptr;
    findings.require(storage.is_whole(), [] { return "the virtual encoder is constructed beyond its storage"; });
    return is;
  };
  findings.require(unit.device_storage > 0, [] { return "the unit has no virtual encoder"; });
  if (unit.device_storage == 0) return;
  findings.require(made(unit.device_storage), [] { return "the virtual encoder needs more than device_storage"; });
  findings.require(!made(unit.device_storage - 1), [] { return "the virtual encoder needs less than device_storage"; });
}

template <class Check>
void for_item_type(const Unit& unit, Check&& check) {
  if (unit.link == LinkKind::can) {
    check.template operator()<CanFrame>();
  } else {
    check.template operator()<std::uint8_t>();
  }
}

}  // namespace

Findings check_settings(const Unit& unit) {
  Findings findings;
  const Configuration configuration = configurations(unit).front();
  for (const Command& command : unit.commands) {
    const bool promises = command.verb == Verb::config_set || command.verb == Verb::zero ||
                          command.verb == Verb::reset_multiturn || command.verb == Verb::clear_alarms;
    if (promises) for_item_type(unit, [&]<class Item>() { change<Item>(unit, configuration, command, findings); });
  }
  return findings;
}

Findings check_memory(const Unit& unit) {
  Findings findings;
  const Configuration configuration = configurations(unit).front();
  for_item_type(unit, [&]<class Item>() {
    try_memory<Item>(unit, configuration, findings);
    try_registers<Item>(unit, configuration, findings);
  });
  return findings;
}

Findings check_storage(const Unit& unit) {
  Findings findings;
  for (const Configuration& configuration : configurations(unit)) {
    if (!configuration.is_model) continue;
    for_item_type(unit, [&]<class Item>() {
      for (const Command& command : unit.commands) store<Item>(unit, configuration, command, findings);
      store_device<Item>(unit, configuration, findings);
    });
  }
  return findings;
}

}  // namespace absenc::kit
