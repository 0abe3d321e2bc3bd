// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/tformat/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/make.hpp"
#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/explain.hpp"
#include "absenc/protocol/tformat/fields.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/timing.hpp"
#include "absenc/protocol/tformat/vectors.hpp"

namespace absenc::tformat {

namespace {

constexpr std::array<Option, 4> options{{
    {.name = "singleturn_bits", .meaning = "bits of ABS", .default_value = 17, .minimum = 1, .maximum = 24},
    {.name = "multiturn_bits", .meaning = "bits of ABM; 0: no turns", .default_value = 16, .minimum = 0, .maximum = 24},
    {.name = "encoder_id",
     .meaning = "ENID that every reply must carry; -1: any",
     .default_value = -1,
     .minimum = -1,
     .maximum = 255},
    {.name = "strict",
     .meaning = "also check what encoders that deviate from the specification fail: SF information bits, SF against "
                "ALMC, EDF of a busy reply",
     .default_value = 1,
     .choices = boolean_choices},
}};

constexpr std::array<OptionValue, 3> ts5700n8500{
    {{option_singleturn_bits, 17}, {option_multiturn_bits, 16}, {option_encoder_id, 0x11}}};
constexpr std::array<OptionValue, 3> bits_23{
    {{option_singleturn_bits, 23}, {option_multiturn_bits, 16}, {option_encoder_id, 0x17}}};

constexpr std::array<Model, 2> models{{
    {"TS5700N8500", "Smart-Abs SA48-17/33bit-LPS-5V: 17 bits, 65536 turns", 6000, ts5700n8500},
    {"23-bit", "Tamagawa encoders with 23 bits, 65536 turns and ENID 17", 6000, bits_23},
}};

constexpr Argument address{"address", "of the byte", 0, page_addresses - 1};
constexpr Argument page{"page", "0 to 5, or 7", 0, service_page, 0, false};
constexpr std::array<Argument, 3> read_arguments{
    {address, page, {"count", "bytes from the address on", 1, page_addresses, 1, false}}};
constexpr std::array<Argument, 3> write_arguments{{address, {"value", "the byte", 0, 255}, page}};
constexpr std::array<Argument, 1> threshold_arguments{{{"degrees", "degC, 1 to 127; 0: never", 0, 127}}};

constexpr std::uint8_t id_of(DataId id) { return static_cast<std::uint8_t>(id); }

constexpr std::array<Command, 12> commands{{
    {"position", Verb::read, id_of(DataId::everything), "position, turns, encoder id and alarms"},
    {"singleturn", Verb::read_part, id_of(DataId::singleturn), "position within the turn"},
    {"multiturn", Verb::read_part, id_of(DataId::multiturn), "turns"},
    {"encoder-id", Verb::info, id_of(DataId::encoder_id), "encoder id"},
    {"clear-alarms", Verb::clear_alarms, id_of(DataId::clear_alarms), "clear all latched alarms", {}, true, false},
    {"zero", Verb::zero, id_of(DataId::zero), "make this the zero of the turn", {}, true, false},
    {"reset-multiturn",
     Verb::reset_multiturn,
     id_of(DataId::reset_multiturn),
     "set the turns to zero and clear all latched alarms",
     {},
     true,
     false},
    {"memory-read", Verb::memory_read, id_of(DataId::read_memory), "read the user's EEPROM; the page stays selected",
     read_arguments},
    {"memory-write", Verb::memory_write, id_of(DataId::write_memory),
     "write a byte of the user's EEPROM; the page stays selected", write_arguments, true, false},
    {"temperature", Verb::temperature, id_of(DataId::read_memory), "temperature of the board"},
    {"overheat-threshold", Verb::config_get, id_of(DataId::read_memory), "temperature above which over_heat is raised"},
    {"set-overheat-threshold", Verb::config_set, id_of(DataId::write_memory), "set that temperature",
     threshold_arguments, true, false, "overheat-threshold"},
}};

constexpr MemoryArea user_page(std::uint32_t number) {
  return {number, 0, page_addresses, "the user's EEPROM", true, true, write_life, {}, true};
}
constexpr std::array<MemoryArea, user_pages + 2> memory{{
    user_page(0),
    user_page(1),
    user_page(2),
    user_page(3),
    user_page(4),
    user_page(5),
    {service_page, overheat_address, 1, "over-heat threshold", true, false, write_life, {}, true},
    {service_page, temperature_address, 1, "temperature", false, false},
}};

constexpr bool memory_is_what_is_open() {
  for (unsigned on_page = 0; on_page <= service_page; ++on_page) {
    for (unsigned at = 0; at <= page_select_address; ++at) {
      const bool has =
          std::any_of(memory.begin(), memory.end(), [&](const MemoryArea& area) { return area.has(on_page, at); });
      if (has != is_open(on_page, at)) return false;
    }
  }
  return true;
}
static_assert(memory_is_what_is_open());

Error decode_frame(const Options& values, Frame request, Frame reply, FieldSink& sink) {
  return decode(to_format(values), request.bytes, reply.bytes, sink);
}

// The one frame that does the command's work; procedures send more (page select, repetitions).
Result<std::size_t> encode(const Options&, const Command& command, Arguments arguments, MutableBytes request) {
  Request frame{static_cast<DataId>(command.id)};
  switch (command.verb) {
    case Verb::memory_write:
      frame.value = static_cast<std::uint8_t>(arguments[1]);
      [[fallthrough]];
    case Verb::memory_read:
      frame.address = static_cast<std::uint8_t>(arguments[0]);
      break;
    case Verb::temperature:
      frame.address = temperature_address;
      break;
    case Verb::config_set:
      frame.value = WriteOverheatThreshold::encoded(static_cast<std::uint8_t>(arguments[0]));
      [[fallthrough]];
    case Verb::config_get:
      frame.address = overheat_address;
      break;
    default:
      break;
  }
  const RequestBytes bytes = encode_request(frame);
  if (bytes.size() > request.size()) return Error::buffer_too_small;
  std::copy_n(bytes.view().begin(), bytes.size(), request.begin());
  return bytes.size();
}

Delimit delimit(const Options&, Direction direction, Bytes bytes) {
  if (bytes.empty()) return {Delimit::Kind::incomplete, 1};
  const std::optional<DataId> id = data_id(bytes[0]);
  if (!id || bytes[0] != control_field(*id)) return {Delimit::Kind::no_frame};
  const std::size_t length = direction == Direction::request ? request_length(*id) : reply_length(*id);
  return {bytes.size() < length ? Delimit::Kind::incomplete : Delimit::Kind::complete, length};
}

Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                       std::span<std::byte> storage) {
  const Format format = to_format(values);
  const auto argument = [arguments](std::size_t i) { return static_cast<std::uint8_t>(arguments[i]); };
  switch (command.verb) {
    case Verb::read:
    case Verb::read_part:
    case Verb::info:
      return make_host<ReadPosition>(storage, format, static_cast<DataId>(command.id));
    case Verb::clear_alarms:
    case Verb::zero:
    case Verb::reset_multiturn:
      return make_host<Reset>(storage, format, static_cast<DataId>(command.id));
    case Verb::memory_read:
      return make_host<ReadMemory>(storage, format, argument(1), argument(0), argument(2));
    case Verb::memory_write:
      return make_host<WriteMemory>(storage, format, argument(2), argument(0), argument(1));
    case Verb::temperature:
      return make_host<ReadTemperature>(storage, format);
    case Verb::config_get:
      return make_host<ReadOverheatThreshold>(storage, format);
    case Verb::config_set:
      return make_host<WriteOverheatThreshold>(storage, format, argument(0));
    default:
      return {};
  }
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  return make_device<VirtualEncoder>(storage, to_format(values), shaft);
}

Resolution resolution(const Options& values) {
  const Format format = to_format(values);
  return {format.singleturn_bits, format.multiturn_bits};
}

Explanation explain(const Options&, Error error, Frame, Frame reply) {
  return error == Error::request_rejected ? explain_refusal(reply.bytes) : Explanation{};
}

}  // namespace

