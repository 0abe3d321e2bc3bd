// SPDX-License-Identifier: Apache-2.0
// A client with this folder's times and its server on one line in virtual time: silence, damage, changes of the rate.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/modbus/server.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::modbus {
namespace {

using Wire = std::vector<std::uint8_t>;
constexpr LineSettings line_settings{.rate = 19'200};
const Time character = line_settings.character();

/// Answers function 03 of address 7 with two fixed bytes, refuses 04, and changes its rate after function 41.
class ToyServer final : public Server {
 public:
  ToyServer() : Server(line_settings) {}
  void raise_alarms(std::uint32_t) override {}
  void lower_alarms(std::uint32_t) override {}
  MutableBytes memory() override { return {}; }
  std::uint32_t memory_version() const override { return 0; }

  unsigned frames = 0;

 private:
  void started() override { set_rate(line_settings.rate); }
  void request(Bytes body, Time at, FrameBytes& reply) override {
    ++frames;
    if (body[0] != 7) return;
    heed_line(at);
    if (body[1] == 0x04) return refuse(reply, 7, body[1], Exception::illegal_function);
    reply.append(hex<"0703021234">);
    if (body[1] == 0x41) set_rate(9600);
  }
};

/// Sends one frame, as often as told.
class ToyClient final : public author::Engine {
 public:
  explicit ToyClient(Bytes body, unsigned count = 1, std::uint32_t rate = line_settings.rate)
      : Engine(client_wire({.rate = rate}, 50ms), storage_), left_(count) {
    frame_.append(body);
    append_crc(frame_);
    if (rate != line_settings.rate) set_rate(rate);
    send(frame_, {}, {});
  }
  void report(FieldSink&) const override {}
  [[nodiscard]] Wire taken() const { return {reply().begin(), reply().end()}; }

 private:
  std::size_t expected(Bytes) const override { return 7; }
  Error check(Bytes bytes) override {
    if (bytes.empty()) return Error::timeout;
    if (bytes.size() != 7) return Error::wrong_length;
    return crc_order(bytes) == CrcOrder::low_first ? Error::none : Error::bad_checksum;
  }
  bool is_whole(Error) const override { return false; }
  void answered(Error error) override {
    if (error != Error::none || --left_ == 0) return finish({.error = error});
    send(frame_, {}, {});
  }

  std::array<std::uint8_t, 20> storage_{};
  FrameBytes frame_;
  unsigned left_;
};

struct Bench {
  Bench() {
    server.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line.observe([this](auto, Time start, Time end, std::uint8_t) {
      if (start - last_end > character) silences.push_back(start - last_end);
      last_end = end;
    });
    line.attach(sim::Role::device, server);
  }
  template <class Machine>
  Machine& run(Machine& machine) {
    if (host == none) {
      host = line.attach(sim::Role::host, machine);
    } else {
      line.replace(host, machine);
    }
    EXPECT_TRUE(line.run(host, line.now() + 10s));
    return machine;
  }
  /// Sends raw characters and returns the reply.
  Wire raw(Wire bytes, Time pause = 5ms) {
    sim::testing::RawHost raw_host(std::move(bytes), 50ms, 3ms, line.now() + pause);
    return run(raw_host).reply;
  }

  static constexpr std::size_t none = ~std::size_t{0};
  ToyServer server;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  std::size_t host = none;
  std::vector<Time> silences;  // longer than a character
  Time last_end{};
};

constexpr auto request_body = hex<"070300000001">;
const Wire good_request{0x07, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x6C};
const Wire good_reply{0x07, 0x03, 0x02, 0x12, 0x34, 0x3D, 0x33};

TEST(ModbusLine, FramesAreFurtherApartThanThreeAndAHalfCharacters) {
  Bench bench;
  ToyClient client(request_body, 20);
  EXPECT_EQ(bench.run(client).error(), Error::none);
  EXPECT_EQ(bench.silences.size(), 40u);
  for (const Time silence : bench.silences) EXPECT_GE(silence, frame_silence(line_settings));
  EXPECT_EQ(bench.server.violation_count(), 0u);
}

TEST(ModbusLine, TheClientWaitsAlsoBeforeItsFirstFrame) {
  Bench bench;
  bench.line.run_until(1s);
  ToyClient client(request_body);
  bench.run(client);
  EXPECT_GE(bench.silences.front(), 1s + request_silence(line_settings));
}

TEST(ModbusLine, ARefusalAndAnUnfinishedReplyEndBySilence) {
  Bench bench;
  ToyClient refused(hex<"070400000001">);
  EXPECT_EQ(bench.run(refused).error(), Error::wrong_length);
  EXPECT_EQ(refused.taken().size(), 5u);
  EXPECT_EQ(refused.taken()[1], 0x84);
  ToyClient silent(hex<"080300000001">);
  EXPECT_EQ(bench.run(silent).error(), Error::timeout);
}

TEST(ModbusLine, TheServerAnswersWhatStandsAloneOnly) {
  Bench bench;
  EXPECT_EQ(bench.raw(good_request).size(), 7u);
  Wire behind = good_request;
  behind.push_back(0x55);
  EXPECT_TRUE(bench.raw(behind).empty());
  Wire before = good_request;
  before.insert(before.begin(), 0x00);
  EXPECT_TRUE(bench.raw(before).empty());
  EXPECT_TRUE(bench.raw(Wire(300, 0x55)).empty()) << "longer than any frame";
  EXPECT_EQ(bench.raw(good_request).size(), 7u);
  EXPECT_EQ(bench.server.frames, 2u);
  EXPECT_EQ(bench.server.violation_count(), 0u);
}

/// Sends characters with a pause before one of them, as a machine that ends with the last.
class Halting final : public Machine<std::uint8_t> {
 public:
  Halting(Wire bytes, std::size_t before, Time pause) : bytes_(std::move(bytes)), before_(before), pause_(pause) {}
  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::sent) sent_at_ = event.at;
    if (event.kind == Event<std::uint8_t>::Kind::received)
      reply.insert(reply.end(), event.items.begin(), event.items.end());
    if (event.kind == Event<std::uint8_t>::Kind::silence) done_ = true;
    waiting_ = waiting_ && event.kind != Event<std::uint8_t>::Kind::sent;
  }
  Step<std::uint8_t> next(Time now) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (done_) return {.kind = Kind::done};
    if (waiting_ || next_ == 2) return {.at = never, .answer = next_ == 2 ? Time(50ms) : Time{}, .gap = 3ms};
    waiting_ = true;
    const Bytes all(bytes_);
    const Bytes part = next_++ == 0 ? all.first(before_) : all.subspan(before_);
    return {.kind = Kind::transfer, .out = part, .at = next_ == 1 ? now + 5ms : sent_at_ + pause_};
  }
  Wire reply;

 private:
  Wire bytes_;
  std::size_t before_;
  Time pause_;
  unsigned next_ = 0;
  bool waiting_ = false;
  bool done_ = false;
  Time sent_at_{};
};

