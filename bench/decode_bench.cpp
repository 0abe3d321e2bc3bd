// SPDX-License-Identifier: Apache-2.0
// Measures decoding of T-format and BiSS frames. If bissc_extract.h of mjbots/moteus is found, it is the reference for
// BiSS.
#include <algorithm>
#include <array>
#include <span>

#if __has_include(<bissc_extract.h>)
#include <bissc_extract.h>
#endif

#include "absenc/protocol/biss/compiled_format.hpp"
#include "absenc/protocol/tformat/frame.hpp"
#include "bench/ratio.hpp"
#include "bench/sampled_peer.hpp"

namespace {

using namespace absenc;
using namespace absenc::tformat;

// Returns many different replies, so that the compiler cannot treat a reply as a constant.
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

// ---- BiSS: three ways to decode formats of 19, 32 and 57 bits, with one reference for all.

template <unsigned bits>
constexpr biss::Format format_of{.word = biss::word_with_status({.position = bits})};

// Samples of the BiSS data line SLO: as packed bits like those of an SPI controller, and as one byte for each sample
// like those of a GPIO port.
constexpr std::size_t samples_size = 96;
struct Samples {
  std::array<std::uint8_t, samples_size / 8> packed;
  alignas(4) std::array<std::uint8_t, samples_size> sampled;
  std::uint64_t position;
};

constexpr unsigned pin = 5;

// Returns BiSS frames with different durations of ACK and different positions.
template <unsigned bits>
std::array<Samples, 64> biss_samples() {
  std::array<Samples, 64> made{};
  for (std::uint64_t i = 0; i < made.size(); ++i) {
    made[i].position = i * 0x9E37'79B9'7F4A'7C15 >> (64 - bits);
    BitBuffer<samples_size> samples;
    biss::encode(format_of<bits>,
                 {.ack_bits = static_cast<unsigned>(1 + i % 20), .word = {.position = made[i].position}}, samples);
    while (samples.size() < samples_size) samples.append(0, 1);
    std::copy_n(samples.bytes().begin(), made[i].packed.size(), made[i].packed.begin());
    for (std::size_t bit = 0; bit < samples_size; ++bit) made[i].sampled[bit] = samples.view()[bit] ? 1u << pin : 0;
  }
  return made;
}

// Decodes frames and checks each decoded position; a wrong position ends the benchmark.
template <unsigned bits, class Decode>
void run_biss(benchmark::State& state, Decode&& decode) {
  const auto frames = biss_samples<bits>();
  std::size_t i = 0;
  for (auto _ : state) {
    const Samples& frame = frames[i++ % frames.size()];
    if (decode(frame) != frame.position) {
      state.SkipWithError("a wrong position");
      break;
    }
  }
}

template <unsigned bits>
void biss_known(benchmark::State& state) {
  run_biss<bits>(state, [](const Samples& samples) {
    const auto reply = biss::decode<format_of<bits>>({samples.packed, samples_size});
    benchmark::DoNotOptimize(reply);
    return reply ? reply->word.position : ~std::uint64_t{0};
  });
}

template <unsigned bits>
void biss_compiled(benchmark::State& state) {
  biss::CompiledFormat compiled(format_of<bits>);
  bench::hide(compiled);
  run_biss<bits>(state, [&compiled](const Samples& samples) {
    const Result<biss::Reply> reply = biss::decode(compiled, {samples.packed, samples_size});
    benchmark::DoNotOptimize(reply);
    return reply ? reply->word.position : ~std::uint64_t{0};
  });
}

// Measures the decoder that does not compile its format: it looks up the fields of the format for each frame.
template <unsigned bits>
void biss_any(benchmark::State& state) {
  biss::Format any = format_of<bits>;
  bench::hide(any);
  run_biss<bits>(state, [&any](const Samples& samples) {
    const Result<biss::Reply> reply = biss::decode(any, {samples.packed, samples_size});
    benchmark::DoNotOptimize(reply);
    return reply ? reply->word.position : ~std::uint64_t{0};
  });
}

// The decoder from moteus is called and not inlined, so that it cannot be specialised for one number of bits.
#if __has_include(<bissc_extract.h>)
using Peer = moteus::BisscExtractConfig;
constexpr Peer peer_of(unsigned bits) { return {pin, static_cast<std::uint8_t>(bits), 6, false}; }
[[gnu::noinline]] moteus::BisscExtractResult decode_by_peer(const Peer& peer, std::span<const std::uint8_t> samples) {
  return moteus::ExtractBisscFrame(samples.data(), static_cast<std::uint32_t>(samples.size()), peer);
}
std::uint64_t position_of(const moteus::BisscExtractResult& result) {
  return result.error == moteus::BisscExtractError::kNone ? result.data_value : ~std::uint64_t{0};
}
#else
using Peer = bench::SampledPeer;
constexpr Peer peer_of(unsigned bits) { return {pin, bits}; }
[[gnu::noinline]] bench::SampledPosition decode_by_peer(const Peer& peer, std::span<const std::uint8_t> samples) {
  return bench::take(peer, samples);
}
std::uint64_t position_of(const bench::SampledPosition& result) {
  return result.error == bench::SampledPosition::Error::none ? result.position : ~std::uint64_t{0};
}
#endif

template <unsigned bits>
void biss_peer(benchmark::State& state) {
  Peer peer = peer_of(bits);
  bench::hide(peer);
  run_biss<bits>(state, [&peer](const Samples& samples) {
    const auto result = decode_by_peer(peer, samples.sampled);
    benchmark::DoNotOptimize(result);
    return position_of(result);
  });
}

#define BISS_BENCHMARKS(bits)                                            \
  BENCHMARK(biss_known<bits>)->Name("biss_known_" #bits);                \
  BENCHMARK(biss_compiled<bits>)->Name("biss_compiled_" #bits);          \
  BENCHMARK(biss_any<bits>)->Name("biss_any_" #bits);                    \
  BENCHMARK(biss_peer<bits>)->Name("biss_known_" #bits "_reference");    \
  BENCHMARK(biss_peer<bits>)->Name("biss_compiled_" #bits "_reference"); \
  BENCHMARK(biss_peer<bits>)->Name("biss_any_" #bits "_reference")
BISS_BENCHMARKS(19);
BISS_BENCHMARKS(32);
BISS_BENCHMARKS(57);

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
