// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/procedures.hpp"

#include "absenc/core/bits.hpp"
#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/raa38/modbus/explain.hpp"

namespace absenc::raa38::rtu {

namespace {

using namespace author;
using namespace std::chrono_literals;

constexpr unsigned most_damaged_answers = 3;
constexpr Time memory_time = 20ms;  // for the encoder to keep a setting; the document gives none
constexpr Request which_address{.function = function::ask_address, .address = any_address};

constexpr Explanation too_few_registers{"one register has 16 bits, and the position has more",
                                        "set registers=2, or leave it to bits (registers=auto); check bits"};
constexpr Explanation lost_encoder{
    "the setting was sent, and now the encoder answers neither as before nor as it should",
    "switch the encoder off and on, then find it: `absenc config get ... baud`, `absenc scan`; do not send it again "
    "blindly, its memory wears out"};

constexpr Request setting(const Format& format, std::uint8_t value) {
  return {.function = function::set_parameter, .address = format.address, .value = value};
}

// Function 03, so often at the most. Asking on is of no use where it is refused.
Part<Result<Reply>> look(Line& line, std::uint8_t address, unsigned attempts) {
  Request request = read_request(line.format());
  request.address = address;
  if (request.registers == 1 && line.format().bits > 16) {
    co_await line.stop(only(Error::invalid_argument, too_few_registers.found, too_few_registers.advice));
  }
  Result<Reply> reply = Error::timeout;
  for (unsigned i = 0; i < attempts; ++i) {
    reply = co_await line.attempt(request);
    if (reply && reply->doubtful_size != 0) {
      const Reply first = *reply;
      reply = co_await line.attempt(request);
      if (reply && differ_doubtfully(first, *reply)) reply = Error::wrong_length;
    }
    if (reply || reply.error() == Error::request_rejected || line.is_noisy()) break;
  }
  co_return reply;
}

// The encoder before its setting is changed.
Part<Reply> look_first(Line& line) {
  const Result<Reply> reply = co_await look(line, line.format().address, 3);
  if (!reply) co_await line.stop({reply.error()});
  co_return *reply;
}

Reading reading_of(const Line& line, const Reply& reply) {
  Reading reading = Protocol::reading(line.format(), {}, reply);
  // The document does not say when the position is taken; the end of the request is the earliest it can be known.
  reading.latched = line.sent_at();
  reading.received = line.received_at();
  return reading;
}

}  // namespace

// ---- Reading

Procedure look_once(Line& line, Looked& found) {
  const Result<Reply> reply = co_await look(line, line.format().address, 1);
  if (!reply) co_return {reply.error()};
  found.reading = reading_of(line, *reply);
  co_return done;
}

Procedure look_at_direction(Line& line, Seen& found) {
  const Result<Reply> reply = co_await look(line, line.format().address, 1);
  found.singleturn = reply->singleturn;
  co_return {reply.error()};
}

Procedure ask_address(Line& line, Address& found) {
  const Result<Reply> reply = co_await line.attempt(which_address).repeated(2);
  found.address = reply ? reply->address : line.format().address;
  if (reply || line.is_noisy()) co_return {reply.error()};
  const Result<Reply> position = co_await look(line, found.address, 2);
  co_return {position.error()};
}

Procedure find_baud(Line& line, Baud& found) {
  const std::size_t own = line.format().baud;
  found.index = own;
  const Result<Reply> first = co_await look(line, line.format().address, 2);
  if (first || first.error() == Error::request_rejected) co_return done;  // a refusal is understood
  if (line.is_noisy()) co_return {first.error()};
  const Explanation reason = explain(read_request(line.format()), first.error(), line.reply());
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (i == own) continue;
    found.index = i;
    line.set_rate(bauds[i]);
    const Result<Reply> reply = co_await look(line, line.format().address, 2);
    const bool there = reply || reply.error() == Error::request_rejected;
    if (!there && !line.is_noisy()) continue;
    line.set_rate(bauds[own]);
    co_return {there ? Error::none : reply.error()};
  }
  line.set_rate(bauds[own]);
  if (first.error() != Error::timeout) co_return only(first.error(), reason.found, reason.advice);
  co_return only(Error::timeout, "nobody answers at this address at any of the five baud rates",
                 "`absenc scan` asks every address; then check supply and A/B");
}

Procedure scan(Line& line, Slaves& found, Arguments arguments) {
  using Kind = Slaves::Kind;
  const std::int64_t first = arguments[0];
  const std::int64_t last = arguments[1];
  if (first > last) co_return {Error::invalid_argument, "the last address is before the first"};
  const Result<Reply> single = co_await line.attempt(which_address);
  if (line.is_noisy()) co_return {single.error()};
  if (single) {
    const Result<Reply> there = co_await look(line, single->address, 1);
    if (line.is_noisy()) co_return {there.error()};
    if (there) {
      found.at[single->address] = Kind::answers;
      co_return done;
    }
  }
  bool any = false;
  for (std::int64_t i = first; i <= last; ++i) {
    const auto address = static_cast<std::uint8_t>(i);
    Result<Reply> reply = Error::timeout;
    for (unsigned damaged = 0; damaged < most_damaged_answers; ++damaged) {
      reply = co_await look(line, address, 1);
      if (line.is_noisy()) co_return {reply.error()};
      if (reply || reply.error() == Error::timeout || reply.error() == Error::request_rejected) break;
      found.at[address] = Kind::clash;
    }
    if (reply) found.at[address] = Kind::answers;
    if (reply.error() == Error::timeout) found.at[address] = Kind::none;
    if (reply.error() == Error::request_rejected) found.at[address] = Kind::refuses;
    any = any || found.at[address] != Kind::none;
  }
  if (!any) co_return only(Error::timeout, "no address was answered at this baud rate");
  co_return done;
}

