// SPDX-License-Identifier: Apache-2.0
// What of a T-format encoder takes several steps: resets, and its memory. author/line.hpp has what runs them (Run).
#pragma once

#include <cstdint>
#include <optional>

#include "absenc/protocol/author/line.hpp"
#include "absenc/protocol/tformat/protocol.hpp"

namespace absenc::tformat {

using Line = author::LineOf<Protocol>;

/// What an encoder shows after a reset.
struct AfterReset {
  Reply reply{};
  Reading reading{};
};

/// Data IDs 7 (latched alarms), 8 (single-turn zero here) and C (turns and latched alarms): makes sure that the shaft
/// stands still, sends ten requests, reads back what became of it. Errors: invalid_argument (the shaft turns, or ID 7
/// would hide a battery_error), cross_check_failed (the encoder did not do it), or that of an exchange.
author::Procedure reset(Line& line, AfterReset& after, DataId id);

/// Bytes of the memory, and the page that they are on. The document shows the page as the content of address 127, but
/// does not say that it can be read: what the encoder refuses is not known then.
struct Memory {
  std::uint8_t page = 0;     // 0 to 5, or 7
  std::uint8_t address = 0;  // 0 to 126
  std::uint8_t count = 1;    // of what is read: 1 to 127 - address
  std::uint8_t value = 0;    // of the first byte: is there, or is to be
  bool restores = false;     // the page before is selected again where it is known; otherwise this one stays

  std::optional<std::uint8_t> page_before{};
  bool selected = false;          // another page than before may be
  bool restored = false;          // the page before is
  std::optional<bool> written{};  // whether a write was sent
  ByteBuffer<page_addresses> data{};
};

/// Selects the page and reads. Errors: invalid_argument (closed area), busy, or that of an exchange.
author::Procedure read_memory(Line& line, Memory& memory);

/// Selects the page, reads, writes what differs (100 000 writes are permitted in total), waits, selects the page again
/// so that the EEPROM itself is read, and compares. Errors: invalid_argument (closed area), busy, cross_check_failed
/// (another value is there now), or that of an exchange.
author::Procedure write_memory(Line& line, Memory& memory);

}  // namespace absenc::tformat
