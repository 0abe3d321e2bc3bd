// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <array>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/subcommand.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

// Prints the encoded request of a command. On CAN and clocked links Unit::encode writes text, which is parsed here.
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
  const bool is_text = unit.link == LinkKind::can || (unit.link == LinkKind::clocked && !encoded.empty());
  const WireFrame frame = is_text
                              ? parse_wire_text(unit.link, command.name, std::string(encoded.begin(), encoded.end()))
                              : WireFrame{.bytes = {encoded.begin(), encoded.end()}, .bits = 0, .can = {}};
  const std::string request = to_wire_text(unit.link, frame.frame());
  if (invocation.has("--json")) {
    print_line(Json::object().set("protocol", unit.id).set("command", command.name).set("request", request).line());
  } else {
    print_line(request);
  }
  return exit_good;
}

constexpr std::array<Parameter, 6> encode_parameters{{
    parameter::protocol,
    parameter::command,
    parameter::arguments,
    parameter::model,
    parameter::protocol_option,
    parameter::json,
}};

constexpr std::array<Example, 3> encode_examples{{
    {"absenc encode tformat position", "1A: the request that asks for everything"},
    {"absenc encode tformat memory-write 5 0x42", "32 05 42 75: the request that writes 42 to address 5"},
    {"absenc encode biss memory-write 5 0x42", "the bits of CDM, one behind each frame"},
}};

}  // namespace

const Subcommand encode_subcommand{
    "encode",
    "print the request of a command as it goes over the wire",
    "Only the request that does the command's work: a procedure may need others before and after it.",
    encode_parameters,
    encode_examples,
    run_encode};

}  // namespace absenc::tool
