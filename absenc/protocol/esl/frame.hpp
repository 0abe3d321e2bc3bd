// SPDX-License-Identifier: Apache-2.0
// QS35 ESL frames (RS-485, 10 Mbps, 8N1, LSB first): their parts, and encoding them. reply.hpp decodes them. Table
// numbers are those of the ESL Protocol Specification, rev 1.5; README.md draws the frames.
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

/// Bits of SF in the order of the document (Table 5); `status_order` gives their order on the wire.
namespace status {
inline constexpr std::uint8_t parity_error = 0x01;                   ///< Status: parity error.
inline constexpr std::uint8_t stop_error = 0x02;                     ///< Status: stop error.
inline constexpr std::uint8_t safety_error = 0x04;                   ///< Status: safety error.
inline constexpr std::uint8_t non_safety_error = 0x08;               ///< Status: non safety error.
inline constexpr std::uint8_t temperature_warning = 0x10;            ///< Status: temperature warning.
inline constexpr std::uint8_t channel_2 = 0x20;                      ///< Status: channel 2.
inline constexpr std::uint8_t ready = 0x40;                          ///< Status: ready.
inline constexpr std::uint8_t forced_test_passed = 0x80;             ///< Status: forced test passed.
inline constexpr std::uint8_t rejected = parity_error | stop_error;  ///< Status: rejected.
}  // namespace status

/// Bits of ALM (Table 7).
namespace alarms {
inline constexpr std::uint8_t xc_error = 0x01;                           ///< Alarm: xc error.
inline constexpr std::uint8_t multiturn_error = 0x02;                    ///< Alarm: multiturn error.
inline constexpr std::uint8_t led_or_lissajous_error = 0x04;             ///< Alarm: led or lissajous error.
inline constexpr std::uint8_t overspeed = 0x08;                          ///< Alarm: overspeed.
inline constexpr std::uint8_t memory_error = 0x10;                       ///< Alarm: memory error.
inline constexpr std::uint8_t singleturn_error = 0x20;                   ///< Alarm: singleturn error.
inline constexpr std::uint8_t under_voltage = 0x40;                      ///< Alarm: under voltage.
inline constexpr std::uint8_t over_voltage = 0x80;                       ///< Alarm: over voltage.
inline constexpr std::uint8_t voltage = under_voltage | over_voltage;    ///< Alarm: voltage.
inline constexpr std::uint8_t turns_wrong = xc_error | multiturn_error;  ///< Alarm: turns wrong.
/// Alarms with which the position within the turn is not used, because it is not safe.
inline constexpr std::uint8_t unsafe = led_or_lissajous_error | memory_error | singleturn_error | voltage;
}  // namespace alarms

inline constexpr unsigned singleturn_bits = 24;     ///< Bits of the position.
inline constexpr unsigned multiturn_bits = 16;      ///< Bits of the turns.
inline constexpr unsigned redundant_bits = 9;       ///< Bits of the redundant position.
inline constexpr std::size_t request_capacity = 4;  ///< Length of the longest request in bytes.
inline constexpr std::size_t reply_capacity = 18;   ///< Length of the longest reply in bytes.
/// Bytes of a request.
using RequestBytes = ByteBuffer<request_capacity>;
/// Bytes of a reply.
using ReplyBytes = ByteBuffer<reply_capacity>;

// ---- Checksums. The document prints the polynomials in Koopman notation: 16'hAC9A is normal 5935, 8'h97 is 2F.

/// Channel of the encoder.
enum class Channel : std::uint8_t { one, two };

inline constexpr CrcParameters crc16_lsb{16, 0x5935, 0, true, true, 0};    ///< CRC of 16 bits, lowest bit first.
inline constexpr CrcParameters crc16_msb{16, 0x5935, 0, false, false, 0};  ///< CRC of 16 bits, highest bit first.
inline constexpr CrcParameters crc8_lsb{8, 0x2F, 0, true, true, 0};        ///< CRC of 8 bits, lowest bit first.
inline constexpr CrcParameters crc8_msb{8, 0x2F, 0, false, false, 0};      ///< CRC of 8 bits, highest bit first.

/// Returns the value of the CRC register before the first byte.
[[nodiscard]] constexpr std::uint16_t initial_value(Channel channel) { return channel == Channel::two ? 0xFFFF : 0; }

