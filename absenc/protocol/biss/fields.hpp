// SPDX-License-Identifier: Apache-2.0
// Names and meanings of everything in a BiSS frame.
#pragma once

#include <algorithm>
#include <array>

#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

enum FieldIndex : std::size_t { field_ack_bits, field_crc, field_life_counter };

inline constexpr std::array<FieldInfo, 3> own_fields{{
    {"ack_bits", FieldInfo::Kind::number, "", "clocks until the encoder was ready"},
    {"crc", FieldInfo::Kind::number, "", "as sent: inverted"},
    {"life_counter", FieldInfo::Kind::number, "", "counts up with every reading (BiSS Safety)"},
}};

/// Every field that a reply carries, in the order of the wire.
constexpr void put_fields(FieldSink& sink, const Format& format, const Reply& reply) {
  sink.put({&own_fields[field_ack_bits], reply.ack_bits});
  put_position(sink, format.word, reply.word, format.scale);
  if (format.check == Check::crc16) sink.put({&own_fields[field_life_counter], reply.life_counter});
  sink.put({&own_fields[field_crc], reply.crc});
}

constexpr Error decode(const Format& format, BitView samples, FieldSink& sink) {
  const Result<Reply> reply = decode(format, samples);
  if (reply) put_fields(sink, format, *reply);
  return reply.error();
}

}  // namespace absenc::biss
