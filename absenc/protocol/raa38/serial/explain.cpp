// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/explain.hpp"

namespace absenc::raa38::serial {

namespace {

Explanation explain_other(const Format& format, Bytes request, Bytes reply) {
  if (reply.empty()) return {"a request is BC AA Bx or BC AA Cx", {}};
  const Result<Request> asked = decode_request(request);
  if (asked && asked->kind == Request::Kind::zero_clear) return {"nothing answers BC AA Cx", {}};
  if (format.mode != Mode::bus) {
    return {"it is no frame: FF 81 is missing, or on a bus FF Bx", "check mode, baud and second_byte"};
  }
  return {"another unit answered, or no frame came: FF 81 or FF Bx answers BC AA Bx, with the same x",
          "check unit and second_byte; `scan` shows who answers"};
}

}  // namespace

Explanation explain_stream(Error error) {
  switch (error) {
    case Error::timeout:
      return {"nothing comes: the encoder does not transmit by itself, or it was unplugged",
              "check supply, A/B polarity and baud rate; mode=handshake or mode=bus for an encoder that must be asked"};
    case Error::out_of_range:
      return {"the frames carry more bits than the option bits says", "set bits"};
    default:
      return {"something comes, but no two frames in a row",
              "check baud, parity, bits (their number of data bytes) and second_byte"};
  }
}

Explanation explain(const Format& format, Error error, Bytes request, Bytes reply) {
  switch (error) {
    case Error::wrong_length:
      if (reply.empty()) return {"a request has three bytes: BC AA Bx or BC AA Cx", {}};
      return {
          "the frame has another number of bytes than the option bits makes: up to 16 bits make two data bytes, more "
          "make three",
          "check bits and baud"};
    case Error::bad_checksum:
      if (format.mode != Mode::bus) return {};
      return {"two encoders with one number, or a bad line",
              "`scan` shows who answers; check numbers, termination and baud"};
    case Error::unexpected_reply:
      return explain_other(format, request, reply);
    case Error::out_of_range:
      return {"the position has more bits than the option bits says", "set bits"};
    case Error::bad_framing:
      return format.mode == Mode::timing ? explain_stream(error) : Explanation{};
    case Error::timeout:
      if (format.mode == Mode::timing) return explain_stream(error);
      if (format.mode == Mode::bus) return {{}, "`scan` shows who answers; check supply, A/B polarity and baud"};
      return {"no frame followed the pulse", "check the wire to CLK, its level, the pulse's width, supply and baud"};
    case Error::cross_check_failed:
      return {"two positions in a row are farther apart than max_rpm allows",
              "the checksum does not see swapped bytes: read again, and check shielding, bits and max_rpm"};
    default:
      return {};
  }
}

}  // namespace absenc::raa38::serial
