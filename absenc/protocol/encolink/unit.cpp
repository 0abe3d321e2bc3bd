// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/encolink/fields.hpp"
#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/encolink/listen.hpp"
#include "absenc/protocol/encolink/probe.hpp"
#include "absenc/protocol/encolink/procedures.hpp"
#include "absenc/protocol/encolink/timing.hpp"
#include "absenc/protocol/encolink/vectors.hpp"
#include "absenc/protocol/make.hpp"

namespace absenc::encolink {

namespace {

constexpr std::array<std::string_view, 2> offset_signs{"add", "subtract"};
constexpr std::array<std::string_view, 2> offset_units{"counts", "turn_fraction"};
constexpr std::array<std::string_view, 2> protocol_versions{"2", "4"};

constexpr std::array<Option, 8> options{{
    {.name = "resolution",
     .meaning = "bits of a turn; 0: asked from the encoder before each command (decode: 22)",
     .default_value = 0,
     .minimum = 0,
     .maximum = maximum_resolution},
    {.name = "multiturn_bits",
     .meaning = "bits of the turn counter; 0: no turns, 5 bytes a frame; -1: asked as well (decode: by the length)",
     .default_value = -1,
     .minimum = -1,
     .maximum = maximum_multiturn_bits},
    {.name = "has_ch2",
     .meaning = "whether frames end in a byte of channel 2; false: those of an AksIM-1, without status and registers",
     .default_value = 1,
     .choices = boolean_choices},
    {.name = "offset_sign",
     .meaning = "whether the position offset is added to the measured position or subtracted",
     .default_value = 0,
     .choices = offset_signs},
    {.name = "stream_rate",
     .meaning = "frames a second that the encoder sends by itself (UART): nothing is sent then; 0: it is asked",
     .default_value = 0,
     .minimum = 0,
     .maximum = 10'000},
    {.name = "offset_unit",
     .meaning = "of the position offset: counts of the resolution, or 2^-32 revolution",
     .default_value = 0,
     .choices = offset_units},
    {.name = "protocol_version",
     .meaning = "virtual encoder: 2, or 4 as an AksIM-4, of which only the positions are described",
     .default_value = 0,
     .choices = protocol_versions},
    {.name = "identity_bytes",
     .meaning =
         "virtual encoder, UART: bytes of its identity; 20: one is behind it, and the frame before is as long, as "
         "clients with the vendor's library read them",
     .default_value = identity_bytes,
     .minimum = identity_bytes,
     .maximum = padded_identity_bytes},
}};

constexpr std::array<Model, 1> models{{{"AksIM-2", "off-axis; resolution and turns as its identity says", 10'000, {}}}};

// What only `run` does, by number: the unit's own ids of commands that share a verb.
enum Id : std::uint8_t {
  id_position = static_cast<std::uint8_t>(Config::position),
  id_alarms = static_cast<std::uint8_t>(Config::reset_channels),
  id_identify = static_cast<std::uint8_t>(Config::identify),
  id_info,
  id_zero,
  id_preset,
  id_read,
  id_write,
  id_listen,
  id_save = commands::save,
  id_reset = commands::reset,
  id_self_calibrate = commands::self_calibrate,
};

constexpr std::int64_t largest_address = 0xFFFFFFFF;
constexpr Argument address{"address", "of the register; the README lists them", 0, largest_address};
constexpr Argument length{"length", "bytes of the register; 0: as the table of registers says", 0, 8, 0, false};
constexpr Argument keep{"save", "1: into the flash as well, so that it survives power off", 0, 1, 1, false};
constexpr std::array<Argument, 2> read_arguments{{address, {"length", length.meaning, 0, access_capacity, 0, false}}};
constexpr std::array<Argument, 3> write_arguments{{address, {"value", "big endian", 0, INT64_MAX}, length}};
constexpr std::array<Argument, 1> zero_arguments{{keep}};
constexpr std::array<Argument, 2> preset_arguments{{{"turns", "", 0, 65535, 0, false}, keep}};
constexpr std::array<Argument, 1> offset_arguments{{{"value", "in what offset_unit says", 0, largest_address}}};
constexpr std::array<Argument, 1> lock_arguments{{{"value", "0: open, 1: locked", 0, 1}}};
constexpr std::array<Argument, 1> listen_arguments{{{"count", "frames", 1, UINT32_MAX, 100, false}}};

constexpr std::array<Command, 17> commands_of_unit{{
    {"position", Verb::read, id_position, "position, turns, and the alarms when there are any"},
    {"alarms", Verb::read_part, id_alarms, "detailed status from channel 2, checked against channel 1"},
    {"info", Verb::info, id_info, "identity, firmware, serial number, temperature, speed"},
    {"identify", Verb::run, id_identify, "identity: protocol version, resolution, part number"},
    {"temperature", Verb::temperature, id_read, "temperature of the readhead"},
    {"zero", Verb::zero, id_zero, "make this the zero of the turn, by the position offset", zero_arguments, true,
     false},
    {"preset-multiturn", Verb::reset_multiturn, id_preset, "set the turns, to 0 if not told otherwise",
     preset_arguments, true, false},
    {"memory-read", Verb::memory_read, id_read, "read a register", read_arguments},
    {"memory-write", Verb::memory_write, id_write, "write a register and read it back", write_arguments, true, false},
    {"position-offset", Verb::config_get, position_offset, "position offset"},
    {"set-position-offset", Verb::config_set, position_offset, "set it, until power off unless saved", offset_arguments,
     true, false, "position-offset"},
    {"write-lock", Verb::config_get, write_lock, "whether the configuration is locked"},
    {"set-write-lock", Verb::config_set, write_lock, "lock or unlock it, until power off unless saved", lock_arguments,
     true, false, "write-lock"},
    {"save", Verb::run, id_save, "write the configuration into the flash", {}, true, false},
    {"reset", Verb::run, id_reset, "set the configuration to the values at shipping", {}, true, false},
    {"self-calibrate",
     Verb::run,
     id_self_calibrate,
     "calibrate for eccentricity while the shaft is turned",
     {},
     true,
     false},
    {"listen", Verb::run, id_listen, "the last of some frames of an encoder that transmits by itself",
     listen_arguments},
}};

constexpr std::array<RegisterInfo, registers.size()> register_infos = [] {
  std::array<RegisterInfo, registers.size()> infos{};
  for (std::size_t i = 0; i < registers.size(); ++i) {
    const Register& one = registers[i];
    infos[i] = {one.name, one.address, one.size, one.access != Access::write_only, one.access != Access::read_only};
  }
  return infos;
}();

/// The value of an argument; its default where the caller leaves it out.
std::int64_t argument(const Command& command, Arguments arguments, std::size_t index) {
  return index < arguments.size() ? arguments[index] : command.arguments[index].default_value;
}

Keep to_keep(std::int64_t value) { return value != 0 ? Keep::forever : Keep::until_power_off; }

// ---- Frames

Error decode_frame(const Options& values, Frame request, Frame reply, FieldSink& sink) {
  return decode(to_format(values), request.bytes, reply.bytes, sink);
}

std::uint16_t length_of(std::uint32_t register_address, std::int64_t wanted) {
  const Register* known = find_register(register_address);
  if (wanted == 0 && known != nullptr) return known->size;
  return static_cast<std::uint16_t>(wanted);
}

// The register access that does the command's work.
Result<RegisterRequest> access_of(const Command& command, Arguments arguments) {
  switch (command.verb) {
    case Verb::temperature:
      return read_request(registers[temperature].address, registers[temperature].size);
    case Verb::config_get:
      return read_request(registers[command.id].address, registers[command.id].size);
    case Verb::config_set:
      return write_request(registers[command.id].address, registers[command.id].size,
                           static_cast<std::uint64_t>(argument(command, arguments, 0)));
    case Verb::reset_multiturn:
      return write_request(registers[multiturn_preset].address, registers[multiturn_preset].size,
                           static_cast<std::uint64_t>(argument(command, arguments, 0)));
    case Verb::memory_read: {
      const auto where = static_cast<std::uint32_t>(argument(command, arguments, 0));
      const std::uint16_t bytes = length_of(where, argument(command, arguments, 1));
      return bytes == 0 ? Result<RegisterRequest>(Error::invalid_argument) : read_request(where, bytes);
    }
    case Verb::memory_write: {
      const auto where = static_cast<std::uint32_t>(argument(command, arguments, 0));
      const std::uint16_t bytes = length_of(where, argument(command, arguments, 2));
      if (bytes == 0 || bytes > 8) return Error::invalid_argument;
      return write_request(where, bytes, static_cast<std::uint64_t>(argument(command, arguments, 1)));
    }
    default:
      break;
  }
  if (command.id == id_save || command.id == id_reset || command.id == id_self_calibrate) {
    return write_request(registers[command_register].address, 1, command.id);
  }
  return Error::unsupported;  // zero: the value depends on the position; listen: nothing is sent
}

// Two bytes, or the `ra` bytes of the access, of which each frame carries one.
Result<std::size_t> encode(const Options&, const Command& command, Arguments arguments, MutableBytes request) {
  AccessBytes bytes;
  if (command.verb == Verb::read || command.verb == Verb::read_part || command.id == id_identify ||
      command.id == id_info) {
    bytes.push_back(command.id == id_info ? std::uint8_t{id_identify} : command.id);
    bytes.push_back(0);
  } else {
    const Result<RegisterRequest> access = access_of(command, arguments);
    if (!access) return access.error();
    bytes = encode_access(*access);
  }
  if (bytes.size() > request.size()) return Error::buffer_too_small;
  std::copy_n(bytes.view().begin(), bytes.size(), request.begin());
  return bytes.size();
}

struct Nowhere final : FieldSink {
  void put(const FieldValue&) override {}
};

// Whether a frame of `size` bytes may stand there, and if so, whether its checksum is right.
struct Candidate {
  bool possible;
  bool sealed;
};

Candidate candidate(const Format& format, std::size_t size, Bytes bytes) {
  const std::size_t covered = size == format.frame_bytes() ? format.position_bytes() + 1 : size;
  const bool cycle = format.has_ch2 && size == format.cycle_bytes();
  const bool possible = size == format.frame_bytes() || cycle || size == identity_bytes;
  return {possible, possible && bytes.size() >= size && is_sealed(bytes.first(covered))};
}

// The length of a frame is known by its checksum only.
Delimit delimit(const Options& values, Direction direction, Bytes bytes) {
  if (direction == Direction::request) {
    if (bytes.size() < request_bytes) return {Delimit::Kind::incomplete, request_bytes};
    Nowhere nowhere;
    const bool known = decode_request(bytes.first(request_bytes), nowhere) == Error::none;
    return known ? Delimit{Delimit::Kind::complete, request_bytes} : Delimit{Delimit::Kind::no_frame};
  }
  const Format format = to_format(values);
  for (std::size_t size = 1; size <= identity_bytes; ++size) {
    for (const int turns : {0, 16}) {
      if (format.multiturn_bits >= 0 && (format.multiturn_bits > 0) != (turns > 0)) continue;
      const Candidate one = candidate({format.resolution, turns, format.has_ch2}, size, bytes);
      if (!one.possible) continue;
      if (bytes.size() < size) return {Delimit::Kind::incomplete, size};
      if (one.sealed) return {Delimit::Kind::complete, size};
    }
  }
  return {Delimit::Kind::no_frame};
}

// The byte of channel 2 stands behind the checksum of a position frame; one that means nothing may stand behind that of
// the identity.
bool covered(const Options& values, Frame request, Frame reply, std::size_t bit) {
  const Format format = to_format(values);
  if (reply.bytes.size() == padded_identity_bytes) return bit / 8 < identity_bytes;
  return request.bytes.size() != request_bytes || !format.has_ch2 || bit / 8 != format.frame_bytes() - 1;
}

bool streams(const Options& values) { return to_build(values).stream_rate > 0; }

// ---- Machines

template <Wire wire>
Any<Conversation> run(const Format& format, const Command& command, Arguments arguments, std::span<std::byte> storage) {
  switch (command.id) {
    case id_identify:
      return make_host<Identify>(storage, format, wire);
    case id_listen:
      return make_host<Listen>(storage, format, static_cast<std::uint32_t>(argument(command, arguments, 0)));
    case id_self_calibrate:
      return make_host<SelfCalibrate>(storage, format, wire);
    default:
      return make_host<SendCommand>(storage, format, wire, command.id);
  }
}

template <Wire wire>
Any<Conversation> host(const Options& values, const Command& command, Arguments arguments,
                       std::span<std::byte> storage) {
  const Format format = to_format(values);
  const auto value = [&](std::size_t index) { return argument(command, arguments, index); };
  switch (command.verb) {
    case Verb::read:
      if (wire == Wire::uart && values[option_stream_rate] > 0) return make_host<Listen>(storage, format);
      return make_host<ReadPosition>(storage, format, wire);
    case Verb::read_part:
      return make_host<ReadDetailedStatus>(storage, format, wire);
    case Verb::info:
      return make_host<ReadInfo>(storage, format, wire);
    case Verb::temperature:
      return make_host<ReadRegister>(storage, format, wire, registers[temperature].address);
    case Verb::zero:
      return make_host<Zero>(storage, format, wire, to_build(values).offset, to_keep(value(0)));
    case Verb::reset_multiturn:
      return make_host<PresetMultiturn>(storage, format, wire, static_cast<std::uint16_t>(value(0)), to_keep(value(1)));
    case Verb::memory_read:
      return make_host<ReadRegister>(storage, format, wire, static_cast<std::uint32_t>(value(0)),
                                     static_cast<std::uint16_t>(value(1)));
    case Verb::memory_write:
      return make_host<WriteRegister>(storage, format, wire, static_cast<std::uint32_t>(value(0)),
                                      static_cast<std::uint16_t>(value(2)), static_cast<std::uint64_t>(value(1)));
    case Verb::config_get:
      return make_host<ReadRegister>(storage, format, wire, registers[command.id].address);
    case Verb::config_set:
      return make_host<WriteRegister>(storage, format, wire, registers[command.id].address, std::uint16_t{0},
                                      static_cast<std::uint64_t>(value(0)));
    case Verb::run:
      return run<wire>(format, command, arguments, storage);
    default:
      return {};
  }
}

template <Wire wire>
Any<Device> device(const Options& values, const Shaft& shaft, std::span<std::byte> storage) {
  return make_device<VirtualEncoder>(storage, to_format(values), wire, shaft, to_build(values));
}

// Those of the virtual encoder where they are asked from the real one.
Resolution resolution(const Options& values) {
  const Format format = to_format(values);
  return {format.resolution != 0 ? format.resolution : virtual_format.resolution,
          static_cast<unsigned>(format.multiturn_bits >= 0 ? format.multiturn_bits : virtual_format.multiturn_bits)};
}

constexpr Unit make_unit(std::string_view id, std::string_view name, Wire wire, std::span<const Vector> frames) {
  const bool spi = wire == Wire::spi;
  return {
      .id = id,
      .name = name,
      .document = "Programming AksIM-2 encoders with EncoLink communication protocol, issue 2",
      .link = spi ? LinkKind::exchange : LinkKind::full_duplex,
      .line = spi ? spi_settings : uart_settings,
      .options = options,
      .models = models,
      .fields = fields,
      .commands = commands_of_unit,
      .registers = register_infos,
      .vectors = frames,
      .status = &fields[field_general_status],
      .alarms = &fields[field_alarms],
      .host_storage = std::max({sizeof(ReadPosition), sizeof(ReadDetailedStatus), sizeof(Identify), sizeof(Listen),
                                sizeof(ReadRegister), sizeof(WriteRegister), sizeof(Zero), sizeof(PresetMultiturn),
                                sizeof(SendCommand), sizeof(SelfCalibrate), sizeof(ReadInfo)}),
      .device_storage = sizeof(VirtualEncoder),
      .decode = decode_frame,
      .encode = encode,
      .delimit = delimit,
      .host = spi ? host<Wire::spi> : host<Wire::uart>,
      .device = spi ? device<Wire::spi> : device<Wire::uart>,
      .resolution = resolution,
      .covered = covered,
      .over_spi = spi ? nullptr : &spi_unit,
      .probe = probe,
      .timing = {.turnaround_limit = answer_limit},
      .streams = streams,
  };
}

}  // namespace

Format to_format(const Options& values) {
  return {.resolution = static_cast<unsigned>(values[option_resolution]),
          .multiturn_bits = static_cast<int>(values[option_multiturn_bits]),
          .has_ch2 = values[option_has_ch2] != 0};
}

Build to_build(const Options& values) {
  return {.offset = {values[option_offset_sign] != 0 ? OffsetSign::subtract : OffsetSign::add,
                     values[option_offset_unit] != 0 ? OffsetUnit::turn_fraction : OffsetUnit::counts},
          .stream_rate = static_cast<std::uint32_t>(values[option_stream_rate]),
          .protocol_version = values[option_protocol_version] != 0 ? version::aksim4 : version::aksim2,
          .identity_size = static_cast<std::size_t>(values[option_identity_bytes])};
}

constinit const Unit unit = make_unit("encolink", "RLS EncoLink (AksIM-2), UART", Wire::uart, vectors);
constinit const Unit spi_unit = make_unit("encolink-spi", "RLS EncoLink (AksIM-2), SPI", Wire::spi, spi_vectors);

}  // namespace absenc::encolink
