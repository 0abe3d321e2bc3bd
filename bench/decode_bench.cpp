// SPDX-License-Identifier: Apache-2.0
// Measures decoding and checking of frames: T-format compared with the same work and a bitwise CRC, BiSS compared with
// the method of a motor controller.
#include <algorithm>
#include <array>

#include "absenc/protocol/biss/frame.hpp"
#include "absenc/protocol/tformat/frame.hpp"
#include "bench/ratio.hpp"
#include "bench/sampled_peer.hpp"

namespace {

using namespace absenc;
using namespace absenc::tformat;

// Returns different replies, so that the compiler cannot treat one as a constant.
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

// Inputs of the BiSS benchmarks: 64 samples of SLO with a frame of 32 bits. They are packed bits, as from an SPI
// controller or an E201-9S, or one byte per sample, as from a port that a timer samples. Times of ACK and positions
// differ.
constexpr biss::Format known{.word = "position:32 error:1! warning:1!"_word};

struct Samples {
  std::array<std::uint8_t, 8> packed;
  alignas(4) std::array<std::uint8_t, 64> sampled;
};

constexpr unsigned pin = 5;

std::array<Samples, 64> biss_samples() {
  std::array<Samples, 64> made{};
  for (std::uint64_t i = 0; i < made.size(); ++i) {
    BitBuffer<64> samples;
    biss::encode(known, {.ack_bits = static_cast<unsigned>(1 + i % 20), .word = {.position = i * 0x9E3779B1}}, samples);
    while (samples.size() < 64) samples.append(0, 1);
    std::copy_n(samples.bytes().begin(), 8, made[i].packed.begin());
    for (std::size_t bit = 0; bit < 64; ++bit) made[i].sampled[bit] = samples.view()[bit] ? 1u << pin : 0;
  }
  return made;
}

// Decodes frames and checks each decoded position; a wrong position ends the benchmark.
template <class Decode>
void run_biss(benchmark::State& state, Decode&& decode) {
  const auto frames = biss_samples();
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t frame = i++ % frames.size();
    if (decode(frames[frame]) != (frame * 0x9E37'79B1 & 0xFFFF'FFFF)) {
      state.SkipWithError("a wrong position");
      break;
    }
  }
}

void biss_known_format(benchmark::State& state) {
  run_biss(state, [](const Samples& samples) {
    const auto reply = biss::decode<known>({samples.packed, 64});
    benchmark::DoNotOptimize(reply);
    return reply ? reply->word.position : 0;
  });
}
BENCHMARK(biss_known_format);

void biss_any_format(benchmark::State& state) {
  biss::Format any = known;
  benchmark::DoNotOptimize(any);
  run_biss(state, [&any](const Samples& samples) {
    const Result<biss::Reply> reply = biss::decode(any, {samples.packed, 64});
    benchmark::DoNotOptimize(reply);
    return reply ? reply->word.position : 0;
  });
}
BENCHMARK(biss_any_format);

// The motor controller's decoder, the reference of both BiSS benchmarks.
void biss_peer(benchmark::State& state) {
  bench::SampledPeer peer{pin, 32};
  benchmark::DoNotOptimize(peer);
  run_biss(state, [&peer](const Samples& samples) {
    const bench::SampledPosition result = bench::take(peer, samples.sampled);
    benchmark::DoNotOptimize(result);
    return result.error == bench::SampledPosition::Error::none ? result.position : 0;
  });
}
BENCHMARK(biss_peer)->Name("biss_known_format_reference");
BENCHMARK(biss_peer)->Name("biss_any_format_reference");

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
