// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/host.hpp"

#include "absenc/protocol/author/busy_memory.hpp"
#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/esl/safety.hpp"

namespace absenc::esl {

using author::done;
using author::Procedure;

namespace {

// Greatest number of times that a request is sent until its reply is valid.
constexpr unsigned attempts = 3;
constexpr unsigned safe_attempts = 6;

Request request_of(const Dialog& dialog, DataId id) { return {id, dialog.format().address}; }

// Stores in `found` the last valid reply and its reading with times.
void show_last(const Dialog& dialog, ProcedureResult& found) {
  found.show(dialog.last());
  found.reading = dialog.last_reading();
}

// Appends a description of an encoder id (ENID), such as "24 bits and turns".
void describe(Sentence& words, std::uint8_t id) {
  const std::array<char, 2> bits{static_cast<char>('0' + (id & 0x1F) / 10), static_cast<char>('0' + (id & 0x1F) % 10)};
  words.add({bits.data(), bits.size()}).add(" bits and ").add((id >> 5 & 3) != 0 ? "turns" : "no turns");
  if ((id & 0x80) == 0) words.add(", not a safety encoder");
}

}  // namespace

Procedure read_encoder_id(Dialog& dialog, ProcedureResult& found) {
  co_await dialog.ask(request_of(dialog, DataId::singleturn_short));
  const Reply reply = co_await dialog.ask(request_of(dialog, DataId::encoder_id));
  found.show(reply);
  const std::uint8_t expected = encoder_id(dialog.format());
  if (reply.one.encoder_id == expected) co_return done;
  found.words.add("the encoder id says ");
  describe(found.words, reply.one.encoder_id);
  found.words.add(", the options say ");
  describe(found.words, expected);
  co_return {Error::unexpected_reply, found.words.view(),
             "choose the model of this encoder; where there is none, do not trust its angle: nothing tells how fewer "
             "bits stand in ABS"};
}

Procedure read_safely(Dialog& dialog, SafePositionResult& found) {
  SafetyMonitor monitor(dialog.format());
  found.has_turns = false;  // a safe position has no turns, because only channel 1 has them
  for (;;) {
    SafetyVerdict verdict{.failed = Check::sequence_unknown};
    for (unsigned i = 0; i < safe_attempts && verdict.failed == Check::sequence_unknown; ++i) {
      const Request request = request_of(dialog, monitor.next_id(position_id(dialog.format())));
      co_await dialog.ask(request);
      show_last(dialog, found);
      verdict = monitor.judge(request, dialog.reply(), dialog.sent_at());
    }
    if (!verdict.position) {
      co_return {error_of(verdict.failed), text_of(verdict.failed).sentence, text_of(verdict.failed).advice};
    }
    found.safe_singleturn = verdict.position->singleturn();
    found.reading.multiturn = 0;
    found.reading.multiturn_bits = 0;
    found.reading.multiturn_valid = false;
    dialog.emit();
  }
}

// ---- Resets (Table 4)

namespace {

// Appends the names of the alarms that remain after a reset with data ID C; returns advice (Table 8).
std::string_view what_remains(Sentence& words, unsigned remaining) {
  constexpr unsigned until_power_off =
      alarms::led_or_lissajous_error | alarms::overspeed | alarms::memory_error | alarms::singleturn_error;
  for (unsigned bit = 0; bit < 8; ++bit) {
    if ((remaining >> bit & 1) != 0) words.add(words.empty() ? "" : ", ").add(alarm_flags[bit].name);
  }
  words.add((remaining & (remaining - 1)) == 0 ? " remains" : " remain");
  if ((remaining & alarms::multiturn_error) != 0) words.add("; multiturn_error: reset-multiturn first");
  if ((remaining & until_power_off) != 0) words.add("; switch the encoder off and on");
  if ((remaining & alarms::voltage) != 0) words.add("; the supply voltage is wrong");
  return words.view();
}

// Returns an explanation if the reply `now`, after a reset, shows that the reset failed; otherwise an empty one.
Explanation failed_part(Sentence& words, DataId id, const Reply& before, const Reply& now) {
  const unsigned remaining = now.one.alarms | now.two.alarms;
  if (id == DataId::clear_alarms) {
    if (remaining == 0) return {};
    return {what_remains(words, remaining), "do first what `absenc alarms` says of each"};
  }
  if (id == DataId::zero) {
    if (author::is_near(now.singleturn, 0, singleturn_bits)) return {};
    return {"the position is still not zero", "hold the shaft still, then `absenc zero` again"};
  }
  if (now.multiturn != 0) {
    return {"the turns are still not zero", "hold the shaft still, then `absenc reset-multiturn` again"};
  }
  // According to rev 1.4 of the document, a reset with data ID D also clears the single-turn position. Other revisions,
  // and other places in rev 1.4, do not say so.
  if (author::is_near(now.singleturn, before.singleturn, singleturn_bits)) return {};
  return {"the turns are zero, but the encoder has moved its single-turn zero too", "find the origin again"};
}

}  // namespace

Procedure reset(Dialog& dialog, ProcedureResult& found, DataId id) {
  const Request look = request_of(dialog, position_id(dialog.format()));
  const Reply first = co_await dialog.ask(look).repeated(attempts);
  const Reply before = co_await dialog.ask(look).repeated(attempts).after(author::between_looks);
  if (!to_reading(before).ready) {
    co_return {Error::invalid_argument, "the encoder is not ready yet; nothing was changed", "wait, then try again"};
  }
  const author::Outcome why_not = id == DataId::zero
                                      ? author::objection_to_zero(to_reading(first), to_reading(before))
                                      : author::objection_to_moving(to_reading(first), to_reading(before));
  if (why_not.error != Error::none) co_return why_not;
  co_await author::send_in_a_row(dialog, request_of(dialog, id), reset_row);
  // After a reset the EEPROM is busy: data ID B writes the zero to it, and data ID D may write to it.
  const Time pause = id == DataId::clear_alarms ? reset_interval : eeprom_write_pause;
  const Reply now = co_await dialog.ask(look).repeated(attempts).after(pause).or_say(
      "all eight requests were sent, but whether the encoder obeyed could not be read");
  show_last(dialog, found);
  if (id == DataId::zero) {
    author::note_zero(dialog, before.singleturn, now.singleturn, singleturn_bits, author::standstill_millidegrees);
  }
  const Explanation what = failed_part(found.words, id, before, now);
  if (!what.detail.empty()) co_return {Error::cross_check_failed, what.detail, what.advice};
  const Verb verb = id == DataId::zero           ? Verb::zero
                    : id == DataId::clear_alarms ? Verb::clear_alarms
                                                 : Verb::reset_multiturn;
  author::note_side_effects(dialog, verb, to_reading(before), to_reading(now));
  co_return done;
}

// ---- Memory

namespace {

// Longest wait for a busy memory; assumed, because the document states no maximum.
constexpr Time busy_limit = 2 * page_time;

constexpr std::string_view unknown_area = "Table 11 lists no such page and address; nothing was sent";

// Repeats a memory request while the memory is busy. `after_busy`: the byte in a reply is accepted only after at least
// one busy reply, because otherwise it may be a byte that another host requested.
author::Part<Result<Reply>> when_ready(Dialog& dialog, const Request& request, bool after_busy = false) {
  const bool writes = request.id == DataId::write_memory && !selects_page(request);
  return author::until_ready<Protocol>(dialog, request,
                                       {.limit = busy_limit,
                                        .pause = Protocol::manner(dialog.format(), request).pause,
                                        .attempts = writes ? 1 : attempts,
                                        .after_busy = after_busy});
}

author::Outcome failure(Error error, std::string_view words, Time hold) {
  if (error == Error::busy)
    words = "the memory stays busy longer than a write may take; the last request was not executed";
  return {error, words, {}, hold};
}

// Selects a memory page, waits until it is ready, and returns its number.
author::Part<std::uint8_t> turn_to(Dialog& dialog, std::uint8_t page, std::string_view words) {
  const Request request{DataId::write_memory, dialog.format().address, page_select_address, page};
  const Result<Reply> reply = co_await when_ready(dialog, request);
  if (!reply) co_await dialog.stop(failure(reply.error(), words, page_time));
  co_await dialog.rest(page_time);
  co_return page;
}

author::Part<std::uint8_t> read_byte(Dialog& dialog, std::uint8_t page, std::uint8_t address, std::string_view words) {
  const Request request{DataId::read_memory, dialog.format().address, address};
  const Result<Reply> reply = co_await when_ready(dialog, request, !is_immediate(page, address));
  if (!reply) co_await dialog.stop(failure(reply.error(), words, eeprom_read_pause));
  co_return reply->value;
}

}  // namespace

Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto page = static_cast<std::uint8_t>(arguments[1]);
  const auto begin = static_cast<std::uint8_t>(arguments[0]);
  const auto end = static_cast<unsigned>(begin + arguments[2]);
  for (unsigned i = begin; i < end; ++i) {
    if (find_area(page, i) == nullptr) co_return {Error::invalid_argument, unknown_area};
  }
  co_await turn_to(dialog, page, {});
  for (unsigned i = begin; i < end; ++i) {
    const std::uint8_t value = co_await read_byte(dialog, page, static_cast<std::uint8_t>(i), {});
    found.bytes.push_back(value);
  }
  found.page = page;
  found.memory_address = begin;
  found.value = found.bytes[0];
  if (found.bytes.size() > 1) found.data = found.bytes.view();
  co_return done;
}

Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto address = static_cast<std::uint8_t>(arguments[0]);
  const auto value = static_cast<std::uint8_t>(arguments[1]);
  const auto page = static_cast<std::uint8_t>(arguments[2]);
  constexpr std::string_view nothing_written = "nothing was written";
  const MemoryArea* const area = find_area(page, address);
  if (area == nullptr) co_return {Error::invalid_argument, unknown_area};
  if (!area->protection.empty() && arguments[3] == 0) {
    found.words.add("this page is not for the user: it holds ").add(area->meaning);
    found.words.add_part("writing there can spoil the encoder and needs force; nothing was sent");
    co_return {Error::invalid_argument, found.words.view()};
  }
  found.page = page;
  found.memory_address = address;
  found.value = value;
  co_await turn_to(dialog, page, nothing_written);
  const std::uint8_t before = co_await read_byte(dialog, page, address, nothing_written);
  found.written = before != value;
  if (before == value) co_return done;
  // If the reply to the write is lost, reading the byte back shows whether it was written.
  const Request write{DataId::write_memory, dialog.format().address, address, value};
  dialog.changes();
  const Result<Reply> written = co_await when_ready(dialog, write);
  if (written.error() == Error::busy) co_return failure(Error::busy, {}, eeprom_read_pause);
  if (!is_immediate(page, address)) co_await dialog.rest(eeprom_write_pause);
  const std::uint8_t now =
      co_await read_byte(dialog, page, address, "the byte was written, but could not be read back");
  if (now == value) co_return done;
  if (now == before) dialog.refused();
  co_return {Error::cross_check_failed, "reading back gave another value: the write has failed",
             "look at what is there with `absenc memory read` before you write it again", eeprom_read_pause};
}

