// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "absenc/core/hex.hpp"
#include "absenc/protocol/raa38/modbus/bench_test.hpp"

namespace absenc::raa38::rtu {
namespace {

using testing::Bench;
using testing::PowerOn;
using testing::Talk;
using Wire = std::vector<std::uint8_t>;

constexpr Format fine{.bits = 21};

bool says(std::string_view text, std::string_view words) { return text.find(words) != std::string_view::npos; }

/// Answers each request by a function of it and of how many came before, instead of an encoder.
class Scripted final : public Machine<std::uint8_t> {
 public:
  using Script = std::function<Wire(Bytes request, unsigned before)>;
  explicit Scripted(Script script) : script_(std::move(script)) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::received)
      heard_.insert(heard_.end(), event.items.begin(), event.items.end());
    if (event.kind != Event<std::uint8_t>::Kind::silence || heard_.empty()) return;
    reply_ = script_(heard_, requests++);
    heard_.clear();
    pending_ = !reply_.empty();
  }
  Step<std::uint8_t> next(Time) override {
    if (!std::exchange(pending_, false)) return {.at = never, .gap = 2ms};
    return {.kind = Step<std::uint8_t>::Kind::transfer, .out = reply_};
  }

  unsigned requests = 0;

 private:
  Script script_;
  Wire heard_;
  Wire reply_;
  bool pending_ = false;
};

Wire framed(std::initializer_list<std::uint8_t> body) {
  modbus::FrameBytes frame;
  for (const std::uint8_t byte : body) frame.push_back(byte);
  modbus::append_crc(frame);
  return {frame.view().begin(), frame.view().end()};
}

template <class Conversation>
unsigned converse(Conversation& conversation, const Scripted::Script& script) {
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  Scripted scripted(script);
  line.attach(sim::Role::device, scripted);
  EXPECT_TRUE(line.run(line.attach(sim::Role::host, conversation), 60s));
  return scripted.requests;
}

// ---- Reading

TEST(Raa38ModbusHost, ReadsEveryResolutionAtEveryBaudRate) {
  for (std::size_t baud = 0; baud < bauds.size(); ++baud) {
    for (unsigned bits = 10; bits <= 21; ++bits) {
      Bench bench({.bits = bits, .baud = baud});
      const auto position = static_cast<std::uint32_t>(0x155555 & low_mask(bits));
      bench.put_shaft(position);
      Talk read(bench.format, "position");
      ASSERT_EQ(bench.run(read).error(), Error::none) << bits << " bits, " << bauds[baud] << " baud";
      EXPECT_EQ(read.reading()->singleturn, position);
      EXPECT_EQ(read.reading()->singleturn_bits, bits);
      EXPECT_TRUE(read.reading()->singleturn_valid());
      EXPECT_EQ(bench.encoder.violation_count(), 0u);
    }
  }
}

TEST(Raa38ModbusHost, ReadsEveryForm) {
  for (const Data data : {Data::four_bytes, Data::three_bytes, Data::three_as_four}) {
    for (const unsigned bits : {14u, 21u}) {
      Bench bench({.bits = bits, .registers = 2, .data = data});
      for (const std::int64_t position : {0, 1, 383, 0x3FFF}) {
        bench.put_shaft(position);
        Talk read(bench.format, "position");
        ASSERT_EQ(bench.run(read).error(), Error::none) << static_cast<int>(data) << " " << position;
        EXPECT_EQ(read.reading()->singleturn, static_cast<std::uint64_t>(position));
      }
      EXPECT_EQ(bench.encoder.violation_count(), 0u);
    }
  }
}

TEST(Raa38ModbusHost, OneRegisterDoesNotHold17Bits) {
  Talk read({.bits = 17, .registers = 1}, "position");
  EXPECT_EQ(read.next(Time{}).kind, Step<std::uint8_t>::Kind::done);
  EXPECT_EQ(read.error(), Error::invalid_argument);
  EXPECT_TRUE(says(read.detail(), "16 bits"));
  EXPECT_EQ(read.reading(), nullptr);
}

