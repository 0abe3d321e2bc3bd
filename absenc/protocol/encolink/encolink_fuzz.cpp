// SPDX-License-Identifier: Apache-2.0
// Any bytes as frames and requests of the decoder, as what a host conversation receives, and as requests to the device.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/fields.hpp"
#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/encolink/listen.hpp"
#include "absenc/protocol/encolink/unit.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::encolink;
using namespace absenc::fuzz;

// The first byte chooses the format.
Format format_of(std::uint8_t byte) {
  constexpr std::array<int, 8> turns{-1, 0, 0, 1, 8, 12, 15, 16};
  return {.resolution = byte % (maximum_resolution + 1u), .multiturn_bits = turns[byte >> 5], .has_ch2 = byte % 7 != 0};
}

// An error puts no field, a good frame at least one; what passes as a frame is the frame that its fields make.
void decode_all(const Format& format, Bytes input) {
  Counting as_reply;
  require((decode(format, {}, input, as_reply) == Error::none) == (as_reply.count > 0));
  Counting as_request;
  require((decode(format, input, {}, as_request) == Error::none) == (as_request.count > 0));
  if (const Result<RegisterRequest> access = decode_access(input)) {
    const AccessBytes again = encode_access(*access);
    require(again.size() == input.size());
    for (std::size_t i = 0; i < input.size(); ++i) require(again[i] == input[i]);
  }
  if (!format.known()) return;
  if (const Result<Position> position = decode_position(format, input)) {
    const ReplyBytes again = encode_position(format, *position);
    require(again.size() == input.size());
    for (std::size_t i = 0; i < input.size(); ++i) require(again[i] == input[i]);
  }
}

// Whatever comes back, a conversation ends or goes on asking, and has a position only after a good frame.
void converse(Conversation<std::uint8_t>& conversation, const Format& format, Bytes input) {
  Time now{};
  std::size_t at = 0;
  for (unsigned steps = 0; steps < 400; ++steps) {
    const auto step = conversation.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::done) {
      require(conversation.error() == Error::none || conversation.reading() == nullptr);
      return;
    }
    now += std::chrono::microseconds(50);
    if (step.kind == Step<std::uint8_t>::Kind::transfer) {
      conversation.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
      // Good frames whose channel 2 is the input, and now and then the input itself.
      ReplyBytes frame = encode_position(format, {.singleturn = 1});
      if (at < input.size()) frame[frame.size() - 1] = input[at++];
      const bool raw = at % 11 == 10;
      conversation.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = raw ? input : Bytes(frame)});
    } else if (step.kind == Step<std::uint8_t>::Kind::wait) {
      conversation.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now});
    }
  }
}

void listen(const Format& format, Bytes input) {
  Listen machine(format, 3);
  machine.next(Time{});
  machine.feed({.kind = Event<std::uint8_t>::Kind::received, .at = Time{1}, .items = input});
  machine.next(Time{1});
  machine.feed({.kind = Event<std::uint8_t>::Kind::timer, .at = std::chrono::hours(1)});
  const auto step = machine.next(std::chrono::hours(1));
  require(step.kind == Step<std::uint8_t>::Kind::done || step.kind == Step<std::uint8_t>::Kind::emit);
}

// Pairs of bytes as requests: the device answers each with a sealed frame.
void ask_device(const Format& format, Bytes input) {
  const Still still;
  VirtualEncoder encoder(format, still);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  const std::size_t sealed = encoder.format().position_bytes() + 1;
  Time now{};
  for (std::size_t i = 0; i + 1 < input.size(); i += 2) {
    now += std::chrono::microseconds(100);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = input.subspan(i, 2)});
    const auto step = encoder.next(now);
    require(step.kind == Step<std::uint8_t>::Kind::transfer && step.at > now);
    require(step.out.size() == identity_bytes ? is_sealed(step.out) : is_sealed(step.out.first(sealed)));
    now = step.at + std::chrono::microseconds(190);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  }
  require(encoder.answered() == input.size() / 2);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes input(data, size);
  decode_all(format_of(data[0]), input);
  decode_all({.resolution = 20, .multiturn_bits = 16}, input);
  ask_device(format_of(data[0]), input.subspan(1));
  const Format format{.resolution = 20, .multiturn_bits = 0};
  listen(format, input);
  alignas(std::max_align_t) static std::array<std::byte, 16384> storage;
  for (const Unit* one : {&unit, &spi_unit}) {
    for (const std::string_view name : {"position", "alarms", "memory-read", "memory-write"}) {
      Options options;
      options.values[0] = format.resolution;
      options.values[2] = 1;
      constexpr std::array<std::int64_t, 3> arguments{0, 1, 2};
      const auto& command = *find_command(*one, name);
      converse(*one->host(options, command, std::span(arguments).first(command.arguments.size()), storage).bytes,
               format, input);
    }
  }
  return 0;
}