Procedure select_page(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto page = static_cast<std::uint8_t>(arguments[0]);
  if (!is_page(page)) co_return {Error::invalid_argument, "Table 11 lists no such page; nothing was sent"};
  dialog.changes();
  co_await turn_to(dialog, page, {});
  found.page = co_await read_byte(dialog, page, page_select_address, {});
  if (found.page == page) co_return done;
  co_return {Error::cross_check_failed, "another page is selected",
             "check that nobody else selects pages on this line, then try again", eeprom_read_pause};
}

namespace {

// Finds from the status field (SF) whether LED or Lissajous signals raise led_or_lissajous_error. Returns false if SF
// does not decide it.
bool find_cause_in_status(ProcedureResult& found, const Reply& reply) {
  constexpr unsigned other_safety = alarms::unsafe & ~unsigned{alarms::led_or_lissajous_error};
  constexpr unsigned other_non_safety = alarms::turns_wrong | alarms::overspeed;
  const unsigned raised = reply.one.alarms | reply.two.alarms;
  const unsigned bits = reply.one.status | reply.two.status;
  const bool is_raised = (raised & alarms::led_or_lissajous_error) != 0;
  const bool led = is_raised && (bits & status::safety_error) != 0;
  const bool lissajous = is_raised && (bits & status::non_safety_error) != 0;
  if (!led || !lissajous || (raised & other_safety) == 0) found.led_error = led;
  if (!led || !lissajous || (raised & other_non_safety) == 0) found.lissajous_error = lissajous;
  return found.led_error || found.lissajous_error;
}

}  // namespace