namespace detail {
// Computes the CRC of 16-bit words. One 00 byte is appended to an odd number of bytes. `swapped`: the second byte of
// each pair enters the CRC first.
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

/// Returns the CRC of 16 bits.
[[nodiscard]] constexpr std::uint16_t checksum16(CrcBitOrder order, Channel channel, Bytes bytes) {
  return order == CrcBitOrder::lsb ? detail::crc_of_pairs<crc16_lsb>(channel, bytes, false)
                                   : detail::crc_of_pairs<crc16_msb>(channel, bytes, order == CrcBitOrder::word);
}

/// Returns the CRC of 8 bits.
[[nodiscard]] constexpr std::uint8_t checksum8(CrcBitOrder order, Bytes bytes) {
  return order == CrcBitOrder::lsb ? Crc<crc8_lsb, CrcTable::nibble>::of(bytes)
                                   : Crc<crc8_msb, CrcTable::nibble>::of(bytes);
}

/// Returns whether the first of the two CRC bytes of this channel is the low one.
[[nodiscard]] constexpr bool low_byte_first(CrcByteOrder order, Channel channel) {
  if (order == CrcByteOrder::table12) return channel == Channel::one;
  return order == CrcByteOrder::low;
}

// ---- Tables 3 and 12 as data: the command ids, and the parts of each channel of their replies

/// Data ID codes of Table 3; 6 is in Tables 6 and 12.
enum class DataId : std::uint8_t {
  position = 1,          ///< safety
  singleturn = 2,        ///< safety
  position_short = 4,    ///< non-safety
  singleturn_short = 5,  ///< non-safety
  calibration = 6,       ///< non-safety
  encoder_id = 8,  ///< never eight times in a row: that is "dynamic addressing", which the document does not describe
  temperature = 9,
  alarms = 0xA,
  zero = 0xB,             ///< sent eight times
  clear_alarms = 0xC,     ///< sent eight times
  reset_multiturn = 0xD,  ///< sent eight times
  read_memory = 0xE,
  write_memory = 0xF,
};

/// The parts between CF and CRC.
namespace part {
inline constexpr unsigned status = 0x0001;                 ///< Status (SF).
inline constexpr unsigned alarms = 0x0002;                 ///< Alarms (ALM).
inline constexpr unsigned singleturn = 0x0004;             ///< Position within the turn (ABS).
inline constexpr unsigned multiturn = 0x0008;              ///< Turns (ABM).
inline constexpr unsigned encoder_id = 0x0010;             ///< Encoder id (ENID).
inline constexpr unsigned temperature = 0x0020;            ///< Temperature (TEMP).
inline constexpr unsigned sequence = 0x0040;               ///< Sequence counter of channel 1 (SC1).
inline constexpr unsigned zero_sequence = 0x0080;          ///< {0, SC2}.
inline constexpr unsigned redundant_sequence = 0x0100;     ///< RS0 {RS1, SC2}.
inline constexpr unsigned redundant_alone = 0x0200;        ///< RS0 RS1 of ID C.
inline constexpr unsigned redundant_calibration = 0x0400;  ///< RS0 RS1 of ID 6.
inline constexpr unsigned memory_address = 0x0800;         ///< Memory address and busy bit (ADF).
inline constexpr unsigned value = 0x1000;                  ///< Byte in memory (EDF).
/// Any redundant position.
inline constexpr unsigned redundant = redundant_sequence | redundant_alone | redundant_calibration;
}  // namespace part

/// A part with its length on the wire.
template <unsigned part_id, std::size_t part_size>
struct WirePart {
  static constexpr unsigned id = part_id;         ///< The part, one of namespace `part`.
  static constexpr std::size_t size = part_size;  ///< Length in bytes.
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

/// Calls `visit(WirePart<...>{}, byte)` for each of `parts`, in the order of the wire. `control_field`: index of CF;
/// `byte`: index of the part's first byte. Returns the index after the last part.
template <class Visit>
constexpr std::size_t walk_parts(unsigned parts, std::size_t control_field, const Visit& visit) {
  return detail::WireOrder::walk(parts, control_field + 1, visit);
}

/// The parts of a reply, in their order on the line.
struct Layout {
  constexpr Layout() = default;
  /// Sets length of the checksum and parts of each channel.
  constexpr Layout(std::uint8_t crc, unsigned parts_one, unsigned parts_two = 0)
      : one(static_cast<std::uint16_t>(parts_one)),
        two(static_cast<std::uint16_t>(parts_two)),
        crc_bytes(crc),
        length_one(length(crc, parts_one)),
        length_two(has_two() ? length(crc, parts_two) : std::uint8_t{0}) {}

