// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/conform_link.hpp"

#include <fmt/format.h>

#include <exception>
#include <utility>

#include "absenc/client/conform/tester.hpp"
#include "absenc/client/error.hpp"

namespace absenc::client {

namespace {

ClauseResult untested(const Unit& unit, const Clause& clause) {
  return {.id = clause.id,
          .document = unit.document,
          .paragraph = clause.paragraph,
          .words = clause.words,
          .verdict = Verdict::untested};
}

[[noreturn]] void throw_left_changed(std::string_view why, const std::vector<std::string>& left) {
  throw Failure(fmt::format("{}\nthe encoder is left changed; to put it back:\n  {}", why, fmt::join(left, "\n  ")));
}

template <class Item>
void test_all(const EncoderAddress& address, Port<Item>& port, Time latency, const ConformChoices& choices,
              std::string_view name, Conformance& conformance) {
  Tester<Item> tester(address, port, latency, choices);
  ChangeTester changes(*address.unit, name, tester.line(), choices.resets);
  try {
    tester.read();
    for (const Clause& clause : clauses_of(*address.unit)) {
      if (changes_encoder(clause.demand) && !choices.changes) continue;
      ClauseResult result = untested(*address.unit, clause);
      result.evidence = reason_against(*address.unit, address.options, clause);
      if (result.evidence.empty()) {
        changes_encoder(clause.demand) ? changes.test(clause, result) : tester.test(clause, result);
      }
      conformance.clauses.push_back(std::move(result));
    }
  } catch (const os::Interrupted&) {
    if (!changes.left().empty()) throw_left_changed("interrupted", changes.left());
    if (tester.ended()) throw Cancelled{};
    throw;
  } catch (const std::exception& error) {
    if (!changes.left().empty()) throw_left_changed(error.what(), changes.left());
    throw;
  }
  conformance.left = changes.left();
}

}  // namespace

Conformance conform(const EncoderAddress& address, Link link, const ConformChoices& choices, std::string_view name) {
  if (clauses_of(*address.unit).empty()) throw UsageError(fmt::format("no clauses are known of {}", address.unit->id));
  Conformance conformance{.protocol = std::string(address.unit->id)};
  if (link.bytes != nullptr) {
    test_all(address, *link.bytes, link.latency, choices, name, conformance);
  } else {
    test_all(address, *link.frames, link.latency, choices, name, conformance);
  }
  return conformance;
}

Conformance conform(std::string_view text, std::span<const std::string> settings, const ConformChoices& choices) {
  const EncoderAddress address = parse_address(text, settings);
  std::string name = fmt::format("\"{}\"", text);
  for (const std::string& setting : settings) name += fmt::format(" --option {}", setting);
  return conform(address, open_link(address), choices, name);
}

}  // namespace absenc::client
