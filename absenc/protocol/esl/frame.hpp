// SPDX-License-Identifier: Apache-2.0
// Frames of the QS35's ESL protocol, which README.md draws. Table numbers are those of the ESL Protocol Specification,
// rev 1.5.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/esl/profile.hpp"

namespace absenc::esl {

/// Bits of the status field (SF) of a channel, in the order of the document (Table 5).
namespace status {
/// Status bit: the request was received with a wrong parity bit and not executed.
inline constexpr std::uint8_t parity_error = 0x01;
/// Status bit: the request was received with a wrong stop bit and not executed.
inline constexpr std::uint8_t stop_error = 0x02;
/// Status bit: an error of single-turn position, memory, voltage or LED.
inline constexpr std::uint8_t safety_error = 0x04;
inline constexpr std::uint8_t non_safety_error = 0x08;  ///< status bit: an error of turns, Lissajous signals or speed
inline constexpr std::uint8_t temperature_warning = 0x10;  ///< status bit: the encoder is too warm
/// Status bit: set in the status of channel 2, clear in that of channel 1.
inline constexpr std::uint8_t channel_2 = 0x20;
inline constexpr std::uint8_t ready = 0x40;  ///< status bit: the encoder has started
/// status bit: the self-test that the document calls forced test has passed
inline constexpr std::uint8_t forced_test_passed = 0x80;
/// Mask of the bits that show that the encoder refused the request.
inline constexpr std::uint8_t rejected = parity_error | stop_error;
}  // namespace status

/// Bits of the alarm field (ALM) of a channel (Table 7).
namespace alarms {
inline constexpr std::uint8_t xc_error = 0x01;         ///< alarm: the turn counter failed to count five times in a row
inline constexpr std::uint8_t multiturn_error = 0x02;  ///< alarm: the encoder found its turn counter wrong
/// Alarm: the LED current or the signals of the disc are out of range.
inline constexpr std::uint8_t led_or_lissajous_error = 0x04;
inline constexpr std::uint8_t overspeed = 0x08;     ///< alarm: the shaft turned faster than 10 000 rpm
inline constexpr std::uint8_t memory_error = 0x10;  ///< alarm: the encoder could not load its settings from the memory
inline constexpr std::uint8_t singleturn_error = 0x20;  ///< alarm: the encoder found its position within the turn wrong
inline constexpr std::uint8_t under_voltage = 0x40;     ///< alarm: the inner supply is below 2.9 V
inline constexpr std::uint8_t over_voltage = 0x80;      ///< alarm: the inner supply is above 3.7 V
/// mask of the two alarms about the inner supply voltage
inline constexpr std::uint8_t voltage = under_voltage | over_voltage;
/// Mask of the alarms that make the turns invalid.
inline constexpr std::uint8_t turns_wrong = xc_error | multiturn_error;
/// Mask of the alarms that can make the position within the turn unsafe.
inline constexpr std::uint8_t unsafe = led_or_lissajous_error | memory_error | singleturn_error | voltage;
}  // namespace alarms

inline constexpr unsigned singleturn_bits = 24;     ///< number of bits of the position within the turn (ABS)
inline constexpr unsigned multiturn_bits = 16;      ///< number of bits of the turns (ABM)
inline constexpr unsigned redundant_bits = 9;       ///< number of bits of the redundant position of channel 2 (RS)
inline constexpr std::size_t request_capacity = 4;  ///< Length of the longest request in bytes.
inline constexpr std::size_t reply_capacity = 18;   ///< Length of the longest reply in bytes.
/// Buffer for the bytes of a request.
using RequestBytes = ByteBuffer<request_capacity>;
/// Buffer for the bytes of a reply.
using ReplyBytes = ByteBuffer<reply_capacity>;

// ---- Checksums. The document has Koopman notation: 16'hAC9A is normal 5935, 8'h97 is 2F.

/// One of the two channels of the encoder, which measure the position independently.
enum class Channel : std::uint8_t { one, two };

/// Parameters of the 16-bit CRC if each byte enters LSB first.
inline constexpr CrcParameters crc16_lsb{16, 0x5935, 0, true, true, 0};
/// Parameters of the 16-bit CRC if each byte enters MSB first.
inline constexpr CrcParameters crc16_msb{16, 0x5935, 0, false, false, 0};
/// Parameters of the 8-bit CRC if each byte enters LSB first.
inline constexpr CrcParameters crc8_lsb{8, 0x2F, 0, true, true, 0};
/// Parameters of the 8-bit CRC if each byte enters MSB first.
inline constexpr CrcParameters crc8_msb{8, 0x2F, 0, false, false, 0};

/// Returns the start value of the 16-bit CRC of a channel.
[[nodiscard]] constexpr std::uint16_t initial_value(Channel channel) { return channel == Channel::two ? 0xFFFF : 0; }

namespace detail {
// Returns the 16-bit CRC of bytes that are taken as 16-bit words; `swapped`: the second byte of each word enters the
// CRC first.
template <CrcParameters parameters>
constexpr std::uint16_t crc_of_pairs(Channel channel, Bytes bytes, bool swapped) {
  Crc<parameters, CrcTable::nibble> crc(initial_value(channel));
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    const std::uint8_t second = i + 1 < bytes.size() ? bytes[i + 1] : std::uint8_t{0};
    crc.update(swapped ? second : bytes[i]);
    crc.update(swapped ? bytes[i] : second);
  }
  return crc.value();
}
}  // namespace detail

