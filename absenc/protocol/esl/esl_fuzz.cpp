// SPDX-License-Identifier: Apache-2.0
// Any bytes as request and reply of the decoder, as captures of a probe, as what a host conversation receives, and as
// requests to the device.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/esl/host.hpp"
#include "absenc/protocol/esl/probe.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::esl;
using namespace absenc::fuzz;

// The profile that the first byte stands for.
Profile profile_of(Bytes input) {
  Profile profile;
  unsigned rest = input.empty() ? 0 : input[0];
  for (const std::size_t option : {option_crc_bit_order, option_crc16_byte_order, option_rs1_sc2, option_status_order,
                                   option_memory_address_order, option_request_crc}) {
    const auto count = static_cast<unsigned>(options[option].choices.size());
    set_option(profile, option, rest % count);
    rest /= count;
  }
  return profile;
}

// Every split of the input into request and reply; an error puts no field.
void decode_all_splits(const Profile& profile, Bytes input) {
  for (std::size_t split = 0; split <= input.size() && split <= request_capacity; ++split) {
    Counting sink;
    const Error error = decode(profile, input.first(split), input.subspan(split), sink);
    require((error == Error::none) == (sink.count > 0));
  }
}

// What passes as a reply is the reply that its fields make.
void decode_and_encode(const Profile& profile, Bytes input) {
  if (input.empty() || !data_id(input[0])) return;
  const Request request{*data_id(input[0]), address_of(input[0]),
                        input.size() > 1 ? esl::detail::address_from_wire(profile, input[1]) : std::uint8_t{0},
                        input.size() > 2 ? input[2] : std::uint8_t{0}};
  const Result<Reply> reply = decode_reply(profile, request, input);
  if (!reply) return;
  const ReplyBytes bytes = encode_reply(profile, *reply);
  require(bytes.size() == input.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) require(bytes[i] == input[i]);
}

void probe_it(const Profile& profile, Bytes input) {
  const Change change = find_change(profile, {.reply = input});
  require(change.count <= change.options.size());
}

// Whatever comes back, a conversation ends, and with a position only after good replies.
void converse(const Profile& profile, Bytes input) {
  ReadSafePosition read(profile);
  Time now{};
  for (unsigned steps = 0; steps < 64; ++steps) {
    const auto step = read.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::done) {
      // The same bytes twice can never show that the sequence counter moves.
      require(read.error() != Error::none && read.position() == nullptr && !read.detail().empty());
      return;
    }
    now += std::chrono::microseconds(100);
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
void ask_device(const Profile& profile, Bytes input) {
  const Still still;
  VirtualEncoder encoder(profile, still);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  Time now{};
  for (std::size_t i = 0; i < input.size(); ++i) {
    now += std::chrono::microseconds(1);
    if (input[i] >= 0xF0 && i > 0 && (input[i - 1] & 1) != 0) {
      now += std::chrono::milliseconds(input[i] & 0xF);
      encoder.feed({.kind = Event<std::uint8_t>::Kind::silence, .at = now});
    } else {
      encoder.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = input.subspan(i, 1)});
    }
    const auto step = encoder.next(now);
    if (step.kind != Step<std::uint8_t>::Kind::transfer) continue;
    const auto id = data_id(step.out[0]);
    require(id && step.out.size() == reply_length(*id) && step.at > now);
    now = step.at + std::chrono::microseconds(18);
    encoder.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  }
  require(encoder.answered() <= input.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input(data, size);
  const Profile profile = profile_of(input);
  decode_all_splits({}, input);
  decode_all_splits(profile, input);
  decode_and_encode({}, input);
  decode_and_encode(profile, input);
  probe_it(profile, input);
  converse({}, input);
  ask_device({}, input);
  ask_device(profile, input);
  return 0;
}
