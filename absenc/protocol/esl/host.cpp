// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/host.hpp"

#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/esl/words.hpp"

namespace absenc::esl {

using author::done;
using author::Procedure;

namespace {

constexpr unsigned attempts = 3;  // of what only reads, or selects a page: resets, writes and ID 8 are never repeated
constexpr unsigned safe_attempts = 6;

Request request_of(const Line& line, DataId id) { return {id, line.format().address}; }

Reading reading_of(const Line& line, const Reply& reply) {
  Reading reading = to_reading(reply);
  reading.latched = latch_time(line.format(), line.sent_at());
  reading.received = line.received_at();
  return reading;
}

}  // namespace

Procedure read_encoder_id(Line& line, Identity& found) {
  co_await line.ask(request_of(line, DataId::singleturn_short));
  found.reply = co_await line.ask(request_of(line, DataId::encoder_id));
  co_return done;
}

Procedure read_safely(Line& line, Safe& found) {
  SafetyMonitor monitor(line.format());
  for (unsigned i = 0; i < safe_attempts && found.failed == Check::sequence_unknown; ++i) {
    const Request request = request_of(line, monitor.next_id());
    found.reply = co_await line.ask(request);
    found.reading = reading_of(line, found.reply);
    const SafetyVerdict verdict = monitor.judge(request, line.reply(), line.sent_at());
    found.position = verdict.position;
    found.failed = verdict.failed;
  }
  co_return {error_of(found.failed), text_of(found.failed).sentence};
}

// ---- Resets (Table 4)

namespace {

// The eight of them are 40 us apart, from start to start; a slow line takes longer.
Time pause_between_resets(const Line& line, DataId id) {
  const Time duration = line_settings.character() * static_cast<std::int64_t>(request_length(line.format(), id));
  return line.sent_at() - duration + reset_interval - line.received_at();
}

author::Outcome judge(AfterReset& found, DataId id, std::uint32_t before) {
  const Reply& reply = found.reply;
  const auto remaining = static_cast<std::uint8_t>(reply.one.alarms | reply.two.alarms);
  if (id == DataId::zero && !author::is_near(reply.singleturn, 0, singleturn_bits)) {
    return {Error::cross_check_failed, "the position is still not zero"};
  }
  if (id == DataId::reset_multiturn && reply.multiturn != 0) {
    return {Error::cross_check_failed, "the turns are still not zero"};
  }
  // Rev 1.4 of the document added a single-turn clear to ID D and left it out elsewhere.
  if (id == DataId::reset_multiturn && !author::is_near(reply.singleturn, before, singleturn_bits)) {
    return {Error::cross_check_failed,
            "the turns are zero, but the encoder has moved its single-turn zero too: find the origin again"};
  }
  if (id == DataId::clear_alarms && remaining != 0) {
    name_what_remains(found.words, remaining);
    return {Error::cross_check_failed, found.words.view()};
  }
  return done;
}

}  // namespace

Procedure reset(Line& line, AfterReset& found, DataId id) {
  const Request look = request_of(line, DataId::position);
  const Reply first = co_await line.ask(look).repeated(attempts);
  const Reply before = co_await line.ask(look).repeated(attempts).after(author::between_looks);
  if (!to_reading(before).ready) {
    co_return {Error::invalid_argument, "the encoder is not ready yet; nothing was sent"};
  }
  if (!author::is_near(before.singleturn, first.singleturn, singleturn_bits)) {
    co_return {Error::invalid_argument, "the shaft is turning: a reset needs it standing still; nothing was sent"};
  }
  for (unsigned i = 0; i < reset_requests; ++i) {
    const Time pause = i == 0 ? Time{} : pause_between_resets(line, id);
    const Result<Reply> reply = co_await line.attempt(request_of(line, id)).after(pause);
    // When the last reply is lost, the reset may have been done all the same: reading tells.
    if (reply || i + 1 == reset_requests) continue;
    co_return {reply.error(),
               "one of the eight requests was not answered well, so the encoder has most likely done nothing: read the "
               "position before you try again"};
  }
  // B saves the zero in the EEPROM; D may do the same.
  const Time pause = id == DataId::clear_alarms ? reset_interval : eeprom_write_pause;
  found.reply = co_await line.ask(look).repeated(attempts).after(pause).or_say(
      "all eight requests were sent, but whether the encoder obeyed could not be read");
  found.reading = reading_of(line, found.reply);
  co_return judge(found, id, before.singleturn);
}

// ---- Memory

namespace {

constexpr Time busy_limit = 2 * page_time;  // the document gives no maximum

constexpr std::string_view unknown_area = "Table 11 lists no such page and address; nothing was sent";

// Nothing in the temporary register stands between such a byte and its reader.
bool is_immediate(std::uint8_t page, std::uint8_t address) {
  const MemoryArea* area = find_area(page, address);
  return address == page_select_address || (area != nullptr && area->kind == MemoryArea::Kind::registers);
}

// What comes when the memory is no longer busy. A busy encoder has not executed the request, so even a write may be
// sent again. `after_busy`: only what follows a busy answer is believed, because the temporary register may hold what
// somebody else once asked for.
author::Part<Result<Reply>> settled(Line& line, Request request, Time pause, bool after_busy) {
  const bool writes = request.id == DataId::write_memory && !selects_page(request);
  const Time busy_pause = Protocol::manner(line.format(), request).pause;
  Time limit = never;
  for (;;) {
    const Result<Reply> reply = co_await line.attempt(request).repeated(writes ? 1 : attempts).after(pause);
    if (!reply || (!reply->busy && !after_busy)) co_return reply;
    if (reply->busy) after_busy = false;
    limit = std::min(limit, line.received_at() + busy_limit);
    if (line.received_at() > limit) {
      co_await line.stop({Error::busy,
                          "the memory stays busy longer than a write may take; the last request was not executed",
                          {},
                          busy_pause});
    }
    pause = busy_pause;
  }
}

// `words`: what the error says where the procedure ends here.
author::Part<std::uint8_t> select(Line& line, std::uint8_t page, std::string_view words) {
  const Request request{DataId::write_memory, line.format().address, page_select_address, page};
  const Result<Reply> reply = co_await settled(line, request, {}, false);
  if (!reply) co_await line.stop({reply.error(), words, {}, page_time});
  co_return page;
}

author::Part<std::uint8_t> read_byte(Line& line, std::uint8_t page, std::uint8_t address, Time pause,
                                     std::string_view words) {
  const Request request{DataId::read_memory, line.format().address, address};
  const Result<Reply> reply = co_await settled(line, request, pause, !is_immediate(page, address));
  if (!reply) co_await line.stop({reply.error(), words, {}, eeprom_read_pause});
  co_return reply->value;
}

}  // namespace

Procedure read_memory(Line& line, MemoryBytes& found, Arguments arguments) {
  found.address = static_cast<std::uint8_t>(arguments[0]);
  found.page = static_cast<std::uint8_t>(arguments[1]);
  const auto end = static_cast<unsigned>(found.address + arguments[2]);
  for (unsigned i = found.address; i < end; ++i) {
    if (find_area(found.page, i) == nullptr) co_return {Error::invalid_argument, unknown_area};
  }
  co_await select(line, found.page, {});
  for (unsigned i = found.address; i < end; ++i) {
    const Time pause = i == found.address ? page_time : Time{};
    const std::uint8_t value = co_await read_byte(line, found.page, static_cast<std::uint8_t>(i), pause, {});
    found.data.push_back(value);
  }
  co_return done;
}

Procedure write_memory(Line& line, Written& found, Arguments arguments) {
  found.address = static_cast<std::uint8_t>(arguments[0]);
  found.value = static_cast<std::uint8_t>(arguments[1]);
  found.page = static_cast<std::uint8_t>(arguments[2]);
  const bool force = arguments[3] != 0;
  constexpr std::string_view nothing_written = "nothing was written";
  const MemoryArea* const area = find_area(found.page, found.address);
  if (area == nullptr) co_return {Error::invalid_argument, unknown_area};
  if (!area->user && !force) {
    found.words.add("this page is not for the user: it holds ").add(area->meaning);
    found.words.add_part("writing there can spoil the encoder and needs force; nothing was sent");
    co_return {Error::invalid_argument, found.words.view()};
  }
  co_await select(line, found.page, nothing_written);
  const std::uint8_t before = co_await read_byte(line, found.page, found.address, page_time, nothing_written);
  if (before == found.value) co_return done;
  found.sent = true;
  // A lost reply does not tell whether the write was done: reading back does.
  const Request write{DataId::write_memory, line.format().address, found.address, found.value};
  static_cast<void>(co_await settled(line, write, {}, false));
  const Time pause = is_immediate(found.page, found.address) ? Time{} : eeprom_write_pause;
  const std::uint8_t now =
      co_await read_byte(line, found.page, found.address, pause, "the byte was written, but could not be read back");
  if (now == found.value) co_return done;
  co_return {Error::cross_check_failed, "reading back gave another value: the write has failed", {}, eeprom_read_pause};
}

Procedure select_page(Line& line, Selected& found, Arguments arguments) {
  found.page = static_cast<std::uint8_t>(arguments[0]);
  if (!is_page(found.page)) co_return {Error::invalid_argument, "Table 11 lists no such page; nothing was sent"};
  co_await select(line, found.page, {});
  const std::uint8_t now = co_await read_byte(line, found.page, page_select_address, page_time, {});
  if (now == found.page) co_return done;
  co_return {Error::cross_check_failed, "another page is selected", {}, eeprom_read_pause};
}

Procedure read_error_info(Line& line, ErrorInfo& found) {
  constexpr std::string_view page_may_be_left = "page 8 may be left selected, where it was another before";
  const Request which{DataId::read_memory, line.format().address, page_select_address};
  const Result<Reply> before = co_await settled(line, which, {}, false);
  const bool known = before && is_page(before->value);
  const std::uint8_t page = known ? before->value : register_page;
  co_await select(line, register_page, page_may_be_left);
  found.flags = co_await read_byte(line, register_page, error_info_address, page_time, page_may_be_left);
  found.page_left = !known;
  if (page == register_page) co_return done;
  // What was asked for is known, whatever becomes of this: reading it back tells what the next user finds.
  const Request restore{DataId::write_memory, line.format().address, page_select_address, page};
  static_cast<void>(co_await settled(line, restore, {}, false));
  const Result<Reply> after = co_await settled(line, which, page_time, false);
  found.page_left = !after || after->value != page;
  co_return done;
}

// ---- Several encoders on one line

Procedure scan(Line& line, Nodes& found) {
  bool any = false;
  for (std::uint8_t address = 0; address < most_encoders; ++address) {
    const Request request{DataId::singleturn_short, address};
    const Result<Reply> reply = co_await line.attempt(request).repeated(attempts).after(request_pause);
    if (!reply && line.is_noisy()) co_return {reply.error()};
    if (reply) found.answers[address] = *reply;
    found.disturbed[address] = !reply && reply.error() != Error::timeout;
    any = any || reply || found.disturbed[address];
  }
  if (!any) co_return {Error::timeout};
  co_return done;
}

}  // namespace absenc::esl