Format to_format(const Options& values) {
  return {.singleturn_bits = static_cast<unsigned>(values[option_singleturn_bits]),
          .multiturn_bits = static_cast<unsigned>(values[option_multiturn_bits]),
          .encoder_id = static_cast<int>(values[option_encoder_id]),
          .strict = values[option_strict] != 0};
}

constinit const Unit unit{
    .id = "tformat",
    .name = "Tamagawa T-format (Smart-Abs)",
    .document = "Specification of Smart-Abs TS5700N8500",
    .link = LinkKind::half_duplex,
    .line = line_settings,
    .options = options,
    .models = models,
    .fields = fields,
    .commands = commands,
    .memory = memory,
    .vectors = vectors,
    .status = &fields[field_status],
    .alarms = &fields[field_alarms],
    .host_storage = std::max({sizeof(ReadPosition), sizeof(Reset), sizeof(ReadMemory), sizeof(WriteMemory)}),
    .device_storage = sizeof(VirtualEncoder),
    .decode = decode_frame,
    .encode = encode,
    .delimit = delimit,
    .host = host,
    .device = device,
    .resolution = resolution,
    .explain = explain,
    // Any pause ends a frame; some encoders may forgive one that is shorter than their own answer time.
    .timing = {.pause_bits = 5, .turnaround = answer_time, .turnaround_limit = answer_limit},
};

}  // namespace absenc::tformat