/// Returns the 16-bit CRC of a channel's bytes, computed in the bit order `order`.
[[nodiscard]] constexpr std::uint16_t checksum16(CrcBitOrder order, Channel channel, Bytes bytes) {
  return order == CrcBitOrder::lsb ? detail::crc_of_pairs<crc16_lsb>(channel, bytes, false)
                                   : detail::crc_of_pairs<crc16_msb>(channel, bytes, order == CrcBitOrder::word);
}

/// Returns the 8-bit CRC of `bytes`, computed in the bit order `order`.
[[nodiscard]] constexpr std::uint8_t checksum8(CrcBitOrder order, Bytes bytes) {
  return order == CrcBitOrder::lsb ? Crc<crc8_lsb, CrcTable::nibble>::of(bytes)
                                   : Crc<crc8_msb, CrcTable::nibble>::of(bytes);
}

/// Returns whether the low byte of this channel's 16-bit CRC is sent first.
[[nodiscard]] constexpr bool low_byte_first(CrcByteOrder order, Channel channel) {
  if (order == CrcByteOrder::table12) return channel == Channel::one;
  return order == CrcByteOrder::low;
}

// ---- Tables 3 and 12 as data: the command ids, and the parts of each channel of their replies

/// Data ID of a request: the code of what the host asks for (Table 3; ID 6 is in Tables 6 and 12 only).
enum class DataId : std::uint8_t {
  position = 1,          ///< Position and turns, with both channels; the reply can make a safe position.
  singleturn = 2,        ///< Position within the turn, with both channels; the reply can make a safe position.
  position_short = 4,    ///< Position and turns of channel 1 alone; the reply cannot make a safe position.
  singleturn_short = 5,  ///< Position within the turn of channel 1 alone; the reply cannot make a safe position.
  calibration = 6,       ///< Position within the turn of each channel; the reply cannot make a safe position.
  /// Encoder id. A host must not send it eight times in a row: that is "dynamic addressing", which the document does
  /// not describe.
  encoder_id = 8,
  temperature = 9,
  alarms = 0xA,
  zero = 0xB,          ///< Eight consecutive requests with this data ID make the present position the zero of the turn.
  clear_alarms = 0xC,  ///< Eight consecutive requests with this data ID clear alarms.
  reset_multiturn = 0xD,  ///< Eight consecutive requests with this data ID set the turns to zero.
  read_memory = 0xE,
  write_memory = 0xF,
};

