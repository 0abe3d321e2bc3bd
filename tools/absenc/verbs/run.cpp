// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <vector>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"
#include "tools/absenc/text/reading_text.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

int run_run(const Invocation& invocation) {
  const EncoderAddress uri = parse_address(invocation.text("encoder"), invocation.texts("--option"));
  const Command& command = require_command(*uri.unit, invocation.text("command"));
  const std::vector<std::int64_t> arguments = require_arguments(command, invocation.texts("arguments"));
  if (command.verb == Verb::scan) return run_scan_command(invocation, uri, command, arguments);
  return run_command(invocation, uri, command, arguments);
}

// Shows the newest intermediate result of the command as progress.
void show_progress(Progress& progress, const Connection& encoder, const Command& command) {
  if (!progress.visible()) return;
  FieldTable so_far;
  encoder.report(so_far);
  if (so_far.rows.empty()) return;
  const std::vector<std::string>& newest = so_far.rows.back();
  progress.show(fmt::format("{}: {}: {}", command.name, newest[0], newest[1]));
}

// Prints the position before the user is asked, so that the user recognises the encoder.
void show_before(Connection& encoder) {
  if (find_command(encoder.unit(), Verb::read) == nullptr) return;
  const Outcome outcome = encoder.read();
  if (outcome.error != Error::none) {
    const Trouble trouble = encoder.trouble(outcome);
    return print_note(fmt::format("now: not known: {}: {}", text_of(trouble.error).name, trouble.message));
  }
  if (outcome.reading == nullptr) return;
  const std::string text = reading_text(encoder.unit(), *outcome.reading);
  print_note(fmt::format("now: {}", text.substr(std::min(text.find_first_not_of(' '), text.size()))));
}

Outcome run_watched(Connection& encoder, const Command& command, Arguments arguments) {
  Progress progress;
  try {
    return encoder.run(command, arguments, [&] { show_progress(progress, encoder, command); });
  } catch (const os::Interrupted&) {
    if (!command.changes_encoder) throw;
    const Failure failure(fmt::format("interrupted in the middle of {}", command.name));
    throw OfChange<Failure>(failure, encoder.change());
  } catch (const os::Failure& failure) {
    FieldTable left;
    encoder.report_left(left);
    if (left.rows.empty()) throw;
    const std::string text =
        fmt::format("{}\n{} was broken off and has left:\n{}", failure.what(), command.name, table(left.rows));
    throw OfChange<Failure>(Failure(text), text, encoder.change());
  }
}

constexpr std::array<Parameter, 6> run_parameters{{
    parameter::encoder,
    parameter::command,
    parameter::arguments,
    parameter::yes,
    parameter::json,
    parameter::option,
}};

constexpr std::array<Example, 2> run_examples{{
    {"absenc run tformat:/dev/ttyUSB0 temperature", "how warm the encoder is"},
    {"absenc run tformat:/dev/ttyUSB0 memory-write 5 0x42 --yes", "write a byte of its memory without being asked"},
}};

}  // namespace

int run_command(const Invocation& invocation, const EncoderAddress& uri, const Command& command, Arguments arguments) {
  os::catch_interrupts();
  tell_disturbance(uri, command);
  const bool asks = command.changes_encoder && must_ask(invocation, uri, command.name, command.meaning);
  const std::unique_ptr<Connection> encoder =
      command.changes_encoder ? before_change([&] { return open_connection(uri); }) : open_connection(uri);
  if (asks) {
    show_before(*encoder);
    if (!confirmed(uri, command.meaning)) {
      print_message("nothing was changed");
      return exit_failed;
    }
  }
  const Outcome outcome = run_watched(*encoder, command, arguments);
  if (outcome.error != Error::none) throw EncoderFailure(encoder->trouble(outcome));
  JsonFields fields;
  FieldTable rows;
  const bool json = invocation.has("--json");
  encoder->report(json ? static_cast<FieldSink&>(fields) : rows);
  if (outcome.change.state == ChangeState::unknown) {
    print_message(fmt::format("note: {}", outcome.change.text()));
  } else if (!outcome.change.note.empty()) {
    print_message(fmt::format("note: {}", outcome.change.note));
  }
  if (json) {
    Json answer = Json::object().set("ok", !outcome.aborted).set("fields", fields.fields);
    set_change(answer, outcome.change);
    print_line(answer.line());
  } else {
    print_line(table(rows.rows));
  }
  if (!outcome.aborted) return exit_good;
  print_message(fmt::format("interrupted: {} ended early, and what it had changed is as it was before", command.name));
  return exit_failed;
}

const Subcommand run_subcommand{"run",
                                "run a command of the protocol: memory, temperature, zero, reset ...",
                                "Commands that change the encoder ask first. Without a terminal they need --yes.",
                                run_parameters,
                                run_examples,
                                run_run};

}  // namespace absenc::tool
