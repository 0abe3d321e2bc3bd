// SPDX-License-Identifier: Apache-2.0
// Any bytes as request and reply of the decoder, as what a host conversation receives, and as requests to the device.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/unit.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::tformat;
using namespace absenc::fuzz;

// Every split of the input into request and reply; an error puts no field, a good reply has its own length.
void decode_all_splits(Bytes input) {
  Options options;
  require(resolve_options(unit, {}, {}, options).kind == OptionError::Kind::none);
  for (std::size_t split = 0; split <= input.size() && split <= request_capacity; ++split) {
    Counting sink;
    const Error error = unit.decode(options, {.bytes = input.first(split)}, {.bytes = input.subspan(split)}, sink);
    require((error == Error::none) == (sink.count > 0));
  }
}

// What passes as a reply is the reply that its fields make.
void decode_and_encode(Bytes input) {
  if (input.size() < 2) return;
  const Result<Request> request = decode_request(input.first(1));
  if (!request) return;
  const Result<Reply> reply = decode_reply({.encoder_id = -1}, *request, input.subspan(1));
  if (!reply) return;
  const ReplyBytes bytes = encode_reply(*reply);
  require(bytes.size() == input.size() - 1);
  for (std::size_t i = 0; i < bytes.size(); ++i) require(bytes[i] == input[i + 1]);
}

// Whatever comes back, a conversation ends, and with a result only after a good reply.
void converse(Bytes input) {
  ReadPosition read({});
  Time now{};
  for (unsigned steps = 0; steps < 16; ++steps) {
    const auto step = read.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::done) {
      require((read.error() == Error::none) == (read.reading() != nullptr));
      return;
    }
    now += std::chrono::milliseconds(1);
    if (step.kind == Step<std::uint8_t>::Kind::transfer) {
      read.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
      read.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = input});
    } else {
      read.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now});
    }
  }
  std::abort();
}

// Bytes with pauses between them (0xF0 to 0xFF after an odd byte stand for one): the device answers no more often than
// it is asked, and only what decodes.
void ask_device(Bytes input) {
  const Still still;
  VirtualEncoder encoder({}, still);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  Time now{};
  for (std::size_t i = 0; i < input.size(); ++i) {
    now += std::chrono::microseconds(4);
    if (input[i] >= 0xF0 && i > 0 && (input[i - 1] & 1) != 0) {
      now += std::chrono::milliseconds(input[i] & 0xF);
      encoder.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now});
    } else {
      encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = input.subspan(i, 1)});
    }
    const auto step = encoder.next(now);
    if (step.kind != Step<std::uint8_t>::Kind::transfer) continue;
    require(!step.out.empty() && step.out.size() <= reply_capacity && checksum(step.out) == 0);
    require(has_sync_code(step.out[0]));
    now = std::max(now, step.at) + std::chrono::microseconds(44);  // a refusal is due when the frame has ended
    encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  }
  require(encoder.answered() <= input.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input(data, size);
  decode_all_splits(input);
  decode_and_encode(input);
  converse(input);
  ask_device(input);
  return 0;
}
