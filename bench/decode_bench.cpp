// SPDX-License-Identifier: Apache-2.0
// Decoding and verifying frames against the same work with the CRC taken bit by bit.
#include <array>
#include <bit>

#include "absenc/protocol/biss/frame.hpp"
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

constexpr Format format{.encoder_id = 0x11};

void tformat_everything(benchmark::State& state) {
  const auto frames = replies();
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(decode_reply(format, {DataId::everything}, frames[i++ % frames.size()]));
  }
}
BENCHMARK(tformat_everything);

void tformat_everything_reference(benchmark::State& state) {
  const auto frames = replies();
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

// 64 samples of SLO with a frame of 32 bits, as a register or an E201-9S gives them; different ACKs and positions.
constexpr unsigned biss_data_bits = 32 + 2 + 6;

std::array<std::uint64_t, 64> biss_samples() {
  std::array<std::uint64_t, 64> made{};
  for (std::uint64_t i = 0; i < made.size(); ++i) {
    BitBuffer<128> samples;
    biss::encode({.word = "position:32 error:1! warning:1!"_word},
                 {.ack_bits = static_cast<unsigned>(1 + i % 20), .word = {.position = i * 0x9E3779B1}}, samples);
    while (samples.size() < 64) samples.append(0, 1);
    made[i] = samples.view().load(0, 64);
  }
  return made;
}

struct BissPosition {
  std::uint32_t position;
  bool error;
  bool warning;
};

BissPosition biss_position(std::uint64_t samples, std::size_t first) {
  const std::uint64_t data = samples << first;
  return {static_cast<std::uint32_t>(data >> 32), (data >> 31 & 1) == 0, (data >> 30 & 1) == 0};
}

void biss_32_bits(benchmark::State& state) {
  const auto frames = biss_samples();
  std::size_t i = 0;
  for (auto _ : state) {
    const std::uint64_t samples = frames[i++ % frames.size()];
    const Result<biss::Framing> framing = biss::find_frame(biss_data_bits, samples);
    Result<BissPosition> result = framing.error();
    if (framing) result = biss_position(samples, framing->first);
    benchmark::DoNotOptimize(result);
  }
}
BENCHMARK(biss_32_bits);

// The same with the CRC taken bit by bit, the frame found in the same fast way.
void biss_32_bits_reference(benchmark::State& state) {
  const auto frames = biss_samples();
  std::size_t i = 0;
  for (auto _ : state) {
    const std::uint64_t samples = frames[i++ % frames.size()];
    const auto idle = static_cast<unsigned>(std::countl_one(samples));
    const unsigned first = idle + static_cast<unsigned>(std::countl_zero(samples << idle)) + 2;
    Result<BissPosition> result = Error::truncated;
    if (first + biss_data_bits <= 64) {
      std::uint32_t remainder = 0;
      for (unsigned bit = first; bit < first + 34; ++bit) {
        const bool feedback = ((remainder >> 5 & 1) != 0) != ((samples >> (63 - bit) & 1) != 0);
        remainder = (remainder << 1 & 0x3F) ^ (feedback ? 0x03u : 0);
      }
      const bool good = (remainder ^ 0x3F) == (samples >> (64 - first - biss_data_bits) & 0x3F);
      result = good ? Result<BissPosition>(biss_position(samples, first)) : Result<BissPosition>(Error::bad_checksum);
    }
    benchmark::DoNotOptimize(result);
  }
}
BENCHMARK(biss_32_bits_reference);

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
