// SPDX-License-Identifier: Apache-2.0
// Tests whether an encoder complies with its document: a verdict and its evidence for each clause.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::client {

/// Verdict on whether the encoder, or a host, complies with a clause.
enum class Verdict : std::uint8_t {
  kept,      ///< the tested behaviour was observed, and the clause was satisfied
  broken,    ///< a violation of the clause was observed
  untested,  ///< the observations do not decide whether the clause is satisfied
};

/// Result of the test of one clause, a requirement of a document.
struct ClauseResult {
  std::string_view id{};         ///< Identifier of the clause, as "crc".
  std::string_view document{};   ///< Name of the document that contains the clause.
  std::string_view paragraph{};  ///< Paragraph of the document that contains the clause.
  std::string_view words{};      ///< Requirement of the clause, in words.
  Verdict verdict{};             ///< Whether the encoder or the host complies with the clause.
  /// Observed behaviour and how often it was observed; if the clause is untested, the reason.
  std::string evidence{};
};

/// Results of a conformance test: one for each clause of the unit's document.
struct Conformance {
  std::string protocol{};               ///< Identifier of the unit.
  std::vector<ClauseResult> clauses{};  ///< Results of the clauses, in the order in which the unit lists its clauses.
  /// Commands with which the user restores values that the test left changed; empty: none.
  std::vector<std::string> left{};

  /// Returns the number of clauses with this verdict.
  [[nodiscard]] std::size_t count(Verdict verdict) const;
  /// Returns `broken` if a clause is broken or the test left a value changed, else `kept` if a clause is kept, else
  /// `untested`.
  [[nodiscard]] Verdict verdict() const;
  /// Returns the results in the Test Anything Protocol, version 13.
  [[nodiscard]] std::string tap() const;
  /// Returns the results of all clauses as JUnit XML.
  [[nodiscard]] std::string junit() const;
  /// Returns the results of all clauses as text for people.
  [[nodiscard]] std::string report() const;
};

/// Limits of a conformance test of an encoder: its length, and the changes it may make.
struct ConformChoices {
  std::size_t readings = 100;  ///< Number of readings that the test takes, at least 1.
  /// Whether clauses that change the encoder are tested too; values are restored where possible.
  bool changes = false;
  /// With `changes`, whether the test may erase a zero, turns or alarms, which nothing restores.
  bool resets = false;
  /// Polled during the test; once it returns true, the test ends with an exception. Empty: never.
  std::function<bool()> over{};
};

/// Returns the verdict as a word: "kept", "broken" or "untested".
[[nodiscard]] std::string_view name_of(Verdict verdict);

/// Tests the encoder of an address and returns the results. `text` and `settings` are those of `open`. Throws
/// UsageError, Cancelled, os::Interrupted, Failure and exceptions of the port. If the test ends early and cannot
/// restore changed values, it throws a Failure whose text contains the commands that restore them.
[[nodiscard]] Conformance conform(std::string_view text, std::span<const std::string> settings = {},
                                  const ConformChoices& choices = {});

}  // namespace absenc::client
