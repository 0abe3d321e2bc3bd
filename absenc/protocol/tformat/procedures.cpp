// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/procedures.hpp"

#include "absenc/protocol/author/standstill.hpp"

namespace absenc::tformat {

using namespace author;

namespace {

constexpr Time busy_limit = 2 * memory_time;  // the document's maximum is memory_time
constexpr Time busy_pause = 1ms;              // between two looks at a busy encoder

}  // namespace

// ---- Resets (10)

namespace {

// Why this reset must not be sent; empty: it may.
std::string_view objection(DataId id, const Reply& first, const Reply& second, unsigned bits) {
  if (!is_near(second.singleturn, first.singleturn, bits)) {
    return "the shaft is turning: a reset needs it standing still; nothing was sent";
  }
  // The position is too coarse then to show a movement.
  if ((second.alarms & alarms::full_absolute_status) != 0) {
    return "full_absolute_status: the encoder was switched on while the shaft turned, and has not seen it stand still "
           "since; nothing was sent";
  }
  if (id == DataId::clear_alarms && (second.alarms & alarms::battery_error) != 0) {
    return "battery_error says that the turns are lost, and clearing it alone would hide that: replace the battery, "
           "then reset the turns (reset-multiturn); nothing was sent";
  }
  return {};
}

// What the encoder did not do; empty: it did all.
std::string_view missed(DataId id, const Reply& now, unsigned bits) {
  if (id == DataId::zero) {
    return is_near(now.singleturn, 0, bits, zero_tolerance_millidegrees) ? "" : "the position is still not zero";
  }
  if (id == DataId::reset_multiturn && now.multiturn != 0) return "the turns are still not zero";
  if ((now.alarms & alarms::over_heat) != 0) return "over_heat remains: the encoder must cool down first";
  if ((now.alarms & alarms::latched) != 0) {
    return "latched alarms remain: read them, mend their cause and try again";
  }
  return {};
}

}  // namespace

Procedure reset(Line& line, AfterReset& after, DataId id) {
  const unsigned bits = line.format().singleturn_bits;
  const Reply first = co_await line.ask({DataId::everything});
  const Reply second = co_await line.ask({DataId::everything}).after(between_looks);
  const std::string_view why_not = objection(id, first, second, bits);
  if (!why_not.empty()) co_return {Error::invalid_argument, why_not};

  // Intervals are counted from the end of the reply: that is 40 us or more however the document means it.
  for (unsigned sent = 1; sent <= reset_requests; ++sent) {
    const Result<Reply> reply = co_await line.attempt({id}).after(reset_interval);
    // When the tenth reply is lost, the reset may have been done all the same: reading tells.
    if (!reply && sent < reset_requests) {
      co_return {reply.error(),
                 "one of the ten requests was not answered well, so the encoder has most likely done nothing; read the "
                 "position before you try again"};
    }
  }
  // Only ID 8 writes the EEPROM; the tenth reply still shows the old errors.
  after.reply = co_await line.ask({DataId::everything})
                    .after(id == DataId::zero ? memory_time : reset_interval)
                    .or_say("all ten requests were sent, but whether the encoder obeyed could not be read");
  after.reading = to_reading(line.format(), after.reply);
  after.reading.latched = line.sent_at();
  after.reading.received = line.received_at();
  const std::string_view what = missed(id, after.reply, bits);
  if (!what.empty()) co_return {Error::cross_check_failed, what};
  co_return done;
}

// ---- Memory (6.3.5, 9.1)

namespace {

// A busy encoder has not executed the request, so even a write may be sent again. A page change must not be disturbed
// by asking whether it is over.
Part<Result<Reply>> persist(Line& line, Request request) {
  const Time pause = selects_page(request) ? memory_time : busy_pause;
  Result<Reply> reply = co_await line.attempt(request);
  const Time give_up = line.received_at() + busy_limit;
  while (reply && reply->busy) {
    if (line.received_at() > give_up) co_return Error::busy;
    reply = co_await line.attempt(request).after(pause);
  }
  co_return reply;
}

Part<Error> select_page(Line& line, std::uint8_t page) {
  const Result<Reply> reply = co_await persist(line, {DataId::write_memory, page_select_address, page});
  if (reply) co_await line.rest(memory_time);
  co_return reply.error();
}

Part<Error> open_page(Line& line, Memory& memory) {
  if (memory.restores) {  // an encoder that refuses is one of those whose page cannot be read
    const Result<Reply> before = co_await persist(line, {DataId::read_memory, page_select_address});
    if (before && is_page(before->value)) memory.page_before = before->value;
  }
  memory.selected = true;
  const Error error = co_await select_page(line, memory.page);
  co_return error;
}

// When that fails, what was asked for is known all the same. Reading it back is what the encoder's next user finds.
Part<bool> restore(Line& line, const Memory& memory) {
  if (!memory.page_before || *memory.page_before == memory.page) co_return memory.page_before.has_value();
  const Error error = co_await select_page(line, *memory.page_before);
  if (error != Error::none) {
    co_await line.rest(memory_time);  // it may be going on all the same
    co_return false;
  }
  const Result<Reply> selected = co_await persist(line, {DataId::read_memory, page_select_address});
  co_return selected && selected->value == *memory.page_before;
}

Outcome failure(const Line& line, Error error, std::string_view step) {
  return {error,
          error == Error::busy ? "the encoder stays busy longer than a write may take" : step,
          {},
          Protocol::manner(line.format(), line.request()).hold};
}

}  // namespace

Procedure read_memory(Line& line, Memory& memory) {
  for (unsigned i = memory.address; i < unsigned{memory.address} + memory.count; ++i) {
    if (is_open(memory.page, i)) continue;
    co_return {Error::invalid_argument,
               "this area is closed: pages 0 to 5 have addresses 0 to 126, page 7 has 4 (over-heat threshold) and 5 "
               "(temperature)"};
  }
  Error error = co_await open_page(line, memory);
  for (unsigned i = 0; error == Error::none && i < memory.count; ++i) {
    const Result<Reply> reply =
        co_await persist(line, {DataId::read_memory, static_cast<std::uint8_t>(memory.address + i)});
    if (reply) memory.data.push_back(reply->value);
    error = reply.error();
  }
  if (error != Error::none) co_return failure(line, error, "");
  memory.value = memory.data[0];
  memory.restored = co_await restore(line, memory);
  co_return done;
}

Procedure write_memory(Line& line, Memory& memory) {
  if (!is_open(memory.page, memory.address) || (memory.page == service_page && memory.address == temperature_address)) {
    co_return {Error::invalid_argument,
               "this address cannot be written: pages 0 to 5 have addresses 0 to 126, page 7 has 4 (over-heat "
               "threshold)"};
  }
  const Request look{DataId::read_memory, memory.address};
  memory.written = false;
  Error error = co_await open_page(line, memory);
  if (error != Error::none) co_return failure(line, error, "nothing was written");
  Result<Reply> there = co_await persist(line, look);
  if (!there) co_return failure(line, there.error(), "nothing was written");
  if (there->value != memory.value) {
    memory.written = true;
    const Result<Reply> reply = co_await persist(line, {DataId::write_memory, memory.address, memory.value});
    if (reply.error() == Error::busy) co_return failure(line, Error::busy, "");
    // A lost reply does not tell whether the write was done: reading back does, of the EEPROM itself.
    co_await line.rest(memory_time);
    error = co_await select_page(line, memory.page);
    if (error != Error::none) co_return failure(line, error, "the byte was written, but could not be read back");
    there = co_await persist(line, look);
    if (!there) co_return failure(line, there.error(), "the byte was written, but could not be read back");
    if (there->value != memory.value) {
      co_return {Error::cross_check_failed, "reading back gave another value: the write has failed"};
    }
  }
  memory.restored = co_await restore(line, memory);
  co_return done;
}

}  // namespace absenc::tformat
