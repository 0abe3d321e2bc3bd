// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "absenc/client/encoder/connection.hpp"
#include "absenc/client/identify/candidate.hpp"
#include "absenc/client/reading_columns.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"

namespace absenc::tool {

namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string turns_text(const Resolution& resolution) {
  const std::int64_t count = std::int64_t{1} << resolution.multiturn_bits;
  const std::int64_t least = resolution.multiturn_signed ? -count / 2 : 0;
  return fmt::format("{} bits of turns ({} to {})", resolution.multiturn_bits, least, least + count - 1);
}

std::string resolution_text(const Resolution& resolution) {
  if (resolution.unit_um > 0) return fmt::format("{} bits of {} um", resolution.singleturn_bits, resolution.unit_um);
  std::vector<std::string> parts;
  if (resolution.singleturn_bits != 0) parts.push_back(fmt::format("{} bits in a turn", resolution.singleturn_bits));
  if (resolution.multiturn_bits != 0) parts.push_back(turns_text(resolution));
  return fmt::format("{}", fmt::join(parts, ", "));
}

// Returns the options of the address that differ from their defaults, as text.
std::string options_in_short(const EncoderAddress& uri) {
  const std::vector<std::string> settings = settings_for(*uri.unit, uri.options);
  return settings.empty() ? "all at their defaults" : fmt::format("{}", fmt::join(settings, " "));
}

Rows identity_rows(const EncoderAddress& uri, bool all) {
  const Unit& unit = *uri.unit;
  const Model* model = uri.options.model;
  Rows rows{{"encoder", address_of(uri)}, {"protocol", std::string(unit.name)}};
  rows.push_back(
      {"model", model == nullptr ? "none with these options" : fmt::format("{}: {}", model->name, model->meaning)});
  rows.push_back({"line", line_of(unit.link, uri.line)});
  if (!all) {
    rows.push_back({"options", options_in_short(uri)});
    return rows;
  }
  std::string_view heading = "options";
  for (const std::string& option : option_texts(unit, uri.options)) {
    rows.push_back({std::string(heading), option});
    heading = "";
  }
  return rows;
}

Json identity_json(const EncoderAddress& uri, const Resolution& resolution) {
  const Unit& unit = *uri.unit;
  Json bits = Json::object().set("singleturn_bits", resolution.singleturn_bits);
  bits.set("multiturn_bits", resolution.multiturn_bits);
  if (resolution.multiturn_bits != 0) bits.set("multiturn_signed", resolution.multiturn_signed);
  if (resolution.unit_um > 0) bits.set("unit_um", resolution.unit_um);
  return Json::object()
      .set("encoder", address_of(uri))
      .set("protocol", unit.id)
      .set("model", uri.options.model == nullptr ? Json() : Json(uri.options.model->name))
      .set("link", name_of(unit.link))
      .set("rate", uri.line.rate == 0 ? Json() : Json(uri.line.rate))
      .set("resolution", bits)
      .set("options", options_to_json(unit, uri.options));
}

/// Collects the fields that `info` shows without --all, such as the identity.
class CardRows final : public FieldSink {
 public:
  explicit CardRows(const Command& command) : command_(command) {}

  void put(const FieldValue& value) override {
    const FieldInfo& info = *value.info;
    std::string name(info.name);
    std::replace(name.begin(), name.end(), '_', ' ');
    const std::string text = info.unit.empty() ? to_text(value) : fmt::format("{} {}", to_text(value), info.unit);
    if (command_.verb == Verb::temperature && info.unit == "degC") rows.push_back({std::string(command_.name), text});
    if (command_.verb == Verb::info && info.role == Role::identity && info.unit.empty()) rows.push_back({name, text});
    const bool is_way = info.role == Role::encoder || info.role == Role::rate;
    if (command_.verb == Verb::config_get && is_way) rows.push_back({name, text});
  }

  Rows rows;

