// SPDX-License-Identifier: Apache-2.0
// Identifies virtual encoders on lines in virtual time, with damage, echo and late replies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absenc/client/identify/attempt.hpp"
#include "absenc/client/identify/line.hpp"
#include "absenc/client/port/virtual_link_test.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// A line with one encoder, which is powered on again each time the port is opened.
struct Place {
  explicit Place(const std::string& text, std::vector<std::string> faults = {}, VirtualPort between = {})
      : encoder(parse_address(text)), way(between) {
    encoder.device.faults = std::move(faults);
    way.clock = &clock;
  }
  [[nodiscard]] LineSearch search() {
    const bool is_can = encoder.unit->link == LinkKind::can;
    return {.place = is_can ? "slcan:/dev/here" : "tcp:here:1",
            .limit = std::chrono::hours(1),
            .open = [this](const EncoderAddress&) { return virtual_link(encoder, way); },
            .now = [this] { return clock.time; }};
  }

  EncoderAddress encoder;
  VirtualPort way;
  VirtualClock clock;
};

/// Identifies the encoder while only requests of its unit are sent; returns the evidence for the unit, and the number
/// of requests.
std::pair<capture::Evidence, std::size_t> asked(const std::string& text, const std::vector<std::string>& faults,
                                                const VirtualPort& way = {}) {
  Place place(text, faults, way);
  const LineSearch search = place.search();
  LineFindings findings;
  Attempt<std::uint8_t> attempt(search, *place.encoder.unit, {}, thorough, never, findings);
  attempt.open();
  attempt.ask();
  return {findings.candidates.empty() ? capture::Evidence{} : findings.candidates.front().hypothesis.evidence,
          findings.requests};
}

/// Results of `damaged_by_runner`: how many of its `count` readings the runner judges damaged, and the number of
/// requests that the runner sends.
struct Counted {
  std::size_t damaged = 0;
  std::size_t requests = 0;
};
Counted damaged_by_runner(const std::string& text, const std::vector<std::string>& faults, std::size_t count,
                          const VirtualPort& way = {}) {
  Place place(text, faults, way);
  Link link = virtual_link(place.encoder, place.way);
  Runner<std::uint8_t> runner(place.encoder);
  runner.attach(*link.bytes, link.latency);
  std::size_t damaged = 0;
  // Runs the unit's scan first, as the search in `asked` does, so that the same faults affect the readings of both.
  if (const Command* scan = find_command(*place.encoder.unit, Verb::scan)) static_cast<void>(runner.once(*scan));
  for (std::size_t i = 0; i < count; ++i) {
    runner.start_again();
    damaged += runner.once(*find_command(*place.encoder.unit, Verb::read)).error != Error::none ? 1 : 0;
  }
  return {damaged, runner.port().requests};
}

