// SPDX-License-Identifier: Apache-2.0
// Any samples of any length: what is accepted is the frame that its fields make.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/biss/host.hpp"

namespace {

using namespace absenc;
using namespace absenc::biss;

void require(bool condition) {
  if (!condition) std::abort();
}

constexpr unsigned widths[]{1, 12, 19, 26, 32, 48, 64};

void decode_and_encode(const Format& format, BitView samples) {
  const Result<Reply> reply = decode(format, samples);
  if (!reply) return;
  BitBuffer<4096> again;
  if (!encode(format, *reply, again)) return;
  const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
  for (std::size_t i = idle_bits; i < again.size(); ++i) require(again.view()[i] == samples[i - idle_bits + idle]);
}

// Whatever comes back, the conversation ends, and with a result only after a good frame.
void converse(const Format& format, Bytes input) {
  ReadPosition read(format, {});
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
  if (size < 2 || size > 256) return 0;
  const bool safety = (data[0] & 8) != 0;
  const Format format{.word = word_with_status({.position = widths[data[0] % 7]}),
                      .check = safety ? Check::crc16 : Check::crc6};
  const Bytes bits = Bytes(data, size).subspan(1);
  decode_and_encode(format, {bits, bits.size() * 8 - data[0] / 16 % 8});
  converse(format, bits);
  // The same bytes as a text of 0 and 1, as the vectors are written.
  std::array<std::uint8_t, 32> packed{};
  for (std::size_t i = 0; i < size; ++i) packed[i / 8] |= static_cast<std::uint8_t>((data[i] & 1) << (7 - i % 8));
  for (const unsigned width : widths) {
    decode_and_encode({.word = word_with_status({.position = width})}, {packed, size});
  }
  return 0;
}
