// SPDX-License-Identifier: Apache-2.0
// Checks that doctor's advice fits the kind of port.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <set>

#include "absenc/client/doctor/observed_test.hpp"
#include "absenc/client/doctor/words.hpp"

namespace absenc::client {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Ids of findings that only a serial port can have.
const std::set<std::string_view> of_serial_ports{"port_is_modem", "latency_timer", "direction_unswitched"};

std::string advice_of(FindingKind finding_kind, PortKind place) {
  Finding one = finding(finding_kind, {"", "", "", "", "", ""});
  suit(one, place);
  return one.cause + " " + one.action;
}

TEST(DoctorAdvice, NamesNothingThatThePlaceHasNot) {
  for (const PortKind place : {PortKind::tcp, PortKind::spi, PortKind::can, PortKind::sim}) {
    for (std::size_t i = 0; i <= static_cast<std::size_t>(FindingKind::few_readings); ++i) {
      const auto finding_kind = static_cast<FindingKind>(i);
      const std::string_view id = id_of(finding_kind);
      if (of_serial_ports.contains(id)) continue;
      if (place == PortKind::sim && (id.starts_with("port_") || id == "modem_answers"))
        continue;  // doctor cannot have these findings here: a simulated port always opens, and has no modem
      const std::string advice = advice_of(finding_kind, place);
      for (const char* word : {"USB", "latency timer", "ModemManager", "/dev/serial"}) {
        EXPECT_THAT(advice, Not(HasSubstr(word))) << id << " at " << port_kind_names[static_cast<std::size_t>(place)];
      }
    }
  }
}

TEST(DoctorAdvice, ProposesALatencyOnlyWhereItCanBeSet) {
  for (const FindingKind finding_kind : {FindingKind::reply_late, FindingKind::sometimes_late,
                                         FindingKind::sometimes_silent, FindingKind::few_readings}) {
    EXPECT_THAT(advice_of(finding_kind, PortKind::serial), HasSubstr("latency="));
    EXPECT_THAT(advice_of(finding_kind, PortKind::tcp), HasSubstr("latency="));
    EXPECT_THAT(advice_of(finding_kind, PortKind::sim), Not(HasSubstr("latency=")));
    EXPECT_THAT(advice_of(finding_kind, PortKind::spi), Not(HasSubstr("latency=")));
  }
}

TEST(DoctorAdvice, OfAPortInUseFitsWhoHasIt) {
  using Holder = os::Failure::Holder;
  const auto action = [](Holder holder) {
    Observations seen;
    seen.refusal = Refusal{.kind = os::Failure::Kind::in_use, .sentence = "the port X is in use", .holder = holder};
    return judged(seen).findings.at(0).action;
  };
  EXPECT_THAT(action(Holder::modem_manager), HasSubstr("systemctl stop ModemManager"));
  EXPECT_THAT(action(Holder::server), Not(HasSubstr("end")));
  for (const Holder holder : {Holder::server, Holder::absenc, Holder::program, Holder::unknown}) {
    EXPECT_THAT(action(holder), Not(HasSubstr("ModemManager")));
  }
}

}  // namespace
}  // namespace absenc::client