std::string name_of_case(const ::testing::TestParamInfo<const Unit*>& one) {
  std::string name(one.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// ---- Damage

class Damage : public ::testing::TestWithParam<const Unit*> {};

TEST_P(Damage, IsWhatTheRunnerSaysWithAndWithoutEcho) {
  const Unit& unit = *GetParam();
  const std::string text = fmt::format("sim:{}", unit.id);
  const EncoderAddress address = parse_address(text);
  const bool is_asked = unit.link == LinkKind::half_duplex && find_command(unit, Verb::read) != nullptr &&
                        !host::sends_unsolicited(unit, address.options);
  if (!is_asked) GTEST_SKIP() << "a reading is not one request with its reply";
  std::size_t damaged = 0;
  for (const char* const fault : {"corrupt=0.4", "garbage=0.4", "truncate=0.4"}) {
    for (const bool echo : {false, true}) {
      SCOPED_TRACE(fmt::format("{}{}", fault, echo ? " with echo" : ""));
      const auto [evidence, requests] = asked(text, {fault}, {.echo = echo});
      const Counted wanted = damaged_by_runner(text, {fault}, evidence.tried, {.echo = echo});
      // If the search has repeated the scan or found several encoders, it has sent other requests than the runner. Then
      // the faults affect other readings, so no comparison is made.
      if (wanted.requests != requests) continue;
      EXPECT_EQ(evidence.tried - evidence.explained, wanted.damaged);
      damaged += wanted.damaged;
    }
  }
  if (find_command(unit, Verb::scan) == nullptr) {
    EXPECT_GT(damaged, 3u) << "nothing was compared";
  }
}

INSTANTIATE_TEST_SUITE_P(Units, Damage, ::testing::ValuesIn(all_units().begin(), all_units().end()), name_of_case);

// ---- Late replies

TEST(Identify, GivesLateRepliesMoreTimeAndTakesEachForItsOwnRequest) {
  for (const char* const fault : {"delay=1", "delay=0.3"}) {
    const capture::Evidence evidence = asked("sim:tformat", {fault}).first;
    EXPECT_GT(evidence.tried, 4u) << fault;
    EXPECT_EQ(evidence.explained, evidence.tried) << fault;
  }
}

// ---- Distinction of several encoders

/// Returns the setting of the highest address on a bus, "address=31"; "" for a unit without addresses, without a scan,
/// or with a scan that disturbs other encoders.
std::string at_last_number(const Unit& unit) {
  const Option* option = find_role(unit.options, Role::encoder);
  const Command* scan = find_command(unit, Verb::scan);
  if (option == nullptr || scan == nullptr || !scan->disturbs.empty()) return {};
  return fmt::format("{}={}", option->name, to_text(*option, option->maximum));
}

/// Returns the resolution of a position that is read with these options; 0: the reading failed.
template <class Item>
unsigned bits_read(Place& place, const Options& options) {
  EncoderAddress address = place.encoder;
  address.options = options;
  Link link = virtual_link(place.encoder, place.way);
  Runner<Item> runner(address);
  if constexpr (std::is_same_v<Item, CanFrame>) {
    runner.attach(*link.frames, link.latency);
  } else {
    runner.attach(*link.bytes, link.latency);
  }
  const Conversation<Item>* const read = runner.run(*find_command(*address.unit, Verb::read), {});
  return read != nullptr && read->reading() != nullptr ? read->reading()->singleturn_bits : 0;
}

/// Returns whether a position that is read with these options has the encoder's resolution. Options may leave the
/// resolution open.
bool reads_right(Place& place, const Options& options) {
  const Unit& unit = *place.encoder.unit;
  const unsigned wanted = unit.resolution(place.encoder.options).singleturn_bits;
  const bool is_can = unit.link == LinkKind::can;
  return wanted == (is_can ? bits_read<CanFrame>(place, options) : bits_read<std::uint8_t>(place, options));
}

class Found : public ::testing::TestWithParam<const Unit*> {};

TEST_P(Found, TheFirstCandidateIsTheEncoderOfEachModelAndNumber) {
  const Unit& unit = *GetParam();
  if (host_clocks(unit.link)) GTEST_SKIP() << "an SPI controller is needed";
  std::vector<std::string> settings{""};
  // Tests addresses and models only of encoders that send no unsolicited frames: finding those that do takes seconds.
  if (!host::sends_unsolicited(unit, parse_address(fmt::format("sim:{}", unit.id)).options)) {
    settings.push_back(at_last_number(unit));
    for (const Model& model : unit.models) settings.push_back(fmt::format("model={}", model.name));
  }
  for (const std::string& setting : settings) {
    SCOPED_TRACE(setting);
    Place place(fmt::format("sim:{}?motion=rpm=60&singleturn=300{}{}", unit.id, setting.empty() ? "" : "&", setting));
    const LineFindings findings = search_line(place.search());
    ASSERT_FALSE(findings.candidates.empty());
    const Candidate& best = findings.candidates.front();
    EXPECT_EQ(best.unit, &unit);
    EXPECT_TRUE(is_found(best));
    EXPECT_THAT(findings.notes, Not(Contains(HasSubstr("who it is"))));
    const unsigned found = unit.resolution(best.hypothesis.options).singleturn_bits;
    const unsigned wanted = unit.resolution(place.encoder.options).singleturn_bits;
    EXPECT_TRUE(found == wanted || best.hypothesis.at_least || reads_right(place, best.hypothesis.options))
        << found << " of " << wanted;
    const Option* number = find_role(unit.options, Role::encoder);
    if (number == nullptr || best.unsolicited) continue;
    const auto index = static_cast<std::size_t>(number - unit.options.data());
    EXPECT_EQ(best.hypothesis.options[index], place.encoder.options[index]);
  }
}

INSTANTIATE_TEST_SUITE_P(Units, Found, ::testing::ValuesIn(all_units().begin(), all_units().end()), name_of_case);

// ---- Identity that the encoder itself reports

TEST(Identify, TheEncoderItselfTellsModelsApartWhoseRepliesAreAlike) {
  for (const Unit* unit : all_units()) {
    if (find_role(unit->fields, Role::identity) == nullptr || unit->models.size() < 2) continue;
    for (const Model& model : unit->models) {
      SCOPED_TRACE(fmt::format("{} {}", unit->id, model.name));
      Place place(fmt::format("sim:{}?model={}", unit->id, model.name));
      if (unit->link != LinkKind::half_duplex) continue;
      const LineFindings findings = search_line(place.search());
      ASSERT_FALSE(findings.candidates.empty());
      const Candidate& best = findings.candidates.front();
      EXPECT_EQ(best.unit, unit);
      // With the default options the encoder may report its resolution itself; then these options fit each model.
      Options usual;
      static_cast<void>(resolve_options(*unit, {}, {}, usual));
      for (const Candidate& one : findings.candidates) {
        if (one.unit != best.unit || !is_as_likely(one, best)) continue;
        const bool is_usual = one.hypothesis.options.values == usual.values;
        EXPECT_TRUE(one.hypothesis.options.values == place.encoder.options.values ||
                    (is_usual && reads_right(place, one.hypothesis.options)));
      }
    }
  }
}

/// Returns what the search finds on the line of a T-format encoder if `change` is called before the encoder is asked
/// for its identity.
LineFindings found_with(Place& place, const std::function<void()>& change) {
  LineSearch search = place.search();
  search.progress = [&](const std::string& text) {
    if (text == "tformat: who it is") change();
  };
  return search_line(search);
}

TEST(Identify, SaysWhatOfTheIdentityCouldNotBeReadAndWhy) {
  for (const auto& [fault, reason] : {std::pair("silence=1", "the encoder did not answer"),
                                      std::pair("corrupt=1", "the checksum of the reply is wrong")}) {
    SCOPED_TRACE(fault);
    Place place("sim:tformat");
    const LineFindings findings = found_with(place, [&] { place.encoder.device.faults = {fault}; });
    ASSERT_FALSE(findings.candidates.empty());
    EXPECT_TRUE(findings.candidates.front().identity.columns.empty());
    const std::string note = fmt::format(
        "tformat: not known who it is: encoder-id could not be read: {}; `absenc info` tries it again", reason);
    EXPECT_THAT(findings.notes, Contains(note));
  }
}

TEST(Identify, SaysWhoWasNotAskedWhenTheTimeWasOver) {
  Place place("sim:tformat");
  const LineFindings findings = found_with(place, [&] { place.clock.time += std::chrono::hours(2); });
  EXPECT_TRUE(findings.out_of_time);
  ASSERT_FALSE(findings.candidates.empty());
  EXPECT_TRUE(findings.candidates.front().identity.columns.empty());
  EXPECT_THAT(findings.notes, Contains("not asked who it is: tformat: the time is over; `absenc info` asks it"));
}

}  // namespace
}  // namespace absenc::client
