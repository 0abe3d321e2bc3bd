// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/fields.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/procedures.hpp"
#include "absenc/protocol/tformat/vectors.hpp"

namespace absenc::tformat {

namespace {

using namespace author;

// ---- Procedures with what they are asked for

constexpr std::uint8_t byte(std::int64_t argument) { return static_cast<std::uint8_t>(argument); }

// Of arguments and bytes found: what they mean.
struct Temperature : Memory {};
struct Threshold : Memory {};

/// The byte in memory (7.2).
constexpr std::uint8_t threshold_of(std::int64_t degrees) { return degrees == 0 ? 0 : byte(0x80 | degrees); }

Procedure read_bytes(Line& line, Memory& memory, Arguments arguments) {
  memory.page = byte(arguments[1]);
  memory.address = byte(arguments[0]);
  memory.count = byte(arguments[2]);
  return read_memory(line, memory);
}
Procedure write_byte(Line& line, Memory& memory, Arguments arguments) {
  memory.page = byte(arguments[2]);
  memory.address = byte(arguments[0]);
  memory.value = byte(arguments[1]);
  return write_memory(line, memory);
}
void use_service_page(Memory& memory, std::uint8_t address) {
  memory.page = service_page;
  memory.address = address;
  memory.restores = true;
}
Procedure read_service(Line& line, Memory& memory, std::uint8_t address) {
  use_service_page(memory, address);
  return read_memory(line, memory);
}
Procedure write_threshold(Line& line, Memory& memory, Arguments arguments) {
  use_service_page(memory, overheat_address);
  memory.value = threshold_of(arguments[0]);
  return write_memory(line, memory);
}

// ---- Memory

constexpr MemoryArea user_page(std::uint32_t number) {
  return {number, 0, page_addresses, "the user's EEPROM", true, true, write_life, {}, true};
}
constexpr std::array<MemoryArea, user_pages + 2> areas{{
    user_page(0),
    user_page(1),
    user_page(2),
    user_page(3),
    user_page(4),
    user_page(5),
    {service_page, overheat_address, 1, "over-heat threshold", true, false, write_life, {}, true},
    {service_page, temperature_address, 1, "temperature", false, false},
}};

constexpr bool areas_are_what_is_open() {
  for (unsigned on_page = 0; on_page <= service_page; ++on_page) {
    for (unsigned at = 0; at <= page_select_address; ++at) {
      const bool has =
          std::any_of(areas.begin(), areas.end(), [&](const MemoryArea& area) { return area.has(on_page, at); });
      if (has != is_open(on_page, at)) return false;
    }
  }
  return true;
}
static_assert(areas_are_what_is_open());

constexpr Argument address{"address", "of the byte", 0, page_addresses - 1, 0, true, Role::address};
constexpr Argument page{"page", "0 to 5, or 7", 0, service_page, 0, false, Role::page};
constexpr std::array<Argument, 3> read_arguments{
    {address, page, {"count", "bytes from the address on", 1, page_addresses, 1, false, Role::count}}};
constexpr std::array<Argument, 3> write_arguments{{address, {"value", "the byte", 0, 255, 0, true, Role::value}, page}};
constexpr std::array<Argument, 1> threshold_arguments{{{"degrees", "degC, 1 to 127; 0: never", 0, 127}}};

// ---- Refusals: the communication alarms of SF (6.3.2), or what else is answered like data ID 3 (8.4, 9.4)

constexpr Explanation explain_refusal(Bytes reply) {
  constexpr std::string_view again =
      "send the same request again, and use nothing of what came (6.3.2); if it stays, check baud rate, termination "
      "and shielding";
  switch (reply.size() > 1 ? reply[1] & status::rejected : 0) {
    case status::rejected:
      return {
          "ca0 and ca1: it received the request with a parity error of the data ID, and with a damaged character "
          "(a wrong delimiter)",
          again};
    case status::parity_error:
      return {"ca0: it received the request with a parity error of the data ID", again};
    case status::delimiter_error:
      return {"ca1: it received a damaged character of the request (a wrong delimiter)", again};
    default:
      return {
          "it answered as to data ID 3, without a communication alarm: a data ID that it does not have, a CRC that "
          "is wrong, or an address that is closed"};
  }
}

// ---- Commands

struct Definition;

template <DataId id>
constexpr Request ask_for(const Format&) {
  return {id};
}
template <DataId id>
constexpr Request reset_by(const Format&, Arguments) {
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
  return reading<Definition, Protocol, ask_for<id>, ReadPosition>(info);
}
template <DataId id>
constexpr CommandOf<Protocol> reset_of(const Command& info) {
  return command<Definition, Protocol, AfterReset, reset, reset_by<id>, id>(info);
}
template <class Found, std::uint8_t at>
constexpr CommandOf<Protocol> service(const Command& info) {
  return command<Definition, Protocol, Found, read_service, read_service_at<at>, at>(info);
}

// ---- What is declared

struct Definition {
  using Protocol = tformat::Protocol;
  using Encoder = VirtualEncoder;
  static constexpr std::string_view id = "tformat", name = "Tamagawa T-format (Smart-Abs)",
                                    document = "Specification of Smart-Abs TS5700N8500";
  static constexpr LinkKind link = LinkKind::half_duplex;
  static constexpr std::size_t frames_size = 900;
  // Any pause ends a frame; some encoders may forgive one that is shorter than their own answer time.
  static constexpr LineTiming timing{.pause_bits = 5, .turnaround = answer_time, .turnaround_limit = answer_limit};

