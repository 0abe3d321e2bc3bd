// SPDX-License-Identifier: Apache-2.0
// Tests the kit itself: each toy unit has one mistake, and the kit must find it.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include "tests/kit/kit.hpp"
#include "tests/kit/toys.hpp"

namespace absenc::kit {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using toy::Mistake;

constexpr ExchangeTest few{.count = 20'000};

template <Mistake mistake>
void expect_no_finding() {
  const Unit& unit = toy::unit<mistake>;
  for (const Findings& findings :
       {check_decoding(unit), check_places(unit), check_hosts(unit), check_requests(unit, 1), check_storage(unit),
        check_declarations(unit), check_settings(unit), check_memory(unit), check_conditions(unit), check_zero(unit),
        check_advice(unit), check_commands(unit), check_exchanges(unit, few)}) {
    EXPECT_THAT(findings.texts(), IsEmpty());
  }
}

TEST(KitToys, WithoutAMistakeNothingIsFound) { expect_no_finding<Mistake::none>(); }

// The reply may begin with any byte, and its weak check accepts some wrong replies. The kit must accept their expected
// number.
TEST(KitToys, AWeakCheckIsNoMistake) {
  expect_no_finding<Mistake::parity>();
  EXPECT_THAT(check_exchanges(toy::unit<Mistake::parity>, few).notes(),
              Contains(HasSubstr("taken for good with another position")));
}

TEST(KitToys, AHostThatTakesTwoBytes) {
  const Unit& unit = toy::unit<Mistake::takes_two>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains(HasSubstr("takes a reply cut after 2")));
  EXPECT_THAT(check_exchanges(unit, few).texts(), Not(IsEmpty()));
}

TEST(KitToys, AHostThatLooksAtNoCheck) {
  const Unit& unit = toy::unit<Mistake::takes_anything>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains(HasSubstr("bit 0 flipped")));
  EXPECT_THAT(check_exchanges(unit, few).texts(), Contains(HasSubstr("taken for good with another position")));
}

TEST(KitToys, AHostThatLeavesAFrameToTheNext) {
  EXPECT_THAT(check_hosts(toy::unit<Mistake::takes_more>).texts(), Contains(HasSubstr("comes twice")));
}

TEST(KitToys, AHostThatReportsNothing) {
  const Unit& unit = toy::unit<Mistake::says_nothing>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains(HasSubstr("singleturn is not reported")));
  EXPECT_THAT(check_commands(unit).texts(), Contains(HasSubstr("has no reading")));
}

TEST(KitToys, ACommandWhoseRequestCannotBeMade) {
  const Unit& unit = toy::unit<Mistake::has_no_request>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains("position has no request: invalid_argument"));
  EXPECT_THAT(check_hosts(unit).texts(), Contains("no vector's position is read by a command"));
}

TEST(KitToys, VectorsThatNoCommandReads) {
  EXPECT_THAT(check_hosts(toy::unit<Mistake::no_vector>).texts(),
              Contains("no vector's position is read by a command"));
}

TEST(KitToys, RepliesToTheRequestBefore) {
  const Unit& unit = toy::unit<Mistake::is_stale>;
  EXPECT_THAT(check_exchanges(unit, few).texts(), Contains(HasSubstr("another position than the shaft's")));
  EXPECT_THAT(check_commands(unit).texts(), Contains(HasSubstr("another position than the shaft's")));
}

TEST(KitToys, AnEncoderBesideItsShaft) {
  EXPECT_THAT(check_commands(toy::unit<Mistake::is_wrong>).texts(), Contains(HasSubstr("another position")));
}

TEST(KitToys, StorageThatIsNotEnough) {
  EXPECT_THAT(check_storage(toy::unit<Mistake::wants_more>).texts(),
              Contains(HasSubstr("needs more than host_storage")));
  EXPECT_THAT(check_storage(toy::unit<Mistake::overflows>).texts(), Contains(HasSubstr("made beyond its storage")));
}

TEST(KitToys, ADecoderThatOverlooksAByte) {
  EXPECT_THAT(check_decoding(toy::unit<Mistake::flips_pass>).texts(),
              Contains(HasSubstr("bit 31 flipped is accepted")));
}

