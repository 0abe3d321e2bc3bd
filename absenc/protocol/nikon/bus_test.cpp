// SPDX-License-Identifier: Apache-2.0
// Tests of virtual encoders of Nikon's A-format on one line.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "absenc/protocol/nikon/device.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::nikon {
namespace {

using Wire = std::vector<std::uint8_t>;

// A shaft that does not turn.
struct Standing final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {.position = position}; }
  std::int64_t position = 0;
};

// A host that sends bytes at given times, and stores the bytes that it receives.
struct RawHost final : Machine<std::uint8_t> {
  void begin(Wire bytes, Time when) {
    received.clear();
    times.clear();
    out = std::move(bytes);
    at = when;
  }
  void feed(const ByteEvent& event) override {
    if (event.kind == ByteEvent::Kind::sent) {
      sending = false;
      sent_at = event.at;
    }
    if (event.kind != ByteEvent::Kind::received) return;
    for (const std::uint8_t byte : event.items) received.push_back(byte);
    times.push_back(event.at);
  }
  ByteStep next(Time) override {
    if (sending || out.empty()) return {.at = never};
    sending = true;
    current = std::exchange(out, {});
    return {.kind = ByteStep::Kind::transfer, .frame = 2, .out = current, .at = at, .width = pause};
  }
  Wire out, current, received;
  std::vector<Time> times;
  Time at{};
  Time sent_at{};
  Time pause = frame_pause;
  bool sending = false;
};

// A line with one encoder for each of the given addresses, each encoder at another position.
struct Bus {
  explicit Bus(const std::vector<unsigned>& addresses, Format format = {})
      : line(LinkKind::half_duplex, format.line()) {
    for (const unsigned address : addresses) {
      shafts.push_back(std::make_unique<Standing>());
      shafts.back()->position = static_cast<std::int64_t>(address + 1) << 20;
      format.address = static_cast<std::uint8_t>(address);
      encoders.push_back(std::make_unique<VirtualEncoder>(format, *shafts.back()));
      encoders.back()->power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
      line.attach(sim::NodeRole::device, *encoders.back());
    }
    node = line.attach(sim::NodeRole::host, host);
  }
  // Sends a request and returns the bytes received within 2 ms.
  Wire ask(const Request& request, const Format& format = {}) {
    const RequestBytes bytes = encode_request(format, request);
    return send({bytes.view().begin(), bytes.view().end()});
  }
  // Sends bytes and returns the bytes received within 2 ms.
  Wire send(Wire bytes) {
    host.begin(std::move(bytes), line.now());
    line.wake(node);
    pass(2ms);
    return host.received;
  }
  // Begins to send a request at the time `at`, and waits for its reply.
  void ask_at(const Request& request, Time at) {
    const RequestBytes bytes = encode_request({}, request);
    host.begin({bytes.view().begin(), bytes.view().end()}, at);
    line.wake(node);
    while (host.received.size() < reply_length(request.code)) pass(1us);
  }
  // Sends a request when the time `pause` has passed since the last reply, and waits for its reply.
  void ask_after_reply(const Request& request, Time pause) {
    ask_at(request, host.times.empty() ? line.now() : host.times.back() + pause);
  }
  // Sends a request and returns the reply of the first encoder that answers; an empty reply after an error.
  OneReply reply(const Request& request, const Format& format = {}) {
    const Wire bytes = ask(request, format);
    const Result<Reply> decoded = decode_reply(format, request, bytes);
    EXPECT_EQ(decoded.error(), Error::none) << unsigned(request.code);
    return decoded ? OneReply(*decoded) : OneReply{};
  }
  std::uint64_t data(const Request& request, const Format& format = {}) { return reply(request, format).data; }
  void pass(Time time) { line.run_until(line.now() + time); }
  [[nodiscard]] std::uint32_t violations() const {
    std::uint32_t all = 0;
    for (const auto& encoder : encoders) all += encoder->violation_count();
    return all;
  }