TEST(ModbusLine, GapsInsideAFrameAreTold) {
  Bench bench;
  Halting hurried(good_request, 4, character);
  EXPECT_EQ(bench.run(hurried).reply, good_reply);
  EXPECT_EQ(bench.server.violation_count(), 0u);
  Halting slow(good_request, 4, character * 2);
  EXPECT_EQ(bench.run(slow).reply, good_reply);
  ASSERT_EQ(bench.server.violation_count(), 1u);
  EXPECT_NE(bench.server.violations()[0].rule.find("1.5 characters"), std::string_view::npos);
  Halting cut(good_request, 4, character * 4);
  EXPECT_TRUE(bench.run(cut).reply.empty()) << "two frames, and none of them is one";
}

TEST(ModbusLine, ARequestThatComesTooSoonIsTold) {
  Bench bench;
  bench.raw(good_request);
  sim::testing::RawHost hasty(good_request, 50ms, 1us, bench.line.now());  // ends as soon as the reply is there
  bench.run(hasty);
  EXPECT_EQ(bench.server.violation_count(), 0u) << "the raw host before waited 3 ms";
  sim::testing::RawHost too_soon(good_request, 50ms, 3ms, bench.line.now() + character);
  EXPECT_FALSE(bench.run(too_soon).reply.empty());
  ASSERT_EQ(bench.server.violation_count(), 1u);
  EXPECT_NE(bench.server.violations()[0].rule.find("3.5 characters"), std::string_view::npos);
}

