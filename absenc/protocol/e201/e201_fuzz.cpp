// SPDX-License-Identifier: Apache-2.0
// Any bytes as request and reply of the decoder, as what a host conversation receives, and as what the interface hears.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>

#include "absenc/protocol/e201/device.hpp"
#include "absenc/protocol/e201/fields.hpp"
#include "absenc/protocol/e201/host.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::e201;
using namespace absenc::fuzz;
using Kind = Event<std::uint8_t>::Kind;

const Format encoders[]{
    {},
    {.carries = Carries::ssi, .ssi = {.word = "multiturn:12 position:13 gray error:1 parity:1"_word}},
};

// Every split of the input into request and reply; an error puts no field, a good one at least one.
void decode_all_splits(const Format& format, Bytes input) {
  for (std::size_t split = 0; split <= input.size() && split <= request_capacity; ++split) {
    Counting sink;
    const Error error = decode(format, input.first(split), input.subspan(split), sink);
    require((error == Error::none) == (sink.count > 0));
  }
}

// The texts that no document describes.
void read_texts(Bytes input) {
  const std::optional<unsigned> clock = find_clock(input);
  require(!clock || (*clock >= 1 && *clock <= clocks_khz.size()));
  static_cast<void>(find_version(input));
  static_cast<void>(find_milli(input, 'V'));
  static_cast<void>(decode_number(input, 16));
}

// Whatever comes back, at once or byte by byte, a conversation ends, and with a result only after a good reply.
template <class Conversation>
void converse(Conversation conversation, Bytes input, bool at_once) {
  Time now{};
  Bytes left{};  // of the input, to the request that was sent last
  for (unsigned steps = 0; steps < 10'000; ++steps) {
    now += std::chrono::milliseconds(1);
    if (steps == 30) conversation.abort();
    const auto step = conversation.next(now);
    switch (step.kind) {
      case Step<std::uint8_t>::Kind::done: {
        Counting sink;
        conversation.report(sink);
        require(conversation.error() == Error::none || sink.count == 0);
        return;
      }
      case Step<std::uint8_t>::Kind::transfer:
        conversation.feed({.kind = Kind::sent, .at = now});
        left = input;
        break;
      case Step<std::uint8_t>::Kind::wait: {
        const Bytes piece = left.first(at_once ? left.size() : std::min<std::size_t>(1, left.size()));
        left = left.subspan(piece.size());
        conversation.feed({.kind = piece.empty() ? Kind::silence : Kind::received, .at = now, .items = piece});
        break;
      }
      default:
        break;
    }
  }
  std::abort();
}

void ask_adapter(const Format& format, Bytes input) {
  const Still still;
  VirtualAdapter adapter(format, still);
  adapter.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  Time now{};
  for (const std::uint8_t byte : input) {
    now += std::chrono::milliseconds(1);
    adapter.feed({.kind = Kind::received, .at = now, .items = {&byte, 1}});
    const auto step = adapter.next(now);
    require(adapter.clock() >= 1 && adapter.clock() <= clocks_khz.size());
    if (step.kind != Step<std::uint8_t>::Kind::transfer) continue;
    require(!step.out.empty() && step.out.back() == end_of_line);
    if ((byte & 1) != 0) adapter.feed({.kind = Kind::sent, .at = now});
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input(data, size);
  read_texts(input);
  for (const Format& format : encoders) {
    decode_all_splits(format, input);
    ask_adapter(format, input);
    for (const bool at_once : {true, false}) {
      converse(ReadPosition(format), input, at_once);
      converse(ClockSweep(format, 2), input, at_once);
      converse(Zero(format), input, at_once);
    }
  }
  converse(Info(), input, true);
  converse(SwitchSupply(true), input, false);
  converse(Set(command::set_clock, 3), input, true);
  return 0;
}
