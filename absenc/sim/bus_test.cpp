// SPDX-License-Identifier: Apache-2.0
// Tests sim::Bus: the host must receive the same bytes as from devices on a sim::Line.
#include "absenc/sim/bus.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <memory>

#include "absenc/sim/line.hpp"

namespace absenc::sim {
namespace {

using namespace std::chrono_literals;
using Wire = std::vector<std::uint8_t>;

constexpr LineSettings settings{.rate = 1'000'000};

/// A device that sends `reply` when the time `after` has passed since it received the byte `key` on an idle line.
struct Responder final : Machine<std::uint8_t> {
  Responder(std::uint8_t its_key, Wire its_reply, Time its_after = 5us)
      : key(its_key), reply(std::move(its_reply)), after(its_after) {}

  void feed(const ByteEvent& event) override {
    switch (event.kind) {
      case ByteEvent::Kind::received:
        for (const std::uint8_t item : event.items) {
          received_bytes.push_back(item);
          if (idle && item == key) begin = event.at + after;
          idle = false;
        }
        break;
      case ByteEvent::Kind::silence:
        idle = true;
        break;
      case ByteEvent::Kind::sent:
        idle = true;
        ++sent;
        break;
      default:
        break;
    }
  }
  ByteStep next(Time) override {
    if (begin != never) {
      const Time at = begin;
      begin = never;
      return {.kind = ByteStep::Kind::transfer, .out = reply, .at = at};
    }
    return {.at = never, .gap = 15us};
  }

  std::uint8_t key;
  Wire reply;
  Time after;
  Time begin = never;
  Wire received_bytes;
  unsigned sent = 0;
  bool idle = true;
};

/// A host that sends one request byte after the other, each further one after a silence.
struct Requester final : Machine<std::uint8_t> {
  explicit Requester(const Wire& all) : requests(all.begin(), all.end()) {}

  void feed(const ByteEvent& event) override {
    if (event.kind == ByteEvent::Kind::received) {
      replies.back().insert(replies.back().end(), event.items.begin(), event.items.end());
    }
    if (event.kind == ByteEvent::Kind::silence) awaiting_reply = false;
  }
  ByteStep next(Time) override {
    if (awaiting_reply) return {.at = never, .answer = 300us, .gap = 25us};
    if (requests.empty()) return {.kind = ByteStep::Kind::done};
    request = {requests.front()};
    requests.pop_front();
    replies.emplace_back();
    awaiting_reply = true;
    return {.kind = ByteStep::Kind::transfer, .out = request};
  }

  std::deque<std::uint8_t> requests;
  Wire request;
  std::vector<Wire> replies;
  bool awaiting_reply = false;
};

std::vector<Wire> run_requests(const Wire& requests, const std::vector<Machine<std::uint8_t>*>& on_the_line) {
  Line<std::uint8_t> line(LinkKind::half_duplex, settings);
  for (Machine<std::uint8_t>* device : on_the_line) line.attach(NodeRole::device, *device);
  Requester requester(requests);
  const auto host = line.attach(NodeRole::host, requester);
  EXPECT_TRUE(line.run(host, 1s));
  return requester.replies;
}

TEST(Bus, DeliversSameBytesAsLine) {
  const auto devices = [] {
    std::vector<std::unique_ptr<Responder>> made;
    made.push_back(std::make_unique<Responder>(1, Wire{0x11, 0x22, 0x33}));
    made.push_back(std::make_unique<Responder>(2, Wire{0xF0, 0xAA, 0x55}));
    // This device answers request 2 at the same time as the device that was made before it.
    made.push_back(std::make_unique<Responder>(2, Wire{0x3C, 0xFF}));
    return made;
  };
  const Wire requests{1, 2, 9, 1};
  const auto alone = devices();
  std::vector<Machine<std::uint8_t>*> pointers;
  for (const auto& device : alone) pointers.push_back(device.get());
  const std::vector<Wire> wanted = run_requests(requests, pointers);
  EXPECT_EQ(wanted[1], (Wire{0x30, 0xAA, 0x55}));
  EXPECT_TRUE(wanted[2].empty());

  const auto behind = devices();
  pointers.clear();
  for (const auto& device : behind) pointers.push_back(device.get());
  Bus bus(pointers, settings.character());
  EXPECT_EQ(run_requests(requests, {&bus}), wanted);
  for (std::size_t i = 0; i < behind.size(); ++i) EXPECT_EQ(behind[i]->sent, alone[i]->sent) << i;
  EXPECT_EQ(behind[0]->received_bytes, (Wire{1, 2, 0x30, 0xAA, 0x55, 9, 1}));
}

TEST(Bus, MergesOverlappingTransfersAndSendsTheRestLater) {
  Responder first(1, {0x81, 0x7E});
  // this device begins its reply about one character later than the first device
  Responder second(1, {0x0F, 0x0F}, 5us + 12us);
  Responder late(1, {0x77}, 50ms);
  Bus bus({&second, &first, &late}, settings.character());
  Line<std::uint8_t> line(LinkKind::half_duplex, settings);
  line.attach(NodeRole::device, bus);
  struct Quiet final : Machine<std::uint8_t> {
    void feed(const ByteEvent& event) override {
      received_bytes.insert(received_bytes.end(), event.items.begin(), event.items.end());
    }
    ByteStep next(Time) override {
      if (requested) return {.at = never};
      requested = true;
      return {.kind = ByteStep::Kind::transfer, .out = question};
    }
    Wire question{1};
    Wire received_bytes;
    bool requested = false;
  } host;
  line.attach(NodeRole::host, host);
  line.run_until(10ms);
  EXPECT_EQ(host.received_bytes, (Wire{0x81, 0x0E, 0x0F}));
  line.run_until(60ms);
  EXPECT_EQ(host.received_bytes, (Wire{0x81, 0x0E, 0x0F, 0x77}));
}

}  // namespace
}  // namespace absenc::sim