TEST(ModbusLine, WhoeverTalksIntoAReplyIsTold) {
  Bench bench;
  sim::testing::RawHost impatient(good_request, 1us, 1us, bench.line.now() + 5ms);
  EXPECT_TRUE(bench.run(impatient).reply.empty());
  sim::testing::RawHost second(good_request, 50ms, 3ms, bench.line.now() + 5 * character);
  bench.run(second);
  EXPECT_GT(bench.server.violation_count(), 0u);
  EXPECT_NE(bench.server.violations()[0].rule.find("transmission"), std::string_view::npos);
}

TEST(ModbusLine, ARateIsChangedAfterTheReply) {
  Bench bench;
  ToyClient changing(hex<"0741">);
  EXPECT_EQ(bench.run(changing).error(), Error::none);
  ToyClient as_before(request_body);
  EXPECT_EQ(bench.run(as_before).error(), Error::timeout);
  ToyClient at_9600(request_body, 2, 9600);
  EXPECT_EQ(bench.run(at_9600).error(), Error::none);
  EXPECT_EQ(bench.server.violation_count(), 0u);
}

TEST(ModbusLine, PowerOffAndOn) {
  Bench bench;
  bench.server.power_off(bench.line.now());
  EXPECT_TRUE(bench.raw(good_request).empty());
  bench.server.power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::real);
  EXPECT_EQ(bench.raw(good_request), good_reply);
}

// A line on which something sends without a pause is given up, whatever comes.
TEST(ModbusLine, NoiseWithoutEnd) {
  ToyClient client(request_body);
  Time now{};
  static_cast<void>(client.next(now));
  now += 5ms;
  ASSERT_EQ(client.next(now).kind, Step<std::uint8_t>::Kind::transfer);
  client.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  const std::uint8_t noise = 0x55;
  unsigned characters = 0;
  for (; client.next(now).kind != Step<std::uint8_t>::Kind::done && characters < 10'000; ++characters) {
    now += character;
    client.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = {&noise, 1}});
  }
  EXPECT_LT(characters, 2'500u);
  EXPECT_EQ(client.error(), Error::wrong_length);
  EXPECT_NE(client.detail().find("without a pause"), std::string_view::npos);
}

TEST(ModbusLine, WhatIsHeardBeforeTheRequestPutsItOff) {
  using Kind = Event<std::uint8_t>::Kind;
  ToyClient client(request_body);
  static_cast<void>(client.next(Time{}));
  const std::uint8_t noise = 0x55;
  client.feed({.kind = Kind::received, .at = 2ms, .items = {&noise, 1}});
  EXPECT_EQ(client.next(3ms).kind, Step<std::uint8_t>::Kind::wait);
  EXPECT_EQ(client.next(3ms).at, 2ms + request_silence(line_settings));
  EXPECT_EQ(client.next(2ms + request_silence(line_settings)).kind, Step<std::uint8_t>::Kind::transfer);
  client.feed({.kind = Kind::sent, .at = 9ms});
  client.feed({.kind = Kind::received, .at = 13ms, .items = good_reply});
  EXPECT_EQ(client.taken(), good_reply);
  EXPECT_EQ(client.error(), Error::none);
}

TEST(ModbusLine, ADamagedCharacterOrOneOutOfTurnIsNoReply) {
  using Kind = Event<std::uint8_t>::Kind;
  ToyClient damaged(request_body);
  static_cast<void>(damaged.next(Time{}));
  ASSERT_EQ(damaged.next(5ms).kind, Step<std::uint8_t>::Kind::transfer);
  damaged.feed({.kind = Kind::sent, .at = 9ms});
  damaged.feed({.kind = Kind::line_error, .at = 12ms});
  damaged.feed({.kind = Kind::silence, .at = 19ms});
  EXPECT_EQ(damaged.error(), Error::bad_framing);

  ToyClient early(request_body);
  static_cast<void>(early.next(Time{}));
  ASSERT_EQ(early.next(5ms).kind, Step<std::uint8_t>::Kind::transfer);
  early.feed({.kind = Kind::received, .at = 8ms, .items = good_reply});
  early.feed({.kind = Kind::sent, .at = 9ms});
  early.feed({.kind = Kind::silence, .at = 19ms});
  EXPECT_EQ(early.error(), Error::wrong_length);
}

}  // namespace
}  // namespace absenc::modbus
