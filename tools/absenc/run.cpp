// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/run.hpp"
#include "tools/absenc/unit_text.hpp"

namespace absenc::tool {

namespace {

int run_run(const Invocation& invocation) {
  const EncoderUri uri = parse_encoder(invocation.text("encoder"), invocation.texts("--option"));
  const Command& command = require_command(*uri.unit, invocation.text("command"));
  return run_command(invocation, uri, command, require_arguments(command, invocation.texts("arguments")));
}

constexpr std::array<Parameter, 6> parameters{{
    parameter::encoder,
    parameter::command,
    parameter::arguments,
    parameter::yes,
    parameter::json,
    parameter::option,
}};

constexpr std::array<Example, 2> examples{{
    {"absenc run tformat:/dev/ttyUSB0 temperature", "how warm the encoder is"},
    {"absenc run tformat:/dev/ttyUSB0 memory-write 5 0x42 --yes", "write a byte of its memory without being asked"},
}};

}  // namespace

int run_command(const Invocation& invocation, const EncoderUri& uri, const Command& command, Arguments arguments) {
  os::catch_interrupts();
  if (command.changes_encoder && must_ask(invocation, uri, command.name, command.meaning) &&
      !confirmed(uri, command.meaning)) {
    print_message("nothing was changed");
    return exit_failed;
  }

  const std::unique_ptr<Encoder> encoder = Encoder::open(uri);
  JsonFields fields;
  FieldTable rows;
  const bool json = invocation.has("--json");
  try {
    run_into(*encoder, command, arguments, json ? static_cast<FieldSink&>(fields) : rows);
  } catch (const os::Interrupted&) {
    if (!command.changes_encoder) throw;
    throw ToolFailure(
        fmt::format("interrupted in the middle of {}: whether it was done is not known, read the encoder "
                    "before you try again",
                    command.name));
  }
  print_line(json ? Json::object().set("ok", true).set("fields", fields.fields).line() : table(rows.rows));
  return exit_good;
}

void run_into(Encoder& encoder, const Command& command, Arguments arguments, FieldSink& sink) {
  const Outcome outcome = encoder.run(command, arguments);
  if (outcome.error != Error::none) throw CommandFailure(encoder.trouble(outcome));
  encoder.report(sink);
}

const Subcommand run_subcommand{"run",
                                "run a command of the protocol: memory, temperature, zero, reset ...",
                                "Commands that change the encoder ask first. Without a terminal they need --yes.",
                                parameters,
                                examples,
                                run_run};

}  // namespace absenc::tool
