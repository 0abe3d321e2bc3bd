// SPDX-License-Identifier: Apache-2.0
// Whether an encoder keeps to its document: each clause tested, each verdict with what was seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::client {

enum class Verdict : std::uint8_t {
  kept,      // what the clause is about was seen, and was as the document says
  broken,    // it was seen, and was not
  untested,  // it was not seen
};

/// Result of one clause of a document.
struct ClauseResult {
  std::string_view id{};         ///< "crc"
  std::string_view document{};   ///< Name of the document.
  std::string_view paragraph{};  ///< Paragraph of the document.
  std::string_view words{};      ///< The demand in words.
  Verdict verdict{};             ///< Whether the encoder complies.
  std::string evidence{};        ///< what was seen and how often, or why nothing was
};

/// Results of all clauses of a unit.
struct Conformance {
  std::string protocol{};               ///< Identifier of the unit.
  std::vector<ClauseResult> clauses{};  ///< Results in the order of the unit's clauses.
  std::vector<std::string> left{};      ///< commands that put back by hand what could not be: the encoder is changed

  /// Returns the number of clauses with this verdict.
  [[nodiscard]] std::size_t count(Verdict verdict) const;
  /// `broken` where any clause is, or the encoder is left changed; else `kept` where any is; else `untested`: nothing
  /// was seen that could be judged.
  [[nodiscard]] Verdict verdict() const;
  /// As the Test Anything Protocol, version 13. It bails out when nothing could be judged.
  [[nodiscard]] std::string tap() const;
  /// As JUnit's XML. It has an error when nothing could be judged.
  [[nodiscard]] std::string junit() const;
  /// For people.
  [[nodiscard]] std::string report() const;
};

/// What a conformance test may do and how long it lasts.
struct ConformChoices {
  std::size_t readings = 100;    ///< at least 1
  bool changes = false;          ///< also the clauses that change the encoder, which is put back as it was
  bool resets = false;           ///< of these also what loses a zero, turns and alarms, which nothing brings back
  std::function<bool()> over{};  ///< from the moment on in which it is true, all ends with Cancelled; empty: never
};

/// "kept", "broken", "untested"
[[nodiscard]] std::string_view name_of(Verdict verdict);

/// Without `changes` nothing is ever written to the encoder. `text` and `settings` as those of `open`. Throws
/// UsageError, Cancelled, what the port throws; what was changed is put back first, and where it cannot be, Failure
/// says so with the commands that do it by hand.
[[nodiscard]] Conformance conform(std::string_view text, std::span<const std::string> settings = {},
                                  const ConformChoices& choices = {});

}  // namespace absenc::client
