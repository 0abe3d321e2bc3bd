// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "absenc/client/port/address.hpp"
#include "absenc/client/port/named_encoder.hpp"
#include "absenc/client/text/known_name.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/clause.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string option_values(const Unit& unit, const Model& model) {
  std::vector<std::string> settings;
  for (const OptionValue& value : model.values) {
    const Option& option = unit.options[value.option];
    settings.push_back(fmt::format("{}={}", option.name, to_text(option, value.value)));
  }
  return fmt::format("{}", fmt::join(settings, " "));
}

std::string argument_names(const Command& command) {
  std::string text(command.name);
  for (const Argument& argument : command.arguments) {
    text += argument.required ? fmt::format(" <{}>", argument.name) : fmt::format(" [{}]", argument.name);
  }
  return text;
}

// Returns rows as text, indented below their heading; "" without rows.
std::string section(std::string_view heading, Rows rows) {
  if (rows.empty()) return {};
  for (auto& row : rows) row.front().insert(0, "  ");
  return fmt::format("\n{}\n{}", heading, table(rows));
}

// Returns the description of the unit's line with the options of `model`.
std::string line_of_model(const Unit& unit, const Model& model) {
  Options options;
  static_cast<void>(resolve_options(unit, model.name, {},
                                    // The result of `resolve_options` is not checked, because a model of the unit
                                    // itself is always valid.
                                    options));
  return line_of(unit.link, line_settings(unit, options));
}

std::string encoders_of(std::span<const Unit* const> units) {
  Rows rows{{"PROTOCOL", "MODEL", "WHAT", "LINE"}};
  for (const Unit* unit : units) {
    for (const Model& model : unit->models) {
      rows.push_back(
          {std::string(unit->id), std::string(model.name), std::string(model.meaning), line_of_model(*unit, model)});
    }
    if (unit->models.empty()) rows.push_back({std::string(unit->id), "", std::string(unit->name), line_of(*unit)});
  }
  return table(rows) + "\n`absenc list <protocol>` shows its models, options, commands and fields.";
}

Rows option_rows(const Unit& unit) {
  Rows rows;
  for (const Option& option : unit.options) {
    rows.push_back({std::string(option.name), range_of(option),
                    fmt::format("default {}", to_text(option, option.default_value)), std::string(option.meaning)});
  }
  if (!takes_word(unit)) return rows;
  std::vector<std::string_view> others;
  for (const Option& option : unit.options) {
    if (option.describes_word) others.push_back(option.name);
  }
  rows.push_back({std::string(word_option_name), "a word format, see below", "",
                  fmt::format("the fields of the position word, in place of {}", fmt::join(others, ", "))});
  return rows;
}

// Returns rows that explain how position words are written, as in protocol/word_format.hpp.
Rows word_rows(const Unit& unit) {
  if (!takes_word(unit)) return {};
  return {
      {"word", "items with a space between them, from the MSB on, as in \"multiturn:12 position:24 error:1!\""},
      {"item", "[NAME=]MEANING:BITS[!], or gray"},
      {"", "NAME: letters, digits and _; !: active low; gray: multiturn and position are one Gray-coded number"},
      {"MEANING", fmt::format("one of {}", fmt::join(meaning_names, ", "))},
      {"  parity", "even over all bits before it, with ! odd"},
      {"  value", "any other number: shown by its name"},
      {"  skip", "nothing; sent as 0"},
  };
}

Rows port_rows() {
  Rows rows;
  for (const LinkParameter& parameter : link_parameters) {
    rows.push_back({fmt::format("{}={}", parameter.name, parameter.value), std::string(parameter.port_kinds),
                    std::string(parameter.meaning)});
  }
  return rows;
}

Rows command_rows(const Unit& unit) {
  Rows rows;
  for (const Command& command : unit.commands) {
    std::string meaning(command.meaning);
    if (command.changes_encoder) meaning += " (changes the encoder)";
    rows.push_back({argument_names(command), meaning});
    for (const Argument& argument : command.arguments) {
      std::string words = fmt::format("{} ({} to {})", argument.meaning, argument.minimum, argument.maximum);
      if (!argument.required) words += fmt::format(", default {}", argument.default_value);
      rows.push_back({fmt::format("  {}", argument.name), "  " + words});
    }
  }
  return rows;
}

