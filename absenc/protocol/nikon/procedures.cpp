// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/nikon/procedures.hpp"

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/nikon/device.hpp"

namespace absenc::nikon {

using namespace author;

// ---- Resets

namespace {

Request request_of(const Format& format, Code code) { return {.code = code, .address = format.address}; }

// Reads position and alarms, stores both in `found`, and returns the reading.
Part<Reading> look(Dialog& dialog, ProcedureResult& found) {
  const Reply position = co_await dialog.ask(request_of(dialog.format(), Code::position));
  found.reading = dialog.last_reading();
  static_cast<Values&>(found) = values_of(dialog.format(), Code::position, position);
  const Reply alarms = co_await dialog.ask(request_of(dialog.format(), Code::alarms));
  found.alarms = alarms_in(Code::alarms, alarms.data);
  found.command.reset();
  judge(found.reading, *found.alarms);
  co_return found.reading;
}

// Returns an explanation if the reading `now`, after a reset, shows that the reset failed; otherwise an empty one.
Explanation failed_part(Code code, const Reading& now) {
  if (code == Code::zero) {
    if (is_near(now.singleturn, 0, now.singleturn_bits, zero_millidegrees)) return {};
    return {"the position is still not zero", "hold the shaft still, then `absenc zero` again"};
  }
  if (code != Code::clear_alarms && now.multiturn != 0) {
    return {"the turns are still not zero", "hold the shaft still, then `absenc reset-multiturn` again"};
  }
  if (code != Code::clear_turns && (now.alarms & ~unsigned{alarm::memory_busy}) != 0) {
    return {"alarms remain", "mend the cause that `absenc alarms` names, then try again"};
  }
  return {};
}

}  // namespace

Procedure reset(Dialog& dialog, ProcedureResult& found, Code code) {
  const Reading first = co_await look(dialog, found);
  co_await dialog.rest(between_looks);
  const Reading second = co_await look(dialog, found);
  if (code != Code::clear_alarms) {
    const Outcome why_not = code == Code::zero ? objection_to_zero(first, second) : objection_to_moving(first, second);
    if (why_not.error != Error::none) co_return why_not;
  }
  const InARow row = reset_row(dialog.format());
  co_await send_in_a_row(dialog, request_of(dialog.format(), code), row);
  co_await dialog.rest(memory_write_time);
  const Reading now = co_await look(dialog, found);
  if (code == Code::zero) note_zero(dialog, second.singleturn, now.singleturn, now.singleturn_bits);
  const Explanation what = failed_part(code, now);
  if (!what.detail.empty()) co_return {Error::cross_check_failed, what.detail, what.advice};
  const Verb verb = code == Code::zero           ? Verb::zero
                    : code == Code::clear_alarms ? Verb::clear_alarms
                                                 : Verb::reset_multiturn;
  note_side_effects(dialog, verb, second, now);
  co_return done;
}

// ---- EEPROM

namespace {

// Reads a word of the EEPROM with two requests: the first makes the encoder fetch the word, the second gets it.
Part<std::uint16_t> fetch(Dialog& dialog, std::uint8_t word, std::string_view step) {
  const Request request{.code = Code::read_memory, .address = dialog.format().address, .word = word};
  co_await dialog.ask(request).or_say(step);
  const Reply reply = co_await dialog.ask(request).after(memory_read_time).or_say(step);
  const Values read = values_of(dialog.format(), Code::read_memory, reply);
  co_await dialog.rest(memory_read_time);
  if (*read.address != word) {
    co_await dialog.stop({Error::unexpected_reply, "the encoder sends another word than it was asked for"});
  }
  co_return *read.value;
}

}  // namespace

Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto first = static_cast<std::uint8_t>(arguments[0]);
  if (arguments[0] + arguments[1] > static_cast<std::int64_t>(word_count)) {
    co_return {Error::invalid_argument, "the EEPROM has the addresses 0 to 255"};
  }
  for (std::int64_t i = 0; i < arguments[1]; ++i) {
    const std::uint16_t word = co_await fetch(dialog, static_cast<std::uint8_t>(first + i), "");
    found.words.push_back(static_cast<std::uint8_t>(word));
    found.words.push_back(static_cast<std::uint8_t>(word >> 8));
    if (i == 0) found.value = word;
  }
  found.address = first;
  if (arguments[1] > 1) found.data = found.words.view();
  co_return done;
}

Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto address = static_cast<std::uint8_t>(arguments[0]);
  const auto value = static_cast<std::uint16_t>(arguments[1]);
  if (address >= user_words) {
    co_return {Error::invalid_argument, "this address cannot be written: the user's EEPROM has 0x00 to 0xEF"};
  }
  found.address = address;
  found.value = value;
  const std::uint16_t before = co_await fetch(dialog, address, "nothing was written");
  found.written = before != value;
  if (before == value) co_return done;
  const Request request{
      .code = Code::write_memory, .address = dialog.format().address, .word = address, .value = value};
  // If the reply to the write is lost, reading the word back shows whether it was written.
  static_cast<void>(co_await dialog.attempt(request).changes());
  co_await dialog.rest(memory_write_time);
  const std::uint16_t now = co_await fetch(dialog, address, "the word was written, but could not be read back");
  if (now == value) co_return done;
  if (now == before) dialog.refused();
  co_return {Error::cross_check_failed, "reading back gave another value: the write has failed",
             "look at what is there with `absenc memory read` before you write it again"};
}

