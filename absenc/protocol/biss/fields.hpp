// SPDX-License-Identifier: Apache-2.0
// Names and meanings of the fields of a BiSS frame outside its word.
#pragma once

#include <array>

#include "absenc/protocol/biss/frame.hpp"

namespace absenc::biss {

/// Index of a field.
enum FieldIndex : std::size_t { field_ack_bits, field_crc, field_life_counter, field_line_delay, field_line_delay_us };

/// Fields of every BiSS unit.
inline constexpr std::array<FieldInfo, 5> own_fields{{
    {"ack_bits", FieldInfo::Kind::number, "", "clocks until the encoder was ready"},
    {"crc", FieldInfo::Kind::number, "", "as sent: inverted"},
    {"life_counter", FieldInfo::Kind::number, "", "counts up with every frame (BiSS Safety)", {}, Role::life_counter},
    {"line_delay_clocks", FieldInfo::Kind::number, "", "whole clocks by which the line is late, there and back"},
    {"line_delay_us", FieldInfo::Kind::real, "us", "the same at the clock of ma_khz: 100 m of cable make 1 us"},
}};

/// Reports the delay of the line. It is known only if the samples begin with the clock; others may begin anywhere in
/// the idle line.
template <class F, class ReplyType>
constexpr void put_line_delay(FieldSink& sink, const F& format, const ReplyType& reply) {
  if (reply.delay_bits == 0) return;
  sink.put({&own_fields[field_line_delay], reply.delay_bits});
  sink.put({&own_fields[field_line_delay_us], 0, reply.delay_bits * 1000.0 / format.ma_khz});
}

}  // namespace absenc::biss