Rows register_rows(const Unit& unit) {
  Rows rows;
  for (const RegisterInfo& one : unit.registers) {
    const std::string_view access = !one.writable ? "read only" : one.readable ? "read and write" : "write only";
    rows.push_back({std::string(one.name), fmt::format("0x{:02X}", one.address),
                    fmt::format("{} byte{}", one.size, one.size == 1 ? "" : "s"), std::string(access)});
  }
  return rows;
}

Rows memory_rows(const Unit& unit) {
  Rows rows;
  for (const MemoryArea& area : unit.memory) {
    const std::uint32_t last = area.first + area.count - 1;
    const std::string to = last == area.first ? "" : fmt::format(" to 0x{:02X}", last);
    std::string writes = area.writable ? "" : "read only";
    if (!area.protection.empty()) writes = "written only with --force";
    if (area.write_life != 0 && area.protection.empty()) writes = life_of(area);
    const std::string pages = area.pages == 1 ? "" : fmt::format(" to {}", area.page + area.pages - 1);
    rows.push_back(
        {fmt::format("page {}{}: 0x{:02X}{}", area.page, pages, area.first, to), std::string(area.meaning), writes});
  }
  return rows;
}

Rows field_rows(const Unit& unit) {
  Rows rows;
  for (const FieldInfo& field : unit.fields) {
    rows.push_back({std::string(field.name), std::string(field.unit), std::string(field.meaning)});
    for (const FlagInfo* flag : raised(field, ~0ull)) {
      rows.push_back({fmt::format("  {}", flag->name), "", std::string(flag->meaning)});
      if (!flag->action.empty()) rows.push_back({"", "", fmt::format("  -> {}", flag->action)});
    }
  }
  return rows;
}

Rows condition_rows(const Unit& unit) {
  Rows rows;
  for (const Condition& condition : unit.conditions) {
    rows.push_back({std::string(condition.name), range_of(condition), fmt::format("normally {}", condition.normal),
                    std::string(condition.meaning)});
  }
  return rows;
}

std::string details(const Unit& unit) {
  std::string text = table(Rows{{std::string(unit.id), std::string(unit.name)},
                                {"document", std::string(unit.document)},
                                {"line", line_of(unit)}});
  Rows models;
  for (const Model& model : unit.models) {
    models.push_back({std::string(model.name), std::string(model.meaning), option_values(unit, model)});
  }
  text += section("Models (--model NAME, or ?model=NAME behind an encoder; the first is the default)", models);
  text += section("Options (--option NAME=VALUE, or ?NAME=VALUE behind an encoder)", option_rows(unit));
  text += section("A word format (the position word of an encoder that the options do not describe)", word_rows(unit));
  text += section("Settings of the port (?NAME=VALUE behind an encoder)", port_rows());
  text += section(fmt::format("Commands (absenc run {}:PORT <command>)", unit.id), command_rows(unit));
  text += section(fmt::format("Registers (absenc memory read {}:PORT <name>)", unit.id), register_rows(unit));
  text += section(fmt::format("Memory (absenc memory read {}:PORT <address> --page P)", unit.id), memory_rows(unit));
  text += section("Fields", field_rows(unit));
  text += section(fmt::format("Conditions of the virtual encoder (emulate --condition NAME=VALUE, "
                              "\"sim:{}?condition=NAME=VALUE\")",
                              unit.id),
                  condition_rows(unit));
  return text;
}

Json models_json(const Unit& unit) {
  return Json::list(unit.models, [&](const Model& model) {
    Json options = Json::object();
    for (const OptionValue& value : model.values) {
      const Option& option = unit.options[value.option];
      options.set(option.name, client::to_json(option, value.value));
    }
    return Json::object()
        .set("name", model.name)
        .set("meaning", model.meaning)
        .set("maximum_rpm", model.maximum_rpm)
        .set("options", options);
  });
}

// Returns `json`, with the key "role" added if the field or option has a role.
Json with_role(Json json, Role role) {
  const std::string_view name = name_of(role);
  return name.empty() ? json : json.set("role", name);
}

