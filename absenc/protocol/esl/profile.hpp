// SPDX-License-Identifier: Apache-2.0
// What the QS35 document leaves open, and how one encoder is addressed and judged: every assumption in one place.
// README.md says how hardware tells each alternative; probe.hpp finds them in captured frames.
#pragma once

#include <cstdint>

#include "absenc/protocol/options.hpp"

namespace absenc::esl {

enum class CrcBitOrder : std::uint8_t {
  lsb,   // every byte LSB first, as the wire has it
  msb,   // every byte MSB first
  word,  // 16-bit words of two bytes, low byte first on the wire, MSB first into the CRC; the 8-bit CRC: as msb
};
enum class CrcByteOrder : std::uint8_t {
  low,      // low byte first
  high,     // high byte first
  table12,  // as Table 12 prints it: channel 1 low byte first, channel 2 high byte first
};
/// Which end of a byte the lowest bit of the redundant position stands at.
enum class RedundantBit : std::uint8_t { b7, b0 };
enum class SequenceStep : std::uint8_t {
  change,   // differs from the last one seen
  safety,   // plus one for each reply to IDs 1, 2, 8, B
  request,  // plus one for each request
};
/// What the parity bit of CF covers.
enum class ParityScope : std::uint8_t { command, all };
/// Order of bits in SF, or in ADF: as the QS35 document lists them, or as Tamagawa's T-format has them.
enum class FieldOrder : std::uint8_t { document, tformat };
/// How many bits the redundant position of ID 6 has.
enum class Id6Redundant : std::uint8_t { bits_16, bits_9 };
/// What the virtual encoder does when parity or stop bit of a request is wrong.
enum class BadRequest : std::uint8_t { report, silent };

struct Profile {
  CrcBitOrder crc_bit_order = CrcBitOrder::lsb;
  CrcByteOrder crc16_byte_order = CrcByteOrder::low;
  RedundantBit rs1_sc2 = RedundantBit::b7;
  SequenceStep sequence_step = SequenceStep::change;
  ParityScope parity_scope = ParityScope::command;
  FieldOrder status_order = FieldOrder::document;
  FieldOrder memory_address_order = FieldOrder::document;
  bool request_crc = true;  // false: only memory requests carry a CRC
  RedundantBit idc_rs1 = RedundantBit::b7;
  Id6Redundant id6_rs = Id6Redundant::bits_16;

  std::uint8_t address = 0;              // EAD, 0 to 7
  Sharing bus = sharing_automatic;       // yes: others share the line, memory cannot be reached (Figure 18)
  bool require_forced_test = false;      // of a safe position
  std::uint8_t redundant_tolerance = 1;  // RS against the top 9 bits of ABS, 1/512 turn, 0 to 255
  BadRequest bad_request = BadRequest::report;
};

}  // namespace absenc::esl