  sim::Line<std::uint8_t> line;
  std::vector<std::unique_ptr<Standing>> shafts;
  std::vector<std::unique_ptr<VirtualEncoder>> encoders;
  RawHost host;
  sim::Line<std::uint8_t>::Node node{};
};

TEST(NikonBus, CharacterTakesEighteenBits) {
  EXPECT_EQ(Format{}.line().character(), 7200ns);
  EXPECT_EQ(Format{}.line().byte_time(), 3600ns);
}

TEST(NikonBus, AllEncodersOfALineAnswerInTurn) {
  Bus bus({0, 1, 2, 3, 4, 5, 6, 7});
  const Wire bytes = bus.ask({.code = Code::all_positions, .address = 7});
  ASSERT_EQ(bytes.size(), 64u);
  const Result<Reply> reply = decode_reply({}, {.code = Code::all_positions}, bytes);
  ASSERT_EQ(reply.error(), Error::none);
  ASSERT_EQ(reply->count, 8u);
  for (unsigned i = 0; i < 8; ++i) {
    EXPECT_EQ(reply->at(i).address, i);
    EXPECT_EQ(singleturn_in({}, Code::all_positions, reply->at(i).data), (i + 1) << 8);
    // Encoders answer in turn, 3 us apart; the first byte of a reply ends half a character (3.6 us) after the reply's
    // begin.
    if (i == 0) continue;
    EXPECT_EQ(bus.host.times[8 * i] - bus.host.times[8 * i - 1], 3us + 3600ns);
  }
  // Each of the eight encoders also answers a request to its own address.
  for (unsigned i = 0; i < 8; ++i) {
    EXPECT_EQ(bus.ask({.code = Code::position, .address = static_cast<std::uint8_t>(i)}).size(), 8u);
  }
  EXPECT_EQ(bus.violations(), 0u);
}

TEST(NikonBus, PauseBetweenEncodersDependsOnTheRate) {
  constexpr std::array<Time, rates.size()> pauses{3us, 2us, 2us, 1500ns, 1500ns};
  for (std::uint8_t rate = 0; rate < rates.size(); ++rate) {
    const Format format{.rate = rate};
    Bus bus({0, 1}, format);
    ASSERT_EQ(bus.ask({.code = Code::all_positions}, format).size(), 16u);
    EXPECT_EQ(bus.host.times[8] - bus.host.times[7], pauses[rate] + format.line().byte_time()) << rates[rate];
  }
}

TEST(NikonBus, EncodersKeepTheirSlotsWhereOthersAreMissing) {
  Bus bus({1, 4, 6});
  for (int round = 0; round < 2; ++round) {
    const Wire bytes = bus.ask({.code = Code::all_alarms});
    const Result<Reply> reply = decode_reply({}, {.code = Code::all_alarms}, bytes);
    ASSERT_EQ(reply.error(), Error::none);
    ASSERT_EQ(reply->count, 3u);
    EXPECT_EQ(reply->at(0).address, 1);
    EXPECT_EQ(reply->at(1).address, 4);
    EXPECT_EQ(reply->at(2).address, 6);
  }
  EXPECT_EQ(bus.violations(), 0u);
}

TEST(NikonBus, FramesOfARequestKeepTheirPause) {
  Bus bus({0});
  const Request write{.code = Code::write_memory, .word = 0x12, .value = 0x5A3C};
  bus.host.pause = 9us;
  EXPECT_EQ(bus.ask(write).size(), 6u);
  EXPECT_EQ(bus.violations(), 3u);
  EXPECT_EQ(bus.encoders[0]->violations()[0].rule, "frames of a request less than 10 us apart");
  bus.pass(memory_write_time);
  bus.host.pause = 10us;
  EXPECT_EQ(bus.ask(write).size(), 6u);
  EXPECT_EQ(bus.violations(), 3u);
}

TEST(NikonBus, EncoderAnswersAfterThreeMicroseconds) {
  Bus bus({0});
  bus.ask({.code = Code::position});
  // The first byte of the reply is half of its first character, which lasts 7.2 us.
  EXPECT_EQ(bus.host.times[0] - bus.host.sent_at, answer_time + 3600ns);
}

