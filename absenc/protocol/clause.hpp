// SPDX-License-Identifier: Apache-2.0
// Clauses of a unit's document that encoders and hosts must satisfy, as data. One engine tests the clauses of all
// units.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/time.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc {

/// Kind of a clause.
enum class Demand : std::uint8_t {
  // Clauses about readings, whose requests any host sends
  answered,  ///< each request, pulse or transfer is answered
  streamed,  ///< frames arrive unsolicited
  in_time,   ///< the reply begins within the unit's time limit: documents give typical times, no limits
  whole,     ///< replies have the length that the document states
  checked,   ///< replies have a correct checksum
  as_drawn,  ///< fixed bits, echoes and ranges are as the document draws them, and values agree
  does,      ///< `command` ends without an error each time, with all its checks
  // Clauses about requests that no host sends
  foreign_silent,  ///< a request to another address is not answered
  reacts,          ///< the encoder reacts to `ask` as `reaction` states
  // Clauses about changes, which are undone
  byte_written,  ///< the byte at `page` and `address` can be written and read back
  byte_alone,    ///< the bytes beside it do not change then
  page_alone,    ///< the byte of page `other` at the same address does not change then
  byte_busy,     ///< while the byte is written, a request to read it is answered as busy; it can be read later
  page_closed,   ///< `page` has no byte at `address`; `ask` requests it
  set,           ///< `setting` has the value that it was set to: `value`, or `other` if it had `value` before
  /// The position is 0 after the zero command with the argument `value`; `setting` has the value that it changes.
  zeroed,
  mirrored,  ///< one of the directions 0 and 1 of `setting`, which cannot be read, mirrors the position
  paced,     ///< after `command` with `value`, that many frames per second arrive unsolicited; `stop` ends them
  // Clauses about values that cannot be restored
  zero,     ///< the position is 0 after the zero command, and was not before
  reset,    ///< `verb` resets its value, which was not reset before
  restarts  ///< after `command` the encoder is silent at first, and has the same position `value` ms later
};

/// Returns whether a demand is about a change of the encoder.
[[nodiscard]] constexpr bool changes_encoder(Demand demand) { return demand >= Demand::byte_written; }
/// Returns whether testing the clause may lose a value: a position, turns, an alarm.
[[nodiscard]] constexpr bool loses(Demand demand) { return demand >= Demand::zero; }

/// A set of Errors, one bit for each.
using Errors = std::uint32_t;
/// Returns a set of errors.
template <class... Some>
[[nodiscard]] constexpr Errors any_of(Some... errors) {
  return ((Errors{1} << static_cast<unsigned>(errors)) | ...);
}
/// Errors of replies that differ from the document's drawing.
inline constexpr Errors form_errors = any_of(Error::bad_framing, Error::unexpected_reply, Error::out_of_range,
                                             Error::sequence_mismatch, Error::cross_check_failed, Error::line_stuck);

/// A request that a clause sends, which reading never sends.
struct Ask {
  std::string_view wire{};  ///< bytes of the request: "a2"
  /// Writes the request, where it depends on the options; null: `wire`.
  Result<std::size_t> (*make)(const Options& options, MutableBytes request) = nullptr;
  bool wrong_end = false;  ///< the request for a position, with a wrong bit in its last byte
  /// Rate of the request in 1/1000 of the line's, so that its last bit is where the stop bit should be.
  std::uint32_t permille = 0;
};

/// Reaction to a bad request.
enum class Reaction : std::uint8_t {
  silent,
  reply,              ///< a valid reply to the request of the command `as`
  refusal,            ///< a valid reply that reports the request as wrong
  refusal_or_silent,  ///< the document permits both
};

