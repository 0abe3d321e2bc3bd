// SPDX-License-Identifier: Apache-2.0
// Fields of EncoLink frames and registers, and the functions that report their values.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/protocol/author/bits.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/encolink/frame.hpp"
#include "absenc/protocol/encolink/registers.hpp"
#include "absenc/protocol/field.hpp"

namespace absenc::encolink {

/// Names of the two status bits (error, warning) of a position frame.
inline constexpr std::array<FlagInfo, 2> general_flags{{
    {"error", "the position is not valid", read_the_alarms, false, status::errors},
    {"warning", "the position is valid, but something is near its limit", read_the_alarms, false, status::warnings},
}};

/// Advice if a position does not fit the configured resolution (error out_of_range).
inline constexpr std::string_view wrong_resolution =
    "padding bits are set: the encoder has more bits than the options resolution and multiturn_bits say; `absenc info` "
    "asks it";

/// Detail of the error that the position in a cycle of channel 2 differs from that in channel 1.
inline constexpr std::string_view channels_disagree =
    "channel 2 has another position than channel 1: positions go on, but the detailed status cannot be trusted";

/// Cause and advice for register accesses to an AksIM-4, which are refused.
inline constexpr std::string_view not_described =
    "protocol version 4 (AksIM-4) has its registers at other addresses, which are not described here: its positions "
    "may be read";

/// Names and advice for the alarms. The advice is not from the vendor, who only names the bits.
inline constexpr std::array<FlagInfo, 16> alarm_flags{{
    {"acceleration_error", "the position changed faster than a shaft can", "check the fixing of ring and readhead"},
    {"magnetic_pattern_error", "the magnetic pattern of the ring is not what it should be",
     "check that ring and readhead belong together; look for damage and magnetic dirt"},
    {"system_error", "the encoder found a fault in itself", "switch it off and on; if it comes back, replace it"},
    {"supply_error", "the supply voltage is outside its range", "measure the supply at the encoder's connector"},
    {"temperature_warning", "the readhead is hotter or colder than it may be", "cool or warm it"},
    {"signal_lost", "the readhead does not see the ring", "check the gap between ring and readhead"},
    {"amplitude_low", "the signal is weak: the readhead is too far from the ring", "make the gap smaller"},
    {"amplitude_high", "the signal is strong: the readhead is too near to the ring", "make the gap wider"},
    {"near_limits", "the encoder works near the limits of its range", "check gap and alignment of the readhead"},
    {"position_invalid", "the position is not valid", "do not use it; check gap, alignment and supply of the readhead"},
    {"configuration_error", "the stored configuration is damaged",
     "`absenc run ... reset`, set it up again, then `absenc run ... save`"},
    {"reading_error", "the sensor could not be read", "switch it off and on; if it comes back, replace it"},
    {"sensor_error", "the magnetic sensor is faulty", "check for magnetic fields from outside, then replace it"},
    {"amplitude_too_high_warning", "the signal is nearly too strong", "make the gap wider"},
    {"amplitude_too_high", "the signal is too strong to be read", "make the gap wider"},
    {"multiturn_mismatch", "the turn counter does not fit the position: turns are wrong",
     "go to the origin, then `absenc reset-multiturn`"},
}};

/// Names of the bits of the calibration status.
inline constexpr std::array<FlagInfo, 4> calibration_flags{{
    {"", "", ""},
    {"", "", ""},
    {"timed_out", "the shaft did not turn far enough in time",
     "turn it evenly, then `absenc run ... self-calibrate` again"},
    {"out_of_range", "the ring is too eccentric to be calibrated",
     "mount the ring again, then `absenc run ... self-calibrate` again"},
}};

/// Values of a frame, a request or a register access. Only members that have a value are reported.
struct Values {
  /// C++ type of a member that may have no value.
  template <class T>
  using Maybe = std::optional<T>;
  /// Error and warning bit as one field. This member never has a value: the field only gives names to the status bits
  /// of a reading.
  Maybe<std::uint8_t> general_status{};
  Maybe<Position> position{};        ///< Position with its error and warning bits.
  Maybe<std::uint16_t> multiturn{};  ///< Number of turns.
  Maybe<std::uint8_t> channel2{};    ///< Byte of channel 2 in a position frame.
  Maybe<std::uint16_t> status{};     ///< Detailed status from a cycle of channel 2.
  Maybe<std::uint8_t> channel3{};    ///< Channel 3 byte from a cycle of channel 2.
  Maybe<Identity> identity{};        ///< Content of an identity frame.
  /// First byte of a request: 00 position, AA reset of the channels, BB identify.
  Maybe<std::uint8_t> config{};
  Maybe<std::uint8_t> ra{};        ///< Second byte of a request (`ra`), which is one byte of a register access.
  Maybe<std::string_view> op{};    ///< Operation of a register access: read or write.
  Maybe<std::string_view> name{};  ///< Name of the accessed register; no value if the table has no such register.
  Maybe<std::uint32_t> address{};  ///< Address of the accessed register.
  Maybe<std::size_t> length{};     ///< Number of bytes of the accessed register.
  Maybe<Bytes> data{};             ///< Bytes of the accessed register, most significant first.
  /// Bytes of the register as a number; no value if the register has 8 bytes or more, or if a field of its own reports
  /// it.
  Maybe<std::int64_t> value{};
};

namespace detail {
// Returns member `member` of the struct `part` of Values; no value if the struct is absent.
template <auto part, auto member>
constexpr auto of(const Values& values) {
  return values.*part ? std::optional((*(values.*part)).*member) : std::nullopt;
}
constexpr std::optional<std::uint16_t> alarms_of(const Values& values) { return values.status; }
constexpr std::optional<author::AsciiText> part_number_of(const Values& values) {
  return values.identity ? std::optional(author::AsciiText{values.identity->part_number()}) : std::nullopt;
}
}  // namespace detail

/// Fields in which Values are reported.
inline constexpr auto frame_fields = [] {
  using author::field;
  using detail::of;
  return author::fields_of<Values>(
      field<&Values::general_status>("general_status", "the two low bits of a position frame, active low",
                                     general_flags),
      field<of<&Values::position, &Position::singleturn>>("singleturn", "counts", "position within the turn",
                                                          Role::position),
      field<&Values::multiturn>("multiturn", "revolutions", "turn counter", Role::turns),
      field<of<&Values::position, &Position::error>>("error", "", "the position is not valid"),
      field<of<&Values::position, &Position::warning>>("warning", "",
                                                       "the position is valid, but something is near its limit"),
      field<&Values::channel2>("channel2", "", "one byte of channel 2; the checksum does not cover it"),
      field<&Values::status>("status", "", "detailed status of a channel 2 cycle"),
      field<detail::alarms_of>("alarms", "detailed status", alarm_flags),
      field<&Values::channel3>("channel3", "", "one byte of channel 3: 33 idle, 66 busy, 88 and 99 ready, or data"),
      field<of<&Values::identity, &Identity::protocol_version>>("protocol_version", "", "of EncoLink: 2 or 4"),
      field<of<&Values::identity, &Identity::frame_bytes>>("frame_bytes", "", "5 without turns, 7 with"),
      field<of<&Values::identity, &Identity::resolution>>("resolution", "bits", "of a turn"),
      field<detail::part_number_of>("part_number", "", "from the identity", Role::identity),
      field<&Values::config>("config", "",
                             "first byte of a request: 00 position, AA reset of the channels, BB identify"),
      field<&Values::ra>("ra", "", "second byte of a request: one byte of a register access"),
      field<&Values::op>("op", "", "read or write"),
      field<&Values::name>("register", "", "its name in the table of registers", Role::exchange),
      field<&Values::address>("address", "", "of the register", Role::exchange),
      field<&Values::length>("length", "bytes", "of the register", Role::exchange),
      field<&Values::data>("data", "", "the register's bytes, most significant first", Role::data),
      field<&Values::value>("value", "", "the same as a number", Role::value));
}();

/// The value of a register; the register's content decides which of the members has it.
struct RegisterValue {
  std::int64_t number;     ///< Value of a register that is a plain number.
  double celsius;          ///< Temperature of the readhead, in degC.
  double rpm;              ///< Speed of the ring, in rpm.
  std::uint8_t flags;      ///< Bits that show how the last self-calibration ended.
  author::AsciiText text;  ///< Serial number, order number or part number.
};

/// Fields in which register values are reported, in the order of the table `registers`.
inline constexpr auto register_fields = [] {
  using author::field;
  constexpr auto by_content = author::fields_of<RegisterValue>(
      field<&RegisterValue::number>("", "", "register"),
      field<&RegisterValue::celsius>("", "degC", "register: temperature of the readhead"),
      field<&RegisterValue::rpm>("", "rpm", "register: speed of the ring"),
      field<&RegisterValue::flags>("", "how the last self-calibration ended", calibration_flags),
      field<&RegisterValue::text>("", "", "register",
                                  Role::identity));  // every register of this kind has text that identifies the encoder
  std::array<FieldInfo, registers.size()> made{};
  for (std::size_t i = 0; i < made.size(); ++i) {
    made[i] = by_content.infos[static_cast<std::size_t>(registers[i].content)];
    made[i].name = registers[i].name;
  }
  return made;
}();

/// Fields of procedures that belong neither to a frame nor to a register.
struct ProcedureValues {
  std::uint8_t calibrations;        ///< Counter of self-calibrations in the encoder, modulo 4.
  bool running;                     ///< Whether a self-calibration is running.
  author::AsciiText not_described;  ///< Text that explains why no register was read.
};
/// Fields in which ProcedureValues are reported.
inline constexpr auto procedure_fields = author::fields_of<ProcedureValues>(
    author::field<&ProcedureValues::calibrations>("calibrations", "", "self-calibrations that ended, modulo 4"),
    author::field<&ProcedureValues::running>("running", "", "whether the self-calibration is running"),
    author::field<&ProcedureValues::not_described>("registers", "", "why no register is shown"));

/// All fields of the unit: those of frames, registers and procedures.
inline constexpr auto fields = author::joined(frame_fields.infos, register_fields, procedure_fields.infos);

/// Puts a position into `sink`, with the detailed status and the channel 3 byte if a cycle of channel 2 has given them.
constexpr void put_position(FieldSink& sink, const Format& format, const Position& position,
                            std::optional<std::uint16_t> detailed = {}, std::optional<std::uint8_t> channel3 = {}) {
  Values values{.position = position, .status = detailed, .channel3 = channel3};
  if (format.multiturn_bits > 0) values.multiturn = position.multiturn;
  if (format.has_ch2 && !channel3) values.channel2 = position.channel2;
  frame_fields.put(sink, values);
  sink.put_reading(to_reading(format, position, detailed));
}

/// Returns the two's complement number in 1 to 8 bytes, most significant byte first.
[[nodiscard]] constexpr std::int64_t signed_value(Bytes bytes) {
  const auto bits = static_cast<unsigned>(8 * bytes.size());
  return bits >= 64 ? static_cast<std::int64_t>(load_big_endian(bytes))
                    : wrapped_difference(load_big_endian(bytes), 0, bits);
}

/// Puts the value of the register with this index in the table `registers` into `sink`.
constexpr void put_value(FieldSink& sink, std::size_t index, Bytes bytes) {
  FieldValue shown{.info = &register_fields[index], .bytes = bytes};
  switch (registers[index].content) {
    case Content::number:
    case Content::flags:
      shown.number = static_cast<std::int64_t>(load_big_endian(bytes));
      break;
    case Content::celsius:
    case Content::rpm:
      shown.real = static_cast<double>(signed_value(bytes)) / 10;
      break;
    case Content::text:
      break;
  }
  sink.put(shown);
  if (index == calibration_status) {
    procedure_fields.put<&ProcedureValues::calibrations>(sink, bytes[0] & calibration::count);
  }
}

/// Puts a register that was read or written into `sink`: its name, address and value.
constexpr void put_register(FieldSink& sink, std::uint32_t address, Bytes data,
                            std::optional<std::string_view> op = {}) {
  const Register* known = find_register(address);
  const bool in_table = known != nullptr && known->size == data.size();
  Values values{.op = op, .address = address, .length = data.size(), .data = data};
  if (known != nullptr) values.name = known->name;
  if (!in_table && data.size() < 8) values.value = static_cast<std::int64_t>(load_big_endian(data));
  frame_fields.put(sink, values);
  if (in_table) put_value(sink, static_cast<std::size_t>(known - registers.data()), data);
}

/// Returns `format` with assumed values for unknown resolution or turns, so that `reply` can be decoded.
[[nodiscard]] constexpr Format assumed(const Format& format, Bytes reply) {
  Format known = format;
  if (known.resolution == 0) known.resolution = maximum_resolution;
  if (known.multiturn_bits >= 0) return known;
  known.multiturn_bits = 16;
  const bool turns = reply.size() == known.cycle_bytes() ||
                     (reply.size() == known.frame_bytes() && is_sealed(reply.first(known.position_bytes() + 1)));
  if (!turns) known.multiturn_bits = 0;
  return known;
}

namespace detail {

constexpr BitRanges identity_bits(const FieldInfo& field) {
  using author::bits_of;
  if (&field == frame_fields.of<of<&Values::identity, &Identity::protocol_version>>()) return bits_of(0, 0, 8);
  if (&field == frame_fields.of<of<&Values::identity, &Identity::frame_bytes>>()) return bits_of(1, 0, 8);
  return {};  // the identity has its resolution as two decimal digits, so no bits are reported for it
}

// Returns the bits of channel 1 that carry `field`: it is one big-endian number with two active-low bits at its end.
constexpr BitRanges position_bits(const Format& format, const FieldInfo& field) {
  const std::size_t size = format.position_bytes();
  if (&field == frame_fields.of<of<&Values::position, &Position::singleturn>>()) {
    return author::big_endian_bits(0, size, format.resolution, 24 - format.resolution);
  }
  if (&field == frame_fields.of<&Values::multiturn>()) {
    return author::big_endian_bits(0, size, static_cast<std::size_t>(format.multiturn_bits), 24 + format.spare_turns());
  }
  BitRanges ranges;
  const std::size_t last = 8 * (size - 1);
  if (&field == frame_fields.of<of<&Values::position, &Position::error>>()) ranges.push_back({last + 1, 1, true});
  if (&field == frame_fields.of<of<&Values::position, &Position::warning>>()) ranges.push_back({last, 1, true});
  return ranges;
}

}  // namespace detail

/// Returns the bits of a valid reply that carry `field`.
[[nodiscard]] constexpr BitRanges bits_of(const Format& format, Bytes reply, const FieldInfo& field) {
  if (reply.size() == identity_bytes || reply.size() == padded_identity_bytes) return detail::identity_bits(field);
  const Format known = assumed(format, reply);
  const std::size_t behind = known.position_bytes();
  if (&field == frame_fields.of<&Values::channel2>()) return author::bits_of(behind + 1, 0, 8);
  if (&field == frame_fields.of<&Values::channel3>()) return author::bits_of(behind + 2, 0, 8);
  if (&field == frame_fields.of<&Values::status>() || &field == frame_fields.of<detail::alarms_of>()) {
    return author::big_endian_bits(behind, 2, 16);
  }
  return detail::position_bits(known, field);
}

/// Decodes a request: its two bytes, or all `ra` bytes (second bytes of requests) of a register access.
constexpr Error decode_request(Bytes request, FieldSink& sink) {
  if (request.size() == request_bytes) {
    if (!is_config(request[0])) return Error::unsupported;
    frame_fields.put(sink, {.config = request[0], .ra = request[1]});
    return Error::none;
  }
  const Result<RegisterRequest> access = decode_access(request);
  if (!access) return access.error();
  const bool reads = access->operation == RegisterRequest::Operation::read;
  Values values{.op = reads ? "read" : "write", .address = access->address, .length = access->length};
  if (!reads) values.data = access->data;
  if (!reads && access->length < 8) values.value = static_cast<std::int64_t>(load_big_endian(access->data));
  frame_fields.put(sink, values);
  return Error::none;
}

/// Decodes the answer to a register access into `sink` and returns the first error.
constexpr Error decode_access_answer(Bytes request, Bytes reply, FieldSink& sink) {
  const Result<RegisterRequest> access = decode_access(request);
  if (!access) return access.error();
  const Result<Bytes> data = decode_answer(*access, reply);
  if (!data) return data.error();
  const bool reads = access->operation == RegisterRequest::Operation::read;
  put_register(sink, access->address, reads ? *data : access->data.view(), reads ? "read" : "write");
  return Error::none;
}

/// Decodes a reply into `sink`, or the request if there is no reply. Returns the first error.
constexpr Error decode(const Format& format, Bytes request, Bytes reply, FieldSink& sink) {
  if (reply.empty()) return decode_request(request, sink);
  if (is_access(request)) return decode_access_answer(request, reply, sink);
  if (reply.size() == identity_bytes || reply.size() == padded_identity_bytes) {
    const Result<Identity> identity = decode_identity(reply);
    if (identity) frame_fields.put(sink, {.identity = *identity});
    return identity.error();
  }
  const Format known = assumed(format, reply);
  if (known.has_ch2 && reply.size() == known.cycle_bytes()) {
    const Result<ChannelCycle> cycle = decode_cycle(known, reply);
    if (cycle) put_position(sink, known, cycle->position, cycle->status, cycle->channel3);
    return cycle.error();
  }
  const Result<Position> position = decode_position(known, reply);
  if (position) put_position(sink, known, *position);
  return position.error();
}

}  // namespace absenc::encolink
