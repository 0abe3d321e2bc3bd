// SPDX-License-Identifier: Apache-2.0
// The verb `changes`: prints the journal of changes that commands made to encoders.
#include <fmt/format.h>

#include <array>
#include <vector>

#include "absenc/client/port/journal.hpp"
#include "absenc/client/text/json.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

// Returns whether the entry belongs to `encoder`, an address with or without settings.
bool is_of(const JournalEntry& entry, std::string_view encoder) {
  const std::string_view written = entry.encoder;
  return written == encoder || written.substr(0, written.find('?')) == encoder;
}

int run_changes(const Invocation& invocation) {
  const std::string path = journal_path();
  const Journal journal = read_journal(path);
  if (journal.damaged != 0) {
    print_message(fmt::format("note: {} line{} of {} cannot be read: left out", journal.damaged,
                              journal.damaged == 1 ? "" : "s", path));
  }
  std::vector<std::vector<std::string>> rows{{"TIME", "ENCODER", "CHANGE", "BEFORE", "AFTER", "RESULT"}};
  std::vector<std::string> put_back;
  for (const JournalEntry& one : journal.entries) {
    if (invocation.has("encoder") && !is_of(one, invocation.text("encoder"))) continue;
    if (invocation.has("--json")) {
      print_line(Json::object()
                     .set("time", one.time)
                     .set("encoder", one.encoder)
                     .set("what", one.what)
                     .set("before", one.before.empty() ? Json() : Json(one.before))
                     .set("after", one.after.empty() ? Json() : Json(one.after))
                     .set("change", one.result)
                     .set("put_back", one.put_back.empty() ? Json() : Json(one.put_back))
                     .line());
      continue;
    }
    rows.push_back({one.time, one.encoder, one.what, one.before.empty() ? "-" : one.before,
                    one.after.empty() ? "-" : one.after, one.result});
    if (!one.put_back.empty()) put_back.push_back(fmt::format("{}  {}", one.time, one.put_back));
  }
  if (invocation.has("--json")) return exit_good;
  if (rows.size() == 1) {
    print_line(path.empty() ? "no journal is kept: ABSENC_CHANGES is \"none\", or there is no home folder; "
                              "ABSENC_CHANGES=FILE names one"
               : invocation.has("encoder") ? fmt::format("no changes of {} are in {}", invocation.text("encoder"), path)
                                           : fmt::format("no changes are in {}", path));
    return exit_good;
  }
  print_line(table(rows));
  if (!put_back.empty()) print_line("\nThe value before is written by:");
  for (const std::string& one : put_back) print_line(one);
  return exit_good;
}

constexpr std::array<Parameter, 2> changes_parameters{{
    {"encoder", "", "only those of this one, as it was written then, with its settings or without"},
    {"--json", "", "one JSON object a line"},
}};
constexpr std::array<Example, 2> changes_examples{{
    {"absenc changes", "what was changed, when, and the commands that put it back"},
    {"absenc changes tformat:/dev/ttyUSB0 --json", "of one encoder, one JSON object a line"},
}};

}  // namespace

const Subcommand changes_subcommand{
    "changes",
    "show what was changed in encoders, and how to put it back",
    "Each change that was sent, by this command, a program, Python or serve, with its result: confirmed, refused or\n"
    "unknown. The journal is changes.tsv in $XDG_STATE_HOME/absenc, or else ~/.local/state/absenc; on Windows in\n"
    "%LOCALAPPDATA%\\absenc.",
    changes_parameters,
    changes_examples,
    run_changes};

}  // namespace absenc::tool