  static constexpr OptionsOf options{
      option<&Format::singleturn_bits>("singleturn_bits", "bits of ABS", 1, 24),
      option<&Format::multiturn_bits>("multiturn_bits", "bits of ABM; 0: no turns", 0, 24),
      option<&Format::encoder_id>("encoder_id", "ENID that every reply must carry; -1: any", -1, 255),
      option<&Format::strict>("strict",
                              "also check what encoders that deviate from the specification fail: SF information bits, "
                              "SF against ALMC, EDF of a busy reply"),
  };
  static constexpr std::array models{
      ModelText{"TS5700N8500", "Smart-Abs SA48-17/33bit-LPS-5V: 17 bits, 65536 turns", 6000,
                "singleturn_bits=17 multiturn_bits=16 encoder_id=0x11"},
      ModelText{"23-bit", "Tamagawa encoders with 23 bits, 65536 turns and ENID 17", 6000,
                "singleturn_bits=23 multiturn_bits=16 encoder_id=0x17"},
  };
  static constexpr const auto& fields = tformat::fields;
  static constexpr const FieldInfo* status = fields.of<&Values::status>();
  static constexpr const FieldInfo* alarms = fields.of<&Values::alarms>();
  static constexpr const auto& memory = areas;
  static constexpr const auto& conditions = tformat::conditions;
  static constexpr const auto& vectors = tformat::vectors;
  static BitRanges bits(const Options& values, Frame, Frame reply, const FieldInfo& field) {
    return place_of(options.format(values), reply.bytes, field);
  }
  static constexpr std::array commands{
      position<DataId::everything>({"position", Verb::read, 0, "position, turns, encoder id and alarms"}),
      position<DataId::singleturn>({"singleturn", Verb::read_part, 0, "position within the turn"}),
      position<DataId::multiturn>({"multiturn", Verb::read_part, 0, "turns"}),
      position<DataId::encoder_id>({"encoder-id", Verb::info, 0, "encoder id"}),
      reset_of<DataId::clear_alarms>(
          {"clear-alarms", Verb::clear_alarms, 0, "clear all latched alarms", {}, true, false}),
      reset_of<DataId::zero>({"zero", Verb::zero, 0, "make this the zero of the turn", {}, true, false}),
      reset_of<DataId::reset_multiturn>({"reset-multiturn",
                                         Verb::reset_multiturn,
                                         0,
                                         "set the turns to zero and clear all latched alarms",
                                         {},
                                         true,
                                         false}),
      command<Definition, Protocol, Memory, read_bytes, read_at>(
          {"memory-read", Verb::memory_read, 0, "read the user's EEPROM; the page stays selected", read_arguments}),
      command<Definition, Protocol, Memory, write_byte, write_at>(
          {"memory-write", Verb::memory_write, 0, "write a byte of the user's EEPROM; the page stays selected",
           write_arguments, true, false}),
      service<Temperature, temperature_address>({"temperature", Verb::temperature, 0, "temperature of the board"}),
      service<Threshold, overheat_address>(
          {"overheat-threshold", Verb::config_get, 0, "temperature above which over_heat is raised"}),
      command<Definition, Protocol, Threshold, write_threshold, set_threshold>(
          {"set-overheat-threshold", Verb::config_set, 0, "set that temperature", threshold_arguments, true, false,
           "overheat-threshold"}),
  };