 private:
  const Command& command_;
};

/// Reads the identity, settings and state of an encoder, and makes rows of text and JSON from them.
class Survey {
 public:
  /// Opens the encoder. `all`: collect every field and setting as rows.
  Survey(const EncoderAddress& uri, bool all)
      : encoder_(open_connection(uri)), resolution_(uri.unit->resolution(uri.options)), all_(all) {}

  void ask(const Command& command) {
    const Outcome outcome = encoder_->run(command, require_arguments(command, {}));
    if (outcome.error != Error::none) return fail(command, encoder_->trouble(outcome));
    if (outcome.reading != nullptr) hear(resolution_of(*outcome.reading));
    JsonFields fields;
    encoder_->report(fields);
    answers.set(command.name, Json::object().set("ok", true).set("fields", fields.fields));
    if (!all_) {
      CardRows card(command);
      encoder_->report(card);
      return add_new(std::move(card.rows));
    }
    FieldTable table;
    encoder_->report(table);
    for (std::vector<std::string>& row : table.rows) row.front().insert(0, "  ");
    // A setting that the identity command also reports is already in the table.
    const auto is_shown = [&](const auto& row) { return std::find(rows.begin(), rows.end(), row) != rows.end(); };
    if (command.verb == Verb::config_get && std::all_of(table.rows.begin(), table.rows.end(), is_shown)) return;
    add_heading(command);
    std::move(table.rows.begin(), table.rows.end(), std::back_inserter(rows));
  }

  void read() {
    const Unit& unit = encoder_->unit();
    const Outcome outcome = encoder_->read();
    const Command& command = *find_command(unit, Verb::read);
    if (outcome.error != Error::none) return fail(command, encoder_->trouble(outcome));
    if (outcome.reading == nullptr) throw Failure("the encoder's reply carries no position");
    const Resolution read_as = resolution_of(*outcome.reading);
    if (heard_ && !same(read_as, resolution_)) return fail(command, contradiction(read_as));
    hear(read_as);
    const Reading reading = checked(*outcome.reading, encoder_->confirmed());
    const ReadingColumns columns(unit, encoder_->uri().options);
    std::vector<Value> values(columns.columns().size());
    columns.fill(reading, values);
    Json json = to_json(Row{columns.columns(), std::move(values)});
    answers.set(command.name, json.set("confirmed", encoder_->confirmed()).set("ok", true));
    const bool is_doubtful = reading.singleturn_valid() != outcome.reading->singleturn_valid();
    const std::string place = reading_text(unit, reading, is_doubtful ? Doubt::unconfirmed : Doubt::none);
    if (all_) {
      add_heading(command);
      below = "  " + place;
    } else {
      rows.push_back({std::string(command.name), place.substr(std::min(place.find_first_not_of(' '), place.size()))});
    }
    const auto add_line = [this](const std::string& line) { below += (below.empty() ? "" : "\n") + line; };
    if (const std::string alarms = alarms_in_words(unit, reading); !alarms.empty()) add_line(alarms);
    if (is_doubtful) add_line("  no two readings in a row agree as well as the fastest shaft allows");
  }

  /// Returns the clock rate in Hz of the last transfer; 0: the port makes no clock.
  [[nodiscard]] std::uint32_t clock_rate() const { return encoder_->clock_rate(); }
  /// Returns the resolution that the encoder has reported; before its first report, that of the options.
  [[nodiscard]] const Resolution& resolution() const { return resolution_; }

  Json answers = Json::object();
  Rows rows;
  // Text below the rows: alarms in words, why a position is doubtful, and with `all` the reading.
  std::string below;
  std::vector<Trouble> troubles;  // one failure for each kind of error: the first that occurred

 private:
  // Adds those of the rows `more` that are not in the table: several commands may report the same value.
  void add_new(Rows more) {
    for (std::vector<std::string>& row : more) {
      if (std::find(rows.begin(), rows.end(), row) == rows.end()) rows.push_back(std::move(row));
    }
  }

  void add_heading(const Command& command) {
    rows.push_back({std::string(command.name), "", std::string(command.meaning)});
  }

