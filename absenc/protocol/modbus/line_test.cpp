// SPDX-License-Identifier: Apache-2.0
// Tests of a Modbus client and server on one line in virtual time.
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <tuple>
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

/// A server at address 7. It refuses function 0x04, and function 0x41 changes its rate.
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
    check_line_rules(at);
    if (body[1] == 0x04) return refuse(reply, 7, body[1], Exception::illegal_function);
    reply.append(hex<"0703021234">);
    if (body[1] == 0x41) set_rate(9600);
  }
};

/// A client that sends the same frame `count` times, or until an error occurs.
class ToyClient final : public author::Engine {
 public:
  explicit ToyClient(Bytes body, unsigned count = 1, std::uint32_t rate = line_settings.rate)
      : Engine(client_times({.rate = rate}, 50ms), storage_), left_(count) {
    frame_.append(body);
    append_crc(frame_);
    if (rate != line_settings.rate) set_rate(rate);
    send(frame_, {}, {});
  }
  void report(FieldSink&) const override {}

 private:
  std::size_t expected() const override { return 7; }
  Error check() override {
    const Bytes bytes = reply();
    if (bytes.empty()) return Error::timeout;
    if (bytes.size() != 7) return Error::wrong_length;
    return crc_order(bytes) == CrcOrder::low_first ? Error::none : Error::bad_checksum;
  }
  bool is_whole(Error) const override { return false; }
  void concluded(Error error) override {
    if (error != Error::none || --left_ == 0) return finish(error);
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
    line.attach(sim::NodeRole::device, server);
  }
  template <class Machine>
  Machine& run(Machine& machine) {
    if (host) line.replace(*host, machine);
    if (!host) host = line.attach(sim::NodeRole::host, machine);
    EXPECT_TRUE(line.run(*host, line.now() + 10s));
    return machine;
  }
  Error ask(Bytes body, unsigned count = 1, std::uint32_t rate = line_settings.rate) {
    ToyClient client(body, count, rate);
    const Error error = run(client).error();
    last_reply = {client.reply().begin(), client.reply().end()};
    return error;
  }
  /// Sends raw characters and returns the reply.
  Wire raw(Wire bytes, Time pause = 5ms, Time answer = 50ms, Time gap = 3ms) {
    sim::testing::RawHost raw_host(std::move(bytes), answer, gap, line.now() + pause);
    return run(raw_host).reply;
  }
  /// Returns the rule that the client broke; empty unless exactly one breach was counted.
  [[nodiscard]] std::string_view broken_rule() const {
    return server.violation_count() == 1 ? server.violations()[0].rule : std::string_view{};
  }

  ToyServer server;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  std::optional<std::size_t> host;
  Wire last_reply;             // last reply that `ask` received
  std::vector<Time> silences;  // durations of all silences on the line that were longer than the time of a character
  Time last_end{};
};

bool says(std::string_view text, std::string_view words) { return text.find(words) != std::string_view::npos; }

constexpr auto request_body = hex<"070300000001">;
const Wire good_request{0x07, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x6C};
const Wire good_reply{0x07, 0x03, 0x02, 0x12, 0x34, 0x3D, 0x33};

TEST(ModbusLine, SeparatesFramesByThreeAndAHalfCharacters) {
  Bench bench;
  EXPECT_EQ(bench.ask(request_body, 20), Error::none);
  EXPECT_EQ(bench.silences.size(), 40u);
  for (const Time silence : bench.silences) EXPECT_GE(silence, frame_silence(line_settings));
  EXPECT_EQ(bench.server.violation_count(), 0u);
}

TEST(ModbusLine, ClientWaitsBeforeFirstFrame) {
  Bench bench;
  bench.line.run_until(1s);
  EXPECT_EQ(bench.ask(request_body), Error::none);
  EXPECT_GE(bench.silences.front(), 1s + request_silence(line_settings));
}

TEST(ModbusLine, SilenceEndsRefusalAndUnfinishedReply) {
  Bench bench;
  EXPECT_EQ(bench.ask(hex<"070400000001">), Error::wrong_length);
  EXPECT_EQ(bench.last_reply.size(), 5u);
  EXPECT_EQ(bench.last_reply[1], 0x84);
  EXPECT_EQ(bench.ask(hex<"080300000001">), Error::timeout);
}

TEST(ModbusLine, ServerAnswersOnlyFramesBetweenSilences) {
  Bench bench;
  EXPECT_EQ(bench.raw(good_request), good_reply);
  Wire behind = good_request;
  behind.push_back(0x55);
  Wire before = good_request;
  before.insert(before.begin(), 0x00);
  for (const Wire& none : {behind, before, Wire(300, 0x55)}) EXPECT_EQ(bench.raw(none), Wire{}) << none.size();
  bench.server.power_off(bench.line.now());
  EXPECT_EQ(bench.raw(good_request), Wire{});
  bench.server.power_on(bench.line.now(), Device<std::uint8_t>::PowerOn::real);
  EXPECT_EQ(bench.raw(good_request), good_reply);
  EXPECT_EQ(bench.server.frames, 2u);
  EXPECT_EQ(bench.server.violation_count(), 0u);
}

