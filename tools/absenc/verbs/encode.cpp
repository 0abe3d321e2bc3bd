// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>
#include <sstream>

#include "absenc/client/emulation/answer.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

// Returns the settings in the values of the option --reply, each of the form "NAME=VALUE NAME=VALUE".
std::vector<std::string> reply_settings(std::span<const std::string> texts) {
  std::vector<std::string> settings;
  for (const std::string& text : texts) {
    std::istringstream words(text);
    for (std::string word; words >> word;) settings.push_back(word);
  }
  return settings;
}

// Returns a virtual encoder's reply to the last request of the command. Throws UsageError.
std::string reply_of(const Invocation& invocation, const Unit& unit, const Command& command, Arguments arguments) {
  std::vector<std::string> settings = reply_settings(invocation.texts("--reply"));
  for (const std::string& option : invocation.texts("--option")) settings.push_back(option);
  if (invocation.has("--model")) settings.push_back(fmt::format("model={}", invocation.text("--model")));
  const Attempted answered = answer_of(parse_address(fmt::format("sim:{}", unit.id), settings), command, arguments);
  if (!answered.exchange.reply.frame().empty()) return to_wire_text(unit.link, answered.exchange.reply.frame());
  throw UsageError(fmt::format("the virtual encoder sends no reply to {}: {}. Try: {}", command.name,
                               text_of(answered.error).description, text_of(answered.error).advice));
}

// On CAN and clocked links Unit::encode writes the frame as text, which is parsed here.
int run_encode(const Invocation& invocation) {
  const Unit& unit = require_unit(invocation.text("protocol"));
  const Options options = require_options(unit, invocation.text("--model"), invocation.texts("--option"));
  const Command& command = require_command(unit, invocation.text("command"));
  const std::vector<std::int64_t> arguments = require_arguments(command, invocation.texts("arguments"));

  std::array<std::uint8_t, longest_encoded> bytes;
  const Result<std::size_t> size = unit.encode(options, command, arguments, bytes);
  if (!size) {
    throw UsageError(fmt::format("{} cannot be encoded: {}. Try: {}", command.name, text_of(size.error()).description,
                                 text_of(size.error()).advice));
  }
  const Bytes encoded = Bytes(bytes).first(*size);
  const bool is_text = unit.link == LinkKind::can || (carries_bits(unit.link) && !encoded.empty());
  const WireFrame frame = is_text
                              ? parse_wire_text(unit.link, command.name, std::string(encoded.begin(), encoded.end()))
                              : WireFrame{.bytes = {encoded.begin(), encoded.end()}, .bits = 0, .can = {}};
  const std::string request = to_wire_text(unit.link, frame.frame());
  Json json = Json::object().set("protocol", unit.id).set("command", command.name).set("request", request);
  std::string text = request;
  if (invocation.has("--reply")) {
    text = reply_of(invocation, unit, command, arguments);
    json.set("reply", text);
  }
  print_line(invocation.has("--json") ? json.line() : text);
  return exit_good;
}

constexpr std::array<Parameter, 7> encode_parameters{{
    parameter::protocol,
    parameter::command,
    parameter::arguments,
    {"--reply", "NAME=VALUE",
     "print the reply of a virtual encoder with these values, as for sim:: singleturn, multiturn, "
     "alarm, condition, options of the protocol; several with a space between them, or given more than once",
     "", false, true},
    parameter::model,
    parameter::protocol_option,
    parameter::json,
}};

constexpr std::array<Example, 4> encode_examples{{
    {"absenc encode tformat position", "1A: the request that asks for everything"},
    {"absenc encode tformat memory-write 5 0x42", "32 05 42 75: the request that writes 42 to address 5"},
    {"absenc encode tformat position --reply \"singleturn=74565 multiturn=4660\"",
     "1A 00 45 23 01 11 34 12 00 00 4A: the reply at this position"},
    {"absenc encode biss memory-write 5 0x42", "the bits of CDM, one behind each frame"},
}};

}  // namespace

const Subcommand encode_subcommand{
    "encode",
    "print the request of a command, or the reply to it, as it goes over the wire",
    "Only the request that does the command's work: a procedure may need others before and after it.\n"
    "The reply is that to the last request of the command.",
    encode_parameters,
    encode_examples,
    run_encode};

}  // namespace absenc::tool
