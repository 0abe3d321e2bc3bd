// SPDX-License-Identifier: Apache-2.0
// What concerns every node of the bus: who is there, and the configuration on 7E5.
#include <algorithm>

#include "absenc/protocol/raa38/can/procedures.hpp"

namespace absenc::raa38::can {

namespace {

using namespace author;
using Frame = std::optional<CanFrame>;

constexpr Time between_requests = 2ms;  // the request and one answer take 1 ms at 250 kbit/s
constexpr unsigned answering = 10;      // so many requests later a frame is no answer any more, but sent by itself
constexpr Time last_answers = 100ms;
constexpr Time entering_time = 20ms;  // nothing is answered to "enter configuration"
constexpr Time answer_window = 100ms;
constexpr Time switching_time = 50ms;  // until a controller is on the bus again with another bit rate
constexpr int rate_attempts = 3;
constexpr auto most_clashes = 16;  // more numbers that are shared are a line on which nothing goes well

constexpr std::string_view alone = "connect this one alone: 7E5 reaches every node on the bus";
constexpr std::string_view supply = "switch its supply off and on, then `scan`";

// ---- Who is there

// Nobody was asked yet, or all were.
constexpr unsigned nobody = 0;
constexpr unsigned everybody = 256;

// Until the time is over. `asked`: the last number that was asked.
Part<bool> hear_nodes(Bus& bus, Nodes& nodes, unsigned asked) {
  Time from = never;
  for (;;) {
    const Frame frame = co_await bus.heard();
    if (!frame) break;
    if (function_of(*frame) != Function::reply) continue;
    bus.keep();
    const unsigned number = node_of(*frame);
    Heard& node = nodes.at[number];
    if (from == never) from = bus.heard_at();
    if (asked == nobody && bus.heard_at() - from < 1s) ++node.per_second;
    const bool was_asked = asked == everybody || (number <= asked && number + answering > asked);
    if (!was_asked) {
      ++node.unasked;
    } else if (node.answers < 255) {
      ++node.answers;
    }
    const Result<std::uint32_t> counts = decode_position(bus.format(), *frame);
    node.readable = counts.has_value();
    node.counts = counts.value_or(0);
  }
  co_return true;
}

Part<bool> survey(Bus& bus, Nodes& nodes, bool listen_first) {
  if (listen_first) {
    bus.listen(listening_time);
    static_cast<void>(co_await hear_nodes(bus, nodes, nobody));
  }
  for (unsigned number = 1; number < nodes.at.size(); ++number) {
    bool once_more = true;
    while (once_more) {
      bus.ask_for(encode_command(static_cast<std::uint8_t>(number), command::read), between_requests);
      static_cast<void>(co_await hear_nodes(bus, nodes, number));
      once_more = bus.is_disturbed() && ++nodes.at[number].damaged < 2;
    }
  }
  bus.listen(last_answers);
  static_cast<void>(co_await hear_nodes(bus, nodes, everybody));
  co_return true;
}

// ---- The configuration

// 7E5 reaches every node: `none` when this one is the only one.
Part<Outcome> be_alone(Bus& bus, Nodes& nodes) {
  static_cast<void>(co_await survey(bus, nodes, true));
  const Heard& node = nodes.at[bus.format().node];
  if (nodes.count() == 0) co_return only(Error::timeout, "no node answers");
  if (!node.is_there()) {
    co_return only(Error::unexpected_reply, "other nodes answer, but not this one", "`scan` shows which: set node=");
  }
  if (nodes.count() > 1) co_return only(Error::invalid_argument, "other nodes are on this bus", alone);
  if (!node.clash()) co_return done;
  co_return only(Error::invalid_argument, "two nodes share the number, or the line is bad", alone);
}

Part<Outcome> configure(Bus& bus, Configured& found, CanFrame setting) {
  bus.ask_for(encode_configuration(configuration::enter, 1), entering_time);
  Frame frame;
  do {
    frame = co_await bus.heard();
  } while (frame);
  found.written = true;
  bus.ask_for(setting, answer_window);
  for (;;) {
    frame = co_await bus.heard();
    if (!frame) co_return done;  // without an answer, but perhaps not without effect
    const Result<std::uint8_t> answer = decode_configuration_answer(setting.data[0], *frame);
    if (!answer) continue;
    bus.keep();
    found.answered = *answer == 0;
    co_return Outcome{found.answered ? Error::none : Error::request_rejected};
  }
}

Part<bool> is_there(Bus& bus, std::uint8_t node) {
  bus.ask(encode_command(node, command::read));
  Frame frame;
  do {
    frame = co_await bus.heard();
  } while (frame && !is_from(*frame, node));
  if (frame) bus.keep();
  co_return frame.has_value();
}

// Switches this end of the line, which takes a moment.
Part<bool> go_to_rate(Bus& bus, std::uint32_t bits_per_second) {
  bus.configure(bits_per_second, switching_time);
  Frame frame;
  do {
    frame = co_await bus.heard();
  } while (frame);
  co_return true;
}

}  // namespace

unsigned Nodes::count() const {
  return static_cast<unsigned>(std::count_if(at.begin(), at.end(), [](const Heard& node) { return node.is_there(); }));
}

std::uint8_t Nodes::first() const {
  for (unsigned node = 1; node < at.size(); ++node) {
    if (at[node].is_there()) return static_cast<std::uint8_t>(node);
  }
  return 0;
}

Procedure scan(Bus& bus, Nodes& nodes) {
  static_cast<void>(co_await survey(bus, nodes, true));
  const auto damaged =
      std::count_if(nodes.at.begin(), nodes.at.end(), [](const Heard& node) { return node.damaged > 1; });
  if (damaged > most_clashes) co_return {Error::bad_framing};
  if (nodes.count() == 0) co_return only(Error::timeout, {});
  co_return done;
}

Procedure find_node(Bus& bus, OneNode& found) {
  const std::uint8_t meant = bus.format().node;
  static_cast<void>(co_await survey(bus, found.nodes, false));
  if (found.nodes.count() == 0) co_return only(Error::timeout, "no node answers");
  found.node = found.nodes.at[meant].is_there() ? meant : found.nodes.first();
  if (found.node != meant && found.nodes.count() > 1) {
    co_return only(Error::unexpected_reply, "several nodes answer, but not this one", "`scan` shows which: set node=");
  }
  if (!found.nodes.at[found.node].clash()) co_return done;
  co_return only(Error::bad_framing, "two nodes share the number, or the line is bad", "connect the nodes one by one");
}

Procedure set_node(Bus& bus, Configured& found, Arguments arguments) {
  const std::uint8_t before = bus.format().node;
  const auto node = static_cast<std::uint8_t>(arguments[0]);
  found.value = node;
  const Outcome is_alone = co_await be_alone(bus, found.nodes);
  if (is_alone.error != Error::none) co_return is_alone;
  if (node == before && arguments[1] == 0) co_return done;
  const Outcome sent = co_await configure(bus, found, encode_configuration(configuration::node, node));
  if (sent.error != Error::none) co_return sent;
  const bool there = co_await is_there(bus, node);
  if (node == before && !there) co_return {bus.missing()};
  if (node != before) {
    const bool still = co_await is_there(bus, before);
    if (still && there) {
      co_return only(Error::cross_check_failed, "it answers under its old number as well: another node was there",
                     "connect it alone and try again");
    }
    if (still) co_return only(Error::cross_check_failed, "it keeps its old number", supply);
    if (!there) {
      co_return only(Error::timeout, "it answers neither under its old number nor under the new one", supply);
    }
  }
  found.verified = true;
  co_return done;
}

Procedure set_rate(Bus& bus, Configured& found, Arguments arguments) {
  const std::uint32_t before = bus.format().bit_rate();
  const std::uint8_t node = bus.format().node;
  const Rate* const rate = rate_of_bits(arguments[0]);
  if (rate == nullptr) {
    co_return only(Error::invalid_argument, "the document has no such bit rate", "give 1000000, 500000 or 250000");
  }
  found.value = rate->bits_per_second;
  const Outcome is_alone = co_await be_alone(bus, found.nodes);
  if (is_alone.error != Error::none) co_return is_alone;
  if (rate->bits_per_second == before && arguments[1] == 0) co_return done;
  const Outcome sent = co_await configure(bus, found, encode_configuration(configuration::rate, 0, rate->index));
  if (sent.error != Error::none) co_return sent;
  static_cast<void>(co_await go_to_rate(bus, rate->bits_per_second));
  for (int attempt = 0; attempt < rate_attempts; ++attempt) {
    found.verified = co_await is_there(bus, node);
    if (found.verified) co_return done;
  }
  static_cast<void>(co_await go_to_rate(bus, before));
  const bool back = co_await is_there(bus, node);
  if (back) {
    co_return only(Error::cross_check_failed, "it keeps its old bit rate",
                   "switch its supply off and on, then try the new one");
  }
  co_return only(Error::timeout, "it answers neither at its old bit rate nor at the new one",
                 "switch its supply off and on, then try both");
}

}  // namespace absenc::raa38::can
