// SPDX-License-Identifier: Apache-2.0
// Tests the kit with toy units.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <map>

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

TEST(KitToys, ReportsNothingForCorrectUnit) { expect_no_finding<Mistake::none>(); }

// A unit with a weak frame check has no finding if it accepts no more wrong replies than chance explains.
TEST(KitToys, AllowsWeakFrameCheck) {
  expect_no_finding<Mistake::weak_check>();
  EXPECT_THAT(check_exchanges(toy::unit<Mistake::weak_check>, few).notes(),
              Contains(HasSubstr("taken for good with another position")));
}

TEST(KitToys, FindsHostThatAcceptsShortReply) {
  const Unit& unit = toy::unit<Mistake::accepts_two_bytes>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains(HasSubstr("takes a reply cut after 2")));
  EXPECT_THAT(check_exchanges(unit, few).texts(), Not(IsEmpty()));
}

TEST(KitToys, FindsHostThatIgnoresChecksum) {
  const Unit& unit = toy::unit<Mistake::ignores_checksum>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains(HasSubstr("bit 0 flipped")));
  EXPECT_THAT(check_exchanges(unit, few).texts(), Contains(HasSubstr("taken for good with another position")));
}

TEST(KitToys, FindsHostThatLeavesExcessBytes) {
  EXPECT_THAT(check_hosts(toy::unit<Mistake::accepts_excess>).texts(), Contains(HasSubstr("comes twice")));
}

TEST(KitToys, FindsHostThatReportsNothing) {
  const Unit& unit = toy::unit<Mistake::reports_nothing>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains(HasSubstr("singleturn is not reported")));
  EXPECT_THAT(check_commands(unit).texts(), Contains(HasSubstr("has no reading")));
}

TEST(KitToys, FindsCommandWithoutRequest) {
  const Unit& unit = toy::unit<Mistake::has_no_request>;
  EXPECT_THAT(check_hosts(unit).texts(), Contains("position has no request: invalid_argument"));
  EXPECT_THAT(check_hosts(unit).texts(), Contains("no vector's position is read by a command"));
}

TEST(KitToys, FindsVectorsThatNoCommandReads) {
  EXPECT_THAT(check_hosts(toy::unit<Mistake::unread_vectors>).texts(),
              Contains("no vector's position is read by a command"));
}

TEST(KitToys, FindsStaleReplies) {
  const Unit& unit = toy::unit<Mistake::stale_reply>;
  EXPECT_THAT(check_exchanges(unit, few).texts(), Contains(HasSubstr("another position than the shaft's")));
  EXPECT_THAT(check_commands(unit).texts(), Contains(HasSubstr("another position than the shaft's")));
}

TEST(KitToys, FindsEncoderWithWrongPosition) {
  EXPECT_THAT(check_commands(toy::unit<Mistake::wrong_position>).texts(), Contains(HasSubstr("another position")));
}

TEST(KitToys, FindsTooSmallStorage) {
  EXPECT_THAT(check_storage(toy::unit<Mistake::needs_more_storage>).texts(),
              Contains(HasSubstr("needs more than host_storage")));
  EXPECT_THAT(check_storage(toy::unit<Mistake::overflows_storage>).texts(),
              Contains(HasSubstr("constructed beyond its storage")));
}

/// Decodes a toy protocol. A request is five bits of data with a checksum of three bits above them; a reply repeats
/// the data.
Error decode_five_bits(const Options&, Frame request, Frame reply, FieldSink& sink) {
  static constexpr FieldInfo data{"data", FieldInfo::Kind::number, "", "what is asked"};
  const unsigned value = request.bytes[0] & 31u;
  if (request.bytes[0] >> 5 != value % 7) return Error::bad_checksum;
  if (!reply.empty() && reply.bytes[0] != value) return Error::unexpected_reply;
  sink.put({&data, std::int64_t{value}});
  return Error::none;
}

std::vector<std::string> open_bytes_of(Bytes reply, std::int64_t value) {
  constexpr std::array<std::uint8_t, 1> request{};
  const std::array<Expected, 1> expected{{{"data", value, 0, {}}}};
  const std::array<Vector, 1> vectors{{{"open", "", "", "", request, reply, expected, Error::none, {0, 1}, {}}}};
  Unit unit = toy::unit<Mistake::none>;
  unit.decode = decode_five_bits;
  unit.vectors = vectors;
  return check_decoding(unit).texts();
}

// Five of the eight open bits are data and three the checksum, so 32 requests are valid.
TEST(KitToys, CompletesRequestByWhatVectorStates) {
  constexpr std::array<std::uint8_t, 1> reply{9};
  EXPECT_THAT(open_bytes_of({}, 9), ElementsAre("open request is not complete: paste \"49\""));
  EXPECT_THAT(open_bytes_of(reply, 9), ElementsAre("open request is not complete: paste \"49\""));
  EXPECT_THAT(open_bytes_of(reply, 8), ElementsAre(HasSubstr("with no value of the open bytes")));
}