TEST(NikonBus, EncoderIgnoresWrongAndForeignRequests) {
  Bus bus({2});
  EXPECT_TRUE(bus.send({0x02, 0x20}).empty()) << "a wrong CRC-3";
  EXPECT_TRUE(bus.send({0x02, 0x17}).empty()) << "a code that no source lists";
  EXPECT_TRUE(bus.send({0x42, 0x2D, 0x5A, 0x22}).empty()) << "a wrong CRC-3 of MDF2";
  EXPECT_TRUE(bus.ask({.code = Code::position, .address = 3}).empty());
  EXPECT_TRUE(bus.ask({.code = Code::all_positions}).size() == 8);
  EXPECT_EQ(bus.ask({.code = Code::position, .address = 2}).size(), 8u);
}

TEST(NikonBus, EncodersDoNotTakeRepliesOfOthersForRequests) {
  Bus bus({0, 1});
  for (unsigned i = 0; i < 40; ++i) {
    bus.shafts[0]->position += 0x0123'4567;
    for (const Code code : {Code::position, Code::lower, Code::alarms, Code::short_position, Code::read_identity}) {
      EXPECT_EQ(bus.ask({.code = code}).size(), reply_length(code));
      EXPECT_EQ(bus.ask({.code = code, .address = 1}).size(), reply_length(code));
    }
  }
  EXPECT_EQ(bus.violations(), 0u);
}

// ---- Data of replies

TEST(NikonBus, EachCodeReadsItsData) {
  Bus bus({3});
  bus.shafts[0]->position = (std::int64_t{0x1234} << 32) + (std::int64_t{0xABCDE} << 12);
  const auto data = [&](Code code) { return bus.data({.code = code, .address = 3}); };
  EXPECT_EQ(data(Code::position), 0x1234ABCDEu);
  EXPECT_EQ(data(Code::lower), 0x4ABCDEu);
  EXPECT_EQ(data(Code::upper), 0x1234Au);
  EXPECT_EQ(data(Code::short_position), 0xBCDEu);
  EXPECT_EQ(data(Code::with_temperature), 140u << 24 | 0x4ABCDEu);
  EXPECT_EQ(data(Code::temperature), 140u);
  EXPECT_EQ(data(Code::read_identity), 0xABCDEFu);
  EXPECT_EQ(data(Code::alarms), 0u);
  bus.encoders[0]->raise_alarms(alarm::battery | 0x800);
  EXPECT_EQ(data(Code::alarms), alarm::battery);
  EXPECT_EQ(data(Code::with_alarms), std::uint64_t{alarm::battery} << 24 | 0x4ABCDEu);
  EXPECT_EQ(bus.reply({.code = Code::position, .address = 3}).status, 1);
  bus.encoders[0]->lower_alarms(alarm::battery);
  EXPECT_EQ(bus.reply({.code = Code::position, .address = 3}).status, 0);
  bus.encoders[0]->set_condition(0, 20, bus.line.now());
  EXPECT_EQ(data(Code::temperature), 80u);
}

// ---- EEPROM

TEST(NikonBus, EepromAnswersWithTheWordAskedForBefore) {
  Bus bus({0});
  const auto word = [&](std::uint8_t address) { return bus.data({.code = Code::read_memory, .word = address}); };
  EXPECT_EQ(bus.data({.code = Code::write_memory, .word = 0x12, .value = 0x5A3C}), 0u);
  EXPECT_EQ(bus.data({.code = Code::alarms}), alarm::memory_busy);
  bus.pass(memory_write_time);
  EXPECT_EQ(bus.data({.code = Code::alarms}), 0u);
  EXPECT_EQ(word(0xF9), 0x125A3Cu);
  EXPECT_EQ(word(0xF0), 0xF9008Cu);  // the temperature, 35 degC, in quarters of a degree: 8C (hex)
  EXPECT_EQ(word(0xEF), 0xF00000u);
  EXPECT_EQ(bus.data({.code = Code::write_memory, .word = 0xF0, .value = 1}), 0xEF0000u);
  EXPECT_EQ(word(0), 0xF00000u) << "words of the maker cannot be written";
  EXPECT_EQ(bus.violations(), 0u);
}

