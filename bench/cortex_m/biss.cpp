// SPDX-License-Identifier: Apache-2.0
// A program without a standard library that decodes the first FRAMES of 64 BiSS frames, for count.sh. DECODER: 0, a
// format known at compile time; 1, one known at run time; 2, the peer of bench/sampled_peer.hpp; 3, moteus' own
// function. The exit status is 0 if all positions are right.
#include "absenc/protocol/biss/frame.hpp"
#include "bench/sampled_peer.hpp"
#if DECODER == 3
#include <bissc_extract.h>
#endif

namespace {

using namespace absenc;

constexpr biss::Format known{.word = "position:32 error:1! warning:1!"_word};
constexpr unsigned pin = 5;
constexpr std::size_t samples = 96;

struct Samples {
  std::array<std::uint8_t, samples / 8> packed;
  alignas(4) std::array<std::uint8_t, samples> sampled;
  std::uint32_t position;
};

constexpr auto frames = [] {
  std::array<Samples, 64> made{};
  for (std::uint32_t i = 0; i < made.size(); ++i) {
    made[i].position = i * 0x9E37'79B1;
    BitBuffer<samples> bits;
    biss::encode(known, {.ack_bits = 1 + i % 20, .word = {.position = made[i].position}}, bits);
    while (bits.size() < samples) bits.append(0, 1);
    for (std::size_t byte = 0; byte < samples / 8; ++byte) made[i].packed[byte] = bits.bytes()[byte];
    for (std::size_t bit = 0; bit < samples; ++bit) made[i].sampled[bit] = bits.view()[bit] ? 1u << pin : 0;
  }
  return made;
}();

[[gnu::noinline]] std::uint32_t position(const Samples& frame) {
  if constexpr (DECODER == 0) {
    const auto reply = biss::decode<known>({frame.packed, samples});
    return reply ? static_cast<std::uint32_t>(reply->word.position) : 0;
  } else if constexpr (DECODER == 1) {
    static biss::Format format = known;
    asm volatile("" : : "r"(&format) : "memory");
    const auto reply = biss::decode(format, {frame.packed, samples});
    return reply ? static_cast<std::uint32_t>(reply->word.position) : 0;
#if DECODER == 3
  } else if constexpr (DECODER == 3) {
    static moteus::BisscExtractConfig config{pin, 32, 6, false};
    asm volatile("" : : "r"(&config) : "memory");
    const auto result = moteus::ExtractBisscFrame(frame.sampled.data(), samples, config);
    return result.error == moteus::BisscExtractError::kNone ? static_cast<std::uint32_t>(result.data_value) : 0;
#endif
  } else {
    static bench::SampledPeer peer{pin, 32};
    asm volatile("" : : "r"(&peer) : "memory");
    const auto result = bench::take(peer, frame.sampled);
    return result.error == bench::SampledPosition::Error::none ? static_cast<std::uint32_t>(result.position) : 0;
  }
}

}  // namespace

extern "C" [[noreturn]] void _start() {
  std::uint32_t wrong = 0;
  for (std::size_t i = 0; i < FRAMES; ++i) wrong |= position(frames[i]) ^ frames[i].position;
  register std::uint32_t status asm("r0") = wrong != 0 ? 1 : 0;
  register std::uint32_t end asm("r7") = 1;  // number of the system call `exit` of ARM Linux, which qemu-arm emulates
  asm volatile("svc 0" : : "r"(status), "r"(end));
  __builtin_unreachable();
}