/// A host that sends a frame with a pause before one of its characters, and records the reply.
class PausingHost final : public Machine<std::uint8_t> {
 public:
  PausingHost(const Wire& bytes, std::ptrdiff_t before, Time pause)
      : parts_{Wire(bytes.begin(), bytes.begin() + before), Wire(bytes.begin() + before, bytes.end())}, pause_(pause) {}
  void feed(const Event<std::uint8_t>& event) override {
    using Kind = Event<std::uint8_t>::Kind;
    if (event.kind == Kind::sent) next_at_ = event.at + pause_;
    if (event.kind == Kind::sent) sending_ = false;
    if (event.kind == Kind::received) reply.insert(reply.end(), event.items.begin(), event.items.end());
    done_ = done_ || event.kind == Kind::silence;
  }
  Step<std::uint8_t> next(Time now) override {
    using Kind = Step<std::uint8_t>::Kind;
    if (done_) return {.kind = Kind::done};
    if (sending_ || part_ == 2) return {.at = never, .answer = part_ == 2 ? Time(50ms) : Time{}, .gap = 3ms};
    sending_ = true;
    return {.kind = Kind::transfer, .out = parts_[part_++], .at = part_ == 1 ? now + 5ms : next_at_};
  }
  Wire reply;

 private:
  std::array<Wire, 2> parts_;
  Time pause_;
  std::size_t part_ = 0;
  bool sending_ = false;
  bool done_ = false;
  Time next_at_{};
};

TEST(ModbusLine, ServerReportsGapsInsideFrame) {
  const std::tuple<int, Wire, std::string_view> rows[]{// the pause of 4 characters makes two invalid frames
                                                       {1, good_reply, ""},
                                                       {2, good_reply, "1.5 characters"},
                                                       {4, {}, ""}};
  for (const auto& [characters, reply, rule] : rows) {
    Bench bench;
    PausingHost pausing(good_request, 4, character * characters);
    EXPECT_EQ(bench.run(pausing).reply, reply) << characters;
    EXPECT_EQ(bench.broken_rule().empty(), rule.empty());
    EXPECT_TRUE(says(bench.broken_rule(), rule)) << bench.broken_rule();
  }
}

TEST(ModbusLine, ServerReportsRequestThatComesTooSoon) {
  Bench bench;
  bench.raw(good_request);
  // The client's gap limit of 1 us ends the exchange as soon as the reply is complete.
  bench.raw(good_request, {}, 50ms, 1us);
  EXPECT_EQ(bench.server.violation_count(), 0u) << "the one before waited 3 ms";
  EXPECT_EQ(bench.raw(good_request, character), good_reply);
  EXPECT_TRUE(says(bench.broken_rule(), "3.5 characters"));
}

// A server whose process the operating system scheduled late does not know how long the client was silent.
TEST(ModbusLine, LateServerReportsNoMissingSilence) {
  using Kind = Event<std::uint8_t>::Kind;
  for (const auto& [late, rules] : {std::pair(Time(1ms), 1u), {Time(50ms), 0u}}) {
    for (const bool replied : {false, true}) {
      ToyServer server;
      server.power_on({}, Device<std::uint8_t>::PowerOn::skip);
      server.feed({.kind = Kind::received, .at = 50ms, .items = good_request});
      Time now = 50ms + frame_silence(line_settings) + late;
      server.feed({.kind = Kind::silence, .at = now});
      // the server's first step is the change of the rate that it requested at power on
      static_cast<void>(server.next(now));
      ASSERT_EQ(server.answer_count(), 1u);
      if (replied) server.feed({.kind = Kind::sent, .at = now});
      server.feed({.kind = Kind::received, .at = now + 100us, .items = good_request});
      server.feed({.kind = Kind::silence, .at = now + 10ms});
      EXPECT_EQ(server.violation_count(), rules) << late.count() << ' ' << replied;
    }
  }
}

TEST(ModbusLine, ServerReportsRequestDuringReply) {
  Bench bench;
  EXPECT_EQ(bench.raw(good_request, 5ms, 1us, 1us), Wire{});
  bench.raw(good_request, 5 * character);
  ASSERT_GT(bench.server.violation_count(), 0u);
  EXPECT_TRUE(says(bench.server.violations()[0].rule, "transmission"));
}

TEST(ModbusLine, ServerChangesRateAfterReply) {
  Bench bench;
  EXPECT_EQ(bench.ask(hex<"0741">), Error::none);
  EXPECT_EQ(bench.ask(request_body), Error::timeout);
  EXPECT_EQ(bench.ask(request_body, 2, 9600), Error::none);
  EXPECT_EQ(bench.server.violation_count(), 0u);
}

// If bytes that are no reply arrive without a pause, the client ends its conversation.
TEST(ModbusLine, ClientStopsOnEndlessNoise) {
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
  EXPECT_TRUE(client.is_noisy());
}

TEST(ModbusLine, ClientDelaysRequestAfterReceivedByte) {
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
  EXPECT_EQ(Wire(client.reply().begin(), client.reply().end()), good_reply);
  EXPECT_EQ(client.error(), Error::none);
}

TEST(ModbusLine, ClientRejectsDamagedAndEarlyReply) {
  using Kind = Event<std::uint8_t>::Kind;
  for (const bool early : {false, true}) {
    ToyClient client(request_body);
    static_cast<void>(client.next(Time{}));
    ASSERT_EQ(client.next(5ms).kind, Step<std::uint8_t>::Kind::transfer);
    if (early) client.feed({.kind = Kind::received, .at = 8ms, .items = good_reply});
    client.feed({.kind = Kind::sent, .at = 9ms});
    if (!early) client.feed({.kind = Kind::line_error, .at = 12ms});
    client.feed({.kind = Kind::silence, .at = 19ms});
    EXPECT_EQ(client.error(), early ? Error::wrong_length : Error::bad_framing);
  }
}

}  // namespace
}  // namespace absenc::modbus