TEST(NikonBus, BusyEepromDoesNothing) {
  Bus bus({0});
  bus.ask({.code = Code::write_memory, .word = 1, .value = 7});
  EXPECT_EQ(bus.violations(), 0u);
  bus.ask({.code = Code::write_memory, .word = 1, .value = 8});
  bus.ask({.code = Code::write_identity, .value = 8});
  EXPECT_EQ(bus.violations(), 2u);
  bus.pass(memory_write_time);
  bus.ask({.code = Code::read_memory, .word = 1});
  EXPECT_EQ(bus.data({.code = Code::read_memory, .word = 1}), 0x010007u);
  EXPECT_EQ(bus.data({.code = Code::read_identity}), 0xABCDEFu);
  EXPECT_EQ(bus.violations(), 2u);
}

TEST(NikonBus, EepromIsBusyAsLongAsTheSourcesSay) {
  for (const auto& [code, busy] : {std::pair{Code::read_memory, Time(300us)}, {Code::write_memory, Time(30ms)}}) {
    for (const Time early : {Time(1us), Time{}}) {
      Bus bus({0});
      const Request request{.code = code, .word = 1, .value = code == Code::write_memory ? 7u : 0u};
      bus.ask_at(request, Time(1ms));
      bus.ask_at(request, Time(1ms) + busy - early);
      EXPECT_EQ(bus.violations(), early > Time{} ? 1u : 0u) << unsigned(code);
    }
  }
}

TEST(NikonBus, EepromKeepsItsWordsWithoutPower) {
  Bus bus({0});
  bus.ask({.code = Code::write_memory, .word = 1, .value = 7});
  bus.encoders[0]->raise_alarms(alarm::battery);
  bus.encoders[0]->power_off(bus.line.now());
  EXPECT_TRUE(bus.ask({.code = Code::alarms}).empty());
  bus.encoders[0]->power_on(bus.line.now(), Device<std::uint8_t>::PowerOn::skip);
  EXPECT_EQ(bus.data({.code = Code::alarms}), 0u) << "neither an alarm nor memory_busy";
  EXPECT_EQ(bus.data({.code = Code::read_memory, .word = 1}), 0u) << "no word was asked for before";
  EXPECT_EQ(bus.data({.code = Code::read_memory, .word = 1}), 0x010007u);
}

// ---- Resets

TEST(NikonBus, ResetNeedsEightRequestsInARow) {
  Bus bus({0});
  const auto position = [&] { return *singleturn_in({}, Code::position, bus.data({.code = Code::position})); };
  for (int i = 0; i < 7; ++i) bus.ask({.code = Code::zero});
  EXPECT_EQ(position(), 1u << 8);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(bus.data({.code = Code::zero}), 0u);
  EXPECT_EQ(bus.data({.code = Code::alarms}), alarm::memory_busy);
  bus.pass(memory_write_time);
  EXPECT_EQ(position(), 0u);
  EXPECT_EQ(bus.violations(), 0u);
}

TEST(NikonBus, RequestsOfAResetKeepTheirPause) {
  for (const Time pause : {Time(9900ns), Time(10us)}) {
    Bus bus({0});
    bus.encoders[0]->raise_alarms(alarm::battery);
    for (int i = 0; i < 8; ++i) bus.ask_after_reply({.code = Code::clear_alarms}, pause);
    EXPECT_EQ(bus.violations(), pause < 10us ? 7u : 0u);
    EXPECT_EQ(bus.data({.code = Code::alarms}) & alarm::battery, pause < 10us ? 1u : 0u);
  }
}

TEST(NikonBus, DamagedRequestEndsTheRow) {
  Bus bus({0});
  bus.encoders[0]->raise_alarms(alarm::battery);
  for (int i = 0; i < 7; ++i) bus.ask({.code = Code::clear_alarms});
  bus.send({0x02, 0x20});
  bus.ask({.code = Code::clear_alarms});
  EXPECT_EQ(bus.data({.code = Code::alarms}), alarm::battery);
}