  /// Returns whether the reply has channel 2.
  [[nodiscard]] constexpr bool has_two() const { return two != 0; }
  /// Returns whether the reply has one of these parts.
  [[nodiscard]] constexpr bool has(unsigned any_of) const { return ((one | two) & any_of) != 0; }

  std::uint16_t one = 0;        ///< Parts of channel 1.
  std::uint16_t two = 0;        ///< Parts of channel 2; 0: none.
  std::uint8_t crc_bytes = 1;   ///< Length of the checksum in bytes.
  std::uint8_t length_one = 0;  ///< length in bytes with CF and CRC
  std::uint8_t length_two = 0;  ///< Length of the part of channel 2 in bytes.

 private:
  static constexpr std::uint8_t length(unsigned crc, unsigned parts) {
    return static_cast<std::uint8_t>(walk_parts(parts, 0, [](auto, std::size_t) {}) + crc);
  }
};

namespace detail {
// Layouts by id; empty for an id that does not exist.
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

/// Returns the layout of replies to a request.
[[nodiscard]] constexpr const Layout& layout_of(DataId id) { return detail::layouts[static_cast<std::size_t>(id)]; }

/// Returns the id of a control field, whatever its parity; nothing for one that the tables do not list.
[[nodiscard]] constexpr std::optional<DataId> data_id(std::uint8_t field) {
  const std::uint8_t id = (field >> 3) & 0xF;
  if (detail::layouts[id].length_one == 0) return std::nullopt;
  return static_cast<DataId>(id);
}

/// Returns whether a request reads or writes the memory.
[[nodiscard]] constexpr bool is_memory_access(DataId id) {
  return id == DataId::read_memory || id == DataId::write_memory;
}
/// Returns whether a request is one of those that reset.
[[nodiscard]] constexpr bool is_reset(DataId id) {
  return id == DataId::zero || id == DataId::clear_alarms || id == DataId::reset_multiturn;
}
/// Returns whether a request is for a safety position.
[[nodiscard]] constexpr bool is_safety_position(DataId id) {
  return id == DataId::position || id == DataId::singleturn;
}
/// Returns the id of the position with all that the encoder measures.
[[nodiscard]] constexpr DataId position_id(const Profile& profile) {
  return profile.turns ? DataId::position : DataId::singleturn;
}
/// Returns whether replies to this id carry the sequence counter (and count it, with sequence_step=safety).
[[nodiscard]] constexpr bool has_sequence(DataId id) { return layout_of(id).crc_bytes == 2; }

/// Returns the length of a reply in bytes.
[[nodiscard]] constexpr std::size_t reply_length(DataId id) {
  return std::size_t{layout_of(id).length_one} + layout_of(id).length_two;
}
/// Returns the length of a request in bytes.
[[nodiscard]] constexpr std::size_t request_length(const Profile& profile, DataId id) {
  if (id == DataId::write_memory) return 4;
  if (id == DataId::read_memory) return 3;
  return profile.request_crc ? 2 : 1;
}

/// Returns CF: EAD, the id, and a parity bit that makes the number of ones odd.
[[nodiscard]] constexpr std::uint8_t control_field(const Profile& profile, unsigned address, DataId data) {
  const auto id = static_cast<unsigned>(data);
  const unsigned covered = profile.parity_scope == ParityScope::all ? address << 4 | id : id;
  return static_cast<std::uint8_t>((address & 7) | id << 3 | (odd_parity(covered) ? 0 : 0x80));
}
/// Returns ENID: b7 a safety encoder, b6..5 bytes of the turns, b4..0 bits of the turn.
[[nodiscard]] constexpr std::uint8_t encoder_id(const Profile& profile) {
  constexpr unsigned safety = 0x80;
  const unsigned turn_bytes = profile.turns ? multiturn_bits / 8 : 0;
  return static_cast<std::uint8_t>(safety | turn_bytes << 5 | singleturn_bits);
}
/// Returns the address in a control field.
[[nodiscard]] constexpr std::uint8_t address_of(std::uint8_t field) { return field & 7; }

/// A request of the protocol.
struct Request {
  DataId id = DataId::position;      ///< Data ID of the request.
  std::uint8_t encoder_address = 0;  ///< address 0 to 7
  std::uint8_t memory_address = 0;   ///< memory access: address 0 to 7F
  std::uint8_t value = 0;            ///< write_memory: byte to be written
};

/// The parts of a reply in one channel.
struct ChannelReply {
  std::uint8_t status = 0;      ///< bits in the order of the document
  std::uint8_t alarms = 0;      ///< Alarms of the channel.
  std::uint8_t sequence = 0;    ///< 8 bits in channel 1, 7 in channel 2
  std::uint8_t encoder_id = 0;  ///< Encoder identifier.
};

/// The fields of a reply; those that its id does not carry are 0.
struct Reply {
  DataId id = DataId::position;                   ///< Data ID of the reply.
  std::uint8_t encoder_address = 0;               ///< Address of the encoder on its line.
  ChannelReply one{};                             ///< Channel 1.
  ChannelReply two{.status = status::channel_2};  ///< Channel 2.
  std::uint32_t singleturn = 0;                   ///< Position in counts.
  std::uint16_t multiturn = 0;                    ///< Turns.
  std::uint16_t redundant = 0;                    ///< 9 bits; with ID 6 16 bits if the profile says so
  std::int8_t temperature = 0;                    ///< signed, which is assumed
  std::uint8_t memory_address = 0;                ///< Address of the memory byte.
  bool busy = false;                              ///< Whether the memory is busy.
  std::uint8_t value = 0;                         ///< Value of the memory byte.
  bool unused_bits = false;                       ///< decoded: a bit that must be 0 was set
};

// ---- Bits whose place the document leaves open

namespace detail {

// In T-format DD is in b0..3, EA in b4..5, CA in b6..7.
[[nodiscard]] constexpr std::uint8_t status_to_wire(const Profile& profile, std::uint8_t value) {
  if (profile.status_order == FieldOrder::document) return value;
  return static_cast<std::uint8_t>(value >> 4 | (value & 0x0C) << 2 | (value & 0x03) << 6);
}
[[nodiscard]] constexpr std::uint8_t status_from_wire(const Profile& profile, std::uint8_t value) {
  if (profile.status_order == FieldOrder::document) return value;
  return static_cast<std::uint8_t>(value << 4 | (value >> 2 & 0x0C) | value >> 6);
}

// Moves b7 of a byte to b0 if `at_b0`: {busy, ADF}, {RS1, SC2}, {0, SC2}, or RS1 alone.
[[nodiscard]] constexpr std::uint8_t to_wire(bool at_b0, unsigned byte) {
  return std::rotl(static_cast<std::uint8_t>(byte), at_b0 ? 1 : 0);
}
[[nodiscard]] constexpr std::uint8_t from_wire(bool at_b0, std::uint8_t byte) { return std::rotr(byte, at_b0 ? 1 : 0); }

}  // namespace detail

// ---- Encoding

/// Returns the request as it is sent.
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

// Returns the bytes of one part, the first on the wire lowest.
template <unsigned id>
constexpr std::uint32_t part_to_wire(const Profile& profile, const Reply& reply, const ChannelReply& channel) {
  const unsigned counter = channel.sequence & 0x7Fu;
  // RS in two bytes: its upper bits, then {RS1, SC2}.
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

/// Encodes a reply with this control field, which is that of the request, even with a wrong parity bit.
[[nodiscard]] constexpr ReplyBytes encode_reply(const Profile& profile, const Reply& reply, std::uint8_t field) {
  ReplyBytes bytes;
  detail::encode_channel(profile, reply, field, Channel::one, bytes);
  if (layout_of(reply.id).has_two()) detail::encode_channel(profile, reply, field, Channel::two, bytes);
  return bytes;
}

/// Returns the reply as it is sent.
[[nodiscard]] constexpr ReplyBytes encode_reply(const Profile& profile, const Reply& reply) {
  return encode_reply(profile, reply, control_field(profile, reply.encoder_address, reply.id));
}

}  // namespace absenc::esl
