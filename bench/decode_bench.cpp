// SPDX-License-Identifier: Apache-2.0
// Decoding and verifying frames against the same work with the CRC taken bit by bit.
#include <array>

#include "absenc/protocol/tformat/frame.hpp"
#include "bench/ratio.hpp"

namespace {

using namespace absenc;
using namespace absenc::tformat;

// Different replies in turn, so that nothing is a constant.
std::array<ReplyBytes, 64> replies() {
  std::array<ReplyBytes, 64> made;
  for (std::uint32_t i = 0; i < made.size(); ++i) {
    made[i] = encode_reply({.singleturn = i * 2011 & 0x1FFFF, .multiturn = i * 977 & 0xFFFF, .encoder_id = 0x11});
  }
  return made;
}

void tformat_everything(benchmark::State& state) {
  const auto frames = replies();
  const Format format;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(decode_reply(format, {DataId::everything}, frames[i++ % frames.size()]));
  }
}
BENCHMARK(tformat_everything);

void tformat_everything_reference(benchmark::State& state) {
  const auto frames = replies();
  const Format format;
  std::size_t i = 0;
  for (auto _ : state) {
    const Bytes bytes = frames[i++ % frames.size()];
    Result<Reply> result = Error::bad_checksum;
    if (crc_bitwise(crc_parameters, bytes.first(bytes.size() - 1)) == bytes.back()) {
      const Reply reply = tformat::detail::split_reply(DataId::everything, bytes);
      const Error error = tformat::detail::check_data_reply(format, reply);
      result = error == Error::none ? Result<Reply>(reply) : Result<Reply>(error);
    }
    benchmark::DoNotOptimize(result);
  }
}
BENCHMARK(tformat_everything_reference);

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
