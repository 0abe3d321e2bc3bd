// SPDX-License-Identifier: Apache-2.0
// Reads T-format like tformat.cpp, but through the carrier.
#include <array>

#include "absenc/host/carrier.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "firmware/readers/reader.hpp"

namespace absenc::firmware {
namespace {

struct Line {
  void begin(const ByteStep&) {}
  void result(bool) {}
};
using Carrier = host::Carrier<std::uint8_t, Line>;

constexpr auto reply = std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});

// Stands in for an interrupt handler, which gets the received character in a register.
[[gnu::noinline]] void interrupt(Carrier& carrier, std::uint8_t character, Time now) {
  carrier.received({&character, 1}, now);
}

}  // namespace
}  // namespace absenc::firmware

int main() {
  using namespace absenc;
  using namespace absenc::firmware;
  static Line line;
  static Carrier carrier(line);
  static tformat::ReadPosition whole{tformat::Format{}}, by_character{tformat::Format{}};
  machine::paint_stack();
  Time now{1'000'000};
  count_begin();
  carrier.start(whole, now);
  carrier.sent(now);
  count_begin();
  carrier.received(reply, now);
  count_end();
  count_end();
  machine::print(machine::stack_used());
  carrier.start(by_character, now);
  carrier.sent(now);
  for (std::size_t i = 0; i < reply.size(); ++i) {
    now += Time{4400};
    if (i == 1) count_begin();
    interrupt(carrier, reply[i], now);
    if (i == 1) count_end();
  }
  machine::end(whole.reading() != nullptr && by_character.reading() != nullptr);
}