/// Parts that a channel of a reply can carry between control field (CF) and CRC, one bit for each part.
namespace part {
inline constexpr unsigned status = 0x0001;       ///< Part of a reply: status field (SF).
inline constexpr unsigned alarms = 0x0002;       ///< Part of a reply: alarms (ALM).
inline constexpr unsigned singleturn = 0x0004;   ///< Part of a reply: position within the turn (ABS).
inline constexpr unsigned multiturn = 0x0008;    ///< Part of a reply: turns (ABM).
inline constexpr unsigned encoder_id = 0x0010;   ///< Part of a reply: encoder id (ENID).
inline constexpr unsigned temperature = 0x0020;  ///< Part of a reply: temperature (TEMP).
inline constexpr unsigned sequence = 0x0040;     ///< Part of a reply: sequence counter of channel 1 (SC1).
/// Part of a reply: a byte that has only the sequence counter of channel 2 (SC2, 7 bits) and a 0.
inline constexpr unsigned zero_sequence = 0x0080;
/// Part of a reply: redundant position and sequence counter of channel 2, together in two bytes.
inline constexpr unsigned redundant_sequence = 0x0100;
/// Part of a reply to data ID C: redundant position in two bytes, RS0 and RS1.
inline constexpr unsigned redundant_alone = 0x0200;
/// Part of a reply to data ID 6: redundant position in two bytes.
inline constexpr unsigned redundant_calibration = 0x0400;
inline constexpr unsigned memory_address = 0x0800;  ///< Part of a reply: memory address and busy bit (ADF).
inline constexpr unsigned value = 0x1000;           ///< Part of a reply: value of the memory byte (EDF).
/// Mask of the parts that contain a redundant position.
inline constexpr unsigned redundant = redundant_sequence | redundant_alone | redundant_calibration;
}  // namespace part

/// A part of a reply, with its length on the wire.
template <unsigned part_id, std::size_t part_size>
struct WirePart {
  static constexpr unsigned id = part_id;  ///< Identifier of this part of a reply: a constant of the namespace `part`.
  static constexpr std::size_t size = part_size;  ///< Length in bytes of this part of a reply.
};

namespace detail {
template <class... Parts>
struct PartsInOrder {
  template <class Visit>
  static constexpr std::size_t walk(unsigned parts, std::size_t at, const Visit& visit) {
    const auto step = [&]<class Part>(Part here) {
      if ((parts & Part::id) == 0) return;
      visit(here, at);
      at += Part::size;
    };
    (step(Parts{}), ...);
    return at;
  }
};
using WireOrder =
    PartsInOrder<WirePart<part::status, 1>, WirePart<part::alarms, 1>, WirePart<part::singleturn, 3>,
                 WirePart<part::multiturn, 2>, WirePart<part::encoder_id, 1>, WirePart<part::temperature, 1>,
                 WirePart<part::sequence, 1>, WirePart<part::zero_sequence, 1>, WirePart<part::redundant_sequence, 2>,
                 WirePart<part::redundant_alone, 2>, WirePart<part::redundant_calibration, 2>,
                 WirePart<part::memory_address, 1>, WirePart<part::value, 1>>;
}  // namespace detail

/// Calls `visit(part, byte)` for each part of a channel, in the order of the wire; `byte` is the index of the part's
/// first byte. Returns the index behind the last part.
template <class Visit>
constexpr std::size_t walk_parts(unsigned parts, std::size_t control_field, const Visit& visit) {
  return detail::WireOrder::walk(parts, control_field + 1, visit);
}

/// Layout of the replies to one data ID: the parts and lengths of each channel.
struct Layout {
  constexpr Layout() = default;
  /// Constructs a layout from the CRC length in bytes and the parts of each channel.
  constexpr Layout(std::uint8_t crc, unsigned parts_one, unsigned parts_two = 0)
      : one(static_cast<std::uint16_t>(parts_one)),
        two(static_cast<std::uint16_t>(parts_two)),
        crc_bytes(crc),
        length_one(length(crc, parts_one)),
        length_two(has_two() ? length(crc, parts_two) : std::uint8_t{0}) {}

  /// Returns whether replies with this layout have channel 2.
  [[nodiscard]] constexpr bool has_two() const { return two != 0; }
  /// Returns whether a channel of replies with this layout has at least one of the parts in the mask `any_of`.
  [[nodiscard]] constexpr bool has(unsigned any_of) const { return ((one | two) & any_of) != 0; }

  std::uint16_t one = 0;  ///< Mask of the parts that channel 1 has in replies with this layout.
  /// Mask of the parts that channel 2 has in replies with this layout; 0: they have no channel 2.
  std::uint16_t two = 0;
  std::uint8_t crc_bytes = 1;   ///< Length of the CRC of a channel in bytes, 1 or 2.
  std::uint8_t length_one = 0;  ///< length of channel 1 in bytes, with control field (CF) and CRC
  /// length of channel 2 in bytes, with control field (CF) and CRC; 0: the replies have no channel 2
  std::uint8_t length_two = 0;

 private:
  static constexpr std::uint8_t length(unsigned crc, unsigned parts) {
    return static_cast<std::uint8_t>(walk_parts(parts, 0, [](auto, std::size_t) {}) + crc);
  }
};

