// SPDX-License-Identifier: Apache-2.0
// Any CAN frames as request and reply of the decoder, as what host conversations hear, and as what a node is told.
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absenc/protocol/raa38/can/device.hpp"
#include "absenc/protocol/raa38/can/host.hpp"
#include "absenc/protocol/raa38/can/survey.hpp"
#include "absenc/protocol/vector_check.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::raa38::can;
using namespace absenc::fuzz;

// Two bytes of identifier and flags, one of size, then the data; the size may be larger than what is left.
CanFrame take_frame(Bytes& input) {
  CanFrame frame;
  const auto next = [&input] {
    const std::uint8_t byte = input.empty() ? std::uint8_t{0} : input[0];
    input = input.subspan(std::min<std::size_t>(1, input.size()));
    return byte;
  };
  const unsigned high = next();
  frame.id = (high & 7) << 8 | next();
  frame.extended = (high & 0x30) == 0x30;
  frame.remote = (high & 0xC0) == 0xC0;
  frame.size = std::min<std::uint8_t>(8, next() & 15);
  for (std::size_t i = 0; i < frame.size; ++i) frame.data[i] = next();
  return frame;
}

void decode_both(const CanFrame* request, const CanFrame* reply) {
  Counting sink;
  const Error error = decode({}, request, reply, sink);
  require((error == Error::none) == (sink.count > 0));
  if (error != Error::none) static_cast<void>(explain_frame(error, request, reply));
}

// Whatever comes, a conversation ends, and puts fields only when it ended well.
template <class Machine>
void converse(Machine& machine, Bytes input) {
  Time now{};
  for (unsigned steps = 0; steps < 20'000; ++steps) {
    const auto step = machine.next(now);
    if (step.kind == Step<CanFrame>::Kind::done) {
      Counting sink;
      machine.report(sink);
      require(machine.error() == Error::none || sink.count == 0);
      return;
    }
    if (step.kind == Step<CanFrame>::Kind::configure) continue;
    if (step.kind == Step<CanFrame>::Kind::transfer) {
      now = std::max(now, step.at);
      machine.feed({.kind = Event<CanFrame>::Kind::sent, .at = now});
    } else if (!input.empty()) {
      now += std::chrono::microseconds(100);
      const CanFrame frame = take_frame(input);
      if (frame.id == 0x7FF) {
        machine.feed({.kind = Event<CanFrame>::Kind::line_error, .at = now});
      } else {
        machine.feed({.kind = Event<CanFrame>::Kind::received, .at = now, .items = {&frame, 1}});
      }
    } else {
      require(step.at != never);
      now = std::max(now, step.at);
      machine.feed({.kind = Event<CanFrame>::Kind::timer, .at = now});
    }
  }
  require(false);
}

// A node answers no more often than it is asked, and only what decodes.
void ask_node(Bytes input) {
  const Still still;
  VirtualNode node({}, still, {.readings_per_s = 0});
  node.power_on(Time{}, Device<CanFrame>::PowerOn::skip);
  Time now{};
  unsigned asked = 0;
  unsigned answers = 0;
  while (!input.empty()) {
    now += std::chrono::milliseconds(1);
    const CanFrame frame = take_frame(input);
    if (frame.id == (0x200u | node.node()) && frame.data[0] == command::cyclic) continue;  // it would send by itself
    node.feed({.kind = Event<CanFrame>::Kind::received, .at = now, .items = {&frame, 1}});
    ++asked;
    for (auto step = node.next(now); step.kind != Step<CanFrame>::Kind::wait; step = node.next(now)) {
      if (step.kind != Step<CanFrame>::Kind::transfer) continue;
      ++answers;
      require(step.out.size() == 1 && step.out[0].size == frame_size && !step.out[0].extended && !step.out[0].remote);
      now = std::max(now, step.at);
      node.feed({.kind = Event<CanFrame>::Kind::sent, .at = now});
    }
  }
  require(answers <= asked);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input(data, size);
  const CanFrame text = can_frame_of_text(input);
  decode_both(nullptr, &text);
  decode_both(&text, nullptr);
  Bytes rest = input;
  const CanFrame request = take_frame(rest);
  const CanFrame reply = take_frame(rest);
  decode_both(nullptr, &request);
  decode_both(&request, nullptr);
  decode_both(&request, &reply);
  Read read({}, Read::Way::ask);
  converse(read, input);
  SetCyclic cyclic({}, 255);
  converse(cyclic, input);
  Zero zero({});
  converse(zero, input);
  SetDirection direction({}, true);
  converse(direction, input);
  ask_node(input);
  if (size % 16 == 0) {  // they send 255 requests
    SetNode node({}, 5, false);
    converse(node, input);
    SetRate rate({}, 500'000, true);
    converse(rate, input);
  }
  return 0;
}
