// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/esl/bus.hpp"
#include "absenc/protocol/esl/device.hpp"
#include "absenc/protocol/esl/fields.hpp"
#include "absenc/protocol/esl/host.hpp"
#include "absenc/protocol/esl/memory.hpp"
#include "absenc/protocol/esl/probe.hpp"
#include "absenc/protocol/esl/settings.hpp"
#include "absenc/protocol/esl/vectors.hpp"
#include "absenc/protocol/make.hpp"

namespace absenc::esl {

namespace {

constexpr std::array<Model, 1> models{{
    {"QS35-M40M-E12F", "24 bits, 65536 turns, two channels (SIL3)", 10'000, {}},
}};

constexpr Argument address{"address", "of the byte", 0, last_address};
constexpr Argument page{"page", "0 to 6, 8 or 14", 0, last_page, 0, false};
constexpr std::array<Argument, 3> read_arguments{
    {address, page, {"count", "bytes from the address on", 1, last_address + 1, 1, false}}};
constexpr std::array<Argument, 4> write_arguments{
    {address,
     {"value", "the byte", 0, 255},
     page,
     {"force", "1: also pages with calibration, lock bits and undescribed commands", 0, 1, 0, false}}};
constexpr std::array<Argument, 1> page_arguments{{{"page", "0 to 6, 8 or 14", 0, last_page}}};

constexpr std::string_view protection = "what is written there can spoil the encoder";

// Permissible writing cycles (notes 6 and 7 of Table 11), which do not say of what.
constexpr std::uint32_t write_life(MemoryArea::Kind kind) {
  if (kind == MemoryArea::Kind::registers) return 0;
  return kind == MemoryArea::Kind::eeprom ? 1'000'000 : 100'000;
}

constexpr std::uint8_t id_of(DataId id) { return static_cast<std::uint8_t>(id); }

// Commands whose id does not tell what they are.
constexpr std::string_view safe_position = "safe-position";
constexpr std::string_view led_or_lissajous = "led-or-lissajous";
constexpr std::string_view select_page = "select-page";

constexpr std::array<Command, 17> commands{{
    {"position", Verb::read, id_of(DataId::position), "position, turns and alarms of both channels"},
    {"singleturn", Verb::read_part, id_of(DataId::singleturn), "position within the turn, both channels"},
    {"position-short", Verb::read_part, id_of(DataId::position_short), "position and turns, one channel, no alarms"},
    {"singleturn-short", Verb::read_part, id_of(DataId::singleturn_short),
     "position within the turn, one channel, no alarms"},
    {"calibration", Verb::read_part, id_of(DataId::calibration), "position within the turn as each channel sees it"},
    {safe_position, Verb::run, id_of(DataId::position),
     "a position that passed every check of a safety reader (not a certified safety function)"},
    {"encoder-id", Verb::info, id_of(DataId::encoder_id), "encoder id", {}, false, false},
    {"alarms", Verb::info, id_of(DataId::alarms), "alarms of both channels"},
    {"temperature", Verb::temperature, id_of(DataId::temperature), "temperature inside the encoder"},
    {led_or_lissajous, Verb::run, id_of(DataId::read_memory), "which of the two is behind led_or_lissajous_error"},
    {"scan", Verb::scan, id_of(DataId::singleturn_short), "who answers on the line", {}, false, false},
    {"zero", Verb::zero, id_of(DataId::zero), "make this the zero of the turn", {}, true, false},
    {"clear-alarms",
     Verb::clear_alarms,
     id_of(DataId::clear_alarms),
     "clear the alarms that can be cleared",
     {},
     true,
     false},
    {"reset-multiturn",
     Verb::reset_multiturn,
     id_of(DataId::reset_multiturn),
     "set the turns to zero",
     {},
     true,
     false},
    {"memory-read", Verb::memory_read, id_of(DataId::read_memory), "read EEPROM, MTP or registers", read_arguments},
    {"memory-write", Verb::memory_write, id_of(DataId::write_memory), "write a byte of the memory", write_arguments,
     true, false},
    {select_page, Verb::run, id_of(DataId::write_memory), "select a memory page", page_arguments, true, true},
}};

// Table 11 in the order of pages.
constexpr std::array<absenc::MemoryArea, memory_map.size()> memory_areas = [] {
  std::array<absenc::MemoryArea, memory_map.size()> areas{};
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const MemoryArea& area = memory_map[i];
    areas[i] = {.page = area.page,
                .first = area.first,
                .count = area.last - area.first + 1u,
                .meaning = area.meaning,
                .in_dump = area.page == 0,
                .write_life = write_life(area.kind),
                .protection = area.user ? "" : protection};
  }
  return areas;
}();

Error decode_frame(const Options& values, Frame request, Frame reply, FieldSink& sink) {
  return decode(to_profile(values), request.bytes, reply.bytes, sink);
}

// The one frame that does the command's work; procedures send more (page select, repetitions).
Result<std::size_t> encode(const Options& values, const Command& command, Arguments arguments, MutableBytes request) {
  const Profile profile = to_profile(values);
  const bool memory = is_memory_access(static_cast<DataId>(command.id));
  if (memory && profile.bus) return Error::unsupported;
  Request frame{static_cast<DataId>(command.id), profile.address};
  if (command.name == led_or_lissajous) {
    frame.memory_address = error_info_address;
  } else if (command.name == select_page) {
    frame.memory_address = page_select_address;
    frame.value = static_cast<std::uint8_t>(arguments[0]);
  } else if (memory) {
    frame.memory_address = static_cast<std::uint8_t>(arguments[0]);
    if (command.verb == Verb::memory_write) frame.value = static_cast<std::uint8_t>(arguments[1]);
  }
  const RequestBytes bytes = encode_request(profile, frame);
  if (bytes.size() > request.size()) return Error::buffer_too_small;
  std::copy_n(bytes.view().begin(), bytes.size(), request.begin());
  return bytes.size();
}

Delimit delimit(const Options& values, Direction direction, Bytes bytes) {
  if (bytes.empty()) return {Delimit::Kind::incomplete, 1};
  const Profile profile = to_profile(values);
  const std::optional<DataId> id = data_id(bytes[0]);
  if (!id || bytes[0] != control_field(profile, address_of(bytes[0]), *id)) return {Delimit::Kind::no_frame};
  const std::size_t length = direction == Direction::request ? request_length(profile, *id) : reply_length(*id);
  return {bytes.size() < length ? Delimit::Kind::incomplete : Delimit::Kind::complete, length};
}

Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                       std::span<std::byte> storage) {
  const Profile profile = to_profile(values);
  const auto argument = [arguments](std::size_t i) { return static_cast<std::uint8_t>(arguments[i]); };
  switch (command.verb) {
    case Verb::read:
    case Verb::read_part:
    case Verb::info:
    case Verb::temperature:
      return make_host<Read>(storage, profile, static_cast<DataId>(command.id));
    case Verb::clear_alarms:
    case Verb::zero:
    case Verb::reset_multiturn:
      return make_host<Reset>(storage, profile, static_cast<DataId>(command.id));
    case Verb::memory_read:
      return make_host<ReadMemory>(storage, profile, argument(1), argument(0), argument(2));
    case Verb::memory_write:
      return make_host<WriteMemory>(storage, profile, argument(2), argument(0), argument(1),
                                    argument(3) != 0 ? Force::yes : Force::no);
    case Verb::run:
      if (command.name == safe_position) return make_host<ReadSafePosition>(storage, profile);
      if (command.name == led_or_lissajous) return make_host<ReadErrorInfo>(storage, profile);
      if (command.name == select_page) return make_host<SelectPage>(storage, profile, argument(0));
      return {};
    case Verb::scan:
      return make_host<Scan>(storage, profile);
    default:
      return {};
  }
}

Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  return make_device<VirtualEncoder>(storage, to_profile(values), shaft);
}