TEST(NikonBus, ResetsClearWhatTheyName) {
  struct Row {
    Code code;
    std::uint64_t alarms;
    std::uint64_t position;
  };
  const std::uint64_t before = 0x5'00100;
  for (const Row& row : {Row{Code::clear_alarms, 0, before}, Row{Code::clear_turns, alarm::battery, 0x00100},
                         Row{Code::clear_both, 0, 0x00100}, Row{Code::zero, alarm::battery, 0x5'00000}}) {
    Bus bus({0});
    bus.shafts[0]->position += std::int64_t{5} << 32;
    bus.encoders[0]->raise_alarms(alarm::battery);
    EXPECT_EQ(bus.data({.code = Code::position}), before);
    for (int i = 0; i < 8; ++i) EXPECT_EQ(bus.data({.code = row.code}), alarm::battery) << "the state from before";
    bus.pass(memory_write_time);
    EXPECT_EQ(bus.data({.code = Code::alarms}), row.alarms) << unsigned(row.code);
    EXPECT_EQ(bus.data({.code = Code::position}), row.position) << unsigned(row.code);
    EXPECT_EQ(bus.violations(), 0u);
  }
}

// ---- Identification and address

TEST(NikonBus, OnlyEncoderOfALineTakesAnAddress) {
  Bus bus({2});
  for (int i = 0; i < 7; ++i) bus.ask({.code = Code::set_address, .address = 5});
  bus.ask({.code = Code::set_address, .address = 6});
  EXPECT_EQ(bus.ask({.code = Code::alarms, .address = 2}).size(), 6u) << "requests for two addresses are two rows";
  for (int i = 0; i < 8; ++i) EXPECT_EQ(bus.reply({.code = Code::set_address, .address = 5}).address, 2);
  EXPECT_TRUE(bus.ask({.code = Code::alarms, .address = 2}).empty());
  EXPECT_EQ(bus.data({.code = Code::alarms, .address = 5}), alarm::memory_busy);
  EXPECT_EQ(bus.reply({.code = Code::read_only_identity}).address, 5);
  bus.encoders[0]->power_off(bus.line.now());
  bus.encoders[0]->power_on(bus.line.now(), Device<std::uint8_t>::PowerOn::skip);
  EXPECT_EQ(bus.ask({.code = Code::alarms, .address = 5}).size(), 6u);
}

TEST(NikonBus, IdentificationNamesTheEncoderThatTakesAnAddress) {
  Bus bus({1, 2});
  EXPECT_EQ(bus.data({.code = Code::write_identity, .address = 2, .value = 0x123456}), 0x123456u);
  bus.pass(memory_write_time);
  EXPECT_EQ(bus.data({.code = Code::read_identity, .address = 1}), 0xABCDEFu);
  EXPECT_TRUE(bus.ask({.code = Code::assign_address, .address = 7, .value = 0x777777}).empty());
  EXPECT_EQ(bus.reply({.code = Code::assign_address, .address = 7, .value = 0x123456}).address, 2);
  EXPECT_EQ(bus.data({.code = Code::alarms, .address = 7}), alarm::memory_busy);
  EXPECT_EQ(bus.data({.code = Code::read_identity, .address = 7}), 0x123456u);
  EXPECT_TRUE(bus.ask({.code = Code::alarms, .address = 2}).empty());
  EXPECT_EQ(bus.ask({.code = Code::alarms, .address = 1}).size(), 6u);
}

TEST(NikonBus, OnlyEncoderOfALineTakesAnIdentification) {
  Bus bus({4}, {.bit_order = BitOrder::high_first});
  const Format high{.bit_order = BitOrder::high_first};
  EXPECT_EQ(bus.data({.code = Code::write_only_identity, .value = 0x123456}, high), reflect(0x123456, 24));
  bus.pass(memory_write_time);
  EXPECT_EQ(bus.data({.code = Code::read_only_identity}), reflect(0x123456, 24));
}

}  // namespace
}  // namespace absenc::nikon