namespace detail {
// Layouts of replies; the index is the data ID. The layout of a data ID that does not exist is empty.
inline constexpr std::array<Layout, 16> layouts = [] {
  using part::status, part::alarms, part::singleturn, part::multiturn, part::encoder_id, part::temperature;
  using part::sequence, part::zero_sequence, part::redundant_sequence, part::redundant_alone;
  std::array<Layout, 16> table{};
  table[0x1] = {2, status | alarms | singleturn | multiturn | sequence, status | alarms | redundant_sequence};
  table[0x2] = {2, status | alarms | singleturn | sequence, status | alarms | redundant_sequence};
  table[0x4] = {1, status | singleturn | multiturn};
  table[0x5] = {1, status | singleturn};
  table[0x6] = {1, status | singleturn, status | part::redundant_calibration};
  table[0x8] = {2, status | encoder_id | sequence, status | encoder_id | zero_sequence};
  table[0x9] = {1, status | temperature};
  table[0xA] = {1, status | alarms, status | alarms};
  table[0xB] = table[0x2];
  table[0xC] = {1, status | alarms | singleturn, status | alarms | redundant_alone};
  table[0xD] = {1, status | alarms | multiturn};
  table[0xE] = {1, part::memory_address | part::value};
  table[0xF] = table[0xE];
  return table;
}();
}  // namespace detail

/// Returns the layout of replies to this data ID.
[[nodiscard]] constexpr const Layout& layout_of(DataId id) { return detail::layouts[static_cast<std::size_t>(id)]; }

/// Returns the data ID in the control field `field`; its parity bit is not checked. No value for an ID without layout.
[[nodiscard]] constexpr std::optional<DataId> data_id(std::uint8_t field) {
  const std::uint8_t id = (field >> 3) & 0xF;
  if (detail::layouts[id].length_one == 0) return std::nullopt;
  return static_cast<DataId>(id);
}

/// Returns whether requests with this data ID read or write the memory.
[[nodiscard]] constexpr bool is_memory_access(DataId id) {
  return id == DataId::read_memory || id == DataId::write_memory;
}
/// Returns whether eight consecutive requests with this data ID reset something: IDs B, C and D.
[[nodiscard]] constexpr bool is_reset(DataId id) {
  return id == DataId::zero || id == DataId::clear_alarms || id == DataId::reset_multiturn;
}
/// Returns whether replies to this data ID can make a safe position: IDs 1 and 2.
[[nodiscard]] constexpr bool is_safety_position(DataId id) {
  return id == DataId::position || id == DataId::singleturn;
}
/// Returns the data ID that reads the position with both channels; it also reads the turns if the encoder counts them.
[[nodiscard]] constexpr DataId position_id(const Profile& profile) {
  return profile.turns ? DataId::position : DataId::singleturn;
}
/// Returns whether replies to this data ID carry the sequence counter.
[[nodiscard]] constexpr bool has_sequence(DataId id) { return layout_of(id).crc_bytes == 2; }

/// Returns the length in bytes of replies to this data ID, with both channels.
[[nodiscard]] constexpr std::size_t reply_length(DataId id) {
  return std::size_t{layout_of(id).length_one} + layout_of(id).length_two;
}
/// Returns the length in bytes of requests with this data ID.
[[nodiscard]] constexpr std::size_t request_length(const Profile& profile, DataId id) {
  if (id == DataId::write_memory) return 4;
  if (id == DataId::read_memory) return 3;
  return profile.request_crc ? 2 : 1;
}

/// Returns the control field (CF) of a request: encoder address, data ID and odd parity.
[[nodiscard]] constexpr std::uint8_t control_field(const Profile& profile, unsigned address, DataId data) {
  const auto id = static_cast<unsigned>(data);
  const unsigned covered = profile.parity_scope == ParityScope::all ? address << 4 | id : id;
  return static_cast<std::uint8_t>((address & 7) | id << 3 | (odd_parity(covered) ? 0 : 0x80));
}
/// Returns the encoder id (ENID): b7 is 1 for a safety encoder, b6..5 the number of bytes of the turns, b4..0 the
/// number of bits of the position.
[[nodiscard]] constexpr std::uint8_t encoder_id(const Profile& profile) {
  constexpr unsigned safety = 0x80;
  const unsigned turn_bytes = profile.turns ? multiturn_bits / 8 : 0;
  return static_cast<std::uint8_t>(safety | turn_bytes << 5 | singleturn_bits);
}
/// Returns the encoder address in a control field.
[[nodiscard]] constexpr std::uint8_t address_of(std::uint8_t field) { return field & 7; }

