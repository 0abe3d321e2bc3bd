// SPDX-License-Identifier: Apache-2.0
// Measures the decoding of an ESL safety reply, compared with the calculation of only its two CRCs bit by bit.
#include <array>

#include "absenc/protocol/esl/reply.hpp"
#include "bench/ratio.hpp"

namespace {

using namespace absenc;
using namespace absenc::esl;

// Returns many different replies, so that the compiler cannot treat a reply as a constant.
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

void esl_position(benchmark::State& state) {
  const auto frames = replies();
  const Profile profile;
  std::size_t i = 0;
  for (auto _ : state) {
    const Result<Reply> reply = decode_reply(profile, {DataId::position}, frames[i++ % frames.size()]);
    if (!reply) return state.SkipWithError("a good reply was refused");
    benchmark::DoNotOptimize(*reply);
  }
}

bool crc_matches(Bytes reply, std::size_t begin, std::size_t end, Channel channel) {
  CrcParameters parameters = crc16_lsb;
  parameters.init = initial_value(channel);
  std::array<std::uint8_t, reply_capacity> padded{};
  for (std::size_t i = begin; i < end; ++i) padded[i - begin] = reply[i];
  return crc_bitwise(parameters, Bytes(padded).first((end - begin + 1) / 2 * 2)) == (reply[end] | reply[end + 1] << 8);
}

void esl_position_reference(benchmark::State& state) {
  const auto frames = replies();
  std::size_t i = 0;
  for (auto _ : state) {
    const Bytes reply = frames[i++ % frames.size()];
    const bool both = crc_matches(reply, 0, 9, Channel::one) && crc_matches(reply, 11, 16, Channel::two);
    if (!both) return state.SkipWithError("a good reply was refused");
    benchmark::DoNotOptimize(both);
  }
}

BENCHMARK(esl_position);
BENCHMARK(esl_position_reference);

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
