// SPDX-License-Identifier: Apache-2.0
// What a unit's document demands of an encoder, clause by clause, as data: how it is tested is the same for every unit.
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
  // About readings, whose requests any host sends
  answered,  ///< each request, pulse or transfer gets a reply
  streamed,  ///< frames come by themselves
  in_time,   ///< the reply begins within the time that the unit waits for it: documents give typical times, no limits
  whole,     ///< replies have the length of the document
  checked,   ///< their checksum is right
  as_drawn,  ///< fixed bits, echoes, ranges, and what must agree
  does,      ///< `command` ends well each time, with all that it compares
  // About requests that no host sends
  foreign_silent,  ///< a request to another address is not answered
  reacts,          ///< to `ask` the encoder does as `reaction` says
  // About changes, which are put back
  byte_written,  ///< what is written to the byte at `page` and `address` is read again
  byte_alone,    ///< and the bytes beside it stay as they are
  page_alone,    ///< and so does the byte of page `other` at the same address
  byte_busy,     ///< while it is written, a request to read it is answered as busy, and the byte is read again later
  page_closed,   ///< what `page` does not have at `address` is asked for by `ask`
  set,           ///< `setting` is what it was set to: `value`, or `other` where it is that already
  zeroed,    ///< the position is 0 after the zero command with the argument `value`; `setting` holds what it changes
  mirrored,  ///< of the directions 0 and 1 of `setting`, which nothing reads, one mirrors the position
  paced,     ///< after `command` with `value` so many frames a second come by themselves; `stop` ends them
  // About values that nothing brings back
  zero,     ///< after the zero command the position is 0, which it was not
  reset,    ///< after `verb` what it resets is reset, and was not
  restarts  ///< after the command `command` it is silent at first, and has the same position behind `value` ms
};

/// Returns whether a demand is about a change of the encoder.
[[nodiscard]] constexpr bool changes_encoder(Demand demand) { return demand >= Demand::byte_written; }
/// Whether something may be lost by it: a position, turns, an alarm.
[[nodiscard]] constexpr bool loses(Demand demand) { return demand >= Demand::zero; }

/// A bit for each Error.
using Errors = std::uint32_t;
/// Returns a set of errors.
template <class... Some>
[[nodiscard]] constexpr Errors any_of(Some... errors) {
  return ((Errors{1} << static_cast<unsigned>(errors)) | ...);
}
/// Errors of replies that are not as the document draws them.
inline constexpr Errors form_errors = any_of(Error::bad_framing, Error::unexpected_reply, Error::out_of_range,
                                             Error::sequence_mismatch, Error::cross_check_failed, Error::line_stuck);

/// A request that a clause sends beside those of readings.
struct Ask {
  std::string_view wire{};  ///< as it stands on the wire: "a2"
  /// Writes the request, where it depends on the options; null: `wire`.
  Result<std::size_t> (*make)(const Options& options, MutableBytes request) = nullptr;
  bool wrong_end = false;      ///< the request for a position, its last byte with a wrong bit
  std::uint32_t permille = 0;  ///< sent at this part of the rate, so that its last bit is where the stop bit should be
};

/// Reaction to a bad request.
enum class Reaction : std::uint8_t {
  silent,
  reply,              ///< a good one to the request of the command `as`
  refusal,            ///< the same, which says that the request was wrong
  refusal_or_silent,  ///< the document says both
};

/// A demand of the document on an encoder. It is kept only by a run that saw what it is about: the requests that it
/// names were sent, good replies came, a wrong bit in one of these would have been seen, a value was another before.
/// The engine (client/conform) counts that, by the demand alone.
struct Clause {
  std::string_view id;                   ///< unique in its unit: "crc"
  std::string_view paragraph;            ///< of the unit's document
  std::string_view words;                ///< What the document demands, in words.
  Demand demand;                         ///< Kind of the demand.
  std::string_view needs{};              ///< options with which the document demands it: "carries=biss", "crc_width!=0"
  Errors errors = 0;                     ///< as_drawn: those that break it; 0: form_errors
  Ask ask{};                             ///< Request that it is about.
  Reaction reaction = Reaction::silent;  ///< What the encoder must do.
  std::string_view as{};                 ///< the command whose reply is demanded; "": a reply to what was sent
  std::string_view option{};             ///< with which it is read for this; "": as the user has it
  std::int64_t value = 0;                ///< of this option, or as the demand says
  std::uint32_t page = 0;                ///< Page of the byte that it is about.
  std::uint32_t address = 0;             ///< Address of the byte that it is about.
  std::string_view setting{};            ///< by which it is written and read, as `config set` has it
  std::string_view field{};              ///< of the setting: the number that is its argument
  std::int64_t other = 0;                ///< A second value.
  Verb verb = Verb::run;                 ///< Verb of the command that it is about.
  std::string_view command{};            ///< Command that it is about.
  std::string_view stop{};               ///< Command that ends what `command` begins; empty: none.
  std::string_view shown_with{};         ///< options of a virtual encoder that shows it, where its defaults do not
};

/// What is looked at when a host is tested.
enum class HostDemand : std::uint8_t {
  asks,           ///< its requests are such that they are answered
  after_silence,  ///< it asks again when no reply came
  after_damage,   ///< and when the reply was damaged
  after_refusal,  ///< and when its request was damaged, so that the encoder refused it
  rule,           ///< it never breaks `rule`
  row  ///< nor does it this one, of requests in a row: looked at while replies are good, as a host may give up
};

/// A step of a host that does not look at replies: how a test makes a host that breaks a clause.
struct HostStep {
  Time pause{};             ///< behind what was sent before
  std::string_view what{};  ///< a command, of which only its own request is sent, or what stands on the wire: "1a 1a"
  std::span<const std::int64_t> arguments{};  ///< of the command; empty: the least that it takes
  unsigned times = 1;                         ///< it is sent so often, each time behind the pause
};
/// Requests of a host, with pauses.
using HostScript = std::span<const HostStep>;

/// What a document demands of the host.
struct HostClause {
  std::string_view id;         ///< Identifier, unique within the unit.
  std::string_view paragraph;  ///< Paragraph of the document.
  std::string_view words;      ///< What the document demands, in words.
  HostDemand demand;           ///< Kind of the demand.
  std::string_view rule{};     ///< as the virtual encoder calls it when it is broken; untested until it looked at it
  // Where what every test tries does not do it (two commands in a row, waits that are left out, a controller that is
  // too fast, too early or in another mode):
  std::array<HostScript, 2> breaks{};  ///< two hosts that break it, and nothing else
  HostScript keeps{};                  ///< a host that does what it is about, as the document wants it
  std::string_view options{};          ///< of the virtual encoder to which they do it: "acquisition_us=20000"
};

/// Which edges a controller clocks and samples at shows in front of the virtual encoder: whoever plays the controller
/// looks at this one.
inline constexpr std::string_view spi_mode_rule = "clock or sampling in another SPI mode than the encoder's";

/// Those of this unit, in the order in which they are tested; empty: none are known. Defined with the list of units.
[[nodiscard]] std::span<const Clause> clauses_of(const Unit& unit);
/// Returns the clauses of the document for the host; none: it has none.
[[nodiscard]] std::span<const HostClause> host_clauses_of(const Unit& unit);

}  // namespace absenc
