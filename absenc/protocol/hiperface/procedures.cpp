// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/hiperface/procedures.hpp"

#include <algorithm>

#include "absenc/protocol/author/memory_map.hpp"
#include "absenc/protocol/author/standstill.hpp"

namespace absenc::hiperface {

namespace {

using namespace author;

Request data_request(const Format& format, CommandCode command, std::int64_t field, std::int64_t first,
                     std::size_t count) {
  return {.command = command,
          .address = format.address,
          .subject = byte(field),
          .first = byte(first),
          .count = static_cast<std::uint8_t>(count),
          .code = format.access_code,
          .any_resolution = !format.is_known()};
}

Request description_request(const Format& format) {
  return data_request(format, CommandCode::read_data, description_field, 0, description_size);
}

// ---- Position and status

// Result of reading the status several times, because an encoder reports its alarms one after the other.
struct Codes {
  std::uint32_t alarms = 0;  // mask of the alarms that the status codes name
  std::uint8_t first = 0;    // status code in the first reply to the requests for the status
  bool unexplained = false;  // whether at least one of the status codes is explained by no source
};

// Reads the status until the encoder sends a code for the second time or a code that is no alarm.
Part<Codes> read_codes(Dialog& dialog) {
  Codes codes;
  for (std::size_t i = 0; i <= alarms.size(); ++i) {
    const Reply reply = co_await dialog.ask(plain_request(dialog.format(), CommandCode::status));
    const auto code = static_cast<std::uint8_t>(reply.value);
    if (i == 0) codes.first = code;
    codes.unexplained = codes.unexplained || is_unexplained(code);
    if ((alarm_of(code) & ~codes.alarms) == 0) break;
    codes.alarms |= alarm_of(code);
  }
  co_return codes;
}

// Reads the resolution if the options do not state it: from the type label, or from the description in data field FF if
// the type does not show it.
Part<bool> know_resolution(Dialog& dialog) {
  if (dialog.format().is_known()) co_return true;
  const Reply label = co_await dialog.ask(plain_request(dialog.format(), CommandCode::type_label));
  Resolution bits = resolution_of_type(label.label[1]);
  if (label.label[1] == type_in_description) {
    const Reply description = co_await dialog.ask(description_request(dialog.format()));
    bits = resolution_in(description.data);
  }
  if (bits.singleturn_bits == 0) {
    co_await dialog.stop({Error::unsupported, "the type label does not show how many bits the position has",
                          "set the options singleturn_bits and multiturn_bits"});
  }
  dialog.set_format(dialog.format().with(bits));
  co_return true;
}

// Reads the position, and the status if the reply has the error bit. If the status then has no alarm, the error bit may
// be that of an earlier request, so the position is read again.
Part<Reading> look(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  Reading reading;
  for (int tries = 0; tries < 3; ++tries) {
    const Reply reply = co_await dialog.ask(plain_request(dialog.format(), CommandCode::position));
    reading = dialog.last_reading();
    static_cast<Values&>(found) = values_of(dialog.format(), dialog.request(), reply);
    if (!reply.has_error) {
      found.alarms = 0;
      break;
    }
    const Codes codes = co_await read_codes(dialog);
    found.command.reset();  // the values are of several exchanges, so no command is shown
    show_status(found, codes.first);
    if (codes.alarms == 0) continue;
    found.alarms = codes.alarms;
    judge(reading, codes.alarms, codes.alarms);
    if (codes.unexplained) doubt(reading);
    break;
  }
  found.reading = reading;
  co_return reading;
}

std::uint32_t whole_position(const Format& format, const Reading& reading) {
  return static_cast<std::uint32_t>(reading.multiturn << format.resolution().singleturn_bits | reading.singleturn);
}

// Reads the position twice. Ends the procedure if the position must not be set now: it is invalid or the shaft turns.
// `needs_turns`: the turns must be valid too.
Part<Reading> may_set(Dialog& dialog, ProcedureResult& found, bool needs_turns) {
  const Reading first = co_await look(dialog, found);
  co_await dialog.rest(between_looks);
  const Reading second = co_await look(dialog, found);
  const Outcome why_not = objection_to_zero(first, second);
  if (why_not.error != Error::none) co_await dialog.stop(why_not);
  const Validity turns = needs_turns ? second.multiturn_validity() : Validity::absent;
  if (second.singleturn_validity() != Validity::valid || turns == Validity::invalid) {
    co_await dialog.stop({Error::invalid_argument,
                          "the position is not valid, and one that is set relative to it would be wrong; nothing was "
                          "changed",
                          "mend what `absenc alarms` names, then try again"});
  }
  co_return second;
}

// Sends one request that sets the position, and reads the position back. `before`: the position until now.
Part<bool> store_position(Dialog& dialog, ProcedureResult& found, const Reading& before, std::uint32_t position) {
  Request request = plain_request(dialog.format(), CommandCode::set_position);
  request.position = position;
  request.code = dialog.format().code0;
  const Result<Reply> stored = co_await dialog.attempt(request).changes();
  if (stored.error() == Error::request_rejected) co_await dialog.stop({stored.error(), "nothing was changed"});
  // without a valid reply, the encoder may still be storing the position
  if (!stored) co_await dialog.rest(store_limit);
  const Reading now = co_await look(dialog, found);
  const Format& format = dialog.format();
  const unsigned turn_bits = format.resolution().singleturn_bits;
  const std::int64_t limit = counts_of_angle(turn_bits, zero_millidegrees);
  const std::uint64_t placed = whole_position(format, now);
  note_placed(dialog, whole_position(format, before), placed, position, format.position_bits(), limit,
              counts_of_angle(turn_bits));
  if (!is_within(placed, position, format.position_bits(), limit)) {
    co_await dialog.stop({Error::cross_check_failed, "the position is another one than was set",
                          "hold the shaft still, then try again"});
  }
  co_return true;
}

// ---- Data fields

// Returns an error if no encoder has these bytes of a data field, or if `writes` is true and they cannot be written;
// otherwise no error.
Outcome objection_to_access(std::int64_t field, std::int64_t first, std::int64_t count, bool writes) {
  const MemoryArea* const area = find_area(memory_areas, static_cast<unsigned>(field), static_cast<unsigned>(first));
  const bool fits = area != nullptr && first + count <= area->first + area->count;
  if (fits && (area->writable || !writes)) return {};
  return {Error::invalid_argument,
          writes ? "these bytes cannot be written: data fields 0 to 13 have addresses 0 to 127"
                 : "these bytes do not exist: data fields 0 to 13 have addresses 0 to 127, data field FF has 0 to 9"};
}

}  // namespace

Procedure read_position(Dialog& dialog, ProcedureResult& found) {
  co_await look(dialog, found);
  co_return done;
}

Procedure read_status(Dialog& dialog, ProcedureResult& found) {
  const Codes codes = co_await read_codes(dialog);
  static_cast<Values&>(found) = values_of(dialog.format(), dialog.request(), dialog.last());
  show_status(found, codes.first);
  found.alarms = codes.alarms;
  co_return done;
}

Procedure read_info(Dialog& dialog, ProcedureResult& found) {
  const Reply label = co_await dialog.ask(plain_request(dialog.format(), CommandCode::type_label));
  found.encoder_address = label.address;
  show_label(found, label);
  const Result<Reply> serial = co_await dialog.attempt(plain_request(dialog.format(), CommandCode::serial_number));
  if (serial) {
    found.bytes = serial->data;
    found.serial_number = AsciiText{found.bytes.view().first(dialog.format().serial_bytes)};
    found.version = AsciiText{found.bytes.view().subspan(dialog.format().serial_bytes)};
  } else if (serial.error() != Error::request_rejected) {
    co_return {serial.error(), "type label read, but not serial number and program version"};
  }
  if (label.label[1] == type_in_description) {
    const Reply description = co_await dialog.ask(description_request(dialog.format()));
    found.periods = static_cast<std::uint32_t>(load_big_endian(description.data.view().subspan(2, 4)));
    found.range = static_cast<std::uint32_t>(load_big_endian(description.data.view().subspan(6, 4)));
  }
  co_return done;
}

Procedure ask_about(Dialog& dialog, ProcedureResult& found, CommandCode command, Arguments arguments) {
  Request request = plain_request(dialog.format(), command);
  request.subject = byte(arguments[0]);
  const Reply reply = co_await dialog.ask(request);
  static_cast<Values&>(found) = values_of(dialog.format(), request, reply);
  co_return done;
}

Procedure set_zero(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  const Resolution bits = dialog.format().resolution();
  const Reading now = co_await may_set(dialog, found, bits.multiturn_bits != 0);
  co_await store_position(dialog, found, now, static_cast<std::uint32_t>(now.multiturn << bits.singleturn_bits));
  co_return done;
}

Procedure reset_multiturn(Dialog& dialog, ProcedureResult& found) {
  co_await know_resolution(dialog);
  if (dialog.format().resolution().multiturn_bits == 0) co_return {Error::unsupported, "this encoder has no turns"};
  const Reading now = co_await may_set(dialog, found, false);
  co_await store_position(dialog, found, now, static_cast<std::uint32_t>(now.singleturn));
  co_return done;
}

Procedure set_position(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  co_await know_resolution(dialog);
  if (arguments[0] >> dialog.format().position_bits() != 0) {
    co_return {Error::invalid_argument, "this encoder has no such position; nothing was changed"};
  }
  const Reading now = co_await may_set(dialog, found, false);
  co_await store_position(dialog, found, now, static_cast<std::uint32_t>(arguments[0]));
  co_return done;
}

Procedure reset(Dialog& dialog, ProcedureResult& found) {
  co_await look(dialog, found);
  co_await dialog.ask(plain_request(dialog.format(), CommandCode::reset)).changes();
  for (Time waited = start_time;; waited += start_time) {
    co_await dialog.rest(start_time);
    const Result<Reply> answer =
        co_await dialog.attempt(plain_request(dialog.format(), CommandCode::type_label)).once();
    if (answer) break;
    if (waited >= start_limit) co_return {answer.error(), "the reset was sent, but the encoder does not answer since"};
  }
  co_await look(dialog, found);
  co_return done;
}

// ---- Counter

Procedure count_up(Dialog& dialog, ProcedureResult& found) {
  const Reply before = co_await dialog.ask(plain_request(dialog.format(), CommandCode::counter));
  const Result<Reply> counted =
      co_await dialog.attempt(plain_request(dialog.format(), CommandCode::count_up)).changes();
  if (counted.error() == Error::request_rejected) co_return {counted.error(), "the counter stays as it was"};
  if (!counted) co_await dialog.rest(store_limit);
  const Reply now = co_await dialog.ask(plain_request(dialog.format(), CommandCode::counter))
                        .or_say("it was sent, but the counter could not be read back");
  found.counter = now.value;
  const std::uint64_t wanted = (std::uint64_t{before.value} + 1) & low_mask(8u * dialog.format().counter_bytes);
  if (now.value == wanted) co_return done;
  if (now.value == before.value) dialog.refused();
  co_return {Error::cross_check_failed, "the counter did not rise by one"};
}

Procedure clear_counter(Dialog& dialog, ProcedureResult& found) {
  Request request = plain_request(dialog.format(), CommandCode::clear_counter);
  request.code = dialog.format().code0;
  const Result<Reply> cleared = co_await dialog.attempt(request).changes();
  if (cleared.error() == Error::request_rejected) co_return {cleared.error(), "the counter stays as it was"};
  if (!cleared) co_await dialog.rest(store_limit);
  const Reply now = co_await dialog.ask(plain_request(dialog.format(), CommandCode::counter))
                        .or_say("it was sent, but the counter could not be read back");
  found.counter = now.value;
  if (now.value != 0) co_return {Error::cross_check_failed, "the counter is not 0"};
  co_return done;
}

// ---- Data fields

namespace {

// Returns the request that reads the byte at `address` and its neighbour. A request for one byte would be as long as
// its reply, so that its echo on the line could be taken for a reply with the access code as the byte.
Request pair_at(const Format& format, std::int64_t field, std::int64_t address) {
  return data_request(format, CommandCode::read_data, field, address & ~std::int64_t{1}, 2);
}

}  // namespace

Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const std::int64_t field = arguments[1];
  const Outcome why_not = objection_to_access(field, arguments[0], arguments[2], false);
  if (why_not.error != Error::none) co_return why_not;
  const auto count = static_cast<std::size_t>(arguments[2]);
  while (found.bytes.size() < count) {
    const std::int64_t next = arguments[0] + static_cast<std::int64_t>(found.bytes.size());
    const std::size_t size = std::min(read_at_once, count - found.bytes.size());
    if (size == 1) {
      const Reply pair = co_await dialog.ask(pair_at(dialog.format(), field, next));
      found.bytes.push_back(pair.data[static_cast<std::size_t>(next & 1)]);
    } else {
      const Reply reply = co_await dialog.ask(data_request(dialog.format(), CommandCode::read_data, field, next, size));
      found.bytes.append(reply.data);
    }
  }
  found.field = byte(field);
  found.address = byte(arguments[0]);
  found.value = found.bytes[0];
  if (count > 1) found.data = found.bytes.view();
  co_return done;
}

Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const std::int64_t field = arguments[2];
  const Outcome why_not = objection_to_access(field, arguments[0], 1, true);
  if (why_not.error != Error::none) co_return why_not;
  const Request look_at = pair_at(dialog.format(), field, arguments[0]);
  const auto place = static_cast<std::size_t>(arguments[0] & 1);
  const Reply before = co_await dialog.ask(look_at).or_say("nothing was written");
  found.field = byte(field);
  found.address = byte(arguments[0]);
  found.value = byte(arguments[1]);
  found.written = before.data[place] != *found.value;
  if (!*found.written) co_return done;
  Request store = data_request(dialog.format(), CommandCode::store_data, field, arguments[0], 1);
  store.data.push_back(*found.value);
  const Result<Reply> stored = co_await dialog.attempt(store).changes();
  if (stored.error() == Error::request_rejected) co_return {stored.error(), "nothing was written"};
  if (!stored) co_await dialog.rest(store_limit);
  const Reply now = co_await dialog.ask(look_at).or_say("the byte was written, but could not be read back");
  if (now.data[place] == *found.value) co_return done;
  if (now.data[place] == before.data[place]) dialog.refused();
  co_return {Error::cross_check_failed, "reading back gave another value: the write has failed",
             "look at what is there with `absenc memory read` before you write it again"};
}

