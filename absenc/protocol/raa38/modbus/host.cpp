// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/host.hpp"

#include "absenc/core/bits.hpp"
#include "absenc/protocol/author/look.hpp"

namespace absenc::raa38::rtu {

// ---- Explanations

namespace {

constexpr Explanation other_crc_order{
    "the CRC would be right with its two bytes exchanged: Modbus RTU sends the low byte first",
    "check what is connected: a slave, gateway or program that sends the high byte first does not speak Modbus RTU"};

Explanation explain_length(const Request& request) {
  switch (request.function) {
    case function::read_address:
      return {"the reply to A0 is FF A0, the address and the CRC; several encoders on a line answer it all at once",
              "with several on the line use scan, and name each by its address"};
    case function::set_address:
      return {"the reply to A1 is the new address, A1 and the CRC", {}};
    case function::set_parameter:
      return {"the reply to CC is the request once more", {}};
    default:
      break;
  }
  if (request.registers == 1) {
    return {"one register was asked for: byte count 02 and 7 bytes in all are the answer",
            "check bits and registers (an encoder with more than 16 bits has two), and that only one slave answers"};
  }
  return {"two registers were asked for: byte count 04 or 03 and 8 or 9 bytes in all are the answer",
          "check bits and registers (registers=1 suits up to 16 bits), and that only one slave answers"};
}

Explanation explain_other(const Request& request, Bytes reply) {
  if (reply.size() < modbus::shortest_frame) return {};
  if (reply[1] != request.function) {
    return {"it answers another function than was asked for", "check that no other program uses the line"};
  }
  if (request.function == function::set_parameter && reply[0] == request.address) {
    return {"the parameter that came back is another than was sent",
            "read the position before you send it again: it may be done, or refused"};
  }
  return {"it comes from another address than was asked", "check address; `absenc scan` asks every one"};
}

Explanation explain_reply(const Request& request, Error error, Bytes reply) {
  switch (error) {
    case Error::timeout:
      return {
          "nobody answers at this address and baud rate",
          "`absenc scan` asks every address, `absenc config get ... baud` every baud rate; then check supply and A/B"};
    case Error::wrong_length:
      return explain_length(request);
    case Error::bad_checksum:
      if (modbus::crc_order(reply) == CrcOrder::high_first) return other_crc_order;
      return {{}, "check shielding, termination and baud rate, and that no two slaves have one address"};
    case Error::unexpected_reply:
      return explain_other(request, reply);
    case Error::request_rejected:
      return reply.size() < modbus::shortest_frame ? Explanation{} : modbus::explain_refusal(reply[2]);
    case Error::unsupported:
      return {"the position is read from register 0 on, one register or two", {}};
    case Error::out_of_range:
      if (request.function == function::read_address) {
        return {"the address that came is none: they go from 1 to 247", "check that an RAA38S6 is connected"};
      }
      return {"the position has more bits than bits says", "set bits to the resolution of the encoder (10 to 21)"};
    default:
      return {};
  }
}

Explanation explain_request(Error error, Bytes request) {
  switch (error) {
    case Error::wrong_length:
      return {"this is not the length of a request with this function", {}};
    case Error::bad_checksum:
      if (modbus::crc_order(request) == CrcOrder::high_first) return other_crc_order;
      return {{}, "check whether it was captured as a whole"};
    case Error::unsupported:
      return {"the encoder knows functions 03, A0, A1 and CC", "check that the request is for this encoder"};
    case Error::unexpected_reply:
      return {"A0 is asked of address FF", {}};
    default:
      return {};
  }
}

}  // namespace

Explanation explain(const Format& format, Error error, Bytes request, Bytes reply) {
  const Result<Request> asked = request.empty() ? assumed_request(format, reply) : decode_request(request);
  return asked ? explain_reply(*asked, error, reply) : explain_request(error, request);
}

// ---- Procedures

namespace {

using namespace author;
using namespace std::chrono_literals;

constexpr unsigned most_damaged_answers = 3;
constexpr Time memory_time = 20ms;  // assumed time for storing a setting; the document gives none
constexpr Request address_request{.function = function::read_address, .address = any_address};

constexpr Explanation too_few_registers{"one register has 16 bits, and the position has more",
                                        "set registers=2, or leave it to bits (registers=auto); check bits"};

constexpr Request setting(const Format& format, std::uint8_t value) {
  return {.function = function::set_parameter, .address = format.address, .value = value};
}

// Tries up to `attempts` times to read the position. Stops the procedure if the host requests only one register (16
// bits) and the position has more bits.
Part<Result<Reply>> read_position(Dialog& dialog, std::uint8_t address, unsigned attempts) {
  Request request = read_request(dialog.format());
  request.address = address;
  if (request.registers == 1 && dialog.format().bits > 16) {
    co_await dialog.stop(only(Error::invalid_argument, too_few_registers.detail, too_few_registers.advice));
  }
  Result<Reply> reply = Error::timeout;
  for (unsigned i = 0; i < attempts; ++i) {
    reply = co_await dialog.attempt(request);
    if (reply && reply->doubtful_size != 0) {
      const Reply first = *reply;
      reply = co_await dialog.attempt(request);
      if (reply && differ_doubtfully(first, *reply)) reply = Error::wrong_length;
    }
    if (reply || reply.error() == Error::request_rejected || dialog.is_noisy()) break;
  }
  co_return reply;
}

void set_rate(Dialog& dialog, std::uint32_t rate) {
  dialog.set_rate(rate, Protocol::host_times(dialog.format(), rate));
}

// Reads the address with function A0; ends the command if an encoder answers that has another address than the format.
// `baud`: present rate of the line.
Part<bool> check_other_address(Dialog& dialog, CommandValues& found, std::uint32_t baud) {
  const std::uint8_t asked = dialog.format().address;
  const Result<Reply> reply_to_a0 = co_await dialog.attempt(address_request).repeated(2);
  if (!reply_to_a0 || reply_to_a0->address == asked) co_return false;
  if (baud != dialog.format().line().rate) set_rate(dialog, dialog.format().line().rate);
  found.words.add("nobody answers at address ").add_number(asked);
  found.words.add(", but A0 is answered by address ")
      .add_number(reply_to_a0->address)
      .add(" at ")
      .add_number(baud)
      .add(" baud");
  co_await dialog.stop(
      only(Error::timeout, found.words.view(), "set address and baud to these; `absenc scan` asks every address"));
  co_return true;
}

// Reads the position at the address of the format; stops the procedure if that fails.
Part<Reply> read_own_position(Dialog& dialog, CommandValues& found, unsigned attempts) {
  const Result<Reply> reply = co_await read_position(dialog, dialog.format().address, attempts);
  if (!reply) {
    const Outcome failed{reply.error()};
    const bool silent = reply.error() == Error::timeout && !dialog.is_noisy();
    if (silent) co_await check_other_address(dialog, found, dialog.format().line().rate);
    co_await dialog.stop(failed);
  }
  co_return *reply;
}

// Copies the position in the last reply into `found`.
void show_position(const Dialog& dialog, CommandValues& found) {
  found.reading = dialog.last_reading();
  found.singleturn = dialog.last().singleturn;
  found.angle = degrees(dialog.last().singleturn, dialog.format().bits);
}

// Checks whether the encoder answers at the new address or baud rate, or else at the old one.
Part<Outcome> verify_setting(Dialog& dialog, std::uint8_t address, std::uint32_t rate,
                             std::string_view at_the_old_one) {
  const Format& format = dialog.format();
  const bool moves_rate = rate != format.line().rate;
  if (moves_rate) set_rate(dialog, rate);
  co_await dialog.rest(memory_time);
  const Result<Reply> there = co_await read_position(dialog, address, 3);
  if (there) co_return done;
  if (moves_rate) set_rate(dialog, format.line().rate);
  const Result<Reply> back = co_await read_position(dialog, format.address, 3);
  if (!back) {
    co_return only(back.error(), "the setting was sent, and now the encoder answers neither as before nor as it should",
                   "switch the encoder off and on, then find it: `absenc config get ... baud`, `absenc scan`; do not "
                   "send it again blindly, its memory wears out");
  }
  dialog.refused();
  co_return {Error::cross_check_failed, at_the_old_one, "try once more, not often: each time may wear its memory"};
}

}  // namespace

// ---- Reading

Procedure read_position_once(Dialog& dialog, CommandValues& found) {
  co_await read_own_position(dialog, found, 1);
  show_position(dialog, found);
  co_return done;
}

Procedure read_direction(Dialog& dialog, CommandValues& found) {
  const Reply reply = co_await read_own_position(dialog, found, 1);
  found.singleturn = reply.singleturn;
  found.direction = "the encoder does not tell: turn the shaft and see";
  co_return done;
}

Procedure read_address(Dialog& dialog, CommandValues& found) {
  const Result<Reply> reply = co_await dialog.attempt(address_request).repeated(2);
  const std::uint8_t address = reply ? reply->address : dialog.format().address;
  found.address = address;
  if (reply || dialog.is_noisy()) co_return {reply.error()};
  const Result<Reply> position = co_await read_position(dialog, address, 2);
  co_return {position.error()};
}

Procedure find_baud(Dialog& dialog, CommandValues& found) {
  const std::size_t own = dialog.format().baud;
  found.baud = bauds[own];
  const Result<Reply> first = co_await read_position(dialog, dialog.format().address, 2);
  // The present baud rate is right if the encoder answers, even with a refusal.
  if (first || first.error() == Error::request_rejected) co_return done;
  if (dialog.is_noisy()) co_return {first.error()};
  const Explanation reason = explain_reply(read_request(dialog.format()), first.error(), dialog.reply());
  if (first.error() == Error::timeout) co_await check_other_address(dialog, found, bauds[own]);
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (i == own) continue;
    found.baud = bauds[i];
    set_rate(dialog, bauds[i]);
    const Result<Reply> reply = co_await read_position(dialog, dialog.format().address, 2);
    const bool there = reply || reply.error() == Error::request_rejected;
    const bool silent = reply.error() == Error::timeout && !dialog.is_noisy();
    if (silent) co_await check_other_address(dialog, found, bauds[i]);
    if (!there && !dialog.is_noisy()) continue;
    set_rate(dialog, bauds[own]);
    co_return {there ? Error::none : reply.error()};
  }
  set_rate(dialog, bauds[own]);
  if (first.error() != Error::timeout) co_return only(first.error(), reason.detail, reason.advice);
  co_return only(Error::timeout, "nobody answers at this address at any of the five baud rates",
                 "`absenc scan` asks every address; then check supply and A/B");
}