/// A request of ESL.
struct Request {
  DataId id = DataId::position;      ///< Data ID of the request.
  std::uint8_t encoder_address = 0;  ///< address of the encoder on the line, 0 to 7
  std::uint8_t memory_address = 0;   ///< for data IDs that access the memory: address of the byte, 0 to 0x7F
  std::uint8_t value = 0;            ///< for data ID write_memory: byte to be written
};

/// Values of a reply that each of the two channels reports for itself.
struct ChannelReply {
  std::uint8_t status = 0;      ///< status (SF): bits of the namespace `status`, in the order of the document
  std::uint8_t alarms = 0;      ///< Alarms of the channel (ALM): bits of the namespace `alarms`.
  std::uint8_t sequence = 0;    ///< sequence counter: 8 bits in channel 1 (SC1), 7 bits in channel 2 (SC2)
  std::uint8_t encoder_id = 0;  ///< Encoder id (ENID): kind and number of bits of the encoder.
};

/// A reply of an encoder. In a decoded reply, members that its data ID does not carry have their initial values.
struct Reply {
  DataId id = DataId::position;                   ///< Data ID of the reply.
  std::uint8_t encoder_address = 0;               ///< Address of the encoder on the line (EAD), 0 to 7.
  ChannelReply one{};                             ///< Values that channel 1 of the reply has for itself.
  ChannelReply two{.status = status::channel_2};  ///< Values that channel 2 of the reply has for itself.
  std::uint32_t singleturn = 0;                   ///< Position within the turn (ABS), in counts.
  std::uint16_t multiturn = 0;                    ///< Number of turns (ABM).
  /// Redundant position of channel 2 (RS): 9 bits; in replies to data ID 6 16 bits if `id6_rs` is bits_16.
  std::uint16_t redundant = 0;
  std::int8_t temperature = 0;      ///< temperature in degC, assumed to be signed
  std::uint8_t memory_address = 0;  ///< Address of the memory byte (ADF).
  bool busy = false;                ///< Whether the memory is busy; if so, no byte was read or written.
  std::uint8_t value = 0;           ///< Value of the memory byte (EDF).
  bool unused_bits = false;         ///< in a decoded reply: whether a bit was set that must be 0
};

// ---- Bits whose place the document leaves open

namespace detail {

// Returns the status field as sent. In T-format order b0..3 are information, b4..5 encoder errors, b6..7 communication
// errors.
[[nodiscard]] constexpr std::uint8_t status_to_wire(const Profile& profile, std::uint8_t value) {
  if (profile.status_order == FieldOrder::document) return value;
  return static_cast<std::uint8_t>(value >> 4 | (value & 0x0C) << 2 | (value & 0x03) << 6);
}
[[nodiscard]] constexpr std::uint8_t status_from_wire(const Profile& profile, std::uint8_t value) {
  if (profile.status_order == FieldOrder::document) return value;
  return static_cast<std::uint8_t>(value << 4 | (value >> 2 & 0x0C) | value >> 6);
}

// If `at_b0`, rotates a byte to the left by one bit, so that its bit 7 is sent as bit 0.
[[nodiscard]] constexpr std::uint8_t to_wire(bool at_b0, unsigned byte) {
  return std::rotl(static_cast<std::uint8_t>(byte), at_b0 ? 1 : 0);
}
[[nodiscard]] constexpr std::uint8_t from_wire(bool at_b0, std::uint8_t byte) { return std::rotr(byte, at_b0 ? 1 : 0); }

}  // namespace detail

// ---- Encoding

/// Returns the bytes of a request.
[[nodiscard]] constexpr RequestBytes encode_request(const Profile& profile, const Request& request) {
  RequestBytes bytes;
  bytes.push_back(control_field(profile, request.encoder_address, request.id));
  if (is_memory_access(request.id)) {
    bytes.push_back(detail::to_wire(profile.memory_address_order == FieldOrder::document, request.memory_address));
    if (request.id == DataId::write_memory) bytes.push_back(request.value);
  }
  if (bytes.size() < request_length(profile, request.id)) bytes.push_back(checksum8(profile.crc_bit_order, bytes));
  return bytes;
}

