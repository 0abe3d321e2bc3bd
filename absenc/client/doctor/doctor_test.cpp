// SPDX-License-Identifier: Apache-2.0
// Checks that doctor names each fault.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "absenc/client/doctor/adapter_faults_test.hpp"
#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/doctor/lines_test.hpp"
#include "absenc/client/doctor/observed_test.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/error.hpp"
#include "absenc/core/crc.hpp"

namespace absenc::client {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

namespace {

// ---- Functions that examine an encoder or a line

/// Examines the encoder with the address `text` over the links that `open` returns.
Examination examine_with(std::string_view text, const std::function<Link(const EncoderAddress&)>& open,
                         const os::PortFacts& facts = {}) {
  const Surroundings surroundings{open, [&](const std::string&) { return facts; }};
  return examine(parse_address(text), {.readings = 120, .limit = 20s}, surroundings);
}

/// Examines a line on which the function `answer` returns the reply to each request.
Examination examine_line(std::function<ByteList(const ByteList&)> answer, ByteList babble = {},
                         const os::PortFacts& facts = {}) {
  return examine_with(
      serial,
      [&](const EncoderAddress&) {
        auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
        port->answer = answer;
        port->babble = babble;
        return link_to(std::move(port));
      },
      facts);
}

/// Examines the virtual encoder of an address, in virtual time.
Examination examine_sim(std::string_view text) {
  return examine_with(text, [](const EncoderAddress& address) { return virtual_link(address); });
}

Link refused(os::Failure::Kind kind, os::Failure::Bus bus = os::Failure::Bus::unknown) {
  throw os::Failure(kind, "the port is not to be had", bus);
}

// ---- Each finding, with the fault that causes it

std::vector<Fault> port_faults() {
  using Kind = os::Failure::Kind;
  std::vector<Fault> faults;
  const std::vector<std::pair<std::string, Kind>> kinds{
      {"port_missing", Kind::not_found},      {"port_forbidden", Kind::no_permission}, {"port_in_use", Kind::in_use},
      {"port_unsuitable", Kind::unsupported}, {"port_rate", Kind::bad_rate},           {"port_lost", Kind::lost},
      {"port_failed", Kind::system}};
  for (const auto& [id, kind] : kinds) {
    faults.push_back(
        {id, [kind = kind] { return examine_with(serial, [kind](const EncoderAddress&) { return refused(kind); }); }});
  }
  faults.push_back({"port_is_modem", [] {
                      return examine_line([](const ByteList&) { return ByteList{}; }, {}, {.driver = "option1"});
                    }});
  faults.push_back({"latency_timer", [] {
                      return examine_line([](const ByteList&) { return good_reply(); }, {}, {.latency_timer = 16});
                    }});
  faults.push_back({"direction_unswitched", [] {
                      return examine_line([](const ByteList&) { return ByteList{}; }, {}, {.driver = "serial8250"});
                    }});
  using Bus = os::Failure::Bus;
  faults.push_back({"can_bus_off", [] {
                      return examine_with("raa38-can:can0",
                                          [](const EncoderAddress&) { return refused(Kind::lost, Bus::off); });
                    }});
  faults.push_back({"can_not_acknowledged", [] {
                      return examine_with("raa38-can:can0", [](const EncoderAddress&) {
                        return refused(Kind::lost, Bus::not_acknowledged);
                      });
                    }});
  faults.push_back({"can_errors", [] {
                      return examine_with("raa38-can:can0", [](const EncoderAddress&) {
                        const auto port = std::make_shared<ScriptedPort<CanFrame>>();
                        port->destroys = true;
                        Link link;
                        link.frames = port.get();
                        link.owner = port;
                        return link;
                      });
                    }});
  return faults;
}

/// Examines a line on which an encoder replies at one baud rate and is silent at all others.
Examination examine_rate(std::string_view text, std::uint32_t rate) {
  return examine_with(text, [rate](const EncoderAddress& address) {
    auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
    if (address.line.rate == rate) port->answer = [](const ByteList&) { return good_reply(); };
    return link_to(std::move(port));
  });
}

Examination examine_spi(const std::function<bool(const EncoderAddress&)>& understands) {
  return examine_with("encolink-spi:spi:/dev/spidev0.0", [understands](const EncoderAddress& address) {
    if (understands(address)) return virtual_link(address);
    auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
    port->answer = [](const ByteList& out) { return ByteList(std::max<std::size_t>(out.size(), 16), 0xA5); };
    return link_to(std::move(port));
  });
}

// Examines a line that stays at the level of rest. `driven`: whether something drives the port's data pin, nothing if
// the port cannot tell.
Examination examine_ones(std::string_view text, std::optional<bool> driven) {
  return examine_with(text, [driven](const EncoderAddress& address) {
    auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
    const std::size_t least = address.unit->link == LinkKind::spi ? 16 : 64;  // all that one reading clocks
    port->answer = [least](const ByteList& out) { return ByteList(std::max(out.size(), least), 0xFF); };
    Link link = link_to(std::move(port));
    if (driven) link.is_data_driven = [driven] { return *driven; };
    return link;
  });
}

std::vector<Fault> line_faults() {
  std::vector<Fault> faults;
  faults.push_back({"never_silent", [] {
                      return examine_line([](const ByteList&) { return ByteList{}; }, {0x55, 0x12});
                    }});
  faults.push_back({"line_inverted", [] { return examine_line([](const ByteList&) { return ByteList(9, 0); }); }});
  faults.push_back({"line_inverted", [] { return examine_line([](const ByteList&) { return ByteList{}; }, {0x00}); }});
  faults.push_back({"wrong_baud", [] { return examine_rate("tformat:/dev/ttyABSENC?baud=2000000", 2'500'000); }});
  faults.push_back({"wrong_baud", [] { return examine_rate(serial, 9'600); }});
  faults.push_back({"wrong_spi_mode",
                    [] { return examine_spi([](const EncoderAddress& address) { return address.spi.mode == 2; }); }});
  faults.push_back({"clock_too_fast", [] {
                      return examine_spi([](const EncoderAddress& address) {
                        return address.spi.speed.value_or(address.line.rate) <= address.line.rate / 4;
                      });
                    }});
  for (const std::string_view unit : {"encolink-spi:ftdi", "biss:ftdi", "ssi:ftdi"}) {
    faults.push_back({"transceiver_missing", [unit] { return examine_ones(unit, false); }});
  }
  faults.push_back({"data_at_rest", [] { return examine_ones("ssi:ftdi", true); }});
  faults.push_back({"data_at_rest", [] { return examine_ones("ssi:spi:/dev/spidev0.0", {}); }});
  faults.push_back({"clock_range", [] {
                      return examine_with("biss:ftdi", [](const EncoderAddress&) {
                        return virtual_link(parse_address("sim:biss?singleturn=1234"));
                      });
                    }});
  faults.push_back({"miso_stuck", [] { return examine_ones("encolink-spi:spi:/dev/spidev0.0", {}); }});
  faults.push_back({"miso_stuck", [] { return examine_ones("biss:ftdi", true); }});
  faults.push_back({"wrong_echo", [] { return examine_sim("sim:tformat?echo=off&fault=echo=1"); }});
  faults.push_back({"only_echo", [] { return examine_line([](const ByteList& sent) { return sent; }); }});
  faults.push_back({"modem_answers", [] {
                      return examine_line([](const ByteList& sent) {
                        ByteList text = sent;
                        for (const char letter : std::string_view("\r\nERROR\r\n"))
                          text.push_back(static_cast<std::uint8_t>(letter));
                        return text;
                      });
                    }});
  faults.push_back({"no_answer", [] { return examine_line([](const ByteList&) { return ByteList{}; }); }});
  faults.push_back({"baud_pattern", [] {
                      return examine_line(
                          [](const ByteList&) { return ByteList{0xF0, 0xFF, 0x00, 0xC0, 0xFE, 0x80, 0xFF}; });
                    }});
  return faults;
}

ByteList with_other_checksum(unsigned number) {
  ByteList reply = good_reply();
  for (std::size_t i = 2; i < 5; ++i) reply[i] = static_cast<std::uint8_t>(number * (37 + 11 * i) + number * number);
  reply[4] &= 0x01;
  reply.pop_back();
  constexpr CrcParameters crc{.width = 8, .poly = 0x07, .init = 0, .refin = false, .refout = false, .xorout = 0x5A};
  reply.push_back(static_cast<std::uint8_t>(crc_bitwise(crc, reply)));
  return reply;
}

std::vector<Fault> frame_faults() {
  std::vector<Fault> faults;
  faults.push_back({"two_answer", [] { return examine_sim("sim:tformat?fault=repeat=1"); }});
  faults.push_back({"same_address", [] {
                      Observations seen;
                      seen.clash = "address 3";
                      seen.readings.push_back({.error = Error::bad_checksum, .raw = {1, 2}, .heard = true});
                      return judged(seen);
                    }});
  faults.push_back({"wrong_settings", [] {
                      return examine_with(serial, [](const EncoderAddress&) {
                        return virtual_link(parse_address("sim:tformat?model=23-bit&motion=rpm=600"));
                      });
                    }});
  faults.push_back(
      {"other_checksum",
       [] { return examine_line([number = 0u](const ByteList&) mutable { return with_other_checksum(++number); }); }});
  faults.push_back({"always_damaged", [] {
                      return examine_line([random = std::mt19937(7)](const ByteList&) mutable {
                        ByteList reply = good_reply();
                        for (std::uint8_t& byte : reply) byte = static_cast<std::uint8_t>(random());
                        return reply;
                      });
                    }});
  faults.push_back({"damaged_bits", [] { return examine_sim("sim:tformat?fault=corrupt=0.1"); }});
  faults.push_back({"damaged_bursts", [] { return examine_sim("sim:tformat?fault=drop=0.1"); }});
  faults.push_back({"sometimes_damaged", [] { return examine_sim("sim:tformat?fault=corrupt=0.1&motion=rpm=60"); }});
  faults.push_back({"sometimes_silent", [] { return examine_sim("sim:tformat?fault=silence=0.2"); }});
  faults.push_back({"refused", [] {
                      Observations seen;
                      for (int i = 0; i < 5; ++i)
                        seen.readings.push_back({.error = Error::busy, .raw = {1}, .heard = true});
                      return judged(seen);
                    }});
  return faults;
}

Observations starting() {
  Observations seen = positions([](std::size_t) { return 5; });
  for (std::size_t i = 0; i < 20; ++i) seen.readings[i].reading->ready = false;
  return seen;
}

std::vector<Fault> other_faults() {
  std::vector<Fault> faults;
  faults.push_back({"reply_late", [] { return examine_sim("sim:tformat?fault=delay=1"); }});
  faults.push_back({"reply_slow", [] {
                      return examine_with(serial, [](const EncoderAddress&) {
                        auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
                        port->answer = [](const ByteList&) { return good_reply(); };
                        port->after = 16ms;
                        port->latency = 30ms;
                        return link_to(std::move(port));
                      });
                    }});
  faults.push_back({"starting", [] { return judged(starting()); }});
  faults.push_back({"alarm", [] { return examine_sim("sim:tformat?alarm=battery_alarm"); }});
  faults.push_back(
      {"position_noise",
       [] { return judged(positions([random = std::mt19937(3)](std::size_t) mutable { return random() % 60; })); }});
  faults.push_back(
      {"position_jumps", [] { return judged(positions([](std::size_t i) { return i == 70 ? 60'000u : 100u; })); }});
  faults.push_back(
      {"stuck_bits",
       [] { return judged(positions([](std::size_t i) { return (i * i * 3 + i * 7) & ~std::uint64_t{0x10}; })); }});
  faults.push_back({"position_frozen", [] {
                      return judged(turned_by_hand([](std::size_t) { return 77; }, [](std::size_t) { return 3; }));
                    }});
  faults.push_back({"turns_stand", [] {
                      return judged(
                          turned_by_hand([](std::size_t i) { return i * hand_counts; }, [](std::size_t) { return 3; }));
                    }});
  faults.push_back({"turns_jump", [] {
                      return judged(turned_by_hand([](std::size_t i) { return i * hand_counts; },
                                                   [](std::size_t i) { return static_cast<std::int64_t>(i / 10); }));
                    }});
  faults.push_back({"few_readings", [] {
                      Observations seen = positions([](std::size_t) { return 5; });
                      seen.readings.resize(3);
                      return judged(seen);
                    }});
  faults.push_back({"comes_and_goes", [] { return examine_contact(4s, [](Time at) { return at % 1s < 300ms; }); }});
  return faults;
}

std::vector<Fault> partial_faults() {
  std::vector<Fault> faults;
  faults.push_back({"extra_bytes", [] {
                      return examine_line([number = 0u](const ByteList&) mutable {
                        ByteList reply = good_reply();
                        reply.insert(reply.begin(), 3 + number++ % 3, 0x55);
                        return reply;
                      });
                    }});
  faults.push_back({"bytes_missing", [] {
                      return examine_line([](const ByteList&) {
                        ByteList reply = good_reply();
                        reply.resize(reply.size() - 3);
                        return reply;
                      });
                    }});
  faults.push_back({"contradictory", [] {
                      Observations seen;
                      for (int i = 0; i < 5; ++i) {
                        seen.readings.push_back({.error = Error::cross_check_failed, .raw = {1}, .heard = true});
                      }
                      return judged(seen);
                    }});
  faults.push_back({"requests_damaged", [] {
                      Observations seen = positions([](std::size_t) { return 5; });
                      for (int i = 0; i < 5; ++i) {
                        seen.readings.push_back({.error = Error::request_rejected, .raw = {1}, .heard = true});
                      }
                      return judged(seen);
                    }});
  faults.push_back({"counter_stands", [] {
                      static const FieldInfo counter{"sequence", FieldInfo::Kind::number, "", "counts the replies"};
                      Observations seen = positions([](std::size_t) { return 5; });
                      for (Attempted& one : seen.readings) {
                        one.counter = 7;
                        one.counter_field = &counter;
                      }
                      return judged(seen);
                    }});
  faults.push_back({"sometimes_late", [] {
                      Observations seen = positions([](std::size_t) { return 5; });
                      seen.late = 3;
                      seen.lateness = 20ms;
                      return judged(seen);
                    }});
  faults.push_back({"status", [] {
                      Observations seen = positions([](std::size_t) { return 5; });
                      for (Attempted& one : seen.readings) one.reading->status = one.reading->status_reported = 1U << 6;
                      return judged(seen);
                    }});
  faults.push_back({"position_invalid", [] {
                      Observations seen = positions([](std::size_t) { return 5; });
                      for (Attempted& one : seen.readings) one.reading->singleturn_valid_bits = 0;
                      return judged(seen);
                    }});
  return faults;
}

std::vector<Fault> all_faults() {
  std::vector<Fault> faults;
  for (const auto& some :
       {port_faults(), line_faults(), frame_faults(), partial_faults(), other_faults(), adapter_faults()}) {
    faults.insert(faults.end(), some.begin(), some.end());
  }
  return faults;
}

}  // namespace

TEST(Doctor, EachFaultIsNamedRightAndFirst) {
  std::set<std::string> named;
  for (const Fault& fault : all_faults()) {
    const Examination examination = fault.examine();
    EXPECT_EQ(ids(examination), std::vector{fault.id}) << examination.verdict();
    if (!examination.findings.empty()) {
      const Finding& found = examination.findings.front();
      EXPECT_THAT(found.sentence(), AllOf(HasSubstr(fault.id + ": "), HasSubstr("Likely: "), HasSubstr("Try: ")));
      EXPECT_EQ(examination.healthy(), found.severity == Severity::note);
      const std::string verdict = "first: " + fault.id + ": " + found.action;
      EXPECT_EQ(examination.verdict() == verdict, found.severity != Severity::note) << examination.verdict();
    }
    named.insert(fault.id);
  }
  for (std::size_t i = 0; i <= static_cast<std::size_t>(FindingKind::few_readings); ++i) {
    EXPECT_TRUE(named.contains(std::string(id_of(static_cast<FindingKind>(i))))) << id_of(static_cast<FindingKind>(i));
  }
}

TEST(Doctor, FindingsSayWhatHelps) {
  EXPECT_EQ(examine_rate(serial, 9'600).findings.at(0).action, "set baud=9600");
  EXPECT_THAT(examine_rate(serial, 9'600).findings.at(0).evidence, HasSubstr("10 of 10 with baud=9600"));
  const Examination other = examine_with(serial, [](const EncoderAddress&) {
    return virtual_link(parse_address("sim:tformat?model=23-bit&motion=rpm=600"));
  });
  EXPECT_EQ(other.findings.at(0).action, "set model=23-bit");
  const Examination alarm = examine_sim("sim:tformat?alarm=battery_alarm");
  EXPECT_THAT(alarm.findings.at(0).evidence, HasSubstr("battery_alarm"));
  EXPECT_THAT(alarm.findings.at(0).action, HasSubstr("replace the battery"));
  EXPECT_THAT(judged(starting()).findings.at(0).evidence, HasSubstr("20 of 200"));
  const Examination bits = examine_sim("sim:tformat?fault=corrupt=0.1");
  EXPECT_THAT(bits.findings.at(0).evidence, HasSubstr("bad_checksum"));
}

TEST(Doctor, TakesTheUnitsExplanationThatMostRepliesHave) {
  const auto examined = [](std::string_view host, const std::string& encoder) {
    return examine_with(host, [&encoder](const EncoderAddress&) { return virtual_link(parse_address(encoder)); });
  };
  const std::string fast = "?singleturn_bits=25&clock_khz=8000";
  const Examination delayed =
      examined("endat:ftdi" + fast + "&latency_us=4", "sim:endat" + fast + "&line_delay_ns=1000");
  ASSERT_EQ(ids(delayed), std::vector<std::string>{"always_damaged"});
  EXPECT_THAT(delayed.findings.at(0).cause, HasSubstr("start bit came so late"));
  EXPECT_THAT(delayed.findings.at(0).action, HasSubstr("line-delay"));
  // The clock is so fast that the host has stopped it before the position is calculated.
  const std::string fastest = "?singleturn_bits=13&version=2.2&clock_khz=16000&latency_us=";
  const Examination hasty = examined("endat:ftdi" + fastest + "1", "sim:endat" + fastest + "20");
  ASSERT_EQ(ids(hasty), std::vector<std::string>{"miso_stuck"}) << hasty.findings.at(0).sentence();
  EXPECT_THAT(hasty.findings.at(0).cause, HasSubstr("no start bit came"));
  EXPECT_THAT(hasty.findings.at(0).action, HasSubstr("latency_us"));
}

// A host of EnDat repeats a damaged position at once, so each reading is good.
TEST(Doctor, RepeatedRequestsOnALineThatTurnsAreFindings) {
  const std::vector<std::pair<std::string, std::string>> faults{{"corrupt", "damaged_bits"},
                                                                {"echo", "damaged_bursts"},
                                                                {"garbage", "damaged_bursts"},
                                                                {"silence", "sometimes_silent"},
                                                                {"request_corrupt", "sometimes_silent"}};
  for (const std::string model : {"asked", "ECN-1325", "EQN-1337", "ECN-1313"}) {
    for (const auto& [fault, found] : faults) {
      const Examination examination =
          examine_sim("sim:endat?model=" + model + "&singleturn=1383&fault=" + fault + "=0.1");
      EXPECT_THAT(ids(examination), Contains(found)) << model << ' ' << fault << ": " << examination.verdict();
    }
  }
}

TEST(Doctor, PositionsOfAnAskedResolutionAreNotDamaged) {
  const Examination examination = examine_with("endat:ftdi", [](const EncoderAddress&) {
    return virtual_link(parse_address("sim:endat?model=EQN-1337&singleturn=1383&alarm=light_source"));
  });
  EXPECT_EQ(ids(examination), (std::vector<std::string>{"clock_range", "alarm", "alarm"})) << examination.verdict();
}

TEST(Doctor, EndsAsSoonAsItIsToldTo) {
  for (const bool answers : {true, false}) {
    const auto open = [&](const EncoderAddress&) {
      auto port = std::make_shared<ScriptedPort<std::uint8_t>>();
      port->answer = [&](const ByteList&) { return answers ? good_reply() : ByteList{}; };
      return link_to(std::move(port));
    };
    const Surroundings surroundings{open, [](const std::string&) { return os::PortFacts{}; }};
    for (const unsigned when : {0u, 1u, 3u, 10u, 60u}) {
      unsigned asked = 0;
      DoctorChoices choices{.readings = 120, .limit = 20s};
      choices.over = [&] { return asked++ >= when; };
      EXPECT_THROW(static_cast<void>(examine(parse_address(serial), choices, surroundings)), Cancelled) << when;
      EXPECT_LE(asked, when + 2) << "it goes on";
    }
  }
}

}  // namespace absenc::client
