// SPDX-License-Identifier: Apache-2.0
// The journal of changes of encoders. Tabs separate the fields of a line: time (UTC), encoder, kind of the change as a
// verb or command of absenc, old value, new value, result, command that restores the old value.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace absenc::client {

struct JournalEntry {
  std::string time{};  // time of the entry in UTC, "2026-11-24T13:27:47.123Z"
  std::string encoder{};
  std::string what{};
  std::string before{};
  std::string after{};
  std::string result{};    // state of the change, as the name of its ChangeState
  std::string put_back{};  // command that restores the old value; "": there is none
};

/// Returns the path of the journal, which may not exist yet; "": no journal is kept.
[[nodiscard]] std::string journal_path();

/// Appends the entry, with the present time, to the journal; returns "", or why that failed.
[[nodiscard]] std::string append_to_journal(const std::string& path, JournalEntry entry);

struct Journal {
  std::vector<JournalEntry> entries{};  // entries of the journal, the oldest first
  std::size_t damaged = 0;              // number of damaged lines, which a full disk may have left
};
/// Reads the journal; returns an empty one if there is no file. Throws Failure.
[[nodiscard]] Journal read_journal(const std::string& path);

}  // namespace absenc::client