// One position in 256 has a CRC that ends with 00: without its last byte the frame is good as another form.
TEST(Raa38ModbusHost, AReplyThatLostItsLastByteIsNotAPosition) {
  Wire whole;
  std::uint32_t position = 0x100000;
  for (; whole.empty() || whole.back() != 0; ++position) {
    whole = framed({1, 3, 4, 0, static_cast<std::uint8_t>(position >> 16), static_cast<std::uint8_t>(position >> 8),
                    static_cast<std::uint8_t>(position)});
  }
  const std::uint32_t right = position - 1;
  const Wire cut(whole.begin(), whole.end() - 1);
  EXPECT_TRUE(decode_reply(fine, read_request(fine), cut)) << "the trap is there";

  Talk read(fine, "position");
  EXPECT_EQ(converse(read, [&](Bytes, unsigned before) { return before == 0 ? cut : whole; }), 2u);
  EXPECT_EQ(read.error(), Error::wrong_length);
  Talk moved(fine, "position");
  const Wire unambiguous = framed({1, 3, 4, 0, 0x1F, 0xAB, 0xCD});
  EXPECT_EQ(converse(moved, [&](Bytes, unsigned before) { return before == 0 ? cut : unambiguous; }), 2u);
  EXPECT_EQ(moved.error(), Error::none);
  EXPECT_EQ(moved.reading()->singleturn, 0x1FABCDu);
  Talk twice(fine, "position");
  EXPECT_EQ(converse(twice, [&](Bytes, unsigned) { return whole; }), 2u);
  EXPECT_EQ(twice.error(), Error::none);
  EXPECT_EQ(twice.reading()->singleturn, right);
}

TEST(Raa38ModbusHost, EachBadReplyHasItsWords) {
  struct Case {
    Wire reply;
    Error error;
    std::string_view found;
  };
  const Case cases[]{
      {{}, Error::timeout, "nobody answers"},
      {{0x01, 0x03, 0x02, 0x01, 0x7F, 0x34, 0xF8}, Error::bad_checksum, "low byte first"},
      {framed({1, 0x83, 2}), Error::request_rejected, "illegal data address"},
      {framed({2, 3, 2, 0, 1}), Error::unexpected_reply, "another address"},
      {framed({1, 4, 2, 0, 1}), Error::unexpected_reply, "another function"},
      {framed({1, 3, 2, 0x40, 0}), Error::out_of_range, "more bits"},
      {framed({1, 3, 4, 0, 0, 0, 1}), Error::wrong_length, "one register"},
      {{0x01}, Error::wrong_length, "one register"},
  };
  for (const Case& one : cases) {
    Talk read({}, "position");
    converse(read, [&](Bytes, unsigned) { return one.reply; });
    EXPECT_EQ(text_of(read.error()).name, text_of(one.error).name);
    EXPECT_TRUE(says(read.detail(), one.found)) << read.detail();
    EXPECT_EQ(read.reading(), nullptr);
  }
}

// A procedure confirms such a reply too.
TEST(Raa38ModbusHost, AProcedureDoesNotTrustAShortReplyEither) {
  modbus::FrameBytes followed;
  for (const std::uint8_t byte : framed({1, 3, 4, 0x00, 0x00, 0x05})) followed.push_back(byte);
  followed.push_back(0);
  const Wire whole(followed.view().begin(), followed.view().end());
  const Wire cut(whole.begin(), whole.end() - 1);
  Talk look(fine, "direction");
  EXPECT_EQ(converse(look, [&](Bytes, unsigned before) { return before == 0 ? cut : whole; }), 2u);
  EXPECT_EQ(look.error(), Error::wrong_length);
}

TEST(Raa38ModbusHost, ALineThatIsNeverSilentIsGivenUpAtOnce) {
  for (const std::string_view command : {"position", "address", "baud", "direction", "scan", "zero"}) {
    Talk talk({}, command);
    EXPECT_LT(raa38::testing::time_with_noise(talk), 1500ms) << command;
    EXPECT_EQ(talk.error(), Error::wrong_length);
    EXPECT_TRUE(says(talk.detail(), "without a pause")) << command << ": " << talk.detail();
  }
}

// ---- What is asked of the encoder beside its position

struct Collector final : FieldSink {
  void put(const FieldValue& value) override {
    text += std::string(value.info->name) + "=" +
            (value.bytes.empty() ? std::to_string(value.number) : std::string(value.bytes.begin(), value.bytes.end())) +
            " ";
  }
  std::string text;
};

std::string report(const Conversation<std::uint8_t>& conversation) {
  Collector collector;
  conversation.report(collector);
  return collector.text;
}

bool written(const Talk& talk) { return says(report(talk), "written=1"); }

TEST(Raa38ModbusHost, TheAddressIsAskedOfWhoeverIsThere) {
  Bench bench({.address = 42});
  Talk read({}, "address");
  EXPECT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(report(read), "address=42 ");
  VirtualEncoder other({.address = 200}, bench.shaft);
  bench.put_on_line(other);
  Talk named({.address = 200}, "address");
  EXPECT_EQ(bench.run(named).error(), Error::none);
  EXPECT_EQ(report(named), "address=200 ");
  Talk nobody({.address = 7}, "address");
  EXPECT_EQ(bench.run(nobody).error(), Error::timeout);
  EXPECT_EQ(report(nobody), "");
}