Json options_json(const Unit& unit) {
  return Json::list(unit.options, [](const Option& option) {
    Json json = Json::object().set("name", option.name).set("meaning", option.meaning);
    json.set("default", client::to_json(option, option.default_value));
    json = with_role(std::move(json), option.role);
    if (option.choices.empty()) {
      if (option.or_zero) json.set("or_zero", true);
      json.set("minimum", client::to_json(option, option.minimum))
          .set("maximum", client::to_json(option, option.maximum));
      return option.step == 1 ? json : json.set("step", client::to_json(option, option.step));
    }
    Json choices = Json::array();
    for (std::size_t i = 0; i < option.choices.size(); ++i) {
      choices.append(client::to_json(option, static_cast<std::int64_t>(i)));
    }
    return json.set("choices", choices);
  });
}

Json argument_json(const Argument& argument) {
  Json json = Json::object().set("name", argument.name).set("meaning", argument.meaning);
  json.set("minimum", argument.minimum).set("maximum", argument.maximum).set("required", argument.required);
  return argument.required ? json : json.set("default", argument.default_value);
}

Json commands_json(const Unit& unit) {
  return Json::list(unit.commands, [](const Command& command) {
    return Json::object()
        .set("name", command.name)
        .set("verb", name_of(command.verb))
        .set("meaning", command.meaning)
        .set("changes_encoder", command.changes_encoder)
        .set("arguments", Json::list(command.arguments, argument_json));
  });
}

Json registers_json(const Unit& unit) {
  return Json::list(unit.registers, [](const RegisterInfo& one) {
    return Json::object()
        .set("name", one.name)
        .set("address", one.address)
        .set("size", one.size)
        .set("readable", one.readable)
        .set("writable", one.writable);
  });
}

Json memory_json(const Unit& unit) {
  return Json::list(unit.memory, [](const MemoryArea& area) {
    return Json::object()
        .set("page", area.page)
        .set("pages", area.pages)
        .set("first", area.first)
        .set("count", area.count)
        .set("meaning", area.meaning)
        .set("writable", area.writable)
        .set("in_dump", area.in_dump)
        .set("write_life", area.write_life)
        .set("write_life_in_total", area.life_in_total)
        .set("protection", area.protection);
  });
}

Json fields_json(const Unit& unit) {
  static constexpr std::array<std::string_view, 7> kinds{"number", "counts", "boolean", "flags",
                                                         "real",   "text",   "bytes"};
  return Json::list(unit.fields, [](const FieldInfo& field) {
    Json json = Json::object().set("name", field.name).set("kind", kinds[static_cast<std::size_t>(field.kind)]);
    json.set("unit", field.unit).set("meaning", field.meaning);
    json = with_role(std::move(json), field.role);
    const Json flags = Json::list(raised(field, ~0ull), flag_to_json);
    return flags.empty() ? json : json.set("flags", flags);
  });
}

Json conditions_json(const Unit& unit) {
  return Json::list(unit.conditions, [](const Condition& condition) {
    return Json::object()
        .set("name", condition.name)
        .set("unit", condition.unit)
        .set("meaning", condition.meaning)
        .set("minimum", condition.minimum)
        .set("maximum", condition.maximum)
        .set("normal", condition.normal);
  });
}

// Returns a text about the verbs `conform` and `conform-host`: which demands of the unit's document they test.
Json clauses_json(const Unit& unit) {
  const auto json = [](const auto& clause) {
    return Json::object().set("id", clause.id).set("paragraph", clause.paragraph).set("words", clause.words);
  };
  return Json::object()
      .set("encoder", Json::list(clauses_of(unit), json))
      .set("host", Json::list(host_clauses_of(unit), json));
}

