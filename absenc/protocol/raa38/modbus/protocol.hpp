// SPDX-License-Identifier: Apache-2.0
// The RAA38S6 as a Modbus slave: its frames, times and checks for the host's side of the line.
#pragma once

#include "absenc/protocol/author/confirm.hpp"
#include "absenc/protocol/raa38/modbus/frame.hpp"

namespace absenc::raa38::rtu {

/// The document gives no time; slaves of this kind need a few milliseconds.
inline constexpr Time answer_limit = std::chrono::milliseconds(50);

struct Protocol {
  using Format = rtu::Format;
  using Request = rtu::Request;
  using Reply = rtu::Reply;
  static constexpr std::size_t longest_reply = 9;

  static constexpr author::Wire wire(const Format&, std::uint32_t rate) {
    return modbus::client_wire({.rate = rate}, answer_limit);
  }
  static constexpr author::Wire wire(const Format& format) { return wire(format, format.line().rate); }
  /// Settings wear the memory: nothing is repeated by itself.
  static constexpr author::Manner manner(const Format&, const Request&) { return {}; }
  static constexpr RequestBytes encode(const Format&, const Request& request) { return encode_request(request); }
  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) { return rtu::decode_request(bytes); }
  static constexpr std::size_t expected(const Format&, const Request& request, Bytes reply) {
    return reply_length(request, reply);
  }
  static constexpr Result<Reply> decode(const Format& format, const Request& request, Bytes bytes) {
    if (bytes.empty()) return Error::timeout;
    return decode_reply(format, request, bytes);
  }
  static constexpr Reading reading(const Format& format, const Request& request, const Reply& reply) {
    if (request.function != function::read) return {};
    return {.singleturn = reply.singleturn, .singleturn_bits = format.bits, .singleturn_valid_bits = format.bits};
  }
  static constexpr bool needs_another(const Format&, const Reply& reply) { return reply.doubtful_size != 0; }
  static constexpr Error agree(const Format&, const Reply& first, const Reply& second, Time) {
    return differ_doubtfully(first, second) ? Error::wrong_length : Error::none;
  }
};

/// Function 03. A reply whose length the CRC cannot vouch for is confirmed by a second one.
using ReadPosition = author::ReadConfirmed<Protocol>;

}  // namespace absenc::raa38::rtu