TEST(Raa38ModbusHost, TheBaudRateIsFound) {
  for (std::size_t set = 0; set < bauds.size(); ++set) {
    for (std::size_t told = 0; told < bauds.size(); ++told) {
      Bench bench({.baud = told});
      bench.encoder.memory()[1] = static_cast<std::uint8_t>(set);
      bench.encoder.power_on(bench.line.now(), PowerOn::skip);
      bench.line.wake(0);
      ASSERT_EQ(bench.encoder.baud(), bauds[set]);
      Talk find({.baud = told}, "baud");
      EXPECT_EQ(bench.run(find).error(), Error::none) << bauds[set] << " told " << bauds[told];
      EXPECT_EQ(report(find), "baud=" + std::to_string(bauds[set]) + " ");
    }
  }
  Bench bench;
  Talk nobody({.address = 2}, "baud");
  EXPECT_EQ(bench.run(nobody).error(), Error::timeout);
  EXPECT_TRUE(says(nobody.detail(), "any of the five"));
  Talk as_before({}, "position");
  EXPECT_EQ(bench.run(as_before).error(), Error::none) << "the line is as it was";
}

TEST(Raa38ModbusHost, ScanFindsASingleOneByAskingAll) {
  Bench bench({.address = 99});
  Talk scan({}, "scan", {1, 247});
  const Time start = bench.line.now();
  EXPECT_EQ(bench.run(scan).error(), Error::none);
  EXPECT_EQ(report(scan), "encoder_address=99 clash=0 ");
  EXPECT_LT(bench.line.now() - start, 200ms);
}

TEST(Raa38ModbusHost, ScanAsksEveryAddressOfALine) {
  Bench bench({.address = 3});
  VirtualEncoder same({.address = 20, .bits = 15}, bench.shaft);
  VirtualEncoder as_same({.address = 20, .bits = 14}, bench.shaft);
  VirtualEncoder last({.address = 247}, bench.shaft);
  VirtualEncoder other_kind({.address = 100, .bits = 18}, bench.shaft);
  for (VirtualEncoder* another : {&same, &as_same, &last, &other_kind}) bench.put_on_line(*another);
  bench.put_shaft(0x1234);
  Talk scan({}, "scan", {1, 247});
  EXPECT_EQ(bench.run(scan).error(), Error::none);
  EXPECT_EQ(report(scan),
            "encoder_address=3 clash=0 encoder_address=20 clash=1 encoder_address=100 clash=0 refuses=1 "
            "encoder_address=247 clash=0 ");
  Talk part({}, "scan", {3, 19});
  bench.run(part);
  EXPECT_EQ(report(part), "encoder_address=3 clash=0 ");
  Talk empty({}, "scan", {4, 19});
  EXPECT_EQ(bench.run(empty).error(), Error::timeout);
  Talk turned({}, "scan", {5, 4});
  EXPECT_EQ(turned.error(), Error::invalid_argument);
}

TEST(Raa38ModbusHost, ScanAsksADamagedAnswerAgain) {
  for (const unsigned damaged : {2u, 3u}) {
    Talk scan({}, "scan", {5, 5});
    converse(scan, [&](Bytes request, unsigned before) {
      if (request[0] != 5) return Wire{};
      return before <= damaged ? Wire{5, 3, 2, 0, 9, 0, 0} : framed({5, 3, 2, 0, 9});
    });
    EXPECT_EQ(report(scan), damaged == 2 ? "encoder_address=5 clash=0 " : "encoder_address=5 clash=1 ");
  }
}

// ---- Settings