/// A demand of the document on an encoder. It passes only if the test saw its case: its requests were sent, valid
/// replies were received, a wrong bit in them would have been detected, a value was different before. The engine
/// (client/conform) decides that by the demand alone.
struct Clause {
  std::string_view id;                   ///< unique in its unit: "crc"
  std::string_view paragraph;            ///< paragraph of the unit's document
  std::string_view words;                ///< Demand of the document, in words.
  Demand demand;                         ///< Kind of the demand.
  std::string_view needs{};              ///< options for which the document demands it: "carries=biss", "crc_width!=0"
  Errors errors = 0;                     ///< as_drawn: errors that break the clause; 0: form_errors
  Ask ask{};                             ///< Request that it is about.
  Reaction reaction = Reaction::silent;  ///< Required reaction of the encoder.
  std::string_view as{};                 ///< command whose reply is demanded; "": a reply to the sent request
  std::string_view option{};             ///< option that reading uses for this clause; "": the user's options
  std::int64_t value = 0;                ///< value of this option, or as the demand states
  std::uint32_t page = 0;                ///< Page of the byte that it is about.
  std::uint32_t address = 0;             ///< Address of the byte that it is about.
  std::string_view setting{};            ///< name of the setting that `config set` writes and reads
  std::string_view field{};              ///< field of the setting: the number that is its argument
  std::int64_t other = 0;                ///< Second value, for demands that need two.
  Verb verb = Verb::run;                 ///< Verb of the command that it is about.
  std::string_view command{};            ///< Command that it is about.
  std::string_view stop{};               ///< Command that ends the stream of `command`; empty: none.
  std::string_view shown_with{};         ///< options of a virtual encoder that shows the case, if its defaults do not
};

/// Kind of a clause for hosts.
enum class HostDemand : std::uint8_t {
  asks,           ///< the encoder answers the host's requests
  after_silence,  ///< the host repeats its request after a missing reply
  after_damage,   ///< the host repeats its request after a damaged reply
  after_refusal,  ///< the host repeats its request after the encoder refused a damaged request
  rule,           ///< the host never breaks `rule`
  /// The host keeps `rule`, about consecutive requests; tested while replies are valid, because a host may give up.
  row
};

/// A step of a host that ignores replies: tests build hosts from it that break a clause.
struct HostStep {
  Time pause{};             ///< pause after the last sent character
  std::string_view what{};  ///< command whose own request alone is sent, or the bytes of a request: "1a 1a"
  std::span<const std::int64_t> arguments{};  ///< arguments of the command; empty: the least ones
  unsigned times = 1;                         ///< how often it is sent, each time after the pause
};
/// Requests of a host, with pauses.
using HostScript = std::span<const HostStep>;

/// A demand of a document on the host.
struct HostClause {
  std::string_view id;         ///< Identifier, unique within the unit.
  std::string_view paragraph;  ///< Paragraph of the document.
  std::string_view words;      ///< Demand of the document, in words.
  HostDemand demand;           ///< Kind of the demand.
  std::string_view rule{};     ///< name of the rule in the virtual encoder; untested until the encoder has checked it
  // Hosts that break the clause, if the steps of every test do not (two commands in a row, pauses left out, a
  // controller that is too fast, too early or in another mode):
  std::array<HostScript, 2> breaks{};  ///< two hosts that break this clause and no other
  HostScript keeps{};                  ///< a host in the same situation that keeps the clause
  std::string_view options{};          ///< options of the virtual encoder for these hosts: "acquisition_us=20000"
};

/// The rule about the edges at which a controller clocks and samples. The virtual encoder cannot see them, so the
/// test's controller checks it.
inline constexpr std::string_view spi_mode_rule = "clock or sampling in another SPI mode than the encoder's";

/// Returns the clauses of this unit in the order of the tests; empty: none. Defined with the list of units.
[[nodiscard]] std::span<const Clause> clauses_of(const Unit& unit);
/// Returns the clauses of the document for the host; none: it has none.
[[nodiscard]] std::span<const HostClause> host_clauses_of(const Unit& unit);

}  // namespace absenc
