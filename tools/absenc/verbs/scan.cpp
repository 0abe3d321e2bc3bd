// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

/// Collects the encoders that a scan of the line finds, with a record for each.
struct Records final : FieldSink {
  struct Record {
    bool clash = false;
    bool trouble = false;
    std::map<const FieldInfo*, std::string> texts{};
    JsonFields json{};
  };

  void put(const FieldValue& value) override {
    const FieldInfo& info = *value.info;
    if (std::find(fields.begin(), fields.end(), &info) == fields.end()) fields.push_back(&info);
    if (info.role == Role::encoder || all.empty()) all.emplace_back();
    Record& record = all.back();
    if (info.role == Role::clash) record.clash = value.number != 0;
    if (info.role == Role::trouble) record.trouble = true;
    record.texts[&info] = to_text(value);
    record.json.put(value);
  }

  void put_reading(const Reading& reading) override {
    Record& record = all.back();
    for (auto& [info, text] : record.texts) text = marked(*info, text, reading);
    record.json.put_reading(reading);
  }

  [[nodiscard]] std::string text() const {
    std::vector<std::vector<std::string>> rows(1);
    for (const FieldInfo* field : fields) rows.front().emplace_back(field->name);
    for (const Record& record : all) {
      rows.emplace_back();
      for (const FieldInfo* field : fields) {
        const auto found = record.texts.find(field);
        rows.back().push_back(found == record.texts.end() ? "-" : found->second);
      }
    }
    return table(rows);
  }

  std::vector<const FieldInfo*> fields;  // columns of the table, in the order in which fields first appeared
  std::vector<Record> all;
};

}  // namespace

int run_scan_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command,
                     Arguments arguments) {
  os::catch_interrupts();
  if (!may_disturb(invocation, uri, command)) return exit_failed;
  const std::unique_ptr<Connection> encoder = open_connection(uri);
  Records records;
  run_into(*encoder, command, arguments, records);
  std::size_t good = 0;
  bool clashes = false;
  Json list = Json::array();
  for (const Records::Record& record : records.all) {
    if (!record.clash && !record.trouble) ++good;
    clashes = clashes || record.clash;
    list.append(record.json.fields);
  }
  if (invocation.has("--json")) {
    print_line(Json::object().set("ok", good != 0).set("encoders", list).line());
    return good != 0 ? exit_good : exit_failed;
  }
  print_line(records.text());
  if (clashes) {
    print_message("clash: the answer is damaged every time; two encoders share the address, or the line is bad");
  }
  return good != 0 ? exit_good : exit_failed;
}

namespace {

int run_scan(const Invocation& invocation) {
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  if (const Command* command = find_command(*uri.unit, Verb::scan)) {
    return run_scan_command(invocation, uri, *command, require_arguments(*command, {}));
  }
  throw UsageError(fmt::format("{} has no addresses to scan: there is one encoder on its line", uri.unit->id));
}

constexpr std::array<Parameter, 4> scan_parameters{{
    parameter::encoder,
    {"--yes", "", "do not ask, where the requests may disturb other devices"},
    parameter::json,
    parameter::option,
}};

constexpr std::array<Example, 2> scan_examples{{
    {"absenc scan esl:/dev/ttyUSB0", "every address with an encoder, and what that is"},
    {"absenc scan sim:esl --json", "the same of a virtual encoder, for programs"},
}};

}  // namespace

const Subcommand scan_subcommand{
    "scan",
    "find out which encoders answer on a line",
    "Asks every address. An answer that is damaged every time is a clash: two encoders have one address, or the\n"
    "line is bad. No encoder is changed. Where other devices on the line may take the requests for their own (CAN),\n"
    "it says so and asks first; without a terminal it needs --yes. Exit status 1 when nobody answers well.",
    scan_parameters,
    scan_examples,
    run_scan};

}  // namespace absenc::tool