namespace detail {

// Returns the bytes of the part `id` as a number whose lowest byte is sent first.
template <unsigned id>
constexpr std::uint32_t part_to_wire(const Profile& profile, const Reply& reply, const ChannelReply& channel) {
  const unsigned counter = channel.sequence & 0x7Fu;
  // Returns two bytes: the upper bits of the redundant position (RS), then its lowest bit together with `sequence`.
  const auto redundant = [&reply](RedundantBit order, unsigned sequence) {
    const unsigned second = to_wire(order == RedundantBit::b0, (reply.redundant & 1u) << 7 | sequence);
    return reply.redundant >> 1 | second << 8;
  };
  if constexpr (id == part::status) return status_to_wire(profile, channel.status);
  if constexpr (id == part::alarms) return channel.alarms;
  if constexpr (id == part::singleturn) return reply.singleturn;
  if constexpr (id == part::multiturn) return reply.multiturn;
  if constexpr (id == part::encoder_id) return channel.encoder_id;
  if constexpr (id == part::temperature) return static_cast<std::uint8_t>(reply.temperature);
  if constexpr (id == part::sequence) return channel.sequence;
  if constexpr (id == part::zero_sequence) return to_wire(profile.rs1_sc2 == RedundantBit::b0, counter);
  if constexpr (id == part::redundant_sequence) return redundant(profile.rs1_sc2, counter);
  if constexpr (id == part::redundant_alone) return redundant(profile.idc_rs1, 0);
  if constexpr (id == part::redundant_calibration) {
    const bool wide = profile.id6_rs == Id6Redundant::bits_16;
    return wide ? reply.redundant >> 8 | (reply.redundant & 0xFFu) << 8 : redundant(RedundantBit::b0, 0);
  }
  if constexpr (id == part::memory_address) {
    const unsigned field = reply.memory_address | (reply.busy ? 0x80u : 0u);
    return to_wire(profile.memory_address_order == FieldOrder::document, field);
  }
  if constexpr (id == part::value) return reply.value;
}

constexpr void encode_parts(const Profile& profile, unsigned parts, const Reply& reply, const ChannelReply& channel,
                            ReplyBytes& bytes) {
  walk_parts(parts, 0, [&]<class Part>(Part, std::size_t) {
    std::uint32_t value = part_to_wire<Part::id>(profile, reply, channel);
    for (std::size_t i = 0; i < Part::size; ++i, value >>= 8) bytes.push_back(static_cast<std::uint8_t>(value));
  });
}

constexpr void encode_channel(const Profile& profile, const Reply& reply, std::uint8_t field, Channel number,
                              ReplyBytes& bytes) {
  const Layout& layout = layout_of(reply.id);
  const bool first = number == Channel::one;
  const std::size_t begin = bytes.size();
  bytes.push_back(field);
  encode_parts(profile, first ? layout.one : layout.two, reply, first ? reply.one : reply.two, bytes);
  const Bytes covered = bytes.view().subspan(begin);
  if (layout.crc_bytes == 1) {
    bytes.push_back(checksum8(profile.crc_bit_order, covered));
    return;
  }
  const std::uint16_t crc = checksum16(profile.crc_bit_order, number, covered);
  const bool low_first = low_byte_first(profile.crc16_byte_order, number);
  bytes.push_back(static_cast<std::uint8_t>(low_first ? crc : crc >> 8));
  bytes.push_back(static_cast<std::uint8_t>(low_first ? crc >> 8 : crc));
}

}  // namespace detail

/// Returns the bytes of a reply; each channel begins with `field`, the control field of the request.
[[nodiscard]] constexpr ReplyBytes encode_reply(const Profile& profile, const Reply& reply, std::uint8_t field) {
  ReplyBytes bytes;
  detail::encode_channel(profile, reply, field, Channel::one, bytes);
  if (layout_of(reply.id).has_two()) detail::encode_channel(profile, reply, field, Channel::two, bytes);
  return bytes;
}

/// Returns the bytes of a reply that echoes a control field with a right parity bit.
[[nodiscard]] constexpr ReplyBytes encode_reply(const Profile& profile, const Reply& reply) {
  return encode_reply(profile, reply, control_field(profile, reply.encoder_address, reply.id));
}

}  // namespace absenc::esl
