// SPDX-License-Identifier: Apache-2.0
// Fuzz target that feeds arbitrary bytes to a unit, which the first bytes select.
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "tests/fuzz_toys.hpp"
#include "tests/kit/frames.hpp"
#include "tests/kit/player.hpp"

namespace {

using namespace absenc;
using namespace absenc::kit;
using fuzz::require;

struct Fields final : FieldSink {
  void put(const FieldValue&) override { ++count; }
  void put_reading(const Reading&) override { ++readings; }
  unsigned count = 0;
  unsigned readings = 0;
};

struct Nowhere final : EvidenceSink {
  void put(const OptionEvidence&) override {}
};

const std::vector<std::vector<Configuration>>& all_configurations() {
  static const std::vector<std::vector<Configuration>> all = [] {
    std::vector<std::vector<Configuration>> made;
    for (const Unit* unit : all_units()) made.push_back(configurations(*unit));
    return made;
  }();
  return all;
}

OwnedFrame as_frame(const Unit& unit, Bytes bytes) {
  OwnedFrame frame{.link = unit.link};
  if (bytes.empty()) return frame;
  frame.bytes.assign(bytes.begin(), bytes.end());
  if (carries_bits(unit.link)) frame.bits = 8 * bytes.size() - (bytes.back() & 7);
  if (unit.link != LinkKind::can) return frame;
  CanFrame can{.id = bytes[0] * 8u, .size = static_cast<std::uint8_t>(std::min<std::size_t>(8, bytes.size() - 1))};
  std::copy_n(bytes.begin() + 1, can.size, can.data.begin());
  frame.can = can;
  return frame;
}

// Decodes the input as request and reply. A frame with an error must report no field, a good frame at least one.
void decode(const Unit& unit, const Options& options, Bytes input) {
  for (std::size_t split = 0; split <= input.size() && split <= 16; ++split) {
    const OwnedFrame request = as_frame(unit, input.first(split));
    const OwnedFrame reply = as_frame(unit, input.subspan(split));
    Fields fields;
    const Error error = unit.decode(options, request.frame(), reply.frame(), fields);
    require((error == Error::none) == (fields.count > 0) && fields.readings <= (error == Error::none ? 1u : 0u));
    if (error != Error::none && unit.explain != nullptr) {
      (void)unit.explain(options, error, request.frame(), reply.frame());
    }
  }
}

void find_frame_end(const Unit& unit, const Options& options, Bytes input) {
  for (const Direction direction : {Direction::request, Direction::reply}) {
    const FrameEnd end = unit.frame_end(options, direction, input);
    if (end.kind == FrameEnd::Kind::complete) require(end.size <= input.size() && (end.size > 0 || input.empty()));
    if (end.kind == FrameEnd::Kind::incomplete) require(end.size > input.size() || end.size == 0);
  }
}

void probe(const Unit& unit, Options options, Bytes input) {
  if (unit.probe == nullptr) return;
  Nowhere nowhere;
  const std::array captures{Capture{{}, input}, Capture{input, {}}, Capture{input.first(input.size() / 2), input}};
  (void)unit.probe(options, captures, nowhere);
}

/// Returns the input as items of the unit's link, which are bytes or CAN frames.
template <class Item>
std::vector<Item> items_of(const Unit& unit, Bytes bytes) {
  if constexpr (std::is_same_v<Item, CanFrame>) {
    std::vector<Item> frames;
    for (std::size_t at = 0; at < bytes.size(); at += 9) {
      frames.push_back(*as_frame(unit, bytes.subspan(at, std::min<std::size_t>(9, bytes.size() - at))).can);
    }
    return frames;
  } else {
    return {bytes.begin(), bytes.end()};
  }
}

// Runs a conversation. The reply to each request is the whole input, in pieces of `piece` items.
template <class Item>
void converse(const Unit& unit, const Options& options, const Command& command, Bytes input, std::size_t piece) {
  using Kind = typename Event<Item>::Kind;
  using Wanted = typename Step<Item>::Kind;
  static std::vector<std::byte> storage;
  storage.resize(std::max(storage.size(), unit.host_storage));
  Conversation<Item>* conversation = unit.host(options, command, least_arguments(command), storage).template of<Item>();
  if (conversation == nullptr) return;
  std::vector<Item> items = items_of<Item>(unit, input);
  const bool clocks = host_clocks(unit.link);
  Time now{};
  std::span<const Item> left{};
  bool unsolicited = true;
  for (unsigned steps = 0; steps < 30'000; ++steps) {
    const Step<Item> step = conversation->next(now);
    require(conversation->error() == Error::none || conversation->reading() == nullptr);
    if (step.kind == Wanted::done) {
      Fields fields;
      conversation->report(fields);
      require(conversation->error() == Error::none || fields.count == 0);
      return;
    }
    if (steps == 300) conversation->abort();
    if (step.kind == Wanted::emit || step.kind == Wanted::configure) continue;
    now = std::max(now + std::chrono::milliseconds(1), step.kind == Wanted::wait ? Time{} : step.at);
    if (step.kind != Wanted::wait) {
      conversation->feed({.kind = Kind::sent, .at = now});
      // A host that clocks the line receives as many bytes as it has clocked, however long the input is.
      if (clocks) items.resize(step.bits != 0 ? (step.bits + 7) / 8 : std::max(step.expect, step.out.size()));
      left = items;
    } else if (!left.empty() || unsolicited) {
      if (unsolicited) left = items;
      const auto part = left.first(clocks ? left.size() : std::min(piece, left.size()));
      left = left.subspan(part.size());
      if (!part.empty()) conversation->feed({.kind = Kind::received, .at = now, .items = part});
    } else {
      conversation->feed({.kind = Kind::silence, .at = now});
      if (step.at > now && step.at != never) now = step.at;
      conversation->feed({.kind = Kind::timer, .at = now});
    }
    unsolicited = false;
  }
  require(false);
}

// Feeds the input to the virtual encoder, which must not send an empty frame.
template <class Item>
void ask_device(const Unit& unit, const Options& options, Bytes input) {
  using Kind = typename Event<Item>::Kind;
  using Wanted = typename Step<Item>::Kind;
  static std::vector<std::byte> storage;
  storage.resize(std::max(storage.size(), unit.device_storage));
  const bool streams = unit.streams != nullptr && unit.streams(options);
  const fuzz::Still still;
  Device<Item>* device = unit.device(options, still, storage).template of<Item>();
  if (device == nullptr) return;
  device->power_on(Time{}, Device<Item>::PowerOn::skip);
  Time now{};
  const std::vector<Item> items = items_of<Item>(unit, input);
  for (std::size_t i = 0; i < items.size(); ++i) {
    now += std::chrono::microseconds(input[i] < 0xF0 ? 10 : 10'000);
    if (input[i] >= 0xF0) device->feed({.kind = Kind::silence, .at = now});
    device->feed({.kind = Kind::received, .at = now, .items = {&items[i], 1}});
    for (unsigned steps = 0;; ++steps) {
      require(steps < 100);
      const Step<Item> step = device->next(now);
      if (step.kind == Wanted::wait) break;
      if (step.kind != Wanted::transfer) continue;
      require(!step.out.empty());
      now = std::max(now, step.at);
      device->feed({.kind = Kind::sent, .at = now});
      if (streams) break;  // an encoder that sends unsolicited frames never stops, so the loop ends here
    }
  }
}

template <class Item>
void run(const Unit& unit, const Options& options, const Command& command, Bytes input) {
  // A scan sends hundreds of requests, so only eight bytes of the input are used as each reply.
  const Bytes reply = input.first(std::min<std::size_t>(input.size(), command.verb == Verb::scan ? 8 : input.size()));
  converse<Item>(unit, options, command, reply, 1);
  converse<Item>(unit, options, command, reply, reply.size() + 1);
  if (!host_clocks(unit.link)) ask_device<Item>(unit, options, input);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  const std::size_t number = data[0] % all_units().size();
  const Unit& unit = *all_units()[number];
  const std::vector<Configuration>& setups = all_configurations()[number];
  const Options& options = setups[data[1] % setups.size()].options;
  const Command& command = unit.commands[data[2] % unit.commands.size()];
  const Bytes input(data + 3, size - 3);
  decode(unit, options, input);
  find_frame_end(unit, options, input);
  probe(unit, options, input);
  if (unit.link == LinkKind::can) {
    run<CanFrame>(unit, options, command, input);
  } else {
    run<std::uint8_t>(unit, options, command, input);
  }
  return 0;
}
