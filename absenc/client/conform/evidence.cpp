// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/conform/evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"

namespace absenc::client {

namespace {

using capture::ObservedExchange;
using capture::ObservedFrame;

std::size_t bits_of(const ObservedFrame& frame) {
  if (frame.can) return std::size_t{frame.can->size} * 8;
  return frame.bits != 0 ? frame.bits : frame.bytes.size() * 8;
}

// Flips the bit `bit` of the frame; on clocked links bit 0 is the most significant of its byte.
void flip(ObservedFrame& frame, std::size_t bit) {
  std::uint8_t& byte = frame.can ? frame.can->data[bit / 8] : frame.bytes[bit / 8];
  byte = static_cast<std::uint8_t>(byte ^ (frame.bits != 0 ? 0x80U >> bit % 8 : 1U << bit % 8));
}

void resize(ObservedFrame& frame, int by) {
  if (frame.can) {
    frame.can->size = static_cast<std::uint8_t>(std::clamp(frame.can->size + by, 0, 8));
  } else {
    frame.bytes.resize(frame.bytes.size() + static_cast<std::size_t>(by));
  }
}

// Returns the request of a command with valid arguments; empty if it cannot be encoded, and always on clocked links.
ObservedFrame request_of(const Unit& unit, const Options& options, const Command& command) {
  std::array<std::uint8_t, longest_request> bytes{};
  std::vector<std::int64_t> arguments;
  for (const Argument& one : command.arguments) {
    arguments.push_back(one.required ? std::max<std::int64_t>(one.minimum, 1) : one.default_value);
  }
  const auto size = unit.encode(options, command, arguments, bytes);
  // on clocked links a request has no frame of its own: its bits are spread over several frames
  if (!size || *size == 0 || unit.link == LinkKind::clocked) return {};
  const Bytes request = Bytes(bytes).first(*size);
  if (unit.link != LinkKind::can) return {.bytes = {request.begin(), request.end()}};
  const std::string text(request.begin(), request.end());
  return {.can = parse_wire_text(unit.link, "a request", text).can};
}

// Returns the requests of all commands to this encoder and, if the unit has addresses, to another encoder.
std::vector<ObservedFrame> other_requests(const Unit& unit, const Options& options) {
  std::vector<ObservedFrame> requests;
  const auto add = [&](const Options& with, const Command& command) {
    ObservedFrame request = request_of(unit, with, command);
    if (!request.frame().empty()) requests.push_back(std::move(request));
  };
  for (const Command& command : unit.commands) add(options, command);
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (unit.options[i].role != Role::encoder) continue;
    Options other = options;
    other.values[i] += options.values[i] == unit.options[i].maximum ? -1 : 1;
    for (const Command& command : unit.commands) add(other, command);
  }
  return requests;
}

bool holds(const Unit& unit, const Options& options, std::string_view need) {
  const std::size_t end = need.find_first_of("!=");
  const bool equal = need[end] == '=';
  const std::string_view name = need.substr(0, end);
  const std::string_view wanted = need.substr(need.find('=') + 1);
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    if (unit.options[i].name == name) return (to_text(unit.options[i], options.values[i]) == wanted) == equal;
  }
  return false;
}

}  // namespace

std::vector<std::uint8_t> request_of_ask(const Unit& unit, const Options& options, const Ask& ask) {
  if (!ask.wire.empty()) {
    if (unit.link == LinkKind::can) return {ask.wire.begin(), ask.wire.end()};
    return parse_wire_text(unit.link, "a request", ask.wire).bytes;
  }
  std::vector<std::uint8_t> request(longest_request);
  const Command* const command = ask.command.empty() ? find_command(unit, Verb::read) : find_command(unit, ask.command);
  std::vector<std::int64_t> arguments(ask.arguments.begin(), ask.arguments.end());
  while (arguments.size() < command->arguments.size()) {
    arguments.push_back(command->arguments[arguments.size()].default_value);
  }
  const Result<std::size_t> size =
      ask.make != nullptr ? ask.make(options, request) : unit.encode(options, *command, arguments, request);
  request.resize(size ? *size : 0);
  if (ask.wrong_end && !request.empty()) request.back() ^= 1;
  return request;
}

std::string reason_against(const Unit& unit, const Options& options, const Clause& clause) {
  std::string_view rest = clause.needs;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    const std::string_view need = rest.substr(0, end);
    if (!holds(unit, options, need)) return fmt::format("it is demanded with {} only", need);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return {};
}

Error reply_error(const Unit& unit, const Options& options, std::string_view command,
                  const ObservedExchange& exchange) {
  if (exchange.reply.frame().empty()) return Error::timeout;
  const ObservedFrame request =
      command.empty() ? exchange.request : request_of(unit, options, *find_command(unit, command));
  return unit.check(options, request.frame(), exchange.reply.frame());
}

std::size_t detected_changes(const Unit& unit, const Options& options, const ObservedExchange& good, Errors errors) {
  std::size_t noticed = 0;
  const auto try_one = [&](const ObservedFrame& request, const ObservedFrame& reply) {
    noticed += (errors & any_of(unit.check(options, request.frame(), reply.frame()))) != 0 ? 1 : 0;
  };
  for (std::size_t bit = 0; bit < bits_of(good.reply); ++bit) {
    ObservedFrame changed = good.reply;
    flip(changed, bit);
    try_one(good.request, changed);
  }
  for (const int by : {-1, 1}) {
    if (good.reply.bytes.empty() && !good.reply.can) break;
    ObservedFrame changed = good.reply;
    resize(changed, by);
    try_one(good.request, changed);
  }
  for (const ObservedFrame& request : other_requests(unit, options)) try_one(request, good.reply);
  // On a clocked link, the checksum is not a byte at the end of the frame, so it cannot be corrected below.
  if (unit.link == LinkKind::clocked) return noticed;
  // A change of a bit would be hidden by a wrong checksum, so each value of the last byte is tried as the checksum.
  ObservedFrame changed = good.reply;
  for (std::size_t bit = 0; noticed == 0 && changed.bytes.size() > 2 && bit < bits_of(good.reply) - 8; ++bit) {
    flip(changed, bit);
    for (unsigned last = 0; last < 256 && noticed == 0; ++last) {
      changed.bytes.back() = static_cast<std::uint8_t>(last);
      try_one(good.request, changed);
    }
    flip(changed, bit);
  }
  return noticed;
}

std::optional<std::int64_t> encoder_of(const Unit& unit, const Options& options, const Frame& request) {
  struct Found final : FieldSink {
    void put(const FieldValue& field) override {
      if (field.info->role == Role::encoder) encoder = field.number;
    }
    std::optional<std::int64_t> encoder;
  } found;
  return unit.decode(options, request, {}, found) == Error::none ? found.encoder : std::nullopt;
}

std::string exchange_text(LinkKind link, const Frame& request, const Frame& reply) {
  return fmt::format("to {} came {}", request.empty() ? "a pulse" : to_wire_text(link, request),
                     reply.empty() ? "nothing" : to_wire_text(link, reply));
}

}  // namespace absenc::client
