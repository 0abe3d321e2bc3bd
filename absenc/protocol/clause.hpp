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

/// What is looked at. Up to `unknown_reported` it is seen by reading; the others change the encoder, and only such
/// things as can be put back.
enum class Demand : std::uint8_t {
  answered,  // each request of a reading gets a reply
  in_time,   // the reply begins within the time that the unit waits for it: documents give typical times, no limits
  whole,     // replies have the length of the document
  checked,   // their checksum is right
  as_drawn,  // fixed bits, echoes, ranges, and what must agree
  foreign_silent,    // a request to another address is not answered
  damaged_silent,    // nor is one whose last byte has a wrong bit
  unknown_silent,    // nor is `request`
  unknown_reported,  // `request` gets a reply of `reply_size` bytes
  byte_written,      // what is written to the byte at `page` and `address` is read again
  byte_alone,        // and the bytes beside it stay as they are
  set,               // `setting` is what it was set to: `value`, or `other` where it is that already
  zeroed,   // the position is 0 after the zero command with the argument `value`; `setting` holds what it changes
  reset,    // the command `verb` is obeyed: only where what it resets is so already
  restarts  // after the command `command` it is silent at first, and has the same position behind `value` ms
};

[[nodiscard]] constexpr bool changes_encoder(Demand demand) { return demand >= Demand::byte_written; }

struct Clause {
  std::string_view id;         // unique in its unit: "crc"
  std::string_view paragraph;  // of the unit's document
  std::string_view words;
  Demand demand;
  std::uint8_t request = 0;     // a whole request of one byte
  std::uint8_t reply_size = 0;  // to it
  std::string_view option{};    // with which it is read for this; "": as the user has it
  std::int64_t value = 0;       // of this option, or as the demand says
  std::uint32_t page = 0;
  std::uint32_t address = 0;
  std::string_view setting{};  // by which it is written and read, as `config set` has it
  std::string_view field{};    // of the setting: the number that is its argument
  std::int64_t other = 0;
  Verb verb = Verb::run;
  std::string_view command{};
};

/// What is looked at when a host is tested.
enum class HostDemand : std::uint8_t {
  asks,           // its requests are such that they are answered
  after_silence,  // it asks again when no reply came
  after_damage,   // and when the reply was damaged
  rule,           // it never breaks `rule`
  row             // nor does it this one, of requests in a row: looked at while replies are good, as a host may give up
};

/// What a host sends without a look at what comes back: how a test makes a host that breaks a clause.
struct HostStep {
  Time pause{};             // behind what was sent before
  std::string_view what{};  // a command, of which only its own request is sent, or what stands on the wire: "1a 1a"
  std::span<const std::int64_t> arguments{};  // of the command; empty: the least that it takes
  unsigned times = 1;                         // it is sent so often, each time behind the pause
};
using HostScript = std::span<const HostStep>;

struct HostClause {
  std::string_view id;
  std::string_view paragraph;
  std::string_view words;
  HostDemand demand;
  std::string_view rule{};  // as the virtual encoder calls it when it is broken; untested until it looked at it
  // Where what every test tries does not do it (two commands in a row, waits that are left out, a controller that is
  // too fast, too early or in another mode):
  std::array<HostScript, 2> breaks{};  // two hosts that break it, and nothing else
  HostScript keeps{};                  // a host that does what it is about, as the document wants it
  std::string_view options{};          // of the virtual encoder to which they do it: "acquisition_us=20000"
};

/// Which edges a controller clocks and samples at shows in front of the virtual encoder: whoever plays the controller
/// looks at this one.
inline constexpr std::string_view spi_mode_rule = "clock or sampling in another SPI mode than the encoder's";

/// Those of this unit, in the order in which they are tested; empty: none are known. Defined with the list of units.
[[nodiscard]] std::span<const Clause> clauses_of(const Unit& unit);
[[nodiscard]] std::span<const HostClause> host_clauses_of(const Unit& unit);

}  // namespace absenc
