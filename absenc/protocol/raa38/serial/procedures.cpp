// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/procedures.hpp"

#include <algorithm>

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/raa38/serial/stream.hpp"

namespace absenc::raa38::serial {

namespace {

using namespace author;

constexpr unsigned scan_attempts = 2;

// The newest frame of what comes first.
Part<Result<Position>> hear_one(HostLine& line) {
  StreamDecoder decoder(line.format());
  Position position{.second_byte = line.format().own_second_byte()};
  bool found = false;
  bool anything = false;
  const auto keep = [&](const serial::Found& frame) {
    if (frame.error != Error::none) return;
    position.singleturn = frame.singleturn;
    found = true;
  };
  line.listen(std::max(listen_limit, 4 * line.format().period()));
  while (!found) {
    const HostLine::Heard heard = co_await line.heard();
    if (heard.over) {
      if (!anything) co_return Error::timeout;
      co_return decoder.saw_larger_positions() ? Error::out_of_range : Error::bad_framing;
    }
    anything = true;
    if (heard.bytes.empty()) decoder.disturbed(keep);
    decoder.feed(heard.bytes, line.received_at(), keep);
  }
  co_return position;
}

// The next position, whatever starts a frame.
Part<Result<Position>> look(HostLine& line) {
  Result<Position> position = Error::timeout;
  if (line.format().mode == Mode::timing) {
    position = co_await hear_one(line);
  } else {
    position = co_await line.attempt(position_request(line.format()));
  }
  co_return position;
}

}  // namespace

Procedure set_zero(HostLine& line, Zeroed& found) {
  const Format& format = line.format();
  if (format.zeroing == Zeroing::none) {
    co_return {
        Error::unsupported, "nothing is known of a way to set the zero of this encoder",
        "an encoder that was ordered with zero clearing: zeroing=line (a wire to CLR) or zeroing=command (a bus)"};
  }
  if (format.zeroing == Zeroing::command && format.mode != Mode::bus) {
    co_return {Error::invalid_argument, "BC AA Cx is a command of a bus",
               "set mode=bus, or zeroing=line for a wire to CLR"};
  }
  const Result<Position> first = co_await look(line);
  if (!first) co_return {first.error()};
  co_await line.rest(between_looks);
  const Result<Position> second = co_await look(line);
  if (!second) co_return {second.error()};
  found.before = *second;
  if (!is_near(second->singleturn, first->singleturn, format.bits)) {
    co_return {Error::invalid_argument,
               "the shaft is turning: setting the zero needs it standing still; nothing was sent", "stop the shaft"};
  }
  const Request by_command{Request::Kind::zero_clear, format.zeroed_unit()};
  co_await line.ask(format.zeroing == Zeroing::line ? Request{Request::Kind::clear} : by_command);
  // It is not told whether that worked.
  const Time give_up_at = line.received_at() + zero_limit;
  Result<Position> now = Error::timeout;
  do {
    co_await line.rest(zero_poll);
    now = co_await look(line);
    found.now = *now;
    if (now && is_near(now->singleturn, 0, format.bits, zero_millidegrees)) co_return done;
  } while (line.received_at() < give_up_at);
  if (!now) {
    co_return only(now.error(), "the zero was set, but the position could not be read back",
                   "read the encoder to see what it is now");
  }
  co_return only(Error::cross_check_failed, "the position is not zero after the zero was set",
                 "let the shaft stand still; check the wire to CLR (below 0.5 V), or zero_unit, and that the encoder "
                 "has it");
}

Procedure scan(HostLine& line, Units& found) {
  line.listen(scan_silence);
  for (HostLine::Heard heard{}; !heard.over;) {
    heard = co_await line.heard();
    if (heard.bytes.empty()) continue;
    co_return only(Error::unexpected_reply, "something comes although nobody asks",
                   "an encoder that transmits by itself has no number: mode=timing, and nothing to scan for");
  }
  bool any = false;
  for (unsigned i = 0; i < unit_count; ++i) {
    Units::One& unit = found.units[i];
    for (unsigned attempt = 0; attempt < scan_attempts && !unit.answers; ++attempt) {
      const Result<Position> reply = co_await line.attempt({Request::Kind::read, static_cast<std::uint8_t>(i)});
      if (line.is_noisy()) co_return {reply.error()};
      unit = {.answers = reply.has_value(), .position = *reply};
      unit.clash = !reply && reply.error() != Error::timeout;
      if (!unit.clash) break;
    }
    any = any || unit.answers || unit.clash;
  }
  if (any) co_return done;
  co_return only(Error::timeout, "no number from 0 to F is answered",
                 "check supply, A/B polarity and baud, and that the encoder is one with bus commands");
}

}  // namespace absenc::raa38::serial
