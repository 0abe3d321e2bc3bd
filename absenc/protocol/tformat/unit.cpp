// SPDX-License-Identifier: Apache-2.0
// Commands and procedures of T-format encoders, and the declaration of the unit.
#include "absenc/protocol/tformat/unit.hpp"

#include <array>
#include <optional>

#include "absenc/protocol/author/busy_memory.hpp"
#include "absenc/protocol/author/standstill.hpp"
#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/fields.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/vectors.hpp"

namespace absenc::tformat {

namespace {

using namespace author;

using Dialog = DialogOf<Protocol>;

// Result of a T-format procedure: the values of its fields, its reading, and the memory bytes that the field `data`
// reports.
struct ProcedureResult : Values {
  Reading reading{};
  ByteBuffer<page_addresses> bytes{};  // storage of the memory bytes that the field `data` reports
  std::optional<std::uint8_t> selected{};
};

// ---- Resets (10)

// Returns an error if the positions in the replies `first` and `second` forbid a reset; otherwise no error.
Outcome objection(const Format& format, DataId id, const Reply& first, const Reply& second) {
  const Reading before = to_reading(format, first);
  const Reading now = to_reading(format, second);
  // While full_absolute_status is raised, the position is too coarse to show whether the shaft moves.
  if ((second.alarms & alarms::full_absolute_status) != 0) {
    return {Error::invalid_argument,
            "full_absolute_status: the encoder was switched on while the shaft turned, and has not seen it stand still "
            "since; nothing was sent",
            "let the shaft stand still, then try again"};
  }
  const Outcome moves = id == DataId::zero ? objection_to_zero(before, now) : objection_to_moving(before, now);
  if (moves.error != Error::none) return moves;
  const bool turns_lost = format.battery && (second.alarms & alarms::battery_error) != 0;
  if (id == DataId::clear_alarms && turns_lost) {
    return {Error::invalid_argument,
            "battery_error says that the turns are lost, and clearing it alone would hide that; nothing was sent",
            "replace the battery, return to the origin, then `absenc reset-multiturn`"};
  }
  return {};
}

// Returns an explanation if the reply `now`, after a reset, shows that the reset failed; otherwise an empty one.
Explanation failed_part(DataId id, const Reply& now, unsigned bits) {
  if (id == DataId::zero) {
    if (is_near(now.singleturn, 0, bits, zero_tolerance_millidegrees)) return {};
    return {"the position is still not zero", "hold the shaft still, then `absenc zero` again"};
  }
  if (id == DataId::reset_multiturn && now.multiturn != 0) {
    return {"the turns are still not zero", "hold the shaft still, then `absenc reset-multiturn` again"};
  }
  if ((now.alarms & alarms::over_heat) != 0) {
    return {"over_heat remains: the encoder is still hotter than its threshold", "let it cool down, then try again"};
  }
  if ((now.alarms & alarms::latched) != 0) {
    return {"latched alarms remain", "mend the cause that `absenc alarms` names, then try again"};
  }
  return {};
}

// Resets with data ID 7 (latched alarms), 8 (zero of the position) or C (turns and latched alarms).
Procedure reset(Dialog& dialog, ProcedureResult& found, DataId id) {
  const Reply first = co_await dialog.ask({DataId::everything});
  const Reply second = co_await dialog.ask({DataId::everything}).after(between_looks);
  const Outcome why_not = objection(dialog.format(), id, first, second);
  if (why_not.error != Error::none) co_return why_not;

  co_await send_in_a_row(dialog, {id}, reset_row);
  // The tenth reply of the reset still shows the old alarms, so the result is read with a request of its own.
  const Reply now = co_await dialog.ask({DataId::everything})
                        .after(id == DataId::zero ? memory_time : reset_interval)
                        .or_say("all ten requests were sent, but whether the encoder obeyed could not be read");
  static_cast<Values&>(found) = values_of(dialog.format(), now);
  found.reading = dialog.last_reading();
  const unsigned bits = dialog.format().singleturn_bits;
  if (id == DataId::zero) note_zero(dialog, second.singleturn, now.singleturn, bits, zero_tolerance_millidegrees);
  const Explanation what = failed_part(id, now, bits);
  if (!what.detail.empty()) co_return {Error::cross_check_failed, what.detail, what.advice};
  const Verb verb = id == DataId::zero              ? Verb::zero
                    : id == DataId::reset_multiturn ? Verb::reset_multiturn
                                                    : Verb::clear_alarms;
  note_side_effects(dialog, verb, to_reading(dialog.format(), second), found.reading);
  co_return done;
}

// ---- Memory (6.3.5, 9.1)

constexpr Time busy_limit = 2 * memory_time;  // longest wait for a busy memory: twice the document's maximum
constexpr Time busy_pause = 1ms;  // pause between two requests to a busy encoder; a page select has its own pause

constexpr std::uint8_t byte(std::int64_t argument) { return static_cast<std::uint8_t>(argument); }

// Repeats a memory request while the encoder is busy, for at most `busy_limit`.
Part<Result<Reply>> when_ready(Dialog& dialog, const Request& request) {
  return until_ready<Protocol>(dialog, request,
                               {.limit = busy_limit,
                                .pause = selects_page(request) ? memory_time : busy_pause,
                                .attempts = Protocol::manner(dialog.format(), request).repeats + 1});
}

Outcome failure(const Dialog& dialog, Error error, std::string_view step) {
  return {error,
          error == Error::busy ? "the encoder stays busy longer than a write may take" : step,
          {},
          Protocol::manner(dialog.format(), dialog.request()).hold};
}

// Executes a memory request and returns the value in its reply; ends the procedure on an error.
Part<std::uint8_t> execute(Dialog& dialog, Request request, std::string_view step) {
  const Result<Reply> reply = co_await when_ready(dialog, request);
  if (!reply) co_await dialog.stop(failure(dialog, reply.error(), step));
  if (selects_page(request)) co_await dialog.rest(memory_time);
  co_return reply->value;
}

Part<std::uint8_t> select_page(Dialog& dialog, ProcedureResult& found, std::uint8_t page, std::string_view step) {
  found.selected = page;
  const std::uint8_t selected = co_await execute(dialog, {DataId::write_memory, page_select_address, page}, step);
  co_return selected;
}

Procedure read_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto address = byte(arguments[0]);
  const auto page = byte(arguments[1]);
  for (std::int64_t i = 0; i < arguments[2]; ++i) {
    if (find_area(page, static_cast<unsigned>(address + i)) != nullptr) continue;
    co_return {Error::invalid_argument,
               "this area is closed: pages 0 to 5 have addresses 0 to 126, page 7 has 4 (over-heat threshold) and 5 "
               "(temperature)"};
  }
  co_await select_page(dialog, found, page, "");
  for (std::int64_t i = 0; i < arguments[2]; ++i) {
    const std::uint8_t value = co_await execute(dialog, {DataId::read_memory, byte(address + i)}, "");
    found.bytes.push_back(value);
  }
  found.page = page;
  found.address = address;
  found.value = found.bytes[0];
  if (found.bytes.size() > 1) found.data = found.bytes.view();
  co_return done;
}

// Writes a byte on the selected page if it differs, and reads it back from the EEPROM.
Part<bool> write_byte(Dialog& dialog, ProcedureResult& found, std::uint8_t address, std::uint8_t value) {
  const Request look{DataId::read_memory, address};
  const std::uint8_t before = co_await execute(dialog, look, "nothing was written");
  found.written = before != value;
  if (before == value) co_return false;
  dialog.changes();
  const Result<Reply> reply = co_await when_ready(dialog, {DataId::write_memory, address, value});
  if (reply.error() == Error::busy) {
    dialog.refused();
    co_await dialog.stop(failure(dialog, Error::busy, ""));
  }
  // If the reply to the write is lost, reading the byte back shows whether it was written.
  co_await dialog.rest(memory_time);
  constexpr std::string_view lost = "the byte was written, but could not be read back";
  co_await select_page(dialog, found, *found.selected, lost);
  const std::uint8_t now = co_await execute(dialog, look, lost);
  if (now != value) {
    if (now == before) dialog.refused();
    co_await dialog.stop({Error::cross_check_failed, "reading back gave another value: the write has failed",
                          "look at what is there with `absenc memory read` before you write it again"});
  }
  co_return true;
}

Procedure write_memory(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const auto address = byte(arguments[0]);
  const auto page = byte(arguments[2]);
  const MemoryArea* const area = find_area(page, address);
  if (area == nullptr || !area->writable) {
    co_return {Error::invalid_argument,
               "this address cannot be written: pages 0 to 5 have addresses 0 to 126, page 7 has 4 (over-heat "
               "threshold)"};
  }
  if (page == service_page && address == overheat_address && byte(arguments[1]) == overheat_at_zero) {
    co_return {
        Error::invalid_argument, "0x80 watches for 0 degC, and the document wants 1 degC or more",
        "write 0x81 to 0xFF, the degrees + 128, or 0x00 for off; `absenc config set ... overheat-threshold` takes "
        "the degrees themselves"};
  }
  co_await select_page(dialog, found, page, "nothing was written");
  co_await write_byte(dialog, found, address, byte(arguments[1]));
  found.page = page;
  found.address = address;
  found.value = byte(arguments[1]);
  co_return done;
}

// ---- The service page (7.2, 7.3); the page before it is selected again if it is known

// Selects the service page. Returns the page that was selected before; no value if it is unknown.
Part<std::optional<std::uint8_t>> open_service_page(Dialog& dialog, ProcedureResult& found, std::string_view step) {
  const Result<Reply> before = co_await when_ready(dialog, {DataId::read_memory, page_select_address});
  found.page_left = service_page;
  co_await select_page(dialog, found, service_page, step);
  co_return before&& is_page(before->value) ? std::optional(before->value) : std::nullopt;
}

// Selects the page `before` again. Returns whether the encoder has confirmed it.
Part<bool> restore(Dialog& dialog, ProcedureResult& found, std::optional<std::uint8_t> before) {
  if (!before) co_return false;
  if (*before != service_page) {
    const Result<Reply> selected = co_await when_ready(dialog, {DataId::write_memory, page_select_address, *before});
    co_await dialog.rest(memory_time);  // without a valid reply the page change may still be in progress
    if (!selected) co_return false;
    const Result<Reply> now = co_await when_ready(dialog, {DataId::read_memory, page_select_address});
    if (!now || now->value != *before) co_return false;
  }
  found.page_left.reset();
  co_return true;
}

Procedure read_temperature(Dialog& dialog, ProcedureResult& found) {
  const std::optional<std::uint8_t> before = co_await open_service_page(dialog, found, "");
  const std::uint8_t value = co_await execute(dialog, {DataId::read_memory, temperature_address}, "");
  found.temperature = static_cast<std::int8_t>(value);
  co_await restore(dialog, found, before);
  co_return done;
}

// Returns the memory byte for an over-heat threshold in degC; 0 switches the threshold off.
constexpr std::uint8_t threshold_of(std::int64_t degrees) { return degrees == 0 ? 0 : byte(0x80 | degrees); }

void show_threshold(ProcedureResult& found, std::uint8_t value) {
  found.overheat_enabled = (value & 0x80) != 0;
  if (*found.overheat_enabled) found.overheat_threshold = value & 0x7F;
}

Procedure read_threshold(Dialog& dialog, ProcedureResult& found) {
  const std::optional<std::uint8_t> before = co_await open_service_page(dialog, found, "");
  const std::uint8_t value = co_await execute(dialog, {DataId::read_memory, overheat_address}, "");
  show_threshold(found, value);
  co_await restore(dialog, found, before);
  co_return done;
}

Procedure write_threshold(Dialog& dialog, ProcedureResult& found, Arguments arguments) {
  const std::optional<std::uint8_t> before = co_await open_service_page(dialog, found, "nothing was written");
  co_await write_byte(dialog, found, overheat_address, threshold_of(arguments[0]));
  show_threshold(found, threshold_of(arguments[0]));
  co_await restore(dialog, found, before);
  co_return done;
}

// ---- Refusals (6.3.2, 8.4, 9.4)

constexpr Explanation explain_refusal(Bytes reply) {
  constexpr std::array<std::string_view, 4> found{
      // Cause of a refusal in words, by the value (0 to 3) of the bits ca1 and ca0 of its status field (SF).
      "it answered as to data ID 3, without a communication alarm: a data ID that it does not have, a CRC that is "
      "wrong, or an address that is closed",
      "ca0: it received the request with a parity error of the data ID",
      "ca1: it received a damaged character of the request (a wrong delimiter)",
      "ca0 and ca1: it received the request with a parity error of the data ID, and with a damaged character (a wrong "
      "delimiter)"};
  const unsigned alarm = reply.size() > 1 ? reply[1] >> 6 : 0;
  return {found[alarm],
          alarm == 0
              ? ""
              : "send the same request again, and use nothing of what came (6.3.2); if it stays, check baud rate, "
                "termination and shielding"};
}

// ---- Reports

constexpr Values values_of_request(const Format&, const Request& request) { return values_of(request); }
constexpr Values values_of_reply(const Format& format, const Request&, const Reply& reply) {
  return values_of(format, reply);
}
constexpr void put_found(FieldSink& sink, const Format&, const ProcedureResult& found) { fields.put(sink, found); }
constexpr void put_left(FieldSink& sink, const Format&, const ProcedureResult& found) {
  fields.put(sink, {.page_left = found.selected});
}
constexpr std::string_view left(const ProcedureResult& found) {
  return found.page_left ? "page 7 may be left selected, where it was another before" : "";
}
constexpr Explanation explain(const Format&, Error error, Bytes, Bytes reply) {
  return error == Error::request_rejected ? explain_refusal(reply) : Explanation{};
}

constexpr Report<Protocol> report{
    .put_request = put_values<fields, values_of_request>,
    .put_reply = put_values<fields, values_of_reply>,
    .explain = explain,
};
constexpr Finding<Format, ProcedureResult> found{.put = put_found, .put_left = put_left, .left = left};

// ---- Commands

constexpr Argument address{"address", "of the byte", 0, page_addresses - 1, 0, true, Role::address};
constexpr Argument page{"page", "0 to 5, or 7", 0, service_page, 0, false, Role::page};
constexpr std::array<Argument, 3> read_arguments{
    {address, page, {"count", "bytes from the address on", 1, page_addresses, 1, false, Role::count}}};
constexpr std::array<Argument, 3> write_arguments{{address, {"value", "the byte", 0, 255, 0, true, Role::value}, page}};
constexpr std::array<Argument, 1> threshold_arguments{{{"degrees", "degC, 1 to 127; 0: never", 0, 127}}};

template <DataId id>
constexpr Request ask_for(const Format&, Arguments) {
  return {id};
}
template <std::uint8_t at>
constexpr Request read_service_at(const Format&, Arguments) {
  return {DataId::read_memory, at};
}
constexpr Request read_at(const Format&, Arguments arguments) { return {DataId::read_memory, byte(arguments[0])}; }
constexpr Request write_at(const Format&, Arguments arguments) {
  return {DataId::write_memory, byte(arguments[0]), byte(arguments[1])};
}
constexpr Request set_threshold(const Format&, Arguments arguments) {
  return {DataId::write_memory, overheat_address, threshold_of(arguments[0])};
}

template <DataId id>
constexpr CommandOf<Protocol> position(const Command& info) {
  return reading<report, ask_for<id>, ReadPosition>(info);
}
template <auto procedure, auto request, auto... bound>
constexpr CommandOf<Protocol> run(const Command& info) {
  return command<report, found, procedure, request, bound...>(info);
}
template <DataId id>
constexpr CommandOf<Protocol> reset_of(std::string_view name, Verb verb, std::string_view meaning) {
  return run<reset, ask_for<id>, id>({name, verb, 0, meaning, {}, true, false});
}

constexpr auto commands = std::array{
    position<DataId::everything>({"position", Verb::read, 0, "position, turns, encoder id and alarms"}),
    position<DataId::singleturn>({"singleturn", Verb::read_part, 0, "position within the turn"}),
    position<DataId::multiturn>({"multiturn", Verb::read_part, 0, "turns"}),
    position<DataId::encoder_id>({"encoder-id", Verb::info, 0, "encoder id"}),
    reset_of<DataId::clear_alarms>("clear-alarms", Verb::clear_alarms, "clear all latched alarms"),
    reset_of<DataId::zero>("zero", Verb::zero, "make this the zero of the turn"),
    reset_of<DataId::reset_multiturn>("reset-multiturn", Verb::reset_multiturn,
                                      "set the turns to zero and clear all latched alarms"),
    run<read_memory, read_at>(
        {"memory-read", Verb::memory_read, 0, "read the user's EEPROM; the page stays selected", read_arguments}),
    run<write_memory, write_at>({"memory-write", Verb::memory_write, 0,
                                 "write a byte of the user's EEPROM; the page stays selected", write_arguments, true,
                                 false}),
    run<read_temperature, read_service_at<temperature_address>>(
        {"temperature", Verb::temperature, 0, "temperature of the board"}),
    run<read_threshold, read_service_at<overheat_address>>(
        {"overheat-threshold", Verb::config_get, 0, "temperature above which over_heat is raised"}),
    run<write_threshold, set_threshold>({"set-overheat-threshold", Verb::config_set, 0, "set that temperature",
                                         threshold_arguments, true, false, "overheat-threshold"}),
};

// ---- Declaration

constexpr auto options = OptionsOf{
    option<&Format::singleturn_bits>("singleturn_bits", "bits of ABS", 1, 24),
    option<&Format::multiturn_bits>("multiturn_bits", "bits of ABM; 0: no turns", 0, 24),
    in_hex(option<&Format::encoder_id>("encoder_id", "ENID that every reply must carry; -1: any", -1, 255)),
    option<&Format::strict>("strict",
                            "also check what encoders that deviate from the specification fail: SF information bits, "
                            "SF against ALMC, EDF of a busy reply"),
    option<&Format::battery>("battery",
                             "false: no battery is connected: the turns are left out, and battery_error and "
                             "battery_alarm, which such an encoder always shows, are no alarms"),
};
constexpr auto models = std::array{
    ModelText{"TS5700N8500", "Smart-Abs SA48-17/33bit-LPS-5V: 17 bits, 65536 turns", 6000,
              "singleturn_bits=17 multiturn_bits=16 encoder_id=0x11"},
    ModelText{"23-bit", "Tamagawa encoders with 23 bits, 65536 turns and ENID 0x17", 6000,
              "singleturn_bits=23 multiturn_bits=16 encoder_id=0x17"},
};

BitRanges bits_in(const Options& values, Frame, Frame reply, const FieldInfo& field) {
  return place_of(options.format(values), reply.bytes, field);
}
constexpr std::size_t size_of_reply(const Format&, Bytes begin) {
  const std::optional<DataId> of = data_id(begin[0]);
  return of && begin[0] == control_field(*of) ? reply_length(*of) : 0;
}
/// Returns the request that a captured reply probably answers, if the capture does not contain it. Error:
/// unexpected_reply.
constexpr Result<Request> guess_request(const Format&, Bytes reply) {
  const std::optional<DataId> asked = data_id(reply[0]);
  if (!asked) return Error::unexpected_reply;
  Request request{*asked};
  if (is_memory_access(*asked) && reply.size() == reply_length(*asked)) {
    request.address = reply[1] & 0x7F;
    request.value = reply[2];
  }
  return request;
}
/// Returns request_rejected if the reply is a refusal (8.4, 9.4); otherwise returns `error`.
constexpr Error answer_to_bad(const Format&, Bytes, Error error, Bytes reply) {
  const bool refused = reply.size() == reply_length(DataId::everything) && checksum(reply) == 0 &&
                       reply[0] == control_field(DataId::everything);
  return refused ? Error::request_rejected : error;
}

constexpr auto known_as = std::array<std::string_view, 2>{"Tamagawa", "Smart-Abs"};

constexpr Declaration<Protocol, VirtualEncoder> declaration{
    .id = "tformat",
    .name = "Tamagawa T-format (Smart-Abs)",
    .document = "Specification of Smart-Abs TS5700N8500",
    .known_as = known_as,
    .link = LinkKind::half_duplex,
    .options = options.infos,
    .format = format_of<options>,
    .models = models,
    .fields = fields.infos,
    .commands = commands,
    .vectors = vectors,
    .frames_size = 1400,
    .report = report,
    .guess_request = guess_request,
    .reply_size = size_of_reply,
    .answer_to_bad = answer_to_bad,
    .bits = bits_in,
    .remembered = remembered,
    .status = fields.of<&Values::status>(),
    .alarms = fields.of<&Values::alarms>(),
    .memory = memory_areas,
    .conditions = conditions,
    // In the document a pause of any length ends a frame; a few bits are allowed here, because some encoders tolerate a
    // short pause.
    .timing = {.pause_bits = 5, .turnaround = answer_time, .turnaround_limit = answer_limit},
};

}  // namespace

constinit const Unit unit = Descriptor<declaration>::make();

}  // namespace absenc::tformat
