// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/probe.hpp"

#include <optional>

#include "absenc/protocol/raa38/modbus/options.hpp"

namespace absenc::raa38::rtu {

namespace {

struct Contradiction {
  std::size_t capture;
  std::string_view why;
};

Result<Request> request_of(const Capture& capture) {
  if (!capture.request.empty()) return decode_request(capture.request);
  Format format;
  if (!capture.reply.empty()) format.address = capture.reply[0];
  return assumed_request(format, capture.reply);
}

/// A good capture of a reading; `reply` is empty where there was none.
struct Look {
  Request request;
  std::optional<Reply> reply;
};

// What is wrong with a capture whatever the options.
std::optional<Contradiction> look_at(std::span<const Capture> captures, std::size_t i, Look& look) {
  constexpr Format most{.bits = 21};
  const Result<Request> request = request_of(captures[i]);
  if (!request) return Contradiction{i, text_of(request.error()).description};
  look = {*request, std::nullopt};
  if (captures[i].reply.empty()) return std::nullopt;
  const Result<Reply> reply = decode_reply(most, *request, captures[i].reply);
  if (reply) look.reply = *reply;
  // A refusal is a good frame, which tells nothing of the bits.
  if (reply || reply.error() == Error::request_rejected) return std::nullopt;
  return Contradiction{i, text_of(reply.error()).description};
}

std::optional<Contradiction> against_bits(std::span<const Capture> captures, unsigned bits) {
  for (std::size_t i = 0; i < captures.size(); ++i) {
    Look look;
    if (const auto wrong = look_at(captures, i, look)) return wrong;
    if (!look.reply || look.request.function != function::read) continue;
    if (look.reply->singleturn >> bits != 0) return Contradiction{i, "the position has more bits"};
    if (look.request.registers == 1 && bits > 16) {
      return Contradiction{i, "one register was answered, and so many bits do not fit"};
    }
  }
  return std::nullopt;
}

std::optional<Contradiction> against_registers(std::span<const Capture> captures, const Format& format) {
  for (std::size_t i = 0; i < captures.size(); ++i) {
    Look look;
    if (const auto wrong = look_at(captures, i, look)) return wrong;
    if (look.request.function == function::read && look.request.registers != format.asked()) {
      return Contradiction{i, "another number of registers was asked for"};
    }
  }
  return std::nullopt;
}

void put(EvidenceSink& sink, std::size_t option, std::int64_t value, const std::optional<Contradiction>& against) {
  constexpr std::string_view agrees = "agrees with all frames";
  sink.put({option, value, !against, against ? against->capture : 0, against ? against->why : agrees});
}

// Puts every value; whether one is possible, which `value` then is: as it was, if that is.
template <class Against>
bool judge(EvidenceSink& sink, std::size_t option, std::int64_t first, std::int64_t last, std::int64_t& value,
           Against&& against) {
  std::optional<std::int64_t> chosen;
  for (std::int64_t i = first; i <= last; ++i) {
    const std::optional<Contradiction> contradiction = against(i);
    put(sink, option, i, contradiction);
    if (!contradiction && (!chosen || i == value)) chosen = i;
  }
  if (chosen) value = *chosen;
  return chosen.has_value();
}

}  // namespace

bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  constexpr std::size_t bits = options.find("bits");
  constexpr std::size_t registers = options.find("registers");
  const Option& range = options.infos[bits];
  const bool bits_found = judge(sink, bits, range.minimum, range.maximum, values.values[bits], [&](std::int64_t value) {
    return against_bits(captures, static_cast<unsigned>(value));
  });
  const bool registers_found =
      judge(sink, registers, 0, 2, values.values[registers], [&](std::int64_t value) -> std::optional<Contradiction> {
        Format format = options.format(values);
        format.registers = static_cast<unsigned>(value);
        return against_registers(captures, format);
      });
  return bits_found && registers_found;
}

}  // namespace absenc::raa38::rtu
