// SPDX-License-Identifier: Apache-2.0
// Types that describe the clauses of protocol documents as data.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "absenc/core/time.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc {

/// Kind of a clause for encoders. Names in backquotes are members of Clause.
enum class Demand : std::uint8_t {
  // Demands about readings of the position; the last one, `does`, is about a command
  answered,  ///< the encoder answers each request, pulse or transfer
  streamed,  ///< the encoder sends frames unsolicited
  in_time,   ///< each reply begins before the timeout of a host; documents often state no limit for this time
  whole,     ///< replies have the length that the document states
  checked,   ///< replies have a correct checksum
  as_drawn,  ///< fixed bits, echoes and ranges are as the document draws them, and redundant values are equal
  does,      ///< the command `command`, which makes checks of its own, ends without an error each time
  // Demands about requests that no host of this encoder sends; the conformance test sends them itself
  foreign_silent,  ///< the encoder does not answer a request to another address
  reacts,          ///< the encoder reacts to the request `ask`, sent without repetition, as `reaction` states
  // Demands about changes of the encoder, which the test undoes
  byte_written,  ///< the byte or word at `page` and `address` can be written and read back
  /// Writing the byte or word at `page` and `address` leaves those at the four addresses below it unchanged.
  byte_alone,
  page_alone,  ///< a write to `page` leaves the byte at `address` of page `other` unchanged
  /// While the byte at `page` and `address` is written, reading it gets a busy reply.
  byte_busy,
  /// With `page` selected, the encoder answers the request `ask`, which reads a byte that hosts may not access, with a
  /// valid reply of the kind that the command `as` gets.
  page_closed,
  set,  ///< the setting `setting` reads back as the value written: `value` or `other`
  /// The zero command with the argument `value` makes the position about 0.
  zeroed,
  /// The positions with the values `value` and `other` of the setting `setting` are mirror images: they count in
  /// opposite directions.
  mirrored,
  /// `command` makes the encoder send as many unsolicited frames per second as its argument says.
  paced,
  // Demands about values that the test cannot restore
  zero,  ///< the position, which was not about 0 before, is about 0 after the zero command
  /// The command with the verb `verb` resets the alarms in the mask `value`, or the turns, and does not change the
  /// position.
  reset,
  restarts  ///< after `command` the encoder is silent; `value` ms later it reports the former position
};

/// Returns whether testing a clause of this kind may change the encoder.
[[nodiscard]] constexpr bool changes_encoder(Demand demand) { return demand >= Demand::byte_written; }
/// Returns whether testing a clause of this kind may erase what the test cannot restore.
[[nodiscard]] constexpr bool loses(Demand demand) { return demand >= Demand::zero; }

/// A set of errors: bit n is set if the enumerator of Error with the value n is in the set.
using Errors = std::uint32_t;
/// Returns the set of the errors given as arguments.
template <class... Some>
[[nodiscard]] constexpr Errors any_of(Some... errors) {
  return ((Errors{1} << static_cast<unsigned>(errors)) | ...);
}
/// Errors in the content of a reply, apart from its checksum.
inline constexpr Errors form_errors = any_of(Error::bad_framing, Error::unexpected_reply, Error::out_of_range,
                                             Error::sequence_mismatch, Error::cross_check_failed, Error::line_stuck);

/// A request that the test of a clause sends.
struct Ask {
  /// The whole request on the wire: bytes in hexadecimal, "ea 00 ea", or a CAN frame, "1ff:022b".
  std::string_view wire{};
  /// Without `wire` and `make`: name of the command that is sent; "": the one that reads the position.
  std::string_view command{};
  std::span<const std::int64_t> arguments{};  ///< Arguments of `command`; those left out have their defaults.
  bool wrong_end = false;  ///< Whether the test flips one bit in the last byte of the request; not used with `wire`.
  /// Writes the request into `request` and returns its length; null: `wire` or `command` gives the request.
  Result<std::size_t> (*make)(const Options& options, MutableBytes request) = nullptr;
  /// Bit rate of the request in 1/1000 of the line's rate; 0: the line's rate.
  std::uint32_t permille = 0;
};

/// Reaction of an encoder to the request `ask` of a clause.
enum class Reaction : std::uint8_t {
  silent,
  reply,    ///< the encoder sends a valid reply to the command `as` or, if `as` is empty, to the request `ask`
  refusal,  ///< the encoder sends a valid reply that reports the request as wrong
  refusal_or_silent,  ///< the document permits either a refusal or silence
};

