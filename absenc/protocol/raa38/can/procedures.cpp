// SPDX-License-Identifier: Apache-2.0
// Procedures of the RAA38S6 on CAN, for one node and for all nodes on the bus.
#include <algorithm>

#include "absenc/core/bits.hpp"
#include "absenc/protocol/author/look.hpp"
#include "absenc/protocol/raa38/can/host.hpp"

namespace absenc::raa38::can {

namespace {

using namespace author;
using MaybeFrame = std::optional<CanFrame>;

// A measurement of the send rate may end early if it has this number of frames over at least this time.
constexpr unsigned enough_frames = 4;
constexpr Time enough_time = 500ms;
constexpr unsigned most_measurements = 3;  // greatest number of measurements of the send rate after order 31
constexpr Time slowest_period = 1s;        // longest period of a node that sends cyclically: one frame per second
// Time for which the host waits for an answer to order 20, 22 or 31; a cyclic position may equal such an answer.
constexpr Time command_window = answer_limit;

/// Measures the rate at which a node sends frames without a request.
struct SendRate {
  unsigned count = 0;
  Time first{};
  Time last{};

  void add(Time at) {
    if (count++ == 0) first = at;
    last = at;
  }
  /// Returns the mean time between frames; 0 with fewer than two frames.
  [[nodiscard]] Time period() const { return count < 2 ? Time{} : (last - first) / (count - 1); }
  /// Returns the mean number of frames per second, rounded, 1 to 255; 0 if no frame was counted.
  [[nodiscard]] unsigned per_second() const {
    if (count == 0) return 0;
    const Time mean = period();
    if (mean <= Time{}) return 1;
    return std::clamp(static_cast<unsigned>((Time(1s) + mean / 2) / mean), 1u, 255u);
  }
  /// Returns the time without a frame after which the node counts as silent.
  [[nodiscard]] Time pause() const { return count < 2 ? listening_time : 2 * period() + answer_limit; }
};

// ---- Receiving until a time is over

// Measures the node's send rate until the time set by `listen` is over; `until_enough` ends it as soon as
// `enough_frames` and `enough_time` are reached.
Part<SendRate> count_frames(Dialog& dialog, bool until_enough = false) {
  SendRate cadence;
  for (;;) {
    const MaybeFrame frame = co_await dialog.heard();
    if (!frame) break;
    if (!is_from(*frame, dialog.format().node)) continue;
    cadence.add(dialog.heard_at());
    if (until_enough && cadence.count >= enough_frames && cadence.last - cadence.first >= enough_time) break;
  }
  co_return cadence;
}

// Sends an order and returns whether the node answers it.
Part<bool> is_answered(Dialog& dialog, Order order, std::uint8_t value) {
  const std::uint8_t node = dialog.format().node;
  bool answered = false;
  dialog.ask_for(encode(order, node, value), command_window);
  while (const MaybeFrame frame = co_await dialog.heard()) {
    if (!(*frame == encode_answer(node, order))) continue;
    answered = true;
    dialog.keep();
  }
  co_return answered;
}

// Requests the position of a node and returns the reply; no value if none arrives.
Part<MaybeFrame> read(Dialog& dialog, std::uint8_t node, Time pause = {}) {
  dialog.ask(encode(Order::read, node), pause);
  MaybeFrame frame;
  do {
    frame = co_await dialog.heard();
  } while (frame && !is_from(*frame, node));
  if (frame) dialog.keep();
  co_return frame;
}

// A position, or the error that prevented its reading.
struct PositionResult {
  Outcome outcome{};
  std::uint32_t counts = 0;
};

Part<PositionResult> read_position(Dialog& dialog, Time pause = {}) {
  const MaybeFrame frame = co_await read(dialog, dialog.format().node, pause);
  const Result<std::uint32_t> counts = frame ? decode_position(dialog.format(), *frame) : dialog.missing();
  // The explanation of the error is made here, because it quotes the last exchange, which the next request replaces.
  const Exchange<CanFrame> exchange = dialog.exchange();
  const Explanation words = explain(dialog.format(), counts.error(), exchange.sent, exchange.received);
  co_return PositionResult{counts ? done : only(counts.error(), words.detail, words.advice), *counts};
}

// ---- Orders 20 and 22, whose answers equal positions

Part<SendRate> stop_cyclic_frames(Dialog& dialog) {
  dialog.listen(listening_time);
  const SendRate before = co_await count_frames(dialog, true);
  if (before.count != 0) {
    co_await is_answered(dialog, Order::cyclic, 0);
    dialog.listen(before.pause());
    // The procedure continues even if the node still sends cyclic frames.
    co_await count_frames(dialog);
  }
  co_return before;
}

Part<Outcome> restore_cyclic_frames(Dialog& dialog, SendRate before, Outcome outcome) {
  if (before.count == 0) co_return outcome;
  co_await is_answered(dialog, Order::cyclic, static_cast<std::uint8_t>(before.per_second()));
  dialog.listen(before.pause());
  const SendRate now = co_await count_frames(dialog);
  if (now.count == 0 && outcome.error == Error::none) {
    co_return only(Error::cross_check_failed, "it was done, but the node no longer sends by itself as it did before",
                   "let it: `absenc run ... cyclic 10`");
  }
  co_return outcome;
}

// Reads the position twice and returns the second one; fails if the shaft turns.
Part<PositionResult> read_at_rest(Dialog& dialog) {
  const PositionResult first = co_await read_position(dialog);
  if (first.outcome.error != Error::none) co_return first;
  PositionResult second = co_await read_position(dialog, between_looks);
  const unsigned bits = dialog.format().bits;
  const Outcome objection =
      objection_to_zero(position_reading(first.counts, bits), position_reading(second.counts, bits));
  if (second.outcome.error == Error::none && objection.error != Error::none) {
    second.outcome = only(objection.error, objection.detail, objection.advice);
  }
  co_return second;
}

// Both positions that the host reads after order 20 (zero) must be near 0, because the first may be a late answer to
// the order: this answer equals the position 32.
Outcome check_zero(const Format& format, const Values& found, std::uint32_t first, std::uint32_t second) {
  if (is_near(first, 0, format.bits, zero_millidegrees) && is_near(second, 0, format.bits, zero_millidegrees)) {
    return done;
  }
  return only(Error::cross_check_failed,
              *found.answered ? "the node answered, but its position is not near 0 afterwards"
                              : "the node did not answer, and its position is not near 0 afterwards",
              "the document only lets one guess that command 20 sets the zero: this node may not have it");
}

Outcome check_direction(const Format& format, Values& found, std::uint32_t first, std::uint32_t second) {
  // The position may differ by twice the angle that a shaft at rest usually may, because the shaft may have vibrated
  // both before and after order 22.
  const auto is_at = [&](std::uint64_t place) {
    return is_near(second, place, format.bits, 2 * standstill_millidegrees);
  };
  const auto before = static_cast<std::uint64_t>(*found.before);
  const bool same = is_at(before);
  found.mirrored = !same && is_at((0 - before) & low_mask(format.bits));
  if (!is_near(second, first, format.bits) || (!same && !*found.mirrored)) {
    return only(Error::cross_check_failed, "the position afterwards is neither the one before nor its mirror image",
                "turn the shaft and see which way the node counts");
  }
  if (*found.answered || !same) return done;
  return only(Error::timeout, "the node did not answer the command, and its position is the same");
}

Part<Outcome> change_quietly(Dialog& dialog, Values& found, Order order, std::uint8_t value) {
  const bool zeroing = order == Order::zero;
  const PositionResult before = co_await read_at_rest(dialog);
  if (before.outcome.error != Error::none) co_return before.outcome;
  found.before = found.after = before.counts;
  if (zeroing) {
    found.written = !is_near(before.counts, 0, dialog.format().bits);
    if (!*found.written) co_return done;
  }
  dialog.changes();
  found.answered = co_await is_answered(dialog, order, value);
  const PositionResult first = co_await read_position(dialog);
  if (first.outcome.error != Error::none) co_return first.outcome;
  const PositionResult second = co_await read_position(dialog, between_looks);
  if (second.outcome.error != Error::none) co_return second.outcome;
  found.after = zeroing ? second.counts : first.counts;
  if (zeroing) note_zero(dialog, before.counts, second.counts, dialog.format().bits);
  co_return zeroing ? check_zero(dialog.format(), found, first.counts, second.counts)
                    : check_direction(dialog.format(), found, first.counts, second.counts);
}

// Compares the measured send rate with the rate that order 31 has requested. A small difference is accepted, because
// the adapter may deliver frames in bursts.
Outcome check_cyclic(Dialog& dialog, unsigned wanted, bool answered, const SendRate& heard) {
  if (wanted == 0) {
    if (heard.count == 0) return done;
    return only(Error::cross_check_failed, "the node goes on sending by itself", "try again");
  }
  if (heard.count == 0 && !answered) return {dialog.missing()};
  const unsigned rate = heard.per_second();
  if (heard.count >= 2 && 4 * rate >= 3 * wanted && 4 * rate <= 5 * wanted + 4) return done;
  return only(Error::cross_check_failed, "the node sends more or fewer readings a second than it was told",
              "try again, or fewer readings a second");
}

}  // namespace

// ---- Procedures for one node

Procedure set_cyclic(Dialog& dialog, Values& found, Arguments arguments) {
  const unsigned wanted = arguments.empty() ? 0 : static_cast<unsigned>(arguments[0]);
  found.node = dialog.format().node;
  found.readings_per_s = wanted;
  dialog.changes();
  found.answered = co_await is_answered(dialog, Order::cyclic, static_cast<std::uint8_t>(wanted));
  Outcome outcome = done;
  // If the adapter delivers frames late, the first measurement of the send rate may be wrong and a repeated one right.
  for (unsigned measurements = 0; measurements < most_measurements; ++measurements) {
    dialog.listen(wanted == 0 ? listening_time : std::max(5 * slowest_period / wanted / 2, enough_time) + answer_limit);
    const SendRate heard = co_await count_frames(dialog);
    outcome = check_cyclic(dialog, wanted, *found.answered, heard);
    if (outcome.error == Error::none || outcome.error == Error::timeout) break;
  }
  co_return outcome;
}

Procedure find_node(Dialog& dialog, Values& found) {
  const std::uint8_t node = dialog.format().node;
  const MaybeFrame frame = co_await read(dialog, node);
  if (!frame) co_return {dialog.missing()};
  found.node = node;
  co_return done;
}

Procedure change(Dialog& dialog, Values& found, Order order, Arguments arguments) {
  const std::uint8_t value = order == Order::zero ? 0 : *value_of(dialog.format(), order, arguments[0]);
  found.node = dialog.format().node;
  if (order == Order::direction) found.value = value;
  const SendRate before = co_await stop_cyclic_frames(dialog);
  const Outcome outcome = co_await change_quietly(dialog, found, order, value);
  const Outcome end = co_await restore_cyclic_frames(dialog, before, outcome);
  co_return end;
}

// ---- Procedures for all nodes

namespace {

constexpr Time between_requests = 2ms;  // time between two requests; one request and one answer take 1 ms at 250 kbit/s
// A node's frame that arrives more than this number of requests after the request to the node does not count as its
// answer.
constexpr unsigned answering = 10;
constexpr Time last_answers = 100ms;
constexpr Time entering_time = 20ms;  // time after "enter configuration", which is not answered
constexpr Time answer_window = 100ms;
// Assumed time that a controller needs to rejoin the bus after a change of its bit rate.
constexpr Time switching_time = 50ms;
constexpr int rate_attempts = 3;
constexpr auto most_clashes = 16;  // If frames were destroyed at more node numbers than this, the line is bad.

constexpr std::string_view connect_alone = "connect this one alone: 7E5 reaches every node on the bus";
constexpr std::string_view number_shared = "two nodes share the number, or the line is bad";
constexpr std::string_view scan_hint = "`absenc scan` shows which: set node=";

// Values of `asked` that are no node numbers: before the first request of a scan, and after the last one.
constexpr unsigned before_requests = 0;
constexpr unsigned after_requests = 256;

// Counts the frames of all nodes until the time is over. `asked`: last requested node number, `before_requests` or
// `after_requests`.
Part<bool> count_node_frames(Dialog& dialog, Nodes& nodes, unsigned asked) {
  Time from = never;
  while (const MaybeFrame frame = co_await dialog.heard()) {
    if (function_of(*frame) != Function::reply) continue;
    dialog.keep();
    const unsigned number = node_of(*frame);
    NodeFrames& node = nodes.at[number];
    if (from == never) from = dialog.heard_at();
    if (asked == before_requests && dialog.heard_at() - from < 1s) ++node.per_second;
    // The answer to an earlier request may arrive while later node numbers are requested.
    const unsigned early = dialog.came_early() && node.damaged == 0 ? 1 : 0;
    const bool was_asked = asked == after_requests || (number + early <= asked && number + answering > asked);
    if (!was_asked) {
      ++node.unsolicited;
    } else if (node.answers < 255) {
      ++node.answers;
    }
    const Result<std::uint32_t> counts = decode_position(dialog.format(), *frame);
    node.readable = counts.has_value();
    node.counts = counts.value_or(0);
  }
  co_return true;
}

Part<bool> survey(Dialog& dialog, Nodes& nodes) {
  dialog.overhear();
  dialog.listen(listening_time);
  co_await count_node_frames(dialog, nodes, before_requests);
  for (unsigned number = 1; number < nodes.at.size(); ++number) {
    bool repeat = true;
    while (repeat) {
      dialog.ask_for(encode(Order::read, static_cast<std::uint8_t>(number)), between_requests);
      co_await count_node_frames(dialog, nodes, number);
      repeat = dialog.is_disturbed() && ++nodes.at[number].damaged < 2;
    }
  }
  dialog.listen(last_answers);
  co_await count_node_frames(dialog, nodes, after_requests);
  dialog.overhear(false);
  co_return true;
}

// Stops the procedure unless the node of the format is alone on the bus.
Part<bool> require_single_node(Dialog& dialog, Nodes& nodes) {
  co_await survey(dialog, nodes);
  const NodeFrames& node = nodes.at[dialog.format().node];
  if (nodes.count() == 0) co_await dialog.stop(only(Error::timeout, "no node answers"));
  if (!node.is_there()) {
    co_await dialog.stop(only(Error::unexpected_reply, "other nodes answer, but not this one", scan_hint));
  }
  if (nodes.count() > 1)
    co_await dialog.stop(only(Error::invalid_argument, "other nodes are on this bus", connect_alone));
  if (node.clash()) co_await dialog.stop(only(Error::invalid_argument, number_shared, connect_alone));
  co_return true;
}

Part<bool> wait_until_over(Dialog& dialog) {
  MaybeFrame frame;
  do {
    frame = co_await dialog.heard();
  } while (frame);
  co_return true;
}

// Writes a setting to the node. If the node's answer is lost, the node may nevertheless have obeyed.
Part<bool> write(Dialog& dialog, ConfigureResult& found, Order order, std::uint8_t value) {
  dialog.ask_for(encode(Order::enter, 0, 1), entering_time);
  co_await wait_until_over(dialog);
  found.written = true;
  found.answered = false;
  dialog.changes();
  dialog.ask_for(encode(order, 0, value), answer_window);
  while (const MaybeFrame frame = co_await dialog.heard()) {
    const Error error = check_configuration_answer(order, *frame);
    if (error != Error::none && error != Error::request_rejected) continue;
    dialog.keep();
    if (error != Error::none) co_await dialog.stop({error});
    found.answered = true;
    break;
  }
  co_return true;
}

Part<Outcome> verify_node(Dialog& dialog, std::uint8_t before, std::uint8_t node) {
  constexpr std::string_view supply = "switch its supply off and on, then `absenc scan`";
  const MaybeFrame there = co_await read(dialog, node);
  if (node == before) co_return Outcome{there ? Error::none : dialog.missing()};
  const MaybeFrame still = co_await read(dialog, before);
  if (still && there) {
    co_return only(Error::cross_check_failed, "it answers under its old number as well: another node was there",
                   "connect it alone and try again");
  }
  if (still) co_return only(Error::cross_check_failed, "it keeps its old number", supply);
  if (there) co_return done;
  co_return only(Error::timeout, "it answers neither under its old number nor under the new one", supply);
}

// Sets the host to the new bit rate; if the node does not answer at it, sets the host back to the old one.
Part<Outcome> verify_rate(Dialog& dialog, std::uint32_t bits_per_second) {
  const Format& format = dialog.format();
  dialog.configure(bits_per_second, switching_time);
  co_await wait_until_over(dialog);
  for (int attempt = 0; attempt < rate_attempts; ++attempt) {
    const MaybeFrame there = co_await read(dialog, format.node);
    if (there) co_return done;
  }
  dialog.configure(format.bit_rate(), switching_time);
  co_await wait_until_over(dialog);
  const MaybeFrame back = co_await read(dialog, format.node);
  if (back) {
    co_return only(Error::cross_check_failed, "it keeps its old bit rate",
                   "switch its supply off and on, then try the new one");
  }
  co_return only(Error::timeout, "it answers neither at its old bit rate nor at the new one",
                 "switch its supply off and on, then try both");
}

}  // namespace

Procedure scan(Dialog& dialog, Nodes& nodes) {
  co_await survey(dialog, nodes);
  const auto damaged =
      std::count_if(nodes.at.begin(), nodes.at.end(), [](const NodeFrames& node) { return node.damaged > 1; });
  if (damaged > most_clashes) co_return {Error::bad_framing};
  if (nodes.count() == 0) co_return only(Error::timeout, {});
  co_return done;
}

Procedure configure(Dialog& dialog, ConfigureResult& found, Order order, Arguments arguments) {
  const Format& format = dialog.format();
  const std::optional<std::uint8_t> value = value_of(format, order, arguments[0]);
  if (!value) {
    co_return only(Error::invalid_argument, "the document has no such bit rate", "give 1000000, 500000 or 250000");
  }
  const std::int64_t before = order == Order::rate ? format.bit_rate() : format.node;
  (order == Order::rate ? found.bit_rate : found.node) = arguments[0];
  found.written = false;
  co_await require_single_node(dialog, found.nodes);
  if (arguments[0] == before && arguments[1] == 0) co_return done;
  co_await write(dialog, found, order, *value);
  Outcome outcome;
  if (order == Order::rate) {
    outcome = co_await verify_rate(dialog, static_cast<std::uint32_t>(arguments[0]));
  } else {
    outcome = co_await verify_node(dialog, format.node, *value);
  }
  found.verified = outcome.error == Error::none;
  co_return outcome;
}

}  // namespace absenc::raa38::can
