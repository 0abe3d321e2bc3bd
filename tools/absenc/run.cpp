// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <iostream>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/encoder.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/run.hpp"
#include "tools/absenc/unit_text.hpp"

namespace absenc::tool {

namespace {

// Only y and yes go on.
bool confirmed(const Command& command, const EncoderUri& uri) {
  const std::string where = uri.place == Place::serial ? uri.path : fmt::format("{}:{}", uri.host, uri.port);
  print_prompt(fmt::format("This changes the encoder at {}: {}. Go on? [y/N] ", where, command.meaning));
  pollfd input{0, POLLIN, 0};
  try {
    os::wait_for({&input, 1}, never);
  } catch (const os::Interrupted&) {
    print_note("");
    throw;
  }
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "yes";
}

// The virtual encoder of sim: is gone afterwards anyway.
bool must_ask(const Command& command, const EncoderUri& uri, const Invocation& invocation) {
  if (!command.changes_encoder || uri.place == Place::sim || invocation.has("--yes")) return false;
  if (can_ask()) return true;
  throw UsageError(fmt::format("{} changes the encoder ({}) and nobody is there to be asked: give --yes to do it",
                               command.name, command.meaning));
}

int run_run(const Invocation& invocation) {
  const EncoderUri uri = parse_encoder(invocation.text("encoder"), invocation.texts("--option"));
  const Command& command = require_command(*uri.unit, invocation.text("command"));
  return run_command(invocation, uri, command, require_arguments(command, invocation.texts("arguments")));
}

constexpr std::array<Parameter, 6> parameters{{
    {"encoder", "", "as for `absenc read`", "", true},
    {"command", "", "a command of the protocol: see `absenc list <protocol>`", "", true},
    {"arguments", "", "those of the command: decimal numbers, or hexadecimal with 0x", "", false, true},
    {"--yes", "", "do not ask before the encoder is changed"},
    {"--json", "", "one JSON object"},
    {"--option", "NAME=VALUE", "sets an option of the protocol or of the port, as behind the encoder", "", false, true},
}};

constexpr std::array<Example, 2> examples{{
    {"absenc run tformat:/dev/ttyUSB0 temperature", "how warm the encoder is"},
    {"absenc run tformat:/dev/ttyUSB0 memory-write 5 0x42 --yes", "write a byte of its memory without being asked"},
}};

}  // namespace

int run_command(const Invocation& invocation, const EncoderUri& uri, const Command& command, Arguments arguments) {
  os::catch_interrupts();
  if (must_ask(command, uri, invocation) && !confirmed(command, uri)) {
    print_message("nothing was changed");
    return exit_failed;
  }

  const std::unique_ptr<Encoder> encoder = Encoder::open(uri);
  const Outcome outcome = encoder->run(command, arguments);
  const bool json = invocation.has("--json");
  if (outcome.error != Error::none) {
    const Trouble trouble = encoder->trouble(outcome);
    if (json) {
      print_line(trouble.json().line());
    } else {
      print_message(trouble.text());
    }
    return exit_failed;
  }
  if (json) {
    JsonFields fields;
    encoder->report(fields);
    print_line(Json::object().set("ok", true).set("fields", fields.fields).line());
  } else {
    FieldTable rows;
    encoder->report(rows);
    print_line(table(rows.rows));
  }
  return exit_good;
}

const Subcommand run_subcommand{"run",
                                "run a command of the protocol: memory, temperature, zero, reset ...",
                                "Commands that change the encoder ask first. Without a terminal they need --yes.",
                                parameters,
                                examples,
                                run_run};

}  // namespace absenc::tool