// ---- Settings

Procedure set_address(Line& line, Set& found, Arguments arguments) {
  const auto address = static_cast<std::uint8_t>(arguments[0]);
  const std::uint8_t before = line.format().address;
  found.value = address;
  static_cast<void>(co_await look_first(line));
  if (address == before && arguments[1] == 0) co_return done;
  if (address != before) {
    const Result<Reply> other = co_await look(line, address, 3);
    const bool is_free = !other && other.error() == Error::timeout;
    if (!is_free) {
      co_return {Error::invalid_argument,
                 other ? "somebody answers at that address already, and two with one address cannot be told apart; "
                         "nothing was sent"
                       : "something answers at that address, though not well; nothing was sent",
                 "choose another address: `absenc scan` shows those in use"};
    }
  }
  found.written = true;
  const Result<Reply> answer =
      co_await line.attempt({.function = function::set_address, .address = before, .value = address});
  if (!answer && answer.error() == Error::request_rejected) co_return {answer.error()};
  // A lost reply does not tell whether it was done: asking does.
  co_await line.rest(memory_time);
  const Result<Reply> there = co_await look(line, address, 3);
  if (there) co_return done;
  const Result<Reply> back = co_await look(line, before, 3);
  if (!back) co_return only(back.error(), lost_encoder.found, lost_encoder.advice);
  co_return {Error::cross_check_failed, "the encoder answers at its old address still: it did not take the new one",
             "try once more, not often: each time may wear its memory"};
}

Procedure set_baud(Line& line, Set& found, Arguments arguments) {
  const std::optional<std::size_t> baud = baud_index(static_cast<std::uint64_t>(arguments[0]));
  if (!baud) {
    co_return {Error::invalid_argument, "the encoder does not have this baud rate",
               "it has 2400, 4800, 9600, 19200 and 57600"};
  }
  const std::uint32_t before = line.format().line().rate;
  found.value = arguments[0];
  line.set_rate(before);  // a port that cannot change its rate must say so before the encoder has
  static_cast<void>(co_await look_first(line));
  if (*baud == line.format().baud && arguments[1] == 0) co_return done;
  found.written = true;
  // Its reply may come at the new rate.
  static_cast<void>(co_await line.attempt(setting(line.format(), baud_parameters[*baud])));
  line.set_rate(bauds[*baud]);
  co_await line.rest(memory_time);
  const Result<Reply> there = co_await look(line, line.format().address, 3);
  if (there) co_return done;
  line.set_rate(before);
  const Result<Reply> back = co_await look(line, line.format().address, 3);
  if (!back) co_return only(back.error(), lost_encoder.found, lost_encoder.advice);
  co_return {Error::cross_check_failed, "the encoder answers at its old baud rate still: it did not take the new one",
             "try once more, not often: each time may wear its memory"};
}

Procedure set_direction(Line& line, Set& found, Arguments arguments) {
  const unsigned bits = line.format().bits;
  found.value = arguments[0];
  const std::uint32_t before = (co_await look_first(line)).singleturn;
  found.written = true;
  const Result<Reply> echo = co_await line.attempt(setting(line.format(), static_cast<std::uint8_t>(arguments[0])));
  if (!echo) {
    co_return only(echo.error(),
                   "the direction was sent, but its echo did not come, and nothing else tells whether it was taken",
                   "turn the shaft and see how the position moves before you send it again: its memory wears out");
  }
  co_await line.rest(memory_time);
  const Result<Reply> now = co_await look(line, line.format().address, 3);
  if (!now) {
    co_return {now.error(), "the encoder has taken the direction, but then its position could not be read"};
  }
  const std::uint64_t mirrored = (std::uint64_t{0} - before) & low_mask(bits);
  found.effect = is_near(now->singleturn, before, bits)
                     ? "as before: it counted so already, or it stands at 0 or half a turn"
                 : is_near(now->singleturn, mirrored, bits) ? "mirrored: the direction has changed"
                                                            : "neither as before nor mirrored: was the shaft turning?";
  co_return done;
}

Procedure set_zero(Line& line, Set& found, Arguments arguments) {
  const unsigned bits = line.format().bits;
  const Reply first = co_await look_first(line);
  co_await line.rest(between_looks);
  const Reply second = co_await look_first(line);
  if (!is_near(second.singleturn, first.singleturn, bits)) {
    co_return {Error::invalid_argument,
               "the shaft is turning: setting the zero needs it standing still; nothing was sent", "stop the shaft"};
  }
  found.reading = reading_of(line, second);
  if (second.singleturn == 0 && arguments[0] == 0) co_return done;
  found.written = true;
  static_cast<void>(co_await line.attempt(setting(line.format(), parameter::zero)));  // perhaps done without a reply
  co_await line.rest(memory_time);
  const Result<Reply> now = co_await look(line, line.format().address, 3);
  if (!now) co_return {now.error(), "the zero was sent, but then the position could not be read"};
  found.reading = reading_of(line, *now);
  if (is_near(now->singleturn, 0, bits, zero_millidegrees)) co_return done;
  co_return {Error::cross_check_failed, "the position is still not zero",
             "does the shaft turn? Try once more, not often: its memory wears"};
}

}  // namespace absenc::raa38::rtu
