// SPDX-License-Identifier: Apache-2.0
// Modbus RTU frames. Sources: MODBUS over Serial Line V1.02, MODBUS Application Protocol V1.1b3.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::modbus {

/// CRC of Modbus RTU (MODBUS over Serial Line, 6.2.2).
inline constexpr CrcParameters crc_parameters{16, 0x8005, 0xFFFF, true, true, 0x0000};

/// Length of the longest frame in bytes (MODBUS over Serial Line, 2.5.1).
inline constexpr std::size_t frame_capacity = 256;
inline constexpr std::size_t shortest_frame = 4;  ///< Length of the shortest frame in bytes: address, function, CRC.
inline constexpr std::size_t crc_size = 2;        ///< Length of the CRC in bytes.
/// Buffer for the bytes of one frame.
using FrameBytes = ByteBuffer<frame_capacity>;

inline constexpr std::uint8_t first_address = 1;   ///< Lowest address of a server; 0 is broadcast and never answered.
inline constexpr std::uint8_t last_address = 247;  ///< Highest address of a server (MODBUS over Serial Line, 2.2).

inline constexpr std::uint8_t read_holding_registers = 0x03;  ///< Function code that reads holding registers.
/// Greatest number of registers in one read request (MODBUS Application Protocol, 6.3).
inline constexpr std::uint16_t most_registers = 125;
/// Bit of the function code that marks a refusal; the function codes of the standard are smaller than this value.
inline constexpr std::uint8_t refusal_bit = 0x80;

/// Byte order of a CRC in a frame; `wrong`: the CRC matches in neither order.
enum class CrcOrder : std::uint8_t { low_first, high_first, wrong };

/// Returns the byte order in which the last two bytes of a frame are its CRC, or `wrong`.
[[nodiscard]] constexpr CrcOrder crc_order(Bytes frame) {
  if (frame.size() < shortest_frame) return CrcOrder::wrong;
  const Bytes crc = frame.last(crc_size);
  const std::uint16_t right = Crc<crc_parameters, CrcTable::nibble>::of(frame.first(frame.size() - crc_size));
  if (right == (crc[0] | crc[1] << 8)) return CrcOrder::low_first;
  return right == (crc[1] | crc[0] << 8) ? CrcOrder::high_first : CrcOrder::wrong;
}

/// Appends the CRC of `frame` to it. The buffer must have room for two bytes.
template <std::size_t Capacity>
constexpr void append_crc(ByteBuffer<Capacity>& frame, CrcOrder order = CrcOrder::low_first) {
  const std::uint16_t crc = Crc<crc_parameters, CrcTable::nibble>::of(frame.view());
  const bool low_first = order == CrcOrder::low_first;
  frame.push_back(static_cast<std::uint8_t>(low_first ? crc : crc >> 8));
  frame.push_back(static_cast<std::uint8_t>(low_first ? crc >> 8 : crc));
}

/// Codes with which the virtual servers refuse a request (MODBUS Application Protocol, 7); `none`: not refused.
enum class Exception : std::uint8_t {
  none = 0,
  illegal_function = 1,
  illegal_data_address = 2,
  illegal_data_value = 3,
};

/// Returns the code in a frame that refuses the function `function`; no value for any other frame. Ignores the CRC.
[[nodiscard]] constexpr std::optional<std::uint8_t> refusal_code(Bytes frame, std::uint8_t function) {
  if (frame.size() != shortest_frame + 1 || frame[1] != (function | refusal_bit)) return std::nullopt;
  return frame[2];
}

/// Returns cause and advice for the code of a refusal (MODBUS Application Protocol, 7).
[[nodiscard]] constexpr Explanation explain_refusal(std::uint8_t code) {
  switch (code) {
    case 0x01:
      return {"exception 01, illegal function: the slave does not have this function",
              "check the address: another kind of slave may have it"};
    case 0x02:
      return {"exception 02, illegal data address: the slave does not have these registers",
              "ask for another number of registers, and check the address: another kind of slave may have it"};
    case 0x03:
      return {"exception 03, illegal data value: the slave does not take this number or value",
              "ask for another number of registers"};
    case 0x04:
      return {"exception 04, server device failure: the slave failed while it did it",
              "switch the slave off and on; if it stays, it is broken"};
    case 0x05:
      return {"exception 05, acknowledge: the slave has begun and needs longer", "wait, then read what became of it"};
    case 0x06:
      return {"exception 06, server device busy: the slave is occupied", "wait and try again"};
    case 0x08:
      return {"exception 08, memory parity error: the slave's memory is damaged", "the slave needs service"};
    case 0x0A:
      return {"exception 0A, gateway path unavailable: the gateway has no way to the slave",
              "check the settings of the gateway"};
    case 0x0B:
      return {"exception 0B, gateway target device failed to respond: nobody answers behind the gateway",
              "check wiring and supply behind the gateway, and the address"};
    default:
      return {"an exception with a code that the standard does not have", "look it up in the slave's manual"};
  }
}

static_assert(crc_bitwise(crc_parameters, std::to_array<std::uint8_t>({'1', '2', '3', '4', '5', '6', '7', '8', '9'})) ==
              0x4B37);

}  // namespace absenc::modbus