  static constexpr LineSettings line(const Format&) { return line_settings; }
  static constexpr Resolution resolution(const Format& format) {
    return {format.singleturn_bits, format.multiturn_bits};
  }
  static constexpr std::size_t reply_size(const Format&, Bytes begin) {
    const std::optional<DataId> of = data_id(begin[0]);
    return of && begin[0] == control_field(*of) ? reply_length(*of) : 0;
  }
  /// The reply's own control field says what was asked; the address of a memory access is taken as it comes.
  static constexpr Result<Request> guess_request(const Format&, Bytes reply) {
    const std::optional<DataId> asked = data_id(reply[0]);
    if (!asked) return Error::unexpected_reply;
    Request request{*asked};
    if (is_memory_access(*asked) && reply.size() == reply_length(*asked)) {
      request.address = reply[1] & 0x7F;
      request.value = reply[2];
    }
    return request;
  }
  /// What the encoder cannot accept is answered like ID 3 (8.4, 9.4).
  static constexpr Error answer_to_bad(Error error, Bytes reply) {
    const bool refused = reply.size() == reply_length(DataId::everything) && checksum(reply) == 0 &&
                         reply[0] == control_field(DataId::everything);
    return refused ? Error::request_rejected : error;
  }
  static constexpr Explanation explain(const Format&, Error error, Bytes, Bytes reply) {
    return error == Error::request_rejected ? explain_refusal(reply) : Explanation{};
  }

  static constexpr void put(FieldSink& sink, const Format&, const Request& request) {
    fields.put(sink, values_of(request));
  }
  static constexpr void put(FieldSink& sink, const Format&, const Request&, const Reply& reply) {
    fields.put(sink, values_of(reply));
  }
  static void put(FieldSink& sink, const Format&, const AfterReset& after) { fields.put(sink, values_of(after.reply)); }
  static void put(FieldSink& sink, const Format&, const Memory& found) {
    Values all{.page = found.page, .address = found.address, .value = found.value, .written = found.written};
    if (found.count > 1) all.data = found.data;
    fields.put(sink, all);
  }
  static void put(FieldSink& sink, const Format&, const Temperature& found) {
    fields.put(sink, {.temperature = static_cast<std::int8_t>(found.value), .page_left = page_left(found)});
  }
  static void put(FieldSink& sink, const Format&, const Threshold& found) {
    Values all{.overheat_enabled = (found.value & 0x80) != 0, .written = found.written, .page_left = page_left(found)};
    if (*all.overheat_enabled) all.overheat_threshold = found.value & 0x7F;
    fields.put(sink, all);
  }
  static std::optional<std::uint8_t> page_left(const Memory& found) {
    if (!found.restores || found.restored) return std::nullopt;
    return found.page;
  }
  static void put_left(FieldSink& sink, const Format&, const Memory& found) {
    if (found.selected) fields.put(sink, {.page_left = found.page});
  }
  static std::string_view left(const Memory& found) {
    return found.restores && found.selected ? "page 7 may be left selected, where it was another before" : "";
  }
};

}  // namespace

constinit const Unit unit = UnitOf<Definition>::make();

}  // namespace absenc::tformat
