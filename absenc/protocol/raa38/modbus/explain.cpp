// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/modbus/explain.hpp"

namespace absenc::raa38::rtu {

namespace {

constexpr Explanation other_crc_order{
    "the CRC would be right with its two bytes exchanged: Modbus RTU sends the low byte first",
    "check what is connected: a slave, gateway or program that sends the high byte first does not speak Modbus RTU"};

Explanation explain_length(const Request& request) {
  switch (request.function) {
    case function::ask_address:
      return {"the reply to A0 is FF A0, the address and the CRC; several encoders on a line answer it all at once",
              "with several on the line use scan, and name each by its address"};
    case function::set_address:
      return {"the reply to A1 is the new address, A1 and the CRC", {}};
    case function::set_parameter:
      return {"the reply to CC is the request once more", {}};
    default:
      break;
  }
  if (request.registers == 1) {
    return {"one register was asked for: byte count 02 and 7 bytes in all are the answer",
            "check bits and registers (an encoder with more than 16 bits has two), and that only one slave answers"};
  }
  return {"two registers were asked for: byte count 04 or 03 and 8 or 9 bytes in all are the answer",
          "check bits and registers (registers=1 suits up to 16 bits), and that only one slave answers"};
}

Explanation explain_other(const Request& request, Bytes reply) {
  if (reply.size() < modbus::shortest_frame) return {};
  if (reply[1] != request.function) {
    return {"it answers another function than was asked for", "check that no other program uses the line"};
  }
  if (request.function == function::set_parameter && reply[0] == request.address) {
    return {"the parameter that came back is another than was sent",
            "read the position before you send it again: it may be done, or refused"};
  }
  return {"it comes from another address than was asked", "check address; `absenc scan` asks every one"};
}

}  // namespace

Explanation explain(const Request& request, Error error, Bytes reply) {
  switch (error) {
    case Error::timeout:
      return {
          "nobody answers at this address and baud rate",
          "`absenc scan` asks every address, `absenc config get ... baud` every baud rate; then check supply and A/B"};
    case Error::wrong_length:
      return explain_length(request);
    case Error::bad_checksum:
      if (modbus::crc_order(reply) == CrcOrder::high_first) return other_crc_order;
      return {{}, "check shielding, termination and baud rate, and that no two slaves have one address"};
    case Error::unexpected_reply:
      return explain_other(request, reply);
    case Error::request_rejected:
      return reply.size() < modbus::shortest_frame ? Explanation{} : modbus::explain_refusal(reply[2]);
    case Error::unsupported:
      return {"the position is read from register 0 on, one register or two", {}};
    case Error::out_of_range:
      if (request.function == function::ask_address) {
        return {"the address that came is none: they go from 1 to 247", "check that an RAA38S6 is connected"};
      }
      return {"the position has more bits than bits says", "set bits to the resolution of the encoder (10 to 21)"};
    default:
      return {};
  }
}

Explanation explain_request(Error error, Bytes request) {
  switch (error) {
    case Error::wrong_length:
      return {"this is not the length of a request with this function", {}};
    case Error::bad_checksum:
      if (modbus::crc_order(request) == CrcOrder::high_first) return other_crc_order;
      return {"the checksum of the request is wrong", "check whether it was captured as a whole"};
    case Error::unsupported:
      return {"the encoder knows functions 03, A0, A1 and CC", "check that the request is for this encoder"};
    case Error::unexpected_reply:
      return {"A0 is asked of address FF", {}};
    default:
      return {};
  }
}

}  // namespace absenc::raa38::rtu