bool probe_captures(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const ProbeResult result = probe(to_profile(values), captures);
  for (std::size_t option = 0; option < open_options; ++option) {
    for (std::size_t value = 0; value < options[option].choices.size(); ++value) {
      const Evidence& evidence = result.values[option][value];
      sink.put({option, static_cast<std::int64_t>(value), evidence.possible, evidence.capture,
                sentence(result, option, value)});
    }
    if (result.profiles != 0) values.values[option] = get_option(result.best, option);
  }
  return result.profiles != 0;
}

// The same words as a host finds for what it refuses.
Explanation explain_frame(const Options& values, Error error, Frame request, Frame reply) {
  if (reply.empty()) return {};
  const Profile profile = to_profile(values);
  const Result<Request> asked = asked_by(profile, request.bytes, reply.bytes);
  if (!asked) return {};
  Reply ignored;
  const Check check = check_reply(profile, *asked, reply.bytes, ignored);
  if (check == Check::length || error_of(check) != error) return {};  // the error says all of it
  return {.found = text_of(check).sentence};
}

Resolution resolution(const Options&) { return {singleturn_bits, multiturn_bits}; }

}  // namespace

Profile to_profile(const Options& values) {
  Profile profile;
  for (std::size_t i = 0; i < options.size(); ++i) set_option(profile, i, values[i]);
  return profile;
}

constinit const Unit unit{
    .id = "esl",
    .name = "QS35 ESL (safety encoder, two channels)",
    .document = "QS35 ESL Protocol Specification, rev 1.5",
    .link = LinkKind::half_duplex,
    .line = line_settings,
    .options = options,
    .models = models,
    .fields = fields,
    .commands = commands,
    .memory = memory_areas,
    .vectors = vectors,
    .status = &fields[field_ch1_status],
    .alarms = &fields[field_ch1_alarms],
    .second_status = &fields[field_ch2_status],
    .second_alarms = &fields[field_ch2_alarms],
    .host_storage = std::max({sizeof(Read), sizeof(ReadSafePosition), sizeof(Reset), sizeof(ReadMemory),
                              sizeof(ReadErrorInfo), sizeof(WriteMemory), sizeof(SelectPage), sizeof(Scan)}),
    .device_storage = sizeof(VirtualEncoder),
    .decode = decode_frame,
    .encode = encode,
    .delimit = delimit,
    .host = host,
    .device = device,
    .resolution = resolution,
    .explain = explain_frame,
    .probe = probe_captures,
    .timing = {.pause_bits = 1, .turnaround = answer_time, .turnaround_limit = answer_limit},
};

}  // namespace absenc::esl
