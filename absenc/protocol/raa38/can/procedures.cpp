// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/can/procedures.hpp"

#include <algorithm>

#include "absenc/core/bits.hpp"
#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/raa38/can/explain.hpp"

namespace absenc::raa38::can {

namespace {

using namespace author;
using Frame = std::optional<CanFrame>;

// To know how often a node sends, to 1 % where a carrier hands frames out some milliseconds late.
constexpr unsigned enough_frames = 4;
constexpr Time enough_time = 500ms;
constexpr Time slowest_period = 1s;  // of a node that sends by itself: TT = 1
// A window of its own, always to its end: a cyclic position may look like the answer.
constexpr Time command_window = answer_limit;

/// How often a node sends by itself.
struct Cadence {
  unsigned count = 0;
  Time first{};
  Time last{};

  void add(Time at) {
    if (count++ == 0) first = at;
    last = at;
  }
  /// Mean, 0 with fewer than two frames.
  [[nodiscard]] Time period() const { return count < 2 ? Time{} : (last - first) / (count - 1); }
  /// Rounded; 1 for a single frame.
  [[nodiscard]] unsigned per_second() const {
    if (count == 0) return 0;
    const Time mean = period();
    if (mean <= Time{}) return 1;
    return std::clamp(static_cast<unsigned>((Time(1s) + mean / 2) / mean), 1u, 255u);
  }
  /// Two of the periods that it had, and a little: long enough to hear that it is silent.
  [[nodiscard]] Time pause() const { return count < 2 ? listening_time : 2 * period() + answer_limit; }
};

// ---- What is heard until the time is over

// What the node sends; until `enough`, where that is wanted.
Part<Cadence> hear_node(Bus& bus, bool until_enough = false) {
  Cadence cadence;
  for (;;) {
    const Frame frame = co_await bus.heard();
    if (!frame) break;
    if (!is_from(*frame, bus.format().node)) continue;
    cadence.add(bus.heard_at());
    if (until_enough && cadence.count >= enough_frames && cadence.last - cadence.first >= enough_time) break;
  }
  co_return cadence;
}

// Whether the answer to a command comes.
Part<bool> command_node(Bus& bus, std::uint8_t code, std::uint8_t value) {
  bool answered = false;
  bus.ask_for(encode_command(bus.format().node, code, value), command_window);
  for (;;) {
    const Frame frame = co_await bus.heard();
    if (!frame) break;
    if (!(*frame == encode_answer(bus.format().node, code))) continue;
    answered = true;
    bus.keep();
  }
  co_return answered;
}

// The position, or why there is none.
struct Look {
  Outcome outcome{};
  std::uint32_t counts = 0;
};

Part<Look> look(Bus& bus, Time pause = {}) {
  const CanFrame request = encode_command(bus.format().node, command::read);
  bus.ask(request, pause);
  Result<std::uint32_t> counts = Error::timeout;
  Frame frame;
  do {
    frame = co_await bus.heard();
  } while (frame && !is_from(*frame, bus.format().node));
  if (frame) bus.keep();
  counts = frame ? decode_position(bus.format(), *frame) : Result<std::uint32_t>(bus.missing());
  // Other frames follow before the end is told.
  const Explanation words = explain_frame(counts.error(), &request, frame ? &*frame : nullptr);
  co_return Look{counts ? done : only(counts.error(), words.found, words.advice), *counts};
}

// ---- Commands whose answer looks like a position: no position counts until the time for the answer is over. The node
// is made to be silent first, and sends again afterwards as it did before.

Part<Cadence> hush(Bus& bus) {
  bus.listen(listening_time);
  const Cadence before = co_await hear_node(bus, true);
  if (before.count != 0) {
    static_cast<void>(co_await command_node(bus, command::cyclic, 0));
    bus.listen(before.pause());
    // A node that cannot be stopped is dealt with all the same.
    static_cast<void>(co_await hear_node(bus));
  }
  co_return before;
}

Part<Outcome> let_send_again(Bus& bus, Cadence before, Outcome outcome) {
  if (before.count == 0) co_return outcome;
  static_cast<void>(co_await command_node(bus, command::cyclic, static_cast<std::uint8_t>(before.per_second())));
  bus.listen(before.pause());
  const Cadence now = co_await hear_node(bus);
  if (now.count == 0 && outcome.error == Error::none) {
    co_return only(Error::cross_check_failed, "it was done, but the node no longer sends by itself as it did before",
                   "let it: `run <encoder> cyclic 10`");
  }
  co_return outcome;
}

// A shaft that stands still.
Part<Look> look_twice(Bus& bus) {
  const Look first = co_await look(bus);
  if (first.outcome.error != Error::none) co_return first;
  Look second = co_await look(bus, between_looks);
  if (second.outcome.error == Error::none && !is_near(second.counts, first.counts, bus.format().bits)) {
    second.outcome = only(Error::invalid_argument, "the shaft turns: it must stand still");
  }
  co_return second;
}

Part<Outcome> zero_quietly(Bus& bus, Changed& found) {
  const unsigned bits = bus.format().bits;
  const Look before = co_await look_twice(bus);
  if (before.outcome.error != Error::none) co_return before.outcome;
  found.before = found.after = before.counts;
  if (is_near(before.counts, 0, bits)) co_return done;
  found.written = true;
  found.answered = co_await command_node(bus, command::zero, 0);
  // Twice, in case that a late answer was taken for the position 32.
  for (const Time pause : {Time{}, between_looks}) {
    const Look now = co_await look(bus, pause);
    if (now.outcome.error != Error::none) co_return now.outcome;
    found.after = now.counts;
    if (is_near(now.counts, 0, bits, zero_millidegrees)) continue;
    co_return only(Error::cross_check_failed,
                   found.answered ? "the node answered, but its position is not near 0 afterwards"
                                  : "the node did not answer, and its position is not near 0 afterwards",
                   "the document only lets one guess that command 20 sets the zero: this node may not have it");
  }
  co_return done;
}

Part<Outcome> direct_quietly(Bus& bus, Changed& found) {
  const unsigned bits = bus.format().bits;
  const Look before = co_await look_twice(bus);
  if (before.outcome.error != Error::none) co_return before.outcome;
  found.before = before.counts;
  found.answered = co_await command_node(bus, command::direction, found.value);
  const Look first = co_await look(bus);
  if (first.outcome.error != Error::none) co_return first.outcome;
  const Look second = co_await look(bus, between_looks);
  if (second.outcome.error != Error::none) co_return second.outcome;
  found.after = first.counts;
  // It may have trembled before and after.
  const std::uint64_t mirror = (std::uint64_t{0} - before.counts) & low_mask(bits);
  const bool same = is_near(second.counts, before.counts, bits, 2 * standstill_millidegrees);
  found.mirrored = !same && is_near(second.counts, mirror, bits, 2 * standstill_millidegrees);
  if (!is_near(second.counts, first.counts, bits) || (!same && !found.mirrored)) {
    co_return only(Error::cross_check_failed, "the position afterwards is neither the one before nor its mirror image",
                   "turn the shaft and see which way the node counts");
  }
  if (!found.answered && same) {
    co_return only(Error::timeout, "the node did not answer the command, and its position is the same");
  }
  co_return done;
}

}  // namespace

// ---- One node

Procedure set_cyclic(Bus& bus, Cyclic& found, Arguments arguments) {
  found.readings_per_s = arguments.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(arguments[0]);
  const unsigned wanted = found.readings_per_s;
  found.answered = co_await command_node(bus, command::cyclic, found.readings_per_s);
  bus.listen(wanted == 0 ? listening_time : std::max(5 * slowest_period / wanted / 2, enough_time) + answer_limit);
  const Cadence cadence = co_await hear_node(bus);
  if (wanted == 0 && cadence.count == 0) co_return done;
  if (wanted == 0) co_return only(Error::cross_check_failed, "the node goes on sending by itself", "try again");
  if (cadence.count == 0 && !found.answered) co_return {bus.missing()};
  // By the number of frames: a carrier may hand them out in bunches.
  const unsigned rate = cadence.per_second();
  if (cadence.count >= 2 && 4 * rate >= 3 * wanted && 4 * rate <= 5 * wanted + 4) co_return done;
  co_return only(Error::cross_check_failed, "the node sends more or fewer readings a second than it was told");
}

Procedure set_zero(Bus& bus, Changed& found) {
  const Cadence before = co_await hush(bus);
  const Outcome outcome = co_await zero_quietly(bus, found);
  const Outcome end = co_await let_send_again(bus, before, outcome);
  co_return end;
}

Procedure set_direction(Bus& bus, Changed& found, Arguments arguments) {
  found.value = arguments[0] != 0 ? bus.format().negative : bus.format().positive;
  const Cadence before = co_await hush(bus);
  const Outcome outcome = co_await direct_quietly(bus, found);
  const Outcome end = co_await let_send_again(bus, before, outcome);
  co_return end;
}

}  // namespace absenc::raa38::can
