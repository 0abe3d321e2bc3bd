// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/unit.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/encolink/channel_follower.hpp"
#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/fields.hpp"
#include "absenc/protocol/encolink/listen.hpp"
#include "absenc/protocol/encolink/procedures.hpp"
#include "absenc/protocol/encolink/vectors.hpp"

namespace absenc::encolink {

namespace {

using author::CommandOf;
using author::option;

// ---- Options

constexpr std::array<std::string_view, 2> offset_signs{"add", "subtract"};
constexpr std::array<std::string_view, 2> offset_units{"counts", "turn_fraction"};
constexpr std::array<std::string_view, 2> generations{"2", "4"};

constexpr auto options = author::OptionsOf{
    option<&Format::resolution>("resolution",
                                "bits of a turn; 0: asked from the encoder before each command (decode: 22)", 0,
                                maximum_resolution),
    option<&Format::multiturn_bits>(
        "multiturn_bits",
        "bits of the turn counter; 0: no turns, 5 bytes a frame; -1: asked as well (decode: by the length)", -1,
        maximum_multiturn_bits),
    option<&Format::has_ch2>(
        "has_ch2",
        "whether frames end in a byte of channel 2; false: those of an AksIM-1, without status and registers"),
    option<&Format::offset_sign>(
        "offset_sign", "whether the position offset is added to the measured position or subtracted", offset_signs),
    option<&Format::stream_rate>(
        "stream_rate",
        "frames a second that the encoder sends by itself (UART): only position and listen are possible then, and "
        "nothing is sent; 0: it is asked",
        0, 10'000),
    option<&Format::offset_unit>("offset_unit", "of the position offset: counts of the resolution, or 2^-32 revolution",
                                 offset_units),
    option<&Format::generation>("protocol_version",
                                "virtual encoder: 2, or 4 as an AksIM-4, of which only the positions are described",
                                generations),
    option<&Format::identity_size>(
        "identity_bytes",
        "virtual encoder, UART: bytes of its identity; 20: one is behind it, and the frame before is as long, as "
        "clients with the vendor's library read them",
        identity_bytes, padded_identity_bytes),
};

// ---- Requests

/// Content of a request: its first byte, or a register access whose bytes several requests carried.
struct Request {
  Config config = Config::position;
  std::optional<RegisterRequest> access{};
};

struct Protocol {
  using Format = encolink::Format;
  using Request = encolink::Request;
  using Reply = Position;
  using Dialog = encolink::Dialog;
  static constexpr bool replies_carry_position = Frames::replies_carry_position;

  static constexpr author::HostTimes host_times(const Format& format) { return Frames::host_times(format); }
  static author::Manner manner(const Format&, const Request&) { return {}; }
  static AccessBytes encode(const Format&, const Request& request) {
    if (request.access) return encode_access(*request.access);
    AccessBytes bytes;
    bytes.push_back(static_cast<std::uint8_t>(request.config));
    bytes.push_back(0);
    return bytes;
  }
  static std::size_t request_size(const Format&, Bytes begin) {
    return begin.size() < request_bytes || is_config(begin[0]) ? request_bytes : 0;
  }
};

using MakeRequest = Result<Request> (*)(const Format&, Arguments);

template <Config config>
Result<Request> frame(const Format&, Arguments) {
  return Request{config};
}

template <std::size_t index>
Result<Request> reading_of(const Format&, Arguments) {
  return Request{Config::position, read_request(registers[index].address, registers[index].size)};
}

Result<Request> writing(std::uint32_t address, std::int64_t wanted, std::int64_t argument) {
  const std::uint16_t size = register_size(address, wanted);
  const auto value = static_cast<std::uint64_t>(argument);
  if (size == 0 || size > 8 || value > low_mask(8u * size)) return Error::invalid_argument;
  return Request{Config::position, write_request(address, size, value)};
}

template <std::size_t index>
Result<Request> writing_of(const Format&, Arguments arguments) {
  return writing(registers[index].address, 0, arguments[0]);
}

template <std::uint8_t code>
Result<Request> order(const Format&, Arguments) {
  return writing(registers[command_register].address, 0, code);
}

Result<Request> memory_reading(const Format&, Arguments arguments) {
  const auto address = static_cast<std::uint32_t>(arguments[0]);
  const std::uint16_t size = register_size(address, arguments[1]);
  if (size == 0) return Error::invalid_argument;
  return Request{Config::position, read_request(address, size)};
}

Result<Request> memory_writing(const Format&, Arguments arguments) {
  return writing(static_cast<std::uint32_t>(arguments[0]), arguments[2], arguments[1]);
}

// A null function marks a command that cannot be encoded as one request: its requests depend on the position, or it
// sends nothing.
constexpr MakeRequest not_encodable = nullptr;

// ---- End of a frame: the shortest of the possible lengths with a right checksum decides

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

// Returns whether a checksum covers `bit` of a reply. It does not cover the channel 2 byte of a frame, nor the byte
// that may follow an identity.
bool is_checked(const Options& values, Frame request, Frame reply, std::size_t bit) {
  const Format format = assumed(options.format(values), reply.bytes);
  // The answer to a register access has no checksum of its own, so only its first two bytes, ready and status, are
  // checked.
  if (is_access(request.bytes)) return bit / 8 < 2;
  if (reply.bytes.size() == padded_identity_bytes) return bit / 8 < identity_bytes;
  return !format.has_ch2 || reply.bytes.size() != format.frame_bytes() || bit / 8 != format.frame_bytes() - 1;
}

// ---- Reported fields

using Host = author::HostOf<Frames>;

void put_channels(FieldSink& sink, const Host& host, const Channels& channels) {
  put_position(sink, host.format(), host.last(), channels.status);
}
void put_found(FieldSink& sink, const Host& host, const ProcedureState& found) {
  if (found.identity) {
    frame_fields.put(sink, {.identity = found.identity});
    if (found.identity->protocol_version == version::aksim4) {
      const Bytes why(reinterpret_cast<const std::uint8_t*>(not_described.data()), not_described.size());
      procedure_fields.put<&ProcedureValues::not_described>(sink, {why});
    }
  } else if (found.address) {
    put_register(sink, *found.address, found.data);
  } else {
    put_position(sink, host.format(), host.last(), found.reports_status ? found.status : std::nullopt);
  }
  for (const ProcedureState::Value& one : found.values.view()) put_value(sink, one.index, one.bytes);
  if (found.running) procedure_fields.put<&ProcedureValues::running>(sink, *found.running);
}
Explanation explain_host(const Host& host) {
  const Ask ask = host.request().ask;
  const bool of_identity = ask == Ask::identify || ask == Ask::identity;
  const Bytes reply = host.reply();
  switch (host.error()) {
    case Error::unexpected_reply:
      if (!decode_identity(reply)) return {};
      return {
          "the identity says another resolution than the options, or disagrees on whether there are turns: "
          "leave resolution and multiturn_bits out, and it is asked"};
    case Error::wrong_length:
      if (of_identity) {
        return {"the encoder did not identify itself: it is starting, or resolution and multiturn_bits must be set"};
      }
      if (host.is_disturbed() || reply.size() > host.format().frame_bytes()) {
        return {"more came than one frame: other turns, or more than one sender"};
      }
      return {"the reply ended early"};
    case Error::out_of_range:
      return {of_identity ? std::string_view{} : wrong_resolution};
    case Error::line_stuck:
      return {reply[0] == 0 ? "MISO stayed low" : "MISO stayed high"};
    default:
      return {};
  }
}
/// Returns the cause of the error of a captured frame or register access; empty if the cause is unknown.
constexpr Explanation explain(const Format&, Error error, Bytes request, Bytes reply) {
  if (is_access(request)) {
    if (error != Error::request_rejected || reply.size() < 2) return {};
    return {text_of(static_cast<AccessStatus>(reply[1]))};
  }
  if (error == Error::cross_check_failed) return {channels_disagree};
  const bool frame = reply.size() < identity_bytes;
  return {error == Error::out_of_range && frame ? wrong_resolution : std::string_view{}};
}

constexpr author::Report<Protocol, Host> report{.explain = explain, .explain_host = explain_host};
constexpr author::Finding<Host, Channels> channels{.put = put_channels};
constexpr author::Finding<Host, ProcedureState> found{.put = put_found};

// ---- Commands

constexpr Argument address{"address", "of the register; the README lists them", 0, 0xFFFFFFFF, 0, true, Role::address};
constexpr Argument length{"length", "bytes of the register; 0: as the table of registers says", 0, 8, 0, false};
constexpr Argument keep{"save", "1: into the flash as well, so that it survives power off", 0, 1, 1, false};
constexpr std::array<Argument, 2> read_arguments{{address, {"length", length.meaning, 0, access_capacity, 0, false}}};
constexpr std::array<Argument, 3> write_arguments{
    {address, {"value", "big endian", 0, INT64_MAX, 0, true, Role::value}, length}};
constexpr std::array<Argument, 1> zero_arguments{{keep}};
constexpr std::array<Argument, 2> preset_arguments{{{"turns", "", 0, 65535, 0, false}, keep}};
constexpr std::array<Argument, 1> listen_arguments{{{"count", "frames", 1, UINT32_MAX, 100, false}}};
constexpr std::array<Argument, 1> offset_arguments{{{"value", "in what offset_unit says", 0, 0xFFFFFFFF}}};
constexpr std::array<Argument, 1> lock_arguments{{{"value", "0: open, 1: locked", 0, 1}}};

constexpr bool streams(const Format& format) { return format.interface == Interface::uart && format.stream_rate > 0; }
constexpr std::string_view not_asked(const Format& format) {
  if (!streams(format)) return {};
  return "an encoder that transmits by itself is not asked: set stream_rate=0 for one that answers; nothing was sent";
}

template <auto procedure, auto... bound>
constexpr CommandOf<Protocol> command(const Command& info, MakeRequest request) {
  CommandOf<Protocol> made = author::command<report, found, procedure, frame<Config::position>, bound...>(info);
  made.request = request;
  return made.unless(not_asked);
}

constexpr CommandOf<Protocol> position(const Command& info) {
  using Made = author::Reported<report, ReadPosition, channels>;
  return {.info = info,
          .request = frame<Config::position>,
          .make = [](const Format& format, Arguments,
                     std::span<std::byte> storage) { return make_host<Made>(storage, format); },
          .size = sizeof(Made)};
}

constexpr CommandOf<Protocol> listen(const Command& info) {
  return {.info = info,
          .request = not_encodable,
          .make = [](const Format& format, Arguments,
                     std::span<std::byte> storage) { return make_host<Listen>(storage, format); },
          .size = sizeof(Listen)};
}

constexpr Command read_position{"position", Verb::read, 0, "position, turns, and the alarms when there are any"};
constexpr auto commands_of_unit = std::array{
    position(read_position).or_when(streams, listen(read_position)),
    command<read_alarms>({.name = "alarms",
                          .verb = Verb::read_part,
                          .id = 0,
                          .meaning = "detailed status from channel 2, checked against channel 1",
                          .reads_alarms = true},
                         frame<Config::reset_channels>),
    command<read_info>({"info", Verb::info, 0, "identity, firmware, serial number, temperature, speed"},
                       frame<Config::identify>),
    command<read_identity>({"identify", Verb::run, 0, "identity: protocol version, resolution, part number"},
                           frame<Config::identify>),
    command<read_register, temperature>({"temperature", Verb::temperature, 0, "temperature of the readhead"},
                                        reading_of<temperature>),
    command<zero>(
        {"zero", Verb::zero, 0, "make this the zero of the turn, by the position offset", zero_arguments, true, false},
        not_encodable),
    command<preset_multiturn>({"preset-multiturn", Verb::reset_multiturn, 0,
                               "set the turns, to 0 if not told otherwise", preset_arguments, true, false},
                              writing_of<multiturn_preset>),
    command<read_memory>({"memory-read", Verb::memory_read, 0, "read a register", read_arguments}, memory_reading),
    command<write_memory>(
        {"memory-write", Verb::memory_write, 0, "write a register and read it back", write_arguments, true, false},
        memory_writing),
    command<read_register, position_offset>({"position-offset", Verb::config_get, 0, "position offset"},
                                            reading_of<position_offset>),
    command<write_register, position_offset>(
        {"set-position-offset", Verb::config_set, 0, "set it, until power off unless saved", offset_arguments, true,
         false, "position-offset"},
        writing_of<position_offset>),
    command<read_register, write_lock>({"write-lock", Verb::config_get, 0, "whether the configuration is locked"},
                                       reading_of<write_lock>),
    command<write_register, write_lock>(
        {"set-write-lock", Verb::config_set, 0, "lock or unlock it, until power off unless saved", lock_arguments, true,
         false, "write-lock"},
        writing_of<write_lock>),
    command<send_command, commands::save>(
        {"save", Verb::run, 0, "write the configuration into the flash", {}, true, false}, order<commands::save>),
    command<send_command, commands::reset>(
        {"reset", Verb::run, 0, "set the configuration to the values at shipping", {}, true, false},
        order<commands::reset>),
    command<self_calibrate>(
        {"self-calibrate", Verb::run, 0, "calibrate for eccentricity while the shaft is turned", {}, true, false},
        order<commands::self_calibrate>),
    listen(
        {"listen", Verb::run, 0, "the last of some frames of an encoder that transmits by itself", listen_arguments}),
};

// ---- Format of a captured encoder, from which no identity can be requested

constexpr std::size_t option_resolution = options.find("resolution");
constexpr std::size_t option_multiturn_bits = options.find("multiturn_bits");

// Evidence for resolution and turns: the identity, or the lengths of position frames.
struct FormatEvidence {
  std::optional<Identity> identity{};
  std::size_t identity_at = 0;  // index of the capture with the identity
  // number of captures that are valid position frames: [0] without turns, [1] with turns
  std::array<std::size_t, 2> good{};
  // index of the first capture that is a valid position frame: [0] without turns, [1] with turns
  std::array<std::size_t, 2> first{};

  [[nodiscard]] bool is_conclusive() const { return identity || good[0] != good[1]; }
  [[nodiscard]] bool has_turns() const { return identity ? identity->frame_bytes == 7 : good[1] > good[0]; }
};

FormatEvidence collect_evidence(const Format& format, std::span<const Capture> captures) {
  FormatEvidence evidence;
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const Bytes reply = captures[i].reply;
    const Result<Identity> identity = decode_identity(reply);
    if (identity && !evidence.identity) {
      evidence.identity = *identity;
      evidence.identity_at = i;
    }
    for (std::size_t turns = 0; turns < 2 && !identity; ++turns) {
      const int multiturn_bits = turns != 0 ? static_cast<int>(maximum_multiturn_bits) : 0;
      if (!decode_position({maximum_resolution, multiturn_bits, format.has_ch2}, reply)) continue;
      if (evidence.good[turns]++ == 0) evidence.first[turns] = i;
    }
  }
  return evidence;
}

// Judges which values of resolution and turns fit the captures. A frame with turns may have a valid checksum also at
// the length without turns, so the more frequent length decides.
bool probe(Options& values, std::span<const Capture> captures, EvidenceSink& sink) {
  const FormatEvidence evidence = collect_evidence(options.format(values), captures);
  constexpr std::string_view open = "these frames do not tell";
  for (std::int64_t bits = 1; bits <= std::int64_t{maximum_resolution}; ++bits) {
    const bool possible = !evidence.identity || bits == evidence.identity->resolution;
    sink.put({option_resolution, bits, possible, possible ? 0 : evidence.identity_at,
              !evidence.identity ? open
              : possible         ? "the identity says so"
                                 : "the identity says another one"});
  }
  for (std::int64_t bits = 0; bits <= std::int64_t{maximum_multiturn_bits}; ++bits) {
    const bool possible = !evidence.is_conclusive() || (bits > 0) == evidence.has_turns();
    const std::size_t against = evidence.identity ? evidence.identity_at : evidence.first[evidence.has_turns() ? 1 : 0];
    sink.put({option_multiturn_bits, bits, possible, possible ? 0 : against,
              possible ? (evidence.is_conclusive() ? "agrees with the length of the frames" : open)
                       : "frames of this encoder have another length"});
  }
  if (evidence.identity && values[option_resolution] == 0)
    values.values[option_resolution] = evidence.identity->resolution;
  if (evidence.is_conclusive() && values[option_multiturn_bits] < 0) {
    values.values[option_multiturn_bits] = evidence.has_turns() ? std::int64_t{maximum_multiturn_bits} : 0;
  }
  const bool is_resolution = !evidence.identity || values[option_resolution] == evidence.identity->resolution;
  return is_resolution && (!evidence.is_conclusive() || (values[option_multiturn_bits] > 0) == evidence.has_turns());
}

// ---- Declaration

constexpr std::array<RegisterInfo, registers.size()> register_infos = [] {
  std::array<RegisterInfo, registers.size()> infos{};
  for (std::size_t i = 0; i < registers.size(); ++i) {
    const Register& one = registers[i];
    infos[i] = {one.name, one.address, one.size, one.access != Access::write_only, one.access != Access::read_only};
  }
  return infos;
}();

constexpr LineSettings uart_line(const Format&) { return uart_settings; }
constexpr LineSettings spi_line(const Format&) { return spi_settings; }
constexpr auto models =
    std::array{author::ModelText{"AksIM-2", "off-axis; resolution and turns as its identity says", 10'000, ""}};

template <Interface interface>
constexpr Format format_of(const Options& values) {
  Format made = options.format(values);
  made.interface = interface;
  return made;
}
// Returns the numbers of bits of position and turns; where the format leaves them unknown, those of the virtual
// encoder.
constexpr Resolution resolution_of(const Format& format) {
  return {format.resolution != 0 ? format.resolution : virtual_format.resolution,
          static_cast<unsigned>(format.multiturn_bits >= 0 ? format.multiturn_bits : virtual_format.multiturn_bits)};
}
constexpr Error decode_frames(const Format& format, Frame asked, Frame reply, FieldSink& sink) {
  return decode(format, asked.bytes, reply.bytes, sink);
}
template <Interface interface>
constexpr bool is_streaming(const Options& values) {
  return streams(format_of<interface>(values));
}
template <Interface interface>
BitRanges bits_in(const Options& values, Frame request, Frame reply, const FieldInfo& field) {
  if (is_access(request.bytes)) return {};
  return bits_of(format_of<interface>(values), reply.bytes, field);
}

template <Interface interface>
Follower* make_follower(const Options& values, std::span<std::byte> storage) {
  if (storage.size() < sizeof(ChannelFollower)) return nullptr;
  return new (storage.data()) ChannelFollower(format_of<interface>(values));
}

constexpr auto known_as = std::array<std::string_view, 2>{"RLS", "AksIM"};

/// Declaration of the EncoLink unit for `interface`, UART or SPI.
template <Interface interface>
constexpr author::Declaration<Protocol, VirtualEncoder, Host> declaration{
    .id = interface == Interface::spi ? "encolink-spi" : "encolink",
    .name = interface == Interface::spi ? "RLS EncoLink (AksIM-2), SPI" : "RLS EncoLink (AksIM-2), UART",
    .document = "Programming AksIM-2 encoders with EncoLink communication protocol, issue 2",
    .known_as = known_as,
    .link = interface == Interface::spi ? LinkKind::spi : LinkKind::full_duplex,
    .options = options.infos,
    .format = format_of<interface>,
    .models = models,
    .fields = fields,
    .commands = commands_of_unit,
    .vectors =
        interface == Interface::spi ? std::span<const author::VectorText>(vector_texts::spi) : vector_texts::uart,
    .frames_size = 2000,
    .report = report,
    .line = interface == Interface::spi ? spi_line : uart_line,
    .resolution = resolution_of,
    .reply_size = reply_size,
    .decode = decode_frames,
    .is_checked = is_checked,
    .bits = bits_in<interface>,
    .probe = probe,
    .streams = is_streaming<interface>,
    .remembered = remembered,
    .follower = make_follower<interface>,
    .follower_storage = sizeof(ChannelFollower),
    .status = frame_fields.of<&Values::general_status>(),
    .alarms = frame_fields.of<detail::alarms_of>(),
    .registers = register_infos,
    .conditions = conditions,
    .timing = {.turnaround_limit = answer_limit},
    .over_spi = interface == Interface::spi ? nullptr : &spi_unit,
};

}  // namespace

constinit const Unit unit = author::Descriptor<declaration<Interface::uart>>::make();
constinit const Unit spi_unit = author::Descriptor<declaration<Interface::spi>>::make();

}  // namespace absenc::encolink