// ---- Identification and address

namespace {

// Returns the identification code that a reply carries.
std::uint32_t identity_in(const Format& format, const Reply& reply) {
  return *values_of(format, Code::read_identity, reply).identification;
}
Request identity_request(std::uint8_t address) { return {.code = Code::read_identity, .address = address}; }

}  // namespace

Procedure write_identity(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto value = static_cast<std::uint32_t>(arguments[0]);
  const Format format = dialog.format();
  const Reply read = co_await dialog.ask(identity_request(format.address)).or_say("nothing was written");
  const std::uint32_t before = identity_in(format, read);
  found.identification = value;
  found.written = before != value;
  if (before == value) co_return done;
  const Request request{.code = Code::write_identity, .address = format.address, .value = value};
  // If the reply to the write is lost, reading the identification back shows whether it was written.
  static_cast<void>(co_await dialog.attempt(request).changes());
  co_await dialog.rest(memory_write_time);
  const Reply again = co_await dialog.ask(identity_request(format.address))
                          .or_say("the identification was written, but could not be read back");
  const std::uint32_t now = identity_in(format, again);
  if (now == value) co_return done;
  if (now == before) dialog.refused();
  co_return {Error::cross_check_failed, "reading back gave another identification: the write has failed",
             "look at what is there with `absenc config get ... identification` before you write it again"};
}

namespace {

constexpr std::string_view other_there = "another encoder has the new address";

// Reads the identification of the encoder at the address `wanted`; ends the procedure if it is not `identity`.
Part<bool> find_at(Dialog& dialog, ProcedureResult& found, std::uint8_t wanted, std::uint32_t identity) {
  co_await dialog.rest(memory_write_time);
  const Reply reply =
      co_await dialog.ask(identity_request(wanted)).or_say("it was sent, but no encoder is found at the new address");
  if (identity_in(dialog.format(), reply) != identity) {
    co_await dialog.stop({Error::cross_check_failed, other_there, "`absenc scan` finds the encoders of the line"});
  }
  found.identification = identity;
  co_return true;
}

}  // namespace

Procedure set_address(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto wanted = static_cast<std::uint8_t>(arguments[0]);
  const Format format = dialog.format();
  const Reply read = co_await dialog.ask(identity_request(format.address)).or_say("nothing was changed");
  found.encoder_address = wanted;
  found.identification = identity_in(format, read);
  found.written = wanted != format.address;
  if (wanted == format.address) co_return done;
  for (std::uint8_t other = 0; other < encoder_count; ++other) {
    if (other == format.address) continue;
    const Result<Reply> reply = co_await dialog.attempt({.code = Code::alarms, .address = other}).once();
    if (reply.error() != Error::timeout) {
      co_return {Error::invalid_argument,
                 "another encoder answers on this line, and would get the same address; nothing was changed",
                 "connect the encoder alone, or use `absenc run ... assign-address`"};
    }
  }
  const InARow row = reset_row(format);
  co_await send_in_a_row(dialog, {.code = Code::set_address, .address = wanted}, row);
  co_await find_at(dialog, found, wanted, *found.identification);
  co_return done;
}

Procedure assign_address(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto wanted = static_cast<std::uint8_t>(arguments[0]);
  const auto identity = static_cast<std::uint32_t>(arguments[1]);
  const Result<Reply> there = co_await dialog.attempt(identity_request(wanted));
  found.encoder_address = wanted;
  found.written = there.error() == Error::timeout;
  if (there && identity_in(dialog.format(), *there) == identity) {
    found.identification = identity;
    co_return done;
  }
  if (!*found.written) co_return {Error::invalid_argument, other_there, "choose a free one: `absenc scan` lists them"};
  // If the reply to this request is lost, an answer at the new address shows whether the encoder took the address.
  static_cast<void>(
      co_await dialog.attempt({.code = Code::assign_address, .address = wanted, .value = identity}).changes());
  co_await find_at(dialog, found, wanted, identity);
  co_return done;
}

}  // namespace absenc::nikon