Procedure create_field(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  if (arguments[1] % static_cast<std::int64_t>(block_size) != 0) {
    co_return {Error::invalid_argument, "the size of a data field is a multiple of 16; nothing was changed"};
  }
  const std::uint8_t wanted = status_of_field(arguments[1], arguments[2], arguments[3] != 0);
  Request ask_status = plain_request(dialog.format(), CommandCode::field_status);
  ask_status.subject = byte(arguments[0]);
  found.field = byte(arguments[0]);
  const Reply before = co_await dialog.ask(ask_status);
  found.written = before.value != wanted;
  if (*found.written) {
    Request create = ask_status;
    create.command = CommandCode::create_field;
    create.new_value = wanted;
    create.code = dialog.format().access_code;
    const Result<Reply> created = co_await dialog.attempt(create).changes();
    if (created.error() == Error::request_rejected) co_return {created.error(), "nothing was changed"};
    co_await dialog.rest(create_time);
    const Reply now = co_await dialog.ask(ask_status).or_say("it was sent, but its status could not be read back");
    if (now.value == before.value) dialog.refused();
    if (now.value != wanted) co_return {Error::cross_check_failed, "the data field has another status than was set"};
  }
  show_field_status(found, wanted);
  co_return done;
}

Procedure set_access_code(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  Request change = plain_request(dialog.format(), CommandCode::access_code);
  change.subject = byte(arguments[0]);
  change.code = byte(arguments[1]);
  change.new_value = byte(arguments[2]);
  const Result<Reply> changed = co_await dialog.attempt(change).changes();
  if (changed.error() == Error::request_rejected) co_return {changed.error(), "the access code stays as it was"};
  if (!changed) co_await dialog.rest(store_limit);
  // The access code cannot be read back. Instead the new code is changed to itself, which the encoder refuses if it has
  // another code.
  change.code = change.new_value;
  const Result<Reply> same = co_await dialog.attempt(change).changes();
  if (!same) {
    co_return {same.error() == Error::request_rejected ? Error::cross_check_failed : same.error(),
               "it was sent, but whether the encoder has the new access code is not known",
               "`absenc run ... set-access-code` from the new code to itself tells it"};
  }
  found.number = change.subject;
  co_return done;
}

}  // namespace absenc::hiperface