Json unit_json(const Unit& unit) {
  static constexpr std::array<std::string_view, 3> parities{"none", "odd", "even"};
  return Json::object()
      .set("protocol", unit.id)
      .set("name", unit.name)
      .set("document", unit.document)
      .set("known_as", Json::list(unit.known_as))
      .set("link", name_of(unit.link))
      .set("line", Json::object()
                       .set("rate", unit.line.rate == 0 ? Json() : Json(unit.line.rate))
                       .set("parity", parities[static_cast<std::size_t>(unit.line.parity)])
                       .set("stop_bits", unit.line.stop_bits))
      .set("models", models_json(unit))
      .set("options", options_json(unit))
      .set("takes_word", takes_word(unit))
      .set("commands", commands_json(unit))
      .set("memory", memory_json(unit))
      .set("registers", registers_json(unit))
      .set("fields", fields_json(unit))
      .set("conditions", conditions_json(unit))
      .set("clauses", clauses_json(unit));
}

Json name_json(std::string_view name, const EncoderAddress& uri) {
  return Json::object()
      .set("name", name)
      .set("encoder", address_of(uri))
      .set("protocol", uri.unit->id)
      .set("model", uri.options.model == nullptr ? Json() : Json(uri.options.model->name))
      .set("options", options_to_json(*uri.unit, uri.options));
}

// Parses all addresses first, so that nothing is printed if one is wrong.
int list_names(bool json) {
  const NamedEncoders names = require_names("the names are those of absenc.toml");
  Rows rows{{"NAME", "ENCODER", "MODEL"}};
  std::string lines;
  for (const FileSection& encoder : names.file().encoders) {
    const EncoderAddress uri = parse_address(encoder.name, names);
    rows.push_back({encoder.name, address_of(uri), std::string(uri.options.model ? uri.options.model->name : "")});
    lines += name_json(encoder.name, uri).line() + '\n';
  }
  if (!json) print_line(table(rows) + fmt::format("\nThey are written in {}.", names.file().path));
  if (json && !lines.empty()) print_line(lines);
  return exit_good;
}

int run_list(const Invocation& invocation) {
  const bool json = invocation.has("--json");
  if (invocation.has("--names")) {
    if (invocation.has("name")) throw UsageError("--names lists encoders of any protocol: give no protocol");
    return list_names(json);
  }
  const std::string_view word = invocation.text("name");
  const std::optional<KnownName> known = find_known_name(word);
  std::vector<const Unit*> units(all_units().begin(), all_units().end());
  if (!word.empty()) units = known ? known->units : std::vector{&require_unit(word)};
  if (json) {
    for (const Unit* unit : units) print_line(unit_json(*unit).line());
    return exit_good;
  }
  if (known) print_line(known->sentence() + "\n");
  print_line(units.size() == 1 ? details(*units.front()) : encoders_of(units));
  return exit_good;
}

constexpr std::array<Parameter, 3> list_parameters{{
    {"name", "", "a protocol: its models, options, commands and fields; or a maker or model: its protocols"},
    {"--names", "", "show the encoders that absenc.toml gives names to, and check their settings"},
    {"--json", "", "one JSON object a line, one line for each protocol or name"},
}};

constexpr std::array<Example, 4> list_examples{{
    {"absenc list", "every supported encoder"},
    {"absenc list tformat", "all about one protocol"},
    {"absenc list tamagawa", "the protocol of a maker, also of a model"},
    {"absenc list --names", "your own encoders, by the names you gave them"},
}};

}  // namespace

const Subcommand list_subcommand{
    "list",
    "show the supported encoders, their options and commands, or your own by name",
    "absenc.toml gives names to encoders, for `absenc read elbow` and every other verb:\n"
    "  [defaults]             # for every encoder, where they fit\n"
    "  echo = \"auto\"\n"
    "  [bus.arm]              # a line that several encoders share\n"
    "  port = \"/dev/ttyUSB0\"  # or \"tcp:192.168.1.20:4001\", \"spi:/dev/spidev0.0\", or \"sim\"\n"
    "  latency = 5\n"
    "  [encoder.elbow]        # all that can stand behind ? in an encoder; lists for what may be repeated\n"
    "  protocol = \"tformat\"\n"
    "  bus = \"arm\"            # or port = ...\n"
    "  model = \"23-bit\"\n"
    "It is the file that ABSENC_CONFIG names, or else ./absenc.toml, or else ~/.config/absenc/absenc.toml.\n"
    "What stands behind the name (\"elbow?latency=20\") and --option override it.",
    list_parameters,
    list_examples,
    run_list};

}  // namespace absenc::tool
