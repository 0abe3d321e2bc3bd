// SPDX-License-Identifier: Apache-2.0
// Any bytes as frames and requests of the decoder, as a stream in pieces, as what hosts receive, and as requests to the
// virtual encoder.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absenc/protocol/raa38/serial/device.hpp"
#include "absenc/protocol/raa38/serial/fields.hpp"
#include "absenc/protocol/raa38/serial/host.hpp"
#include "absenc/protocol/raa38/serial/listen.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::raa38::serial;
using namespace absenc::fuzz;

Settings settings_of(std::uint8_t byte) {
  Settings settings;
  settings.format.bits = least_bits + byte % (most_bits - least_bits + 1);
  settings.format.second_byte = static_cast<SecondByte>(byte % 3);
  settings.mode = static_cast<Mode>(byte / 3 % 3);
  settings.zeroing = settings.mode == Mode::bus ? Zeroing::command : Zeroing::line;
  if (byte % 2 != 0) settings.period = std::chrono::milliseconds(1);
  if (byte % 8 == 7) settings.maximum_rpm = 3000;
  return settings;
}

// An error puts no field; what passes is the frame that its fields make.
void decode_all(const Format& format, Bytes input) {
  Counting as_reply;
  require((decode(format, {}, input, as_reply) == Error::none) == (as_reply.count > 0));
  Counting as_request;
  require((decode(format, input, {}, as_request) == Error::none) == (as_request.count > 0));
  if (const Result<Position> position = decode_position(format, input)) {
    require(std::ranges::equal(encode_position(format, *position).view(), input));
  }
  if (const Result<Request> request = decode_request(input)) {
    require(std::ranges::equal(encode_request(*request).view(), input));
  }
}

// In whatever pieces, the same positions, each of them in the bytes as a good frame.
void stream(const Settings& settings, Bytes input) {
  const auto hear = [&](std::size_t piece) {
    std::vector<std::uint32_t> positions;
    StreamDecoder decoder(settings.format, settings.second_byte());
    for (std::size_t at = 0; at < input.size(); at += piece) {
      decoder.feed(input.subspan(at, std::min(piece, input.size() - at)), Time{}, [&](const Found& found) {
        if (found.error == Error::none) positions.push_back(found.singleturn);
      });
    }
    return positions;
  };
  const std::vector<std::uint32_t> whole = hear(input.size());
  require(hear(1) == whole && hear(3) == whole);
  std::size_t from = 0;
  for (const std::uint32_t position : whole) {
    const FrameBytes frame = encode_position(settings.format, {position, settings.second_byte()});
    const auto rest = input.subspan(from);
    const auto found = std::search(rest.begin(), rest.end(), frame.view().begin(), frame.view().end());
    require(found != rest.end());
    from += static_cast<std::size_t>(found - rest.begin()) + frame.size();
  }
}

// Whatever comes, a conversation has a position only without an error, and ends when nothing more comes.
template <class Conversation>
void converse(Conversation& conversation, Bytes input) {
  using Kind = Step<std::uint8_t>::Kind;
  Time now{};
  std::size_t at = 0;
  for (unsigned steps = 0; steps < 4000; ++steps) {
    const auto step = conversation.next(now);
    require(conversation.error() == Error::none || conversation.reading() == nullptr);
    if (step.kind == Kind::done) return;
    if (step.kind == Kind::emit) continue;
    now = std::max(now, step.at) + std::chrono::milliseconds(1);
    if (step.kind != Kind::wait) {
      conversation.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
      const Bytes piece = input.subspan(at, std::min<std::size_t>(5, input.size() - at));
      at += piece.size();
      if (!piece.empty()) conversation.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = piece});
    } else if (at < input.size() && step.answer == Time{}) {
      conversation.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = input.subspan(at)});
      at = input.size();
    } else {
      conversation.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now});
      conversation.feed({.kind = Event<std::uint8_t>::Kind::timer, .at = now});
    }
  }
  require(false);
}

// Whatever it hears, the encoder sends whole frames.
void ask_device(Settings settings, Bytes input) {
  const Still still;
  settings.mode = Mode::bus;
  VirtualEncoder encoder(settings, still);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  Time now{};
  for (std::size_t i = 0; i < input.size(); ++i) {
    now += std::chrono::microseconds(100);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = input.subspan(i, 1)});
    const auto step = encoder.next(now);
    if (step.kind != Step<std::uint8_t>::Kind::transfer) continue;
    require(decode_position(settings.format, step.out, settings.unit).has_value());
    encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes input(data, size);
  const Settings settings = settings_of(data[0]);
  decode_all(settings.format, input);
  decode_all({}, input);
  stream(settings, input);
  stream({}, input);
  ask_device(settings, input.subspan(1));
  Settings asked = settings;
  if (asked.mode == Mode::timing) asked.mode = Mode::handshake;
  ReadPosition read(asked);
  converse(read, input);
  Zero zero(settings);
  converse(zero, input);
  Scan scan(settings);
  converse(scan, input);
  Listen listen(settings);
  converse(listen, input);
  return 0;
}
