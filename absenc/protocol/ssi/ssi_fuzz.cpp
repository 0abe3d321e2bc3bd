// SPDX-License-Identifier: Apache-2.0
// Any bits of any length: what is accepted is the word that its fields make, with what follows it.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/ssi/host.hpp"

namespace {

using namespace absenc;
using namespace absenc::ssi;

void require(bool condition) {
  if (!condition) std::abort();
}

Format format_of(std::uint8_t a, std::uint8_t b) {
  Format format{.word = word_with({.position = 1u + a % 32, .multiturn = b % 16u, .multiturn_first = (b & 16) != 0},
                                  (b & 32) != 0, static_cast<ErrorBit>(a / 32 % 3), static_cast<Parity>(b / 64 % 3)),
                .after_word = static_cast<AfterWord>(a / 96 % 3)};
  format.extra_clocks = (a & 1) != 0 ? format.word.bits() : (a & 2);
  return format;
}

void decode_and_encode(const Format& format, BitView bits) {
  const Result<Word> word = decode(format, bits);
  if (!word) return;
  require(bits.size >= format.word.bits() && bits.size <= 2 * WordFormat::maximum_bits);
  BitBuffer<frame_capacity> again;
  require(encode(format, *word, bits.size, again));
  for (std::size_t i = 0; i < bits.size; ++i) require(again.view()[i] == bits[i]);
}

// Whatever comes back, the conversation ends, and with a result only after a good word.
void converse(const Format& format, Bytes input) {
  ReadPosition read(format);
  Time now{};
  for (unsigned steps = 0; steps < 16; ++steps) {
    const auto step = read.next(now);
    if (step.kind == Step<std::uint8_t>::Kind::done) {
      require((read.error() == Error::none) == (read.reading() != nullptr));
      return;
    }
    now += std::chrono::milliseconds(1);
    if (step.kind != Step<std::uint8_t>::Kind::wait) continue;
    read.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    read.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = input});
  }
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3 || size > 256) return 0;
  const Format format = format_of(data[0], data[1]);
  const Bytes input = Bytes(data, size).subspan(2);
  for (std::size_t bits = 0; bits <= input.size() * 8 && bits <= 300; ++bits) decode_and_encode(format, {input, bits});
  converse(format, input);
  // The same bytes as a text of 0 and 1, as the vectors are written.
  std::array<std::uint8_t, 32> packed{};
  for (std::size_t i = 0; i < size; ++i) packed[i / 8] |= static_cast<std::uint8_t>((data[i] & 1) << (7 - i % 8));
  decode_and_encode({}, {packed, size});
  return 0;
}