/// A demand of the document on an encoder, with the data for its test.
struct Clause {
  std::string_view id;         ///< identifier, unique in its unit: "crc"
  std::string_view paragraph;  ///< paragraph of the unit's document
  std::string_view words;      ///< Demand of the document, in words.
  Demand demand;               ///< Kind of the clause, which selects its test.
  /// Conditions on options under which the clause applies, separated by blanks: "carries=biss crc_width!=0"; empty: the
  /// clause always applies.
  std::string_view needs{};
  Errors errors = 0;  ///< for Demand::as_drawn: a reply with one of these errors breaks the clause; 0: form_errors
  Ask ask{};          ///< Request that the test sends, for demands that name `ask`.
  Reaction reaction = Reaction::silent;  ///< for Demand::reacts: required reaction of the encoder to `ask`
  std::string_view as{};  ///< command whose reply must be the reaction to `ask`; "": a reply to `ask` itself
  /// For Demand::whole, checked, as_drawn: option that is set to `value` for the readings; "": none.
  std::string_view option{};
  std::int64_t value = 0;     ///< value of `option`, or the number that the demand names `value`
  std::uint32_t page = 0;     ///< Page of the memory byte that the clause is about.
  std::uint32_t address = 0;  ///< Address of the memory byte that the clause is about.
  /// Setting that the clause is about; for demands about memory: setting that access to the memory byte changes.
  std::string_view setting{};
  /// Name of the field that carries the value of `setting` in the result of the command that reads it.
  std::string_view field{};
  std::int64_t other = 0;      ///< Second page, or second value of `setting`, for demands that name `other`.
  Verb verb = Verb::run;       ///< For Demand::reset: verb of the command that resets.
  std::string_view command{};  ///< Name of the command, for demands that name `command`.
  std::string_view stop{};     ///< Command that ends the unsolicited frames of `command`; empty: none.
  /// Options of a virtual encoder with which the clause applies and can be tested: "resolution=20&multiturn_bits=0".
  std::string_view shown_with{};
};

/// Kind of a clause for hosts: the behaviour that the document demands.
enum class HostDemand : std::uint8_t {
  /// From its first request on the host sends nothing but requests, and the encoder answers at least one of them.
  asks,
  after_silence,  ///< the host sends further requests after the encoder sent no reply
  after_damage,   ///< the host sends further requests after a damaged reply
  after_refusal,  ///< the host sends further requests after a request that reached the encoder damaged
  rule,           ///< the host never breaks `rule`
  /// The host keeps `rule`; requests during or soon after an injected fault do not count.
  row
};

/// A request of a host that ignores replies, and how often it is sent.
struct HostStep {
  /// Pause before the request, after the last sent character. It is longer than a reply takes,
  /// unless the step is to send during the encoder's transmission.
  Time pause{};
  /// Name of a command, or the bytes or CAN frame to send: "1a 1a", "220:8020". No pause separates the
  /// bytes: a request of several frames with pauses between them is written as one step for each frame.
  std::string_view what{};
  /// Arguments of the command; empty: each required argument is 1, or its minimum if that is greater.
  std::span<const std::int64_t> arguments{};
  unsigned times = 1;  ///< how often the request is sent, each time after `pause`
};
/// The steps of a scripted host that ignores replies, in order.
using HostScript = std::span<const HostStep>;

/// A demand of a document on the host.
struct HostClause {
  std::string_view id;         ///< Identifier, unique within the unit.
  std::string_view paragraph;  ///< Paragraph of the document.
  std::string_view words;      ///< Demand of the document, in words.
  HostDemand demand;           ///< Kind of the clause, which selects its test.
  /// For HostDemand::rule and HostDemand::row: name of the rule that hosts must keep.
  std::string_view rule{};
  /// Scripted hosts that break this clause and no other, except perhaps the clause "asks"; empty: none. They are needed
  /// if none of the hosts that the tests use for every clause breaks this clause. If every host that breaks this clause
  /// also breaks another one, the two demands belong into one clause.
  std::array<HostScript, 2> breaks{};
  /// A scripted host that keeps this clause, although its requests resemble those of `breaks`; empty: none.
  HostScript keeps{};
  /// Options of the virtual encoder in tests of host clauses: "acquisition_us=20000".
  std::string_view options{};
};

/// Name of the rule that a host must use the encoder's SPI mode. os::SpiDevice checks the rule, because a virtual
/// encoder cannot see the clock's edges.
inline constexpr std::string_view spi_mode_rule = "clock or sampling in another SPI mode than the encoder's";

/// The clauses of a unit. The unit's descriptor has no pointer to them, because firmware would then link the clauses,
/// too.
struct Clauses {
  std::span<const Clause> encoder{};   ///< Clauses for encoders, in the order in which they are tested.
  std::span<const HostClause> host{};  ///< Clauses for hosts.
};

/// Returns the clauses of this unit for encoders, in the order of their tests; empty: none.
[[nodiscard]] std::span<const Clause> clauses_of(const Unit& unit);
/// Returns the clauses of this unit for hosts; empty if the unit has none.
[[nodiscard]] std::span<const HostClause> host_clauses_of(const Unit& unit);

}  // namespace absenc
