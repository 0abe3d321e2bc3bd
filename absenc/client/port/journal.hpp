// SPDX-License-Identifier: Apache-2.0
// The journal of changes: a line for each command that was to change an encoder, whoever sent it (the command, a
// program, Python, serve). Fields are separated by tabs: time (UTC), encoder, what, value before, value after, result,
// command that puts it back; a value that is not known is empty.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::client {

struct JournalEntry {
  std::string time{};  // "2026-11-24T13:27:47.123Z"
  std::string encoder{};
  std::string what{};
  std::string before{};
  std::string after{};
  std::string result{};    // the word of its ChangeState
  std::string put_back{};  // a command; "": there is no value before that a command could write
};

/// $ABSENC_CHANGES; else changes.tsv in $STATE_DIRECTORY, $XDG_STATE_HOME/absenc or ~/.local/state/absenc. "": none is
/// kept, because ABSENC_CHANGES is "none" or there is no home.
[[nodiscard]] std::string journal_path();

/// Appends one line by one write. Returns "", or a sentence that says why it is not there; throws nothing: the change
/// has been made already.
[[nodiscard]] std::string append_to_journal(const std::string& path, JournalEntry entry);

struct Journal {
  std::vector<JournalEntry> entries{};  // the oldest first
  std::size_t damaged = 0;              // lines that are no entry, as a full disk leaves them
};
/// Empty when there is no file. Throws Failure.
[[nodiscard]] Journal read_journal(const std::string& path);

}  // namespace absenc::client
