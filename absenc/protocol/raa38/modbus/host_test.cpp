// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/raa38/modbus/bench_test.hpp"

namespace absenc::raa38::rtu {
namespace {

using namespace testing;

constexpr Format fine{.bits = 21};
const Wire position_of_1 = framed({1, 3, 2, 0, 9});

// ---- Reading

TEST(Raa38ModbusHost, ReadsAsFastAsSilencesAllow) {
  for (std::size_t baud = 0; baud < bauds.size(); ++baud) {
    Bench bench({.baud = baud});
    bench.put(0x1555);
    const Time start = bench.line.now();
    constexpr int readings = 200;
    for (int i = 0; i < readings; ++i) ASSERT_EQ(bench.position(), 0x1555u);
    // Shortest possible duration of an exchange: two silences, the answer time, and the 15 characters of request and
    // reply.
    const LineSettings line = bench.format.line();
    const Time least = modbus::frame_silence(line) * 2 + 200us + 15 * line.character();
    const auto seconds = std::chrono::duration<double>(bench.line.now() - start);
    const double ratio = std::chrono::duration<double>(least * readings) / seconds;
    std::printf("%u baud: %.1f positions a second, %.3f of what the line allows\n", bauds[baud],
                readings / seconds.count(), ratio);
    EXPECT_GT(ratio, 0.95);
    EXPECT_EQ(bench.encoder().violation_count(), 0u);
  }
}

TEST(Raa38ModbusHost, ReadsEveryForm) {
  for (const Data data : {Data::four_bytes, Data::three_bytes, Data::three_as_four}) {
    for (const unsigned bits : {14u, 21u}) {
      Bench bench({.bits = bits, .registers = 2, .data = data});
      for (const std::uint32_t position : {0u, 1u, 383u, 0x3FFFu}) {
        bench.put(position);
        EXPECT_EQ(bench.position(), position) << static_cast<int>(data);
      }
      EXPECT_EQ(bench.encoder().violation_count(), 0u);
    }
  }
}

TEST(Raa38ModbusHost, RefusesOneRegisterFor17Bits) {
  Talk read({.bits = 17, .registers = 1}, "position");
  EXPECT_EQ(read->next(Time{}).kind, Step<std::uint8_t>::Kind::done);
  EXPECT_TRUE(ended(raa38::testing::result_of<std::uint8_t>(*read), Error::invalid_argument, "16 bits"));
}

// A reply whose CRC ends with 00 can also be valid without that byte, as a reply with three bytes of data.
TEST(Raa38ModbusHost, RejectsReplyThatLostItsLastByte) {
  Wire whole;
  std::uint32_t position = 0x100000;
  for (; whole.empty() || whole.back() != 0; ++position) {
    whole = framed({1, 3, 4, 0, static_cast<std::uint8_t>(position >> 16), static_cast<std::uint8_t>(position >> 8),
                    static_cast<std::uint8_t>(position)});
  }
  const std::uint32_t right = position - 1;
  const Wire cut(whole.begin(), whole.end() - 1);
  EXPECT_TRUE(decode_reply(fine, read_request(fine), cut)) << "the trap is there";
  const Wire unambiguous = framed({1, 3, 4, 0, 0x1F, 0xAB, 0xCD});
  struct Row {
    Wire first;
    Wire second;
    Error error;
    std::uint32_t position;
  };
  const Row rows[]{{cut, whole, Error::wrong_length, 0},
                   {cut, unambiguous, Error::none, 0x1FABCD},
                   {whole, whole, Error::none, right}};
  for (const std::string_view command : {"position", "direction"}) {
    for (const Row& row : rows) {
      const ScriptedResult read =
          with([&](Bytes, unsigned before) { return before == 0 ? row.first : row.second; }, command, {}, fine);
      EXPECT_TRUE(ended(read, row.error));
      EXPECT_EQ(read.requests, 2u);
      if (row.error != Error::none) continue;
      EXPECT_TRUE(read.has("singleturn=" + std::to_string(row.position))) << read.fields;
    }
  }
}

TEST(Raa38ModbusHost, ExplainsEachBadReply) {
  struct Row {
    Wire reply;
    Error error;
    std::string_view words;
  };
  const Row rows[]{
      {{}, Error::timeout, "nobody answers"},
      {{0x01, 0x03, 0x02, 0x01, 0x7F, 0x34, 0xF8}, Error::bad_checksum, "low byte first"},
      {framed({1, 0x83, 2}), Error::request_rejected, "illegal data address"},
      {framed({2, 3, 2, 0, 1}), Error::unexpected_reply, "another address"},
      {framed({1, 4, 2, 0, 1}), Error::unexpected_reply, "another function"},
      {framed({1, 3, 2, 0x40, 0}), Error::out_of_range, "more bits"},
      {framed({1, 3, 4, 0, 0, 0, 1}), Error::wrong_length, "one register"},
      {{0x01}, Error::wrong_length, "one register"},
  };
  for (const Row& row : rows) {
    EXPECT_TRUE(ended(with([&](Bytes, unsigned) { return row.reply; }, "position"), row.error, row.words));
  }
}

TEST(Raa38ModbusHost, StopsOnEndlessNoise) {
  for (const std::string_view command : {"position", "address", "baud", "direction", "scan", "zero"}) {
    Talk talk({}, command);
    EXPECT_LT(raa38::testing::time_with_noise(*talk), 1500ms) << command;
    EXPECT_TRUE(ended(raa38::testing::result_of<std::uint8_t>(*talk), Error::wrong_length, "without a pause"));
  }
}

// ---- Address, baud rate, direction and scan

TEST(Raa38ModbusHost, ReadsAddressOfConnectedSlave) {
  Bench bench({.address = 42});
  EXPECT_EQ(bench.run_command(Format{}, "address").fields, "address=42 ");
  bench.add({.address = 200});
  EXPECT_EQ(bench.run_command(Format{.address = 200}, "address").fields, "address=200 ");
  EXPECT_TRUE(ended(bench.run_command(Format{.address = 7}, "address"), Error::timeout));
}

TEST(Raa38ModbusHost, ReadsAddressWithEitherCrcOrder) {
  for (const CrcOrder order : {CrcOrder::low_first, CrcOrder::high_first}) {
    Bench bench({.address = 42, .address_crc = order});
    const Wire reply = bench.raw(framed({0xFF, 0xA0}));
    EXPECT_EQ(modbus::crc_order(reply), order);
    EXPECT_EQ(bench.run_command("address").fields, "address=42 ");
    EXPECT_EQ(bench.run_command("scan").fields, "encoder_address=42 clash=0 ");
    EXPECT_EQ(modbus::crc_order(bench.raw(framed({42, 3, 0, 0, 0, 1}))), CrcOrder::low_first) << "no other reply";
  }
}

TEST(Raa38ModbusHost, NamesAddressThatAnswersA0) {
  const std::pair<std::string_view, std::vector<std::int64_t>> commands[]{{"baud", {}},           {"direction", {}},
                                                                          {"set-address", {2}},   {"set-baud", {9600}},
                                                                          {"set-direction", {1}}, {"zero", {0}}};
  for (const auto& [command, arguments] : commands) {
    Bench bench({.address = 42});
    const CommandResult end = bench.run_command(Format{.address = 5}, command, arguments);
    EXPECT_TRUE(
        ended(end, Error::timeout, "nobody answers at address 5, but A0 is answered by address 42 at 19200 baud"))
        << command;
    EXPECT_EQ(bench.encoder().settings().writes(), 0u);
    bench.add({.address = 43});  // the answers of both slaves to function A0 collide
    EXPECT_TRUE(
        ended(bench.run_command(Format{.address = 5}, command, arguments), Error::timeout, "nobody answers at this"));
  }
  Bench bench({.address = 42});
  bench.encoder().memory()[1] = 4;
  bench.encoder().power_on(bench.line.now(), PowerOn::skip);
  bench.line.wake(0);
  EXPECT_TRUE(ended(bench.run_command(Format{.address = 5}, "baud"), Error::timeout, "by address 42 at 57600 baud"));
}

TEST(Raa38ModbusHost, FindsBaudRate) {
  for (std::size_t set = 0; set < bauds.size(); ++set) {
    for (std::size_t reply_to_a0 = 0; reply_to_a0 < bauds.size(); ++reply_to_a0) {
      Bench bench({.baud = reply_to_a0});
      bench.encoder().memory()[1] = static_cast<std::uint8_t>(set);
      bench.encoder().power_on(bench.line.now(), PowerOn::skip);
      bench.line.wake(0);
      EXPECT_EQ(bench.run_command("baud").fields, "baud=" + std::to_string(bauds[set]) + " ") << bauds[reply_to_a0];
    }
  }
  Bench bench;
  EXPECT_TRUE(ended(bench.run_command(Format{.address = 2}, "baud"), Error::timeout, "by address 1"));
  EXPECT_TRUE(ended(bench.run_command("position"), Error::none)) << "the line is as it was";
  bench.encoder().power_off(bench.line.now());
  EXPECT_TRUE(ended(bench.run_command("baud"), Error::timeout, "any of the five"));
}

TEST(Raa38ModbusHost, ScanFindsSingleSlaveByA0) {
  Bench bench({.address = 99});
  const CommandResult scan = bench.run_command("scan");
  EXPECT_EQ(scan.fields, "encoder_address=99 clash=0 ");
  EXPECT_LT(scan.took, 200ms);
}

TEST(Raa38ModbusHost, ScanPollsEveryAddress) {
  Bench bench({.address = 3});
  bench.add({.address = 20, .bits = 15});
  bench.add({.address = 20, .bits = 14});
  bench.add({.address = 247});
  bench.add({.address = 100, .bits = 18});
  bench.put(0x1234);
  EXPECT_EQ(bench.run_command("scan").fields,
            "encoder_address=3 clash=0 encoder_address=20 clash=1 encoder_address=100 clash=0 refuses=1 "
            "encoder_address=247 clash=0 ");
  EXPECT_EQ(bench.run_command("scan", {3, 19}).fields, "encoder_address=3 clash=0 ");
  EXPECT_TRUE(ended(bench.run_command("scan", {4, 19}), Error::timeout));
  EXPECT_TRUE(ended(bench.run_command("scan", {5, 4}), Error::invalid_argument));
}

TEST(Raa38ModbusHost, ScanRepeatsRequestAfterDamagedReply) {
  for (const unsigned damaged : {2u, 3u}) {
    const auto answer = [&](Bytes request, unsigned before) {
      if (request[0] != 5) return Wire{};
      return before <= damaged ? Wire{5, 3, 2, 0, 9, 0, 0} : framed({5, 3, 2, 0, 9});
    };
    EXPECT_TRUE(with(answer, "scan", {5, 5}).has(damaged == 2 ? "clash=0" : "clash=1"));
  }
}

// ---- Settings

TEST(Raa38ModbusSettings, SetsAndVerifiesAddress) {
  Bench bench;
  EXPECT_EQ(bench.run_command("set-address", {5}).fields, "address=5 written=1 ");
  EXPECT_EQ(bench.encoder().address(), 5);
  const Format moved{.address = 5};
  EXPECT_EQ(bench.run_command(moved, "set-address", {5}).fields, "address=5 written=0 ");
  EXPECT_EQ(bench.encoder().settings().writes(), 1u);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
  EXPECT_EQ(bench.run_command(moved, "set-address", {5, 1}).fields, "address=5 written=1 ");
  EXPECT_EQ(bench.encoder().settings().writes(), 2u);
  EXPECT_EQ(bench.encoder().violation_count(), 1u);
}

TEST(Raa38ModbusSettings, RefusesAddressInUse) {
  Bench bench;
  const VirtualEncoder& other = bench.add({.address = 2});
  EXPECT_TRUE(ended(bench.run_command("set-address", {2}), Error::invalid_argument, "already"));
  EXPECT_EQ(bench.encoder().settings().writes() + other.settings().writes(), 0u);
  const auto damaged = [](Bytes request, unsigned) {
    EXPECT_EQ(request[1], function::read);
    return request[0] == 1 ? position_of_1 : Wire{2, 3, 2, 0, 9, 0, 0};
  };
  EXPECT_TRUE(ended(with(damaged, "set-address", {2}), Error::invalid_argument, "though not well"));
  // After one damaged reply of the wanted new address the host does not use this address, even if its next requests are
  // not answered.
  unsigned asked = 0;
  const auto damaged_once = [&asked](Bytes request, unsigned) {
    if (request[0] == 1) return position_of_1;
    return ++asked == 1 ? Wire{2, 3, 2, 0, 9, 0, 0} : Wire{};
  };
  EXPECT_TRUE(ended(with(damaged_once, "set-address", {2}), Error::invalid_argument, "though not well"));
}

TEST(Raa38ModbusSettings, ReportsSettingThatWasNotAccepted) {
  const auto ignores_settings = [](Bytes request, unsigned) {
    if (request[1] == function::read) return request[0] == 1 ? framed({1, 3, 2, 0x10, 0}) : Wire{};
    if (request[1] == function::set_address) return framed({request[2], request[1]});
    return Wire(request.begin(), request.end());
  };
  struct Row {
    std::string_view command;
    std::int64_t value;
    std::string_view words;
  };
  for (const Row& row : {Row{"set-address", 2, "old address"}, Row{"set-baud", 9600, "old baud rate"},
                         Row{"zero", 1, "still not zero"}}) {
    EXPECT_TRUE(ended(with(ignores_settings, row.command, {row.value}), Error::cross_check_failed, row.words));
  }
}

TEST(Raa38ModbusSettings, SendsSettingOnlyOnce) {
  for (const std::string_view command : {"set-address", "set-baud"}) {
    unsigned sent = 0;
    const auto dies = [&](Bytes request, unsigned) {
      if (request[1] != function::read) ++sent;
      return sent == 0 && request[0] == 1 ? position_of_1 : Wire{};
    };
    EXPECT_TRUE(ended(with(dies, command, {command == "set-baud" ? 57'600 : 2}), Error::timeout, "neither as before"));
    EXPECT_EQ(sent, 1u);
  }
}

TEST(Raa38ModbusSettings, ReportsRefusalWithoutRepetition) {
  const ScriptedResult read = with([](Bytes, unsigned) { return framed({1, 0x83, 2}); }, "set-address", {2});
  EXPECT_TRUE(ended(read, Error::request_rejected));
  EXPECT_EQ(read.requests, 1u);
  const auto refuses = [](Bytes request, unsigned) {
    if (request[1] == function::set_address) return framed({1, 0xA1, 1});
    return request[0] == 1 ? position_of_1 : Wire{};
  };
  EXPECT_TRUE(ended(with(refuses, "set-address", {2}), Error::request_rejected, "illegal function"));
}

// The document gives no time for storing a setting.
TEST(Raa38ModbusSettings, WaitsForEncoderToStoreSetting) {
  const std::pair<std::string_view, std::int64_t> commands[]{
      {"set-address", 2}, {"set-baud", 9600}, {"set-direction", 1}, {"zero", 0}};
  for (const auto& [command, value] : commands) {
    unsigned set_at = 0;
    const auto accepts = [&](Bytes request, unsigned before) -> Wire {
      if (request[1] == function::read) return request[0] == 1 ? framed({1, 3, 2, 0x10, 0}) : Wire{};
      set_at = before;
      return request[1] == function::set_address ? framed({request[2], request[1]})
                                                 : Wire(request.begin(), request.end());
    };
    const ScriptedResult talk = with(accepts, command, {value});
    ASSERT_LT(set_at + 1, talk.request_times.size()) << command;
    EXPECT_GE(talk.request_times[set_at + 1] - talk.request_times[set_at], 20ms) << command;
  }
}

TEST(Raa38ModbusSettings, VerifiesSettingAfterLostReply) {
  std::uint8_t address = 1;
  const auto accepts = [&](Bytes request, unsigned) -> Wire {
    if (request[1] == function::set_address) address = request[2];
    return request[1] == function::read && request[0] == address ? framed({address, 3, 2, 0, 9}) : Wire{};
  };
  EXPECT_TRUE(ended(with(accepts, "set-address", {2}), Error::none));
  EXPECT_EQ(address, 2);
}

TEST(Raa38ModbusSettings, SwitchesHostToNewBaudRate) {
  for (std::size_t from = 0; from < bauds.size(); ++from) {
    for (std::size_t to = 0; to < bauds.size(); ++to) {
      Bench bench({.baud = from});
      EXPECT_TRUE(bench.run_command("set-baud", {bauds[to]}).has(from != to ? "written=1" : "written=0"));
      EXPECT_EQ(bench.encoder().baud(), bauds[to]);
      EXPECT_TRUE(ended(bench.run_command(Format{.baud = to}, "position"), Error::none)) << "the line goes on so";
      EXPECT_EQ(bench.encoder().violation_count(), 0u);
    }
  }
  EXPECT_TRUE(ended(Bench().run_command("set-baud", {38'400}), Error::invalid_argument, "57600"));
  // The first step changes the port's baud rate, so that a port that cannot do so fails before the encoder has changed.
  EXPECT_EQ(Talk({}, "set-baud", {9600})->next(Time{}).kind, Step<std::uint8_t>::Kind::configure);
}

TEST(Raa38ModbusSettings, ReportsEffectOfDirection) {
  Bench bench;
  bench.put(383);
  const auto set = [&](std::uint8_t value) { return bench.run_command("set-direction", {value}).fields; };
  EXPECT_EQ(set(parameter::negative),
            "parameter=2 setting=negative direction effect=mirrored: the direction has changed written=1 ");
  EXPECT_TRUE(bench.encoder().settings().counts_down());
  EXPECT_TRUE(says(set(parameter::negative), "counted so already"));
  bench.shaft.spin(60, bench.line.now());
  EXPECT_TRUE(says(set(parameter::positive), "neither"));
  EXPECT_TRUE(says(bench.run_command("direction").fields, "does not tell"));
}

TEST(Raa38ModbusSettings, ReportsDirectionWithoutEchoAsUnknown) {
  const auto mute = [](Bytes request, unsigned) { return request[1] == function::read ? position_of_1 : Wire{}; };
  EXPECT_TRUE(ended(with(mute, "set-direction", {1}), Error::timeout, "nothing else tells"));
}

TEST(Raa38ModbusSettings, SetsZeroOfShaftAtRest) {
  Bench bench;
  bench.put(5000);
  EXPECT_EQ(bench.run_command("zero").fields, "singleturn=0 written=1 ");
  EXPECT_EQ(bench.run_command("zero").fields, "singleturn=0 written=0 ");
  bench.shaft.spin(60, bench.line.now());
  EXPECT_TRUE(ended(bench.run_command("zero"), Error::not_still, "nothing was changed"));
  EXPECT_EQ(bench.encoder().settings().writes(), 1u);
  EXPECT_EQ(bench.encoder().violation_count(), 0u);
}

TEST(Raa38ModbusSettings, SendsNoSettingWithoutEncoder) {
  Bench bench({.address = 9});
  const std::pair<std::string_view, std::int64_t> commands[]{
      {"set-address", 2}, {"set-baud", 9600}, {"set-direction", 1}, {"zero", 0}};
  for (const auto& [command, value] : commands) {
    EXPECT_TRUE(ended(bench.run_command(Format{}, command, {value}), Error::timeout));
  }
  EXPECT_EQ(bench.encoder().settings().writes(), 0u);
}

}  // namespace
}  // namespace absenc::raa38::rtu
