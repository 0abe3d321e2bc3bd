// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "tools/absenc/diagnosis.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/unit_text.hpp"
#include "tools/absenc/wire_text.hpp"

namespace absenc::tool {

namespace {

WireFrame frame_of(const Unit& unit, const Invocation& invocation, std::string_view option) {
  if (!invocation.has(option)) return {};
  return parse_wire_text(unit.link, option, invocation.text(option));
}

int run_decode(const Invocation& invocation) {
  const Unit& unit = require_unit(invocation.text("protocol"));
  const Options options = require_options(unit, invocation.text("--model"), invocation.texts("--option"));
  const WireFrame request = frame_of(unit, invocation, "--request");
  const WireFrame reply = frame_of(unit, invocation, "--hex");
  if (request.frame().empty() && reply.frame().empty()) {
    throw UsageError("there is nothing to decode: give the frame with --hex, and what was asked with --request");
  }

  const bool json = invocation.has("--json");
  JsonFields fields;
  FieldTable rows;
  FieldSink& sink = json ? static_cast<FieldSink&>(fields) : rows;
  const Error error = unit.decode(options, request.frame(), reply.frame(), sink);
  if (error == Error::none) {
    if (json) {
      print_line(Json::object().set("protocol", unit.id).set("ok", true).set("fields", fields.fields).line());
    } else {
      print_line(table(rows.rows));
    }
    return exit_good;
  }
  const Frame sent = request.frame();
  const Frame received = reply.frame();
  const Diagnosis diagnosis = diagnose(unit, options, sent, received);
  const Explanation explanation =
      unit.explain == nullptr ? Explanation{} : unit.explain(options, error, sent, received);
  std::string message = describe(error, explanation.found, diagnosis.finding);
  const std::string_view advice = diagnosis.advice.empty() ? explanation.advice : diagnosis.advice;
  if (!advice.empty()) message += fmt::format(": {}", advice);
  if (json) {
    print_line(Json::object()
                   .set("protocol", unit.id)
                   .set("ok", false)
                   .set("error", text_of(error).name)
                   .set("message", message)
                   .line());
  } else {
    print_message(fmt::format("{}: {}", text_of(error).name, message));
  }
  return exit_failed;
}

constexpr std::array<Parameter, 6> parameters{{
    parameter::protocol,
    {"--hex", "FRAME",
     "the reply: hexadecimal bytes with or without spaces, commas and 0x; a CAN frame as ID:DATA; "
     "a clocked word as a string of 0 and 1"},
    {"--request", "FRAME", "the request it answers; without --hex the request itself is decoded"},
    parameter::model,
    parameter::protocol_option,
    parameter::json,
}};

constexpr std::array<Example, 2> examples{{
    {"absenc decode tformat --request 1A --hex \"1A 00 45 23 01 11 34 12 00 00 4A\"",
     "a position, its turns and alarms"},
    {"absenc decode tformat --hex 0200cdab0165 --option strict=false --json", "without the request, for a program"},
}};

}  // namespace

const Subcommand decode_subcommand{
    "decode",
    "say what a captured frame means, or what is wrong with it",
    "Every check that the protocol allows is made: the first that fails names the error.\n"
    "Exit status 1 for a bad frame.",
    parameters,
    examples,
    run_decode};

}  // namespace absenc::tool
