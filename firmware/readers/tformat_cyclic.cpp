// SPDX-License-Identifier: Apache-2.0
// Reads T-format as a drive does (docs/drive.md): host::CyclicHost begins a reading in each cycle, and host::Carrier
// runs it from interrupts.
#include <array>
#include <new>

#include "absenc/host/carrier.hpp"
#include "absenc/host/cyclic_host.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "firmware/readers/reader.hpp"

namespace absenc::firmware {
namespace {

using namespace std::chrono_literals;

constexpr auto reply = std::to_array<std::uint8_t>({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});
constexpr Time begin{1'000'000};
constexpr Time period = 100us;

struct Read {
  Conversation<std::uint8_t>& operator()() { return *new (memory) tformat::ReadPosition(tformat::Format{}); }
  alignas(tformat::ReadPosition) std::byte memory[sizeof(tformat::ReadPosition)];
};
using CyclicHost = host::CyclicHost<std::uint8_t, Read&>;

/// The drive's side of the line. It only stores which step or result the carrier gave last.
struct Line {
  void begin(const ByteStep& step) { last = step.kind; }
  void result(bool over) { last = over ? ByteStep::Kind::done : ByteStep::Kind::emit; }
  ByteStep::Kind last = ByteStep::Kind::wait;
};

/// A cyclic host and its carrier with the interface of a reader: `feed` acts as an interrupt, and the first call of
/// `next` begins the first cycle.
class CyclicReader {
 public:
  void feed(const ByteEvent& event) {
    line_.last = ByteStep::Kind::wait;
    if (event.kind == ByteEvent::Kind::sent) return carrier_.sent(event.at);
    if (event.kind == ByteEvent::Kind::received) return carrier_.received(event.items, event.at);
    carrier_.tick(event.at);
  }
  ByteStep next(Time now) {
    if (!started_) carrier_.start(host_, now);
    started_ = true;
    return {.kind = line_.last, .at = carrier_.due()};
  }
  [[nodiscard]] const Reading* reading() const {
    return host_.cycle().kind == host::Cycle::Kind::fresh ? &host_.cycle().reading : nullptr;
  }

 private:
  Line line_;
  Read read_;
  CyclicHost host_{read_, {.period = period, .line = tformat::line_settings, .answer = 12us}, begin};
  host::Carrier<std::uint8_t, Line> carrier_{line_};
  bool started_ = false;
};

#ifndef ABSENC_UNIT

// Represents an interrupt handler, which gets the received character in a register.
[[gnu::noinline]] void interrupt(CyclicReader& reader, std::uint8_t character, Time now) {
  reader.feed({.kind = ByteEvent::Kind::received, .at = now, .items = {&character, 1}});
}

[[noreturn]] void measure() {
  alignas(CyclicReader) static std::byte memory[sizeof(CyclicReader)];
  CyclicReader& reader = *new (memory) CyclicReader;
  machine::paint_stack();
  count_begin();
  static_cast<void>(reader.next(begin));
  reader.feed({.kind = ByteEvent::Kind::sent, .at = begin});
  count_begin();
  reader.feed({.kind = ByteEvent::Kind::received, .at = begin, .items = reply});
  count_end();
  count_end();
  machine::print(machine::stack_used());
  const bool is_fresh = reader.reading() != nullptr;
  Time now = begin + period;
  reader.feed({.kind = ByteEvent::Kind::timer, .at = now});
  reader.feed({.kind = ByteEvent::Kind::sent, .at = now});
  for (std::size_t i = 0; i < reply.size(); ++i) {
    now += Time{4400};
    if (i == 1) count_begin();
    interrupt(reader, reply[i], now);
    if (i == 1) count_end();
  }
  machine::end(is_fresh && reader.reading() != nullptr);
}

#endif

}  // namespace
}  // namespace absenc::firmware

int main() {
#ifdef ABSENC_UNIT
  absenc::firmware::run<std::uint8_t, absenc::firmware::CyclicReader>(absenc::firmware::reply, true);
#else
  absenc::firmware::measure();
#endif
}
