// SPDX-License-Identifier: Apache-2.0
// Decoding and verifying the 18 bytes of an ESL safety reply, against the same work with the CRCs taken bit by bit.
#include <array>
#include <cstdio>

#include "absenc/protocol/esl/reply.hpp"
#include "bench/ratio.hpp"

namespace {

using namespace absenc;
using namespace absenc::esl;

static_assert(sizeof(absenc::esl::detail::nibble_effects) == 512);

// Different replies in turn, so that nothing is a constant.
std::array<ReplyBytes, 64> replies() {
  std::array<ReplyBytes, 64> made;
  for (std::uint32_t i = 0; i < made.size(); ++i) {
    Reply reply{.one = {.status = status::ready}, .two = {.status = status::ready | status::channel_2}};
    reply.singleturn = i * 200'003 & 0xFFFFFF;
    reply.multiturn = static_cast<std::uint16_t>(i * 977);
    reply.redundant = static_cast<std::uint16_t>(reply.singleturn >> 15);
    reply.one.sequence = reply.two.sequence = static_cast<std::uint8_t>(i);
    made[i] = encode_reply({}, reply);
  }
  return made;
}

struct BitwiseChecksum {
  std::uint16_t operator()(CrcBitOrder, Channel channel, Bytes bytes) const {
    CrcParameters parameters = crc16_lsb;
    parameters.init = initial_value(channel);
    std::array<std::uint8_t, reply_capacity> padded{};
    for (std::size_t i = 0; i < bytes.size(); ++i) padded[i] = bytes[i];
    return crc_bitwise(parameters, Bytes(padded).first((bytes.size() + 1) / 2 * 2));
  }
};

template <class Checksum16>
void decode_and_verify(benchmark::State& state) {
  const auto frames = replies();
  const Profile profile;
  std::size_t i = 0;
  for (auto _ : state) {
    Reply reply;
    const Check check = check_reply<Checksum16>(profile, {DataId::position}, frames[i++ % frames.size()], reply);
    if (check != Check::passed) return state.SkipWithError("a good reply was refused");
    benchmark::DoNotOptimize(reply);
  }
}

void esl_position(benchmark::State& state) { decode_and_verify<absenc::esl::detail::TableChecksum>(state); }
void esl_position_reference(benchmark::State& state) { decode_and_verify<BitwiseChecksum>(state); }
BENCHMARK(esl_position);
BENCHMARK(esl_position_reference);

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
