// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/fields.hpp"
#include "absenc/protocol/encolink/listen.hpp"
#include "absenc/protocol/encolink/options.hpp"
#include "absenc/protocol/encolink/probe.hpp"
#include "absenc/protocol/encolink/procedures.hpp"
#include "absenc/protocol/encolink/vectors.hpp"

namespace absenc::encolink {

namespace {

using author::CommandOf;

// ---- What goes out

/// Two bytes, or the access whose bytes ride in the second one.
struct Request {
  Config config = Config::position;
  std::optional<RegisterRequest> access{};
};

struct Protocol {
  using Format = encolink::Format;
  using Request = encolink::Request;
  using Line = encolink::Line;

  static AccessBytes encode(const Format&, const Request& request) {
    if (request.access) return encode_access(*request.access);
    AccessBytes bytes;
    bytes.push_back(static_cast<std::uint8_t>(request.config));
    bytes.push_back(0);
    return bytes;
  }
  static std::size_t request_size(Bytes begin) {
    if (begin.size() < request_bytes) return request_bytes;
    const auto config = static_cast<Config>(begin[0]);
    const bool known = config == Config::position || config == Config::reset_channels || config == Config::identify;
    return known ? request_bytes : 0;
  }
};

template <Config config>
Result<Request> frame(const Format&, Arguments) {
  return Request{config};
}

template <std::size_t index>
Result<Request> reading_of(const Format&, Arguments) {
  return Request{Config::position, read_request(registers[index].address, registers[index].size)};
}

template <std::size_t index>
Result<Request> writing_of(const Format&, Arguments arguments) {
  const auto value = static_cast<std::uint64_t>(arguments[0]);
  return Request{Config::position, write_request(registers[index].address, registers[index].size, value)};
}

template <std::uint8_t code>
Result<Request> order(const Format&, Arguments) {
  return Request{Config::position, write_request(registers[command_register].address, 1, code)};
}

Result<Request> memory_reading(const Format&, Arguments arguments) {
  const auto address = static_cast<std::uint32_t>(arguments[0]);
  const std::uint16_t size = size_of(address, arguments[1]);
  if (size == 0) return Error::invalid_argument;
  return Request{Config::position, read_request(address, size)};
}

Result<Request> memory_writing(const Format&, Arguments arguments) {
  const auto address = static_cast<std::uint32_t>(arguments[0]);
  const std::uint16_t size = size_of(address, arguments[2]);
  const auto value = static_cast<std::uint64_t>(arguments[1]);
  if (size == 0 || size > 8 || value > low_mask(8u * size)) return Error::invalid_argument;
  return Request{Config::position, write_request(address, size, value)};
}

constexpr auto not_known = nullptr;  // the value depends on the position, or nothing is sent

// ---- Where a frame ends: its checksum alone tells

constexpr std::size_t reply_size(const Format& format, Bytes begin) {
  for (std::size_t size = 1; size <= identity_bytes; ++size) {
    for (const int turns : {0, 16}) {
      if (format.multiturn_bits >= 0 && (format.multiturn_bits > 0) != (turns > 0)) continue;
      const Format one{.resolution = format.resolution, .multiturn_bits = turns, .has_ch2 = format.has_ch2};
      const bool cycle = one.has_ch2 && size == one.cycle_bytes();
      if (size != one.frame_bytes() && !cycle && size != identity_bytes) continue;
      if (begin.size() < size) return size;
      if (is_sealed(begin.first(size == one.frame_bytes() ? one.position_bytes() + 1 : size))) return size;
    }
  }
  return 0;
}

// The byte of channel 2 stands behind the checksum of a position frame; one that means nothing may stand behind that of
// the identity.
bool covered(const Options& values, Frame request, Frame reply, std::size_t bit) {
  const Format format = options.format(values);
  if (reply.bytes.size() == padded_identity_bytes) return bit / 8 < identity_bytes;
  return request.bytes.size() != request_bytes || !format.has_ch2 || bit / 8 != format.frame_bytes() - 1;
}

// ---- Commands

struct Report;  // what is told of each, below

constexpr Argument address{"address", "of the register; the README lists them", 0, 0xFFFFFFFF, 0, true, Role::address};
constexpr Argument length{"length", "bytes of the register; 0: as the table of registers says", 0, 8, 0, false};
constexpr Argument keep{"save", "1: into the flash as well, so that it survives power off", 0, 1, 1, false};
constexpr std::array<Argument, 2> read_arguments{{address, {"length", length.meaning, 0, access_capacity, 0, false}}};
constexpr std::array<Argument, 3> write_arguments{
    {address, {"value", "big endian", 0, INT64_MAX, 0, true, Role::value}, length}};
constexpr std::array<Argument, 1> zero_arguments{{keep}};
constexpr std::array<Argument, 2> preset_arguments{{{"turns", "", 0, 65535, 0, false}, keep}};
constexpr std::array<Argument, 1> listen_arguments{{{"count", "frames", 1, UINT32_MAX, 100, false}}};

template <class Found, auto procedure, auto... bound>
constexpr CommandOf<Protocol> command(const Command& info, Result<Request> (*request)(const Format&, Arguments)) {
  CommandOf<Protocol> made =
      author::command<Report, Protocol, Found, procedure, frame<Config::position>, bound...>(info);
  made.request = request;
  return made;
}

constexpr CommandOf<Protocol> position(const Command& info) {
  using Made = author::Told<Report, ReadPosition>;
  return {.info = info,
          .request = frame<Config::position>,
          .make = [](const Format& format, Arguments,
                     std::span<std::byte> storage) { return make_host<Made>(storage, format); },
          .size = sizeof(Made)};
}

constexpr CommandOf<Protocol> listen(const Command& info) {
  return {.info = info,
          .request = not_known,
          .make =
              [](const Format& format, Arguments arguments, std::span<std::byte> storage) {
                const std::int64_t count = arguments.empty() ? 1 : arguments[0];
                return make_host<Listen>(storage, format, static_cast<std::uint32_t>(count));
              },
          .size = sizeof(Listen)};
}

/// The names of the two commands of a register: as it is, with '-' for '_'.
template <std::size_t index>
struct SettingNames {
  static constexpr std::string_view prefix = "set-";
  static constexpr std::array<char, prefix.size() + registers[index].name.size()> text = [] {
    std::array<char, prefix.size() + registers[index].name.size()> made{};
    std::size_t at = 0;
    for (const char c : prefix) made[at++] = c;
    for (const char c : registers[index].name) made[at++] = c == '_' ? '-' : c;
    return made;
  }();
  static constexpr std::string_view set{text.data(), text.size()};
  static constexpr std::string_view get = set.substr(prefix.size());
  static constexpr std::array<Argument, 1> arguments{
      {{"value", registers[index].setting.value, 0, registers[index].setting.largest}}};
};

template <std::size_t index>
constexpr CommandOf<Protocol> get() {
  return command<FoundRegister, read_register, index>(
      {SettingNames<index>::get, Verb::config_get, 0, registers[index].setting.meaning}, reading_of<index>);
}

template <std::size_t index>
constexpr CommandOf<Protocol> set() {
  using Names = SettingNames<index>;
  return command<FoundRegister, write_register, index>(
      {Names::set, Verb::config_set, 0, registers[index].setting.how, Names::arguments, true, false, Names::get},
      writing_of<index>);
}

constexpr bool streams(const Format& format) { return format.wire == Wire::uart && format.stream_rate > 0; }

constexpr Command read_position{"position", Verb::read, 0, "position, turns, and the alarms when there are any"};
constexpr std::array commands_of_unit{
    position(read_position).or_when(streams, listen(read_position)),
    command<FoundAlarms, read_alarms>(
        {"alarms", Verb::read_part, 0, "detailed status from channel 2, checked against channel 1"},
        frame<Config::reset_channels>),
    command<FoundIdentity, read_info>({"info", Verb::info, 0, "identity, firmware, serial number, temperature, speed"},
                                      frame<Config::identify>),
    command<FoundIdentity, read_identity>(
        {"identify", Verb::run, 0, "identity: protocol version, resolution, part number"}, frame<Config::identify>),
    command<FoundRegister, read_register, temperature>(
        {"temperature", Verb::temperature, 0, "temperature of the readhead"}, reading_of<temperature>),
    command<FoundZero, zero>(
        {"zero", Verb::zero, 0, "make this the zero of the turn, by the position offset", zero_arguments, true, false},
        not_known),
    command<Nothing, preset_multiturn>({"preset-multiturn", Verb::reset_multiturn, 0,
                                        "set the turns, to 0 if not told otherwise", preset_arguments, true, false},
                                       writing_of<multiturn_preset>),
    command<FoundRegister, read_memory>({"memory-read", Verb::memory_read, 0, "read a register", read_arguments},
                                        memory_reading),
    command<FoundRegister, write_memory>(
        {"memory-write", Verb::memory_write, 0, "write a register and read it back", write_arguments, true, false},
        memory_writing),
    get<position_offset>(),
    set<position_offset>(),
    get<write_lock>(),
    set<write_lock>(),
    command<Nothing, send_command, commands::save>(
        {"save", Verb::run, 0, "write the configuration into the flash", {}, true, false}, order<commands::save>),
    command<Nothing, send_command, commands::reset>(
        {"reset", Verb::run, 0, "set the configuration to the values at shipping", {}, true, false},
        order<commands::reset>),
    command<FoundCalibration, self_calibrate>(
        {"self-calibrate", Verb::run, 0, "calibrate for eccentricity while the shaft is turned", {}, true, false},
        order<commands::self_calibrate>),
    listen(
        {"listen", Verb::run, 0, "the last of some frames of an encoder that transmits by itself", listen_arguments}),
};

struct Report {
  static void put(FieldSink& sink, const ReadPosition& read) { encolink::put(sink, read); }
  template <class Run>
  static void put(FieldSink& sink, const Run& run) {
    encolink::put(sink, run, run.found());
  }
  static Explanation explain(const Stream& stream) { return encolink::explain(stream); }
};

// ---- What is declared

constexpr std::array<RegisterInfo, registers.size()> register_infos = [] {
  std::array<RegisterInfo, registers.size()> infos{};
  for (std::size_t i = 0; i < registers.size(); ++i) {
    const Register& one = registers[i];
    infos[i] = {one.name, one.address, one.size, one.access != Access::write_only, one.access != Access::read_only};
  }
  return infos;
}();

struct FieldTable {
  std::span<const FieldInfo> infos;
};

/// What the document says of both wires, and of each.
template <Wire wire>
struct Definition {
  using Protocol = encolink::Protocol;
  using Encoder = VirtualEncoder;
  static constexpr bool spi = wire == Wire::spi;
  static constexpr std::string_view id = spi ? "encolink-spi" : "encolink";
  static constexpr std::string_view name = spi ? "RLS EncoLink (AksIM-2), SPI" : "RLS EncoLink (AksIM-2), UART";
  static constexpr std::string_view document =
      "Programming AksIM-2 encoders with EncoLink communication protocol, issue 2";
  static constexpr LinkKind link = spi ? LinkKind::exchange : LinkKind::full_duplex;
  static constexpr LineSettings line(const Format&) { return spi ? spi_settings : uart_settings; }
  static constexpr LineTiming timing{.turnaround_limit = answer_limit};
  static constexpr auto& options = encolink::options;
  static constexpr std::array models{
      author::ModelText{"AksIM-2", "off-axis; resolution and turns as its identity says", 10'000, ""}};
  static constexpr FieldTable fields{encolink::fields};
  static constexpr auto& commands = commands_of_unit;
  static constexpr auto vectors = [] {
    if constexpr (spi) {
      return vector_texts::spi;
    } else {
      return vector_texts::uart;
    }
  }();
  static constexpr std::size_t frames_size = 1280;
  static constexpr auto& conditions = encolink::conditions;
  static constexpr const FieldInfo* status = &general_status_field;
  static constexpr const FieldInfo* alarms = frame_fields.of<&Values::alarms>();
  static constexpr auto& registers = register_infos;
  static constexpr const Unit* over_spi = spi ? nullptr : &spi_unit;
  static constexpr auto probe = encolink::probe;
  static constexpr auto covered = encolink::covered;
  static bool streams(const Options& values) { return format(values).stream_rate > 0; }

  static constexpr Format format(const Options& values) {
    Format made = options.format(values);
    made.wire = wire;
    return made;
  }
  // Those of the virtual encoder where they are asked from the real one.
  static constexpr Resolution resolution(const Format& format) {
    return {format.resolution != 0 ? format.resolution : virtual_format.resolution,
            static_cast<unsigned>(format.multiturn_bits >= 0 ? format.multiturn_bits : virtual_format.multiturn_bits)};
  }
  static constexpr std::size_t reply_size(const Format& format, Bytes begin) {
    return encolink::reply_size(format, begin);
  }
  static constexpr Error decode(const Format& format, Frame asked, Frame reply, FieldSink& sink) {
    return encolink::decode(format, asked.bytes, reply.bytes, sink);
  }
  static constexpr Explanation explain(const Format&, Error error, Bytes, Bytes reply) {
    const bool frame = reply.size() < identity_bytes;
    return {error == Error::out_of_range && frame ? wrong_resolution : std::string_view{}};
  }
};

}  // namespace

constinit const Unit unit = author::UnitOf<Definition<Wire::uart>>::make();
constinit const Unit spi_unit = author::UnitOf<Definition<Wire::spi>>::make();

}  // namespace absenc::encolink
