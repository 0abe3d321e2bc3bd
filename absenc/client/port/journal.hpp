// SPDX-License-Identifier: Apache-2.0
// The journal of changes: one line for each changing command that was sent to an encoder other than sim:, except by
// conformance tests. Fields are separated by tabs: time (UTC), encoder, what, old value, new value, result, command
// that restores the old value. An unknown value is empty.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::client {

struct JournalEntry {
  std::string time{};  // time of the change in UTC, "2026-11-24T13:27:47.123Z"
  std::string encoder{};
  std::string what{};
  std::string before{};
  std::string after{};
  std::string result{};    // state of the change, as the name of its ChangeState
  std::string put_back{};  // command that restores the old value; "": there is none
};

/// Returns the path of the journal: $ABSENC_CHANGES, or else changes.tsv in $STATE_DIRECTORY, $XDG_STATE_HOME/absenc or
/// ~/.local/state/absenc. Returns "" if ABSENC_CHANGES is "none", or if none of these is known.
[[nodiscard]] std::string journal_path();

/// Appends an entry to the journal as one line, with a single write. Returns "", or a sentence with the reason of a
/// failure. Throws nothing, because the change has already been made.
[[nodiscard]] std::string append_to_journal(const std::string& path, JournalEntry entry);

struct Journal {
  std::vector<JournalEntry> entries{};  // entries of the journal, the oldest first
  std::size_t damaged = 0;              // number of damaged lines, which a full disk may have left
};
/// Reads the journal; returns an empty one if there is no file. Throws Failure.
[[nodiscard]] Journal read_journal(const std::string& path);

}  // namespace absenc::client