  static Resolution resolution_of(const Reading& reading) {
    return {.singleturn_bits = reading.singleturn_bits,
            .multiturn_bits = reading.multiturn_bits,
            .unit_um = reading.unit_um,
            .multiturn_signed = reading.multiturn_signed};
  }
  static bool same(const Resolution& a, const Resolution& b) {
    return a.singleturn_bits == b.singleturn_bits && a.multiturn_bits == b.multiturn_bits && a.unit_um == b.unit_um;
  }

  // Stores the resolution of the first reply that reports one; later replies do not change it.
  void hear(const Resolution& resolution) {
    if (!heard_) resolution_ = resolution;
    heard_ = true;
  }

  [[nodiscard]] Trouble contradiction(const Resolution& read_as) const {
    return {.error = Error::cross_check_failed,
            .message = fmt::format("it would be read as {}, by the options, but the encoder says that it has {}",
                                   resolution_text(read_as), resolution_text(resolution_)),
            .advice = "leave the options out that say otherwise, or give those that the encoder says"};
  }

  void fail(const Command& command, const Trouble& trouble) {
    answers.set(command.name, to_json(trouble));
    const std::string why = fmt::format("{}: {}", text_of(trouble.error).name, trouble.message);
    // If several settings fail one after the other for the same reason, only the first of them gets a row.
    if (command.verb == Verb::config_get && why == std::exchange(failed_setting_, why)) return;
    rows.push_back({std::string(command.name), "FAILED", why});
    const bool is_known = std::any_of(troubles.begin(), troubles.end(),
                                      [&](const Trouble& other) { return other.error == trouble.error; });
    if (!is_known) troubles.push_back(trouble);
  }

  std::unique_ptr<Connection> encoder_;
  Resolution resolution_;
  bool all_;
  bool heard_ = false;          // whether a reply has reported the resolution of the encoder
  std::string failed_setting_;  // error message of the last setting that could not be read
};

int run_info(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  const bool json = invocation.has("--json");
  const bool all = json || invocation.has("--all");
  if (!json) print_line(table(identity_rows(uri, all)) + '\n');
  Survey survey(uri, all);
  for (const Command* command : questions(*uri.unit, uri.options)) survey.ask(*command);
  if (find_command(*uri.unit, Verb::read) != nullptr) survey.read();
  const bool good = survey.troubles.empty();
  const std::uint32_t clock = survey.clock_rate();
  if (json) {
    Json line = identity_json(uri, survey.resolution());
    if (clock != 0) line.set("clock_hz", clock);
    print_line(line.set("answers", survey.answers).set("ok", good).line());
  } else {
    Rows rows{{"resolution", resolution_text(survey.resolution())}};
    if (clock != 0) rows.push_back({"clock", fmt::format("{} Hz", clock)});
    if (all) print_line(table(std::exchange(rows, {})) + '\n');
    rows.insert(rows.end(), survey.rows.begin(), survey.rows.end());
    print_line(table(rows) + survey.below);
    for (const Trouble& trouble : survey.troubles) print_message(trouble.text());
  }
  return good ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 4> info_parameters{{
    parameter::encoder,
    {"--all", "", "every option, every field of every reply, and the settings"},
    parameter::json,
    parameter::option,
}};

constexpr std::array<Example, 3> info_examples{{
    {"absenc info tformat:/dev/ttyUSB0", "who is there, and how it is"},
    {"absenc info tformat:/dev/ttyUSB0 --all", "all that it says of itself"},
    {"absenc info sim:tformat --json", "the same of a virtual encoder, for programs"},
}};

}  // namespace

const Subcommand info_subcommand{
    "info",
    "show who is there: the protocol, the model, and all that the encoder says of itself",
    "First what absenc was told or assumes, then what the encoder answers: its identity, temperature, position and\n"
    "alarms; with --all also each field of these replies, and the settings. What fails is shown in its place and the\n"
    "rest goes on; of settings that fail for the same reason the first is shown.\n"
    "Exit status 1 when anything failed.",
    info_parameters,
    info_examples,
    run_info};

}  // namespace absenc::tool