Procedure scan(Dialog& dialog, Slaves& found, Arguments arguments) {
  using Kind = Slaves::Kind;
  const std::int64_t first = arguments[0];
  const std::int64_t last = arguments[1];
  if (first > last) co_return {Error::invalid_argument, "the last address is before the first"};
  const Result<Reply> single = co_await dialog.attempt(address_request);
  if (dialog.is_noisy()) co_return {single.error()};
  if (single) {
    const Result<Reply> there = co_await read_position(dialog, single->address, 1);
    if (dialog.is_noisy()) co_return {there.error()};
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
      reply = co_await read_position(dialog, address, 1);
      if (dialog.is_noisy()) co_return {reply.error()};
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

Procedure set_address(Dialog& dialog, CommandValues& found, Arguments arguments) {
  const auto address = static_cast<std::uint8_t>(arguments[0]);
  const Format& format = dialog.format();
  found.address = address;
  found.written = false;
  co_await read_own_position(dialog, found, 3);
  if (address == format.address && arguments[1] == 0) co_return done;
  if (address != format.address) {
    Result<Reply> other = Error::timeout;
    for (unsigned i = 0; i < 3 && !other && other.error() == Error::timeout; ++i) {
      other = co_await read_position(dialog, address, 1);
    }
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
      co_await dialog.attempt({.function = function::set_address, .address = format.address, .value = address})
          .changes();
  if (!answer && answer.error() == Error::request_rejected) co_return {answer.error()};
  // If the reply is lost, only a request at the new address shows whether the address was set.
  const Outcome end = co_await verify_setting(
      dialog, address, format.line().rate, "the encoder answers at its old address still: it did not take the new one");
  co_return end;
}

Procedure set_baud(Dialog& dialog, CommandValues& found, Arguments arguments) {
  const std::optional<std::size_t> baud = baud_index(static_cast<std::uint64_t>(arguments[0]));
  const Format& format = dialog.format();
  if (!baud) {
    co_return {Error::invalid_argument, "the encoder does not have this baud rate",
               "it has 2400, 4800, 9600, 19200 and 57600"};
  }
  found.baud = bauds[*baud];
  found.written = false;
  // a port that cannot change its rate must fail here, before the encoder changes its rate
  set_rate(dialog, format.line().rate);
  co_await read_own_position(dialog, found, 3);
  if (*baud == format.baud && arguments[1] == 0) co_return done;
  found.written = true;
  // The encoder may send its reply at the new rate, so the reply is ignored.
  static_cast<void>(co_await dialog.attempt(setting(format, baud_parameters[*baud])).changes());
  const Outcome end =
      co_await verify_setting(dialog, format.address, bauds[*baud],
                              "the encoder answers at its old baud rate still: it did not take the new one");
  co_return end;
}

Procedure set_direction(Dialog& dialog, CommandValues& found, Arguments arguments) {
  const unsigned bits = dialog.format().bits;
  const auto value = static_cast<std::uint8_t>(arguments[0]);
  found.parameter = value;
  found.setting = name_of_setting(value);
  const std::uint32_t before = (co_await read_own_position(dialog, found, 3)).singleturn;
  found.written = true;
  const Result<Reply> echo = co_await dialog.attempt(setting(dialog.format(), value)).changes();
  if (!echo) {
    co_return only(echo.error(),
                   "the direction was sent, but its echo did not come, and nothing else tells whether it was taken",
                   "turn the shaft and see how the position moves before you send it again: its memory wears out");
  }
  co_await dialog.rest(memory_time);
  const Result<Reply> now = co_await read_position(dialog, dialog.format().address, 3);
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

Procedure set_zero(Dialog& dialog, CommandValues& found, Arguments arguments) {
  const unsigned bits = dialog.format().bits;
  const Reply first = co_await read_own_position(dialog, found, 3);
  co_await dialog.rest(between_looks);
  const Reply second = co_await read_own_position(dialog, found, 3);
  const Outcome objection =
      objection_to_zero(position_reading(first.singleturn, bits), position_reading(second.singleturn, bits));
  if (objection.error != Error::none) co_return objection;
  show_position(dialog, found);
  found.written = second.singleturn != 0 || arguments[0] != 0;
  if (!*found.written) co_return done;
  static_cast<void>(
      // the result is ignored, because the encoder may set the zero without a reply
      co_await dialog.attempt(setting(dialog.format(), parameter::zero)).changes());
  co_await dialog.rest(memory_time);
  const Result<Reply> now = co_await read_position(dialog, dialog.format().address, 3);
  if (!now) co_return {now.error(), "the zero was sent, but then the position could not be read"};
  show_position(dialog, found);
  note_zero(dialog, second.singleturn, now->singleturn, bits);
  if (is_near(now->singleturn, 0, bits, zero_millidegrees)) co_return done;
  co_return {Error::cross_check_failed, "the position is still not zero",
             "does the shaft turn? Try once more, not often: its memory wears"};
}

}  // namespace absenc::raa38::rtu
