// SPDX-License-Identifier: Apache-2.0
// Reads T-format like tformat.cpp, but the class host::Carrier runs the conversation.
#include <array>

#include "absenc/host/carrier.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "firmware/readers/reader.hpp"

namespace absenc::firmware {
namespace {

constexpr auto reply = std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});

#ifdef ABSENC_UNIT

// The line of the carrier. It only stores which step or result the carrier gave last.
struct Line {
  void begin(const ByteStep& step) { last = step.kind; }
  void result(bool over) { last = over ? ByteStep::Kind::done : ByteStep::Kind::emit; }
  ByteStep::Kind last = ByteStep::Kind::wait;
};
using Carrier = host::Carrier<std::uint8_t, Line>;

// A carrier and its conversation with the interface of a reader: `feed` acts as an interrupt, and the first call of
// `next` starts the conversation.
class CarriedReader {
 public:
  void feed(const ByteEvent& event) {
    line_.last = ByteStep::Kind::wait;
    if (event.kind == ByteEvent::Kind::sent) return carrier_.sent(event.at);
    if (event.kind == ByteEvent::Kind::received) return carrier_.received(event.items, event.at);
    carrier_.tick(event.at);
  }
  ByteStep next(Time now) {
    if (!started_) carrier_.start(conversation_, now);
    started_ = true;
    return {.kind = line_.last, .at = carrier_.due()};
  }
  [[nodiscard]] const Reading* reading() const { return conversation_.reading(); }

 private:
  Line line_;
  Carrier carrier_{line_};
  tformat::ReadPosition conversation_{tformat::Format{}};
  bool started_ = false;
};

#else

struct Line {
  void begin(const ByteStep&) {}
  void result(bool) {}
};
using Carrier = host::Carrier<std::uint8_t, Line>;

// Represents an interrupt handler, which gets the received character in a register.
[[gnu::noinline]] void interrupt(Carrier& carrier, std::uint8_t character, Time now) {
  carrier.received({&character, 1}, now);
}

[[noreturn]] void measure() {
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

#endif

}  // namespace
}  // namespace absenc::firmware

int main() {
#ifdef ABSENC_UNIT
  absenc::firmware::run<std::uint8_t, absenc::firmware::CarriedReader>(absenc::firmware::reply, true);
#else
  absenc::firmware::measure();
#endif
}