TEST(KitToys, AFieldThatStandsElsewhere) {
  EXPECT_THAT(check_places(toy::unit<Mistake::misplaced>).texts(), Contains(HasSubstr("has more bits")));
}

TEST(KitToys, CapturesThatWaitForLongerThanHosts) {
  EXPECT_THAT(check_hosts(toy::unit<Mistake::gives_up_late>).texts(),
              ElementsAre("captures wait 2000000 ns for a reply, hosts 200000 ns"));
}

TEST(KitToys, AConditionThatNothingShows) {
  EXPECT_THAT(check_conditions(toy::unit<Mistake::no_condition>).texts(),
              ElementsAre("condition eccentricity is not seen by any host, whatever it is"));
}

TEST(KitToys, AZeroThatDoesNotLook) {
  EXPECT_THAT(check_zero(toy::unit<Mistake::zeroes_blindly>).texts(),
              Contains(HasSubstr("as it is: zero is set of a position that does not hold")));
}

TEST(KitToys, AdviceThatNobodyCanFollow) {
  const auto findings_of = [](std::string_view action) {
    const std::array<FlagInfo, 1> flags{{{"too_hot", "it is too hot", action}}};
    const std::array<FieldInfo, 2> fields{
        {toy::fields[0], {"alarms", FieldInfo::Kind::flags, "", "what is wrong", flags}}};
    Unit unit = toy::unit<Mistake::none>;
    unit.fields = fields;
    unit.alarms = &fields[1];
    return check_advice(unit).texts();
  };
  EXPECT_THAT(findings_of("let it cool, and see that with `absenc read`"), IsEmpty());
  EXPECT_THAT(findings_of("read the alarms"), ElementsAre(HasSubstr("that is circular")));
  EXPECT_THAT(findings_of(read_the_alarms), Contains("alarm too_hot sends to the alarms, among which it is"));
  EXPECT_THAT(findings_of("let it cool, then `absenc clear-alarms`"),
              Contains(HasSubstr("`absenc clear-alarms` is no command of this unit")));
  EXPECT_THAT(findings_of("then `read`"), ElementsAre(HasSubstr("not written \"absenc ...\"")));
}

TEST(KitToys, AConversationThatDoesNotEnd) {
  EXPECT_THAT(check_exchanges(toy::unit<Mistake::never_ends>, few).texts(), Contains(HasSubstr("hangs")));
}

TEST(KitToys, ArgumentsThatNobodyAskedFor) {
  const std::vector<std::string> texts = check_requests(toy::unit<Mistake::takes_all>, 1).texts();
  EXPECT_THAT(texts, Contains("position 0: has a request"));
  EXPECT_THAT(texts, Contains("position 0: has a conversation"));
}

template <Role forgotten>
std::vector<std::string> findings_without() {
  return check_declarations(toy::Declared<forgotten>::unit).texts();
}

TEST(KitToys, ARoleThatIsForgotten) {
  EXPECT_THAT(findings_without<Role::other>(), IsEmpty());
  EXPECT_THAT(findings_without<Role::position>(), ElementsAre("position needs a field of the role position"));
  EXPECT_THAT(findings_without<Role::encoder>(),
              ElementsAre("scan needs a field of the role encoder", "scan needs an option of the role encoder"));
  EXPECT_THAT(findings_without<Role::clash>(), ElementsAre("scan needs a field of the role clash"));
  EXPECT_THAT(findings_without<Role::address>(), ElementsAre("memory-read needs an argument of the role address",
                                                             "memory-write needs an argument of the role address"));
  EXPECT_THAT(findings_without<Role::value>(), ElementsAre("memory-read needs a field of the role data or value",
                                                           "memory-write needs an argument of the role value"));
}

TEST(KitToys, ARoleThatTwoHave) {
  const std::array two{toy::Declared<Role::other>::options[0], toy::Declared<Role::other>::options[0]};
  Unit unit = toy::Declared<Role::other>::unit;
  unit.options = two;
  EXPECT_THAT(check_declarations(unit).texts(), ElementsAre("toy: encoder has the role of another"));
}

}  // namespace
}  // namespace absenc::kit