Procedure read_error_info(Dialog& dialog, ProcedureResult& found) {
  if (dialog.format().bus == sharing_yes) {
    const Reply reply = co_await dialog.ask(request_of(dialog, DataId::alarms));
    found.show(reply);
    if (find_cause_in_status(found, reply)) co_return done;
    co_return {Error::unsupported,
               "other alarms raise the same bits of SF, and memory cannot be reached with several encoders on the line "
               "(Figure 18)",
               "connect this encoder alone and say bus=false: then a register tells"};
  }
  constexpr std::string_view page_may_be_left = "page 8 may be left selected, where it was another before";
  const Request which{DataId::read_memory, dialog.format().address, page_select_address};
  const Result<Reply> before = co_await when_ready(dialog, which);
  if (before.error() == Error::busy) co_return failure(Error::busy, {}, eeprom_read_pause);
  const bool known = before && is_page(before->value);
  co_await turn_to(dialog, register_page, page_may_be_left);
  const std::uint8_t flags = co_await read_byte(dialog, register_page, error_info_address, page_may_be_left);
  found.led_error = (flags & error_info_led) != 0;
  found.lissajous_error = (flags & error_info_lissajous) != 0;
  if (known && before->value == register_page) co_return done;
  found.page_left = register_page;
  if (!known) co_return done;
  // The memory page that this request selects stays selected after the procedure, so the host reads back whether it is
  // the page that was selected before the procedure.
  const Request restore{DataId::write_memory, dialog.format().address, page_select_address, before->value};
  const Result<Reply> restored = co_await when_ready(dialog, restore);
  if (restored.error() == Error::busy) co_return failure(Error::busy, {}, page_time);
  co_await dialog.rest(page_time);
  const Result<Reply> after = co_await when_ready(dialog, which);
  if (after.error() == Error::busy) co_return failure(Error::busy, {}, eeprom_read_pause);
  if (after && after->value == before->value) found.page_left.reset();
  co_return done;
}

// ---- Several encoders on one line

Procedure scan(Dialog& dialog, Nodes& found) {
  bool any = false;
  for (std::uint8_t address = 0; address < most_encoders; ++address) {
    const Request request{DataId::singleturn_short, address};
    const Result<Reply> reply = co_await dialog.attempt(request).repeated(attempts);
    if (!reply && dialog.is_noisy()) co_return {reply.error()};
    any = any || reply.error() != Error::timeout;
    if (reply) {
      found.answers[address] = *reply;
    } else if (is_damage(reply.error())) {
      found.disturbed[address] = true;
    } else if (reply.error() != Error::timeout) {
      Reply ignored;
      found.troubles[address] = check_reply(dialog.format(), request, dialog.reply(), ignored);
    }
  }
  if (!any) co_return {Error::timeout};
  co_return done;
}

}  // namespace absenc::esl