TEST(Raa38ModbusSettings, AnAddressIsSetAndAsked) {
  Bench bench;
  Talk set({}, "set-address", {5});
  EXPECT_EQ(bench.run(set).error(), Error::none);
  EXPECT_EQ(report(set), "address=5 written=1 ");
  EXPECT_EQ(bench.encoder.address(), 5);
  Talk again({.address = 5}, "set-address", {5});
  EXPECT_EQ(bench.run(again).error(), Error::none);
  EXPECT_EQ(report(again), "address=5 written=0 ");
  EXPECT_EQ(bench.encoder.writes(), 1u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
  Talk forced({.address = 5}, "set-address", {5, 1});
  EXPECT_EQ(bench.run(forced).error(), Error::none);
  EXPECT_EQ(bench.encoder.writes(), 2u);
  EXPECT_EQ(bench.encoder.violation_count(), 1u);
}

TEST(Raa38ModbusSettings, AnAddressThatIsTakenIsRefused) {
  Bench bench;
  VirtualEncoder other({.address = 2}, bench.shaft);
  bench.put_on_line(other);
  Talk set({}, "set-address", {2});
  EXPECT_EQ(bench.run(set).error(), Error::invalid_argument);
  EXPECT_TRUE(says(set.detail(), "already"));
  EXPECT_EQ(bench.encoder.writes() + other.writes(), 0u);
}

const Wire position_of_1 = framed({1, 3, 2, 0, 9});

TEST(Raa38ModbusSettings, AnEncoderThatDoesNotTakeASettingIsFoundOut) {
  const auto deaf_to_settings = [](Bytes request, unsigned) {
    if (request[1] == function::read) return request[0] == 1 ? position_of_1 : Wire{};
    if (request[1] == function::set_address) return framed({request[2], request[1]});
    return Wire(request.begin(), request.end());
  };
  Talk address({}, "set-address", {2});
  converse(address, deaf_to_settings);
  EXPECT_EQ(address.error(), Error::cross_check_failed);
  EXPECT_TRUE(says(address.detail(), "old address"));
  Talk baud({}, "set-baud", {9600});
  converse(baud, deaf_to_settings);
  EXPECT_EQ(baud.error(), Error::cross_check_failed);
  EXPECT_TRUE(says(baud.detail(), "old baud rate"));
  Talk zero({}, "zero", {1});
  converse(zero, [&](Bytes request, unsigned before) {
    return request[1] == function::read ? framed({1, 3, 2, 0x10, 0}) : deaf_to_settings(request, before);
  });
  EXPECT_EQ(zero.error(), Error::cross_check_failed);
  EXPECT_EQ(report(address) + report(baud) + report(zero), "");
}

TEST(Raa38ModbusSettings, ASettingIsSentOnceWhateverComes) {
  for (const std::uint8_t code : {function::set_address, function::set_parameter}) {
    unsigned sent = 0;
    const auto dies = [&](Bytes request, unsigned) {
      if (request[1] == code) ++sent;
      return sent == 0 && request[0] == 1 && request[1] == function::read ? position_of_1 : Wire{};
    };
    Talk address({}, "set-address", {2});
    Talk baud({}, "set-baud", {57'600});
    if (code == function::set_address) {
      converse(address, dies);
      EXPECT_EQ(address.error(), Error::timeout);
      EXPECT_TRUE(says(address.detail(), "neither as before"));
    } else {
      converse(baud, dies);
      EXPECT_EQ(baud.error(), Error::timeout);
      EXPECT_TRUE(says(baud.detail(), "neither as before"));
    }
    EXPECT_EQ(sent, 1u);
  }
}

TEST(Raa38ModbusSettings, AnAddressWhereSomethingIsDamagedIsTaken) {
  unsigned sent = 0;
  Talk set({}, "set-address", {2});
  converse(set, [&](Bytes request, unsigned) {
    if (request[1] != function::read) ++sent;
    return request[0] == 1 ? position_of_1 : Wire{2, 3, 2, 0, 9, 0, 0};
  });
  EXPECT_EQ(set.error(), Error::invalid_argument);
  EXPECT_TRUE(says(set.detail(), "though not well"));
  EXPECT_EQ(sent, 0u);
}

TEST(Raa38ModbusSettings, ARefusalIsNotAskedForAgain) {
  Talk set({}, "set-address", {2});
  EXPECT_EQ(converse(set, [](Bytes, unsigned) { return framed({1, 0x83, 2}); }), 1u);
  EXPECT_EQ(set.error(), Error::request_rejected);
}

TEST(Raa38ModbusSettings, ARefusedAddressIsToldInWords) {
  Talk set({}, "set-address", {2});
  converse(set, [](Bytes request, unsigned) {
    if (request[1] == function::set_address) return framed({1, 0xA1, 1});
    return request[0] == 1 ? position_of_1 : Wire{};
  });
  EXPECT_EQ(set.error(), Error::request_rejected);
  EXPECT_TRUE(says(set.detail(), "illegal function"));
}

TEST(Raa38ModbusSettings, ALostReplyIsNoLostSetting) {
  Bench bench;
  Talk set({}, "set-address", {2});
  bool lost = false;
  sim::Line<std::uint8_t> line{LinkKind::half_duplex, line_settings};
  std::uint8_t address = 1;
  converse(set, [&](Bytes request, unsigned) -> Wire {
    if (request[1] == function::set_address) {
      address = request[2];
      lost = true;
      return {};
    }
    return request[0] == address ? framed({address, 3, 2, 0, 9}) : Wire{};
  });
  EXPECT_TRUE(lost);
  EXPECT_EQ(set.error(), Error::none);
}

TEST(Raa38ModbusSettings, ABaudRateIsFollowed) {
  for (std::size_t from = 0; from < bauds.size(); ++from) {
    for (std::size_t to = 0; to < bauds.size(); ++to) {
      Bench bench({.baud = from});
      Talk set({.baud = from}, "set-baud", {bauds[to]});
      EXPECT_EQ(bench.run(set).error(), Error::none) << bauds[from] << " to " << bauds[to];
      EXPECT_EQ(written(set), from != to);
      EXPECT_EQ(bench.encoder.baud(), bauds[to]);
      Talk read({.baud = to}, "position");
      EXPECT_EQ(bench.run(read).error(), Error::none) << "the line goes on at the new rate";
      EXPECT_EQ(bench.encoder.violation_count(), 0u);
    }
  }
  Talk unknown({}, "set-baud", {38'400});
  EXPECT_EQ(unknown.error(), Error::invalid_argument);
  EXPECT_TRUE(says(unknown.advice(), "57600"));
}

TEST(Raa38ModbusSettings, APortThatCannotChangeItsRateSaysSoBeforeTheEncoderDoes) {
  Talk set({}, "set-baud", {9600});
  EXPECT_EQ(set.next(Time{}).kind, Step<std::uint8_t>::Kind::configure);
}

TEST(Raa38ModbusSettings, ADirectionShowsInThePosition) {
  Bench bench;
  bench.put_shaft(383);
  Talk backwards({}, "set-direction", {parameter::negative});
  EXPECT_EQ(bench.run(backwards).error(), Error::none);
  EXPECT_TRUE(says(report(backwards), "direction has changed")) << report(backwards);
  EXPECT_TRUE(bench.encoder.counts_backwards());
  Talk once_more({}, "set-direction", {parameter::negative});
  EXPECT_EQ(bench.run(once_more).error(), Error::none);
  EXPECT_TRUE(says(report(once_more), "counted so already"));
  bench.shaft.spin(60, bench.line.now());
  Talk turning({}, "set-direction", {parameter::positive});
  EXPECT_EQ(bench.run(turning).error(), Error::none);
  EXPECT_TRUE(says(report(turning), "neither")) << report(turning);
  Talk read({}, "direction");
  EXPECT_EQ(bench.run(read).error(), Error::none);
  EXPECT_TRUE(says(report(read), "does not tell"));
}

TEST(Raa38ModbusSettings, ADirectionWithoutItsEchoIsNotKnown) {
  Talk set({}, "set-direction", {parameter::positive});
  converse(set, [](Bytes request, unsigned) { return request[1] == function::read ? position_of_1 : Wire{}; });
  EXPECT_EQ(set.error(), Error::timeout);
  EXPECT_TRUE(says(set.detail(), "nothing else tells"));
}

TEST(Raa38ModbusSettings, ZeroIsHere) {
  Bench bench;
  bench.put_shaft(5000);
  Talk zero({}, "zero");
  EXPECT_EQ(bench.run(zero).error(), Error::none);
  EXPECT_EQ(zero.reading()->singleturn, 0u);
  EXPECT_TRUE(written(zero));
  Talk again({}, "zero");
  EXPECT_EQ(bench.run(again).error(), Error::none);
  EXPECT_FALSE(written(again));
  EXPECT_EQ(bench.encoder.writes(), 1u);
  bench.shaft.spin(60, bench.line.now());
  Talk turning({}, "zero");
  EXPECT_EQ(bench.run(turning).error(), Error::invalid_argument);
  EXPECT_TRUE(says(turning.detail(), "turning"));
  EXPECT_EQ(bench.encoder.writes(), 1u);
  EXPECT_EQ(bench.encoder.violation_count(), 0u);
}

TEST(Raa38ModbusSettings, NothingIsSentToAnEncoderThatIsNotThere) {
  Bench bench({.address = 9});
  Talk address({}, "set-address", {2});
  Talk baud({}, "set-baud", {9600});
  Talk direction({}, "set-direction", {parameter::positive});
  Talk zero({}, "zero");
  EXPECT_EQ(bench.run(address).error(), Error::timeout);
  EXPECT_EQ(bench.run(baud).error(), Error::timeout);
  EXPECT_EQ(bench.run(direction).error(), Error::timeout);
  EXPECT_EQ(bench.run(zero).error(), Error::timeout);
  EXPECT_EQ(bench.encoder.writes(), 0u);
}

}  // namespace
}  // namespace absenc::raa38::rtu