TEST(KitToys, FindsDecoderThatIgnoresByte) {
  EXPECT_THAT(check_decoding(toy::unit<Mistake::ignores_last_byte>).texts(),
              Contains(HasSubstr("bit 31 flipped is accepted")));
}

TEST(KitToys, FindsDecoderThatDiffersAmongManyFrames) {
  EXPECT_THAT(check_decoding(toy::unit<Mistake::differs_among_many>).texts(),
              Contains(HasSubstr("something else among many frames")));
}

TEST(KitToys, FindsWrongBitPositions) {
  EXPECT_THAT(check_places(toy::unit<Mistake::wrong_bit_positions>).texts(), Contains(HasSubstr("has more bits")));
}

TEST(KitToys, FindsCaptureTimeoutLongerThanHosts) {
  EXPECT_THAT(check_hosts(toy::unit<Mistake::late_capture_timeout>).texts(),
              ElementsAre("captures wait 2000000 ns for a reply, hosts 200000 ns"));
}

TEST(KitToys, FindsHostThatAsksAgainWithinPauseOfFrames) {
  Unit unit = toy::unit<Mistake::none>;
  unit.timing.frame_pause = toy::gap;
  EXPECT_THAT(check_hosts(unit).texts(), IsEmpty());
  unit.timing.frame_pause = toy::gap + std::chrono::nanoseconds(1);
  EXPECT_THAT(check_hosts(unit).texts(), Contains(HasSubstr("30000 ns after a reply that was cut short")));
}

TEST(KitToys, FindsInvisibleCondition) {
  EXPECT_THAT(check_conditions(toy::unit<Mistake::ignores_condition>).texts(),
              ElementsAre("condition eccentricity is invisible to every host"));
}

TEST(KitToys, FindsZeroOfInvalidPosition) {
  EXPECT_THAT(check_zero(toy::unit<Mistake::zeroes_invalid_position>).texts(),
              Contains(HasSubstr("as it is: zero is set from an invalid position")));
}

TEST(KitToys, FindsAdviceThatCannotBeFollowed) {
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
  EXPECT_THAT(findings_of("read the alarms"), ElementsAre(HasSubstr("it is circular")));
  EXPECT_THAT(findings_of(read_the_alarms), Contains("alarm too_hot refers to the alarms, of which it is one"));
  EXPECT_THAT(findings_of("let it cool, then `absenc clear-alarms`"),
              Contains(HasSubstr("`absenc clear-alarms` is not a command of this unit")));
  EXPECT_THAT(findings_of("then `read`"), ElementsAre(HasSubstr("not written \"absenc ...\"")));
}

TEST(KitToys, FindsConversationThatNeverEnds) {
  EXPECT_THAT(check_exchanges(toy::unit<Mistake::never_ends>, few).texts(), Contains(HasSubstr("hangs")));
}

TEST(KitToys, FindsAcceptedSurplusArguments) {
  const std::vector<std::string> texts = check_requests(toy::unit<Mistake::accepts_all_arguments>, 1).texts();
  EXPECT_THAT(texts, Contains("position 0: has a request"));
  EXPECT_THAT(texts, Contains("position 0: has a conversation"));
}

// The toy has three models with the same configuration, and a second configuration with another value of its option.
// Every second round uses only configurations of models.
TEST(KitToys, PrefersConfigurationsOfModels) {
  static std::map<std::int64_t, unsigned> made;  // number of virtual encoders created, by value of the option "kind"
  constexpr std::array<OptionValue, 1> values{{{0, 2}}};
  constexpr std::array<Option, 1> options{
      {{.name = "kind", .meaning = "", .default_value = 2, .minimum = 1, .maximum = 2}}};
  const std::array<Model, 3> models{{{"old", "", 0, values}, {"new", "", 0, values}, {"newest", "", 0, values}}};
  Unit unit = toy::unit<Mistake::none>;
  unit.options = options;
  unit.models = models;
  unit.device = [](const Options& with, const Shaft& shaft, std::span<std::byte> storage) {
    ++made[with.values[0]];
    return toy::unit<Mistake::none>.device(with, shaft, storage);
  };
  EXPECT_THAT(check_exchanges(unit, few).texts(), IsEmpty());
  EXPECT_EQ(made.size(), 2u);
  EXPECT_GT(made[2], made[1]);
}

template <Role forgotten>
std::vector<std::string> findings_without() {
  return check_declarations(toy::Declared<forgotten>::unit).texts();
}

TEST(KitToys, FindsMissingRole) {
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

TEST(KitToys, FindsDuplicateRole) {
  const std::array two{toy::Declared<Role::other>::options[0], toy::Declared<Role::other>::options[0]};
  Unit unit = toy::Declared<Role::other>::unit;
  unit.options = two;
  EXPECT_THAT(check_declarations(unit).texts(), ElementsAre("toy: encoder has a role that another has"));
}

}  // namespace
}  // namespace absenc::kit
