// SPDX-License-Identifier: Apache-2.0
// Requests and replies of an RAA38S6 over Modbus RTU (RAA38S6 Operation Manual, 3.1.7).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/core/angle.hpp"
#include "absenc/protocol/author/confirm.hpp"
#include "absenc/protocol/author/look.hpp"
#include "absenc/protocol/modbus/frame.hpp"
#include "absenc/protocol/modbus/timing.hpp"

namespace absenc::raa38::rtu {

using modbus::CrcOrder;

namespace function {
inline constexpr std::uint8_t read = modbus::read_holding_registers;  ///< Function code that reads registers.
/// Function code that reads the encoder's address. The codes A0, A1 and CC are the maker's own, not of the Modbus
/// standard.
inline constexpr std::uint8_t read_address = 0xA0;
inline constexpr std::uint8_t set_address = 0xA1;    ///< Function code that sets the address.
inline constexpr std::uint8_t set_parameter = 0xCC;  ///< Function code that sets a parameter.

/// Returns whether the encoder has a function with this code.
[[nodiscard]] constexpr bool is_known(std::uint8_t code) {
  return code == read || code == read_address || code == set_address || code == set_parameter;
}
}  // namespace function

/// Address (FF) to which a host sends the request that reads the encoder's address.
inline constexpr std::uint8_t any_address = 0xFF;

namespace parameter {
inline constexpr std::uint8_t zero = 0x00;      ///< Parameter of function CC that makes the present position zero.
inline constexpr std::uint8_t positive = 0x01;  ///< Parameter of function CC that sets the positive counting direction.
inline constexpr std::uint8_t negative = 0x02;  ///< Parameter of function CC that sets the negative counting direction.
}  // namespace parameter

/// Baud rates of the encoder in bits per second.
inline constexpr std::array<std::uint32_t, 5> bauds{2400, 4800, 9600, 19'200, 57'600};
/// Parameters of function CC that set the baud rates in `bauds`, in the same order.
inline constexpr std::array<std::uint8_t, bauds.size()> baud_parameters{0x24, 0x48, 0x96, 0x19, 0x57};
inline constexpr std::size_t baud_at_shipping = 3;  ///< Index in `bauds` of the baud rate at shipping.

/// Returns the meaning of a parameter of function CC in words, or "unknown".
[[nodiscard]] constexpr std::string_view name_of_setting(std::uint8_t value) {
  constexpr std::array<std::string_view, bauds.size()> baud_names{"2400 baud", "4800 baud", "9600 baud", "19200 baud",
                                                                  "57600 baud"};
  constexpr std::array<std::string_view, 3> names{"zero here", "positive direction", "negative direction"};
  if (value < names.size()) return names[value];
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (baud_parameters[i] == value) return baud_names[i];
  }
  return "unknown";
}

/// Returns the index of a baud rate in `bauds`; no value if the encoder does not have the rate.
[[nodiscard]] constexpr std::optional<std::size_t> baud_index(std::uint64_t baud) {
  for (std::size_t i = 0; i < bauds.size(); ++i) {
    if (bauds[i] == baud) return i;
  }
  return std::nullopt;
}

/// Line settings of an encoder as delivered.
inline constexpr LineSettings line_settings{.rate = bauds[baud_at_shipping]};

/// Form of the virtual encoder's reply to a request of two registers; the document has an example of each of the three
/// forms.
enum class Data : std::uint8_t {
  four_bytes,     ///< Reply with byte count 04 and four bytes of data.
  three_bytes,    ///< Reply with byte count 03 and three bytes of data.
  three_as_four,  ///< Reply with byte count 04, but only three bytes of data.
};

/// Frame layout and settings of one encoder, as the unit's options select them.
struct Format {
  std::uint8_t address = 1;  ///< Address of the encoder, 1 to 247.
  unsigned bits = 14;        ///< Number of bits of the position, 10 to 21.
  /// Number of registers that the host requests, 1 or 2; 0: as many as the bits of the position need.
  unsigned registers = 0;
  std::size_t baud = baud_at_shipping;  ///< Index of the baud rate in `bauds`.
  Data data = Data::four_bytes;         ///< Form of the virtual encoder's reply to a request of two registers.
  /// Byte order of the CRC in the virtual encoder's reply to the function A0, low_first or high_first.
  CrcOrder address_crc = CrcOrder::low_first;

  /// Returns the number of registers that the host requests.
  [[nodiscard]] constexpr unsigned register_count() const { return registers != 0 ? registers : bits > 16 ? 2 : 1; }
  /// Returns the line settings with the baud rate of the format.
  [[nodiscard]] constexpr LineSettings line() const { return {.rate = bauds[baud]}; }
  /// Returns the number of bits of the position.
  [[nodiscard]] constexpr Resolution resolution() const { return {.singleturn_bits = bits}; }
};

/// A request to the encoder.
struct Request {
  std::uint8_t function = function::read;  ///< Function code of the request.
  std::uint8_t address = 1;                ///< Address to which the request is sent.
  /// Only for set_address: the new address; only for set_parameter: the number of the parameter.
  std::uint8_t value = 0;
  std::uint16_t first_register = 0;  ///< Only for the function `read`: the first register to read.
  std::uint16_t registers = 1;       ///< Only for the function `read`: number of registers to read.
};

/// Buffer for the bytes of one request.
using RequestBytes = ByteBuffer<8>;

/// Returns the length in bytes of a request with a known function code.
[[nodiscard]] constexpr std::size_t request_length(std::uint8_t code) {
  if (code == function::read) return 8;
  return code == function::read_address ? 4 : 5;
}

/// Returns the bytes of `request`, with their CRC.
[[nodiscard]] constexpr RequestBytes encode_request(const Request& request) {
  RequestBytes bytes;
  bytes.push_back(request.address);
  bytes.push_back(request.function);
  if (request.function == function::read) {
    for (const std::uint16_t number : {request.first_register, request.registers}) {
      bytes.push_back(static_cast<std::uint8_t>(number >> 8));
      bytes.push_back(static_cast<std::uint8_t>(number));
    }
  } else if (request.function != function::read_address) {
    bytes.push_back(request.value);
  }
  modbus::append_crc(bytes);
  return bytes;
}

/// Returns a request that reads the position.
[[nodiscard]] constexpr Request read_request(const Format& format) {
  return {.address = format.address, .registers = static_cast<std::uint16_t>(format.register_count())};
}

/// Decodes a request. Errors: wrong_length, bad_checksum, unsupported, unexpected_reply.
[[nodiscard]] constexpr Result<Request> decode_request(Bytes bytes) {
  if (bytes.size() < modbus::shortest_frame) return Error::wrong_length;
  const std::uint8_t code = bytes[1];
  const bool known = function::is_known(code);
  if (known && bytes.size() != request_length(code)) return Error::wrong_length;
  if (modbus::crc_order(bytes) != CrcOrder::low_first) return Error::bad_checksum;
  if (!known) return Error::unsupported;
  Request request{.function = code, .address = bytes[0]};
  if (code == function::read_address && request.address != any_address) return Error::unexpected_reply;
  if (code == function::read) {
    request.first_register = static_cast<std::uint16_t>(bytes[2] << 8 | bytes[3]);
    request.registers = static_cast<std::uint16_t>(bytes[4] << 8 | bytes[5]);
  } else if (code != function::read_address) {
    request.value = bytes[2];
  }
  return request;
}

/// A decoded reply of the encoder.
struct Reply {
  std::uint8_t function = function::read;  ///< Function code of the reply.
  std::uint8_t address = 1;                ///< Address of the encoder; in the reply to set_address, the new address.
  std::uint32_t singleturn = 0;            ///< Only for the function `read`: position in counts.
  std::uint8_t value = 0;  ///< Number of the parameter that was set; only in the reply to the function `set_parameter`.
  CrcOrder order = CrcOrder::low_first;  ///< Byte order of the CRC in the reply.
  /// Only for the function `read`: length of the reply in bytes if the CRC cannot prove this length; otherwise 0.
  std::size_t doubtful_size = 0;
};

/// Returns whether a valid reply may have three or four bytes of data: its CRC fits both lengths.
[[nodiscard]] constexpr bool length_is_doubtful(Bytes reply) {
  return reply.size() > 7 && reply[1] == function::read && reply[2] == 4 && (reply.size() == 8 || reply.back() == 0);
}

/// Returns whether the length of the reply `first` stays in doubt after the reply `second` to the same request.
[[nodiscard]] constexpr bool differ_doubtfully(const Reply& first, const Reply& second) {
  return second.doubtful_size != 0 && second.doubtful_size != first.doubtful_size;
}

namespace detail {

// Returns the exception code if the reply refuses function 03 or A1; no value for any other reply.
constexpr std::optional<std::uint8_t> refusal_of(const Request& request, Bytes reply) {
  if (request.function != function::read && request.function != function::set_address) return std::nullopt;
  return modbus::refusal_code(reply, request.function);
}

// Returns whether the length of a reply to `read` fits its byte count and the request (3.1.7).
constexpr bool read_length_is_right(const Request& request, Bytes reply) {
  if (reply.size() < modbus::shortest_frame) return false;
  const std::size_t count = reply[2];
  if (request.registers != 2) return reply.size() == 5u + 2u * request.registers && count == 2u * request.registers;
  return (reply.size() == 9 && count == 4) || (reply.size() == 8 && (count == 3 || count == 4));
}

constexpr bool length_is_right(const Request& request, Bytes reply) {
  if (request.function == function::read) return read_length_is_right(request, reply);
  return reply.size() == (request.function == function::set_address ? 4u : 5u);
}

constexpr bool is_answer(const Request& request, Bytes reply) {
  if (reply[1] != request.function) return false;
  switch (request.function) {
    case function::read_address:
      return reply[0] == any_address;
    case function::set_address:
      return reply[0] == request.value;
    case function::set_parameter:
      return reply[0] == request.address && reply[2] == request.value;
    default:
      return reply[0] == request.address;
  }
}

}  // namespace detail

/// Decodes a reply with all checks. Errors: wrong_length, bad_checksum, unexpected_reply, request_rejected,
/// unsupported, out_of_range.
[[nodiscard]] constexpr Result<Reply> decode_reply(const Format& format, const Request& request, Bytes bytes) {
  const std::optional<std::uint8_t> refusal = detail::refusal_of(request, bytes);
  if (!refusal && !detail::length_is_right(request, bytes)) return Error::wrong_length;
  Reply reply{.function = request.function, .address = bytes[0], .order = modbus::crc_order(bytes)};
  // The document draws the CRC of the reply to function A0 as "MSB first", unlike all other CRCs.
  const bool either = request.function == function::read_address;
  if (reply.order == CrcOrder::wrong || (reply.order == CrcOrder::high_first && !either)) return Error::bad_checksum;
  if (refusal) return bytes[0] == request.address ? Error::request_rejected : Error::unexpected_reply;
  if (!detail::is_answer(request, bytes)) return Error::unexpected_reply;
  if (request.function == function::read) {
    if (request.first_register != 0 || request.registers == 0 || request.registers > 2) return Error::unsupported;
    const Bytes data = bytes.subspan(3, bytes.size() - 3 - modbus::crc_size);
    for (const std::uint8_t byte : data) reply.singleturn = reply.singleturn << 8 | byte;
    if (reply.singleturn >> format.bits != 0) return Error::out_of_range;
    if (length_is_doubtful(bytes)) reply.doubtful_size = bytes.size();
  } else if (request.function == function::read_address) {
    reply.address = bytes[2];
    if (reply.address < modbus::first_address || reply.address > modbus::last_address) return Error::out_of_range;
  } else if (request.function == function::set_parameter) {
    reply.value = bytes[2];
  }
  return reply;
}

/// Returns the request that a captured reply probably answers, if the capture does not contain the request.
[[nodiscard]] constexpr Request assumed_request(const Format& format, Bytes reply) {
  Request request = read_request(format);
  if (reply.size() < modbus::shortest_frame) return request;
  if (reply[1] == function::read) request.registers = reply[2] == 2 ? 1 : 2;
  if (reply[1] == function::read || !function::is_known(reply[1])) return request;
  request.function = reply[1];
  request.value = reply[1] == function::set_address ? reply[0] : reply[2];
  return request;
}

/// Returns the probable length in bytes of a reply that begins with `begun`.
[[nodiscard]] constexpr std::size_t reply_length(const Request& request, Bytes begun) {
  if (request.function == function::set_address) return 4;
  if (request.function != function::read) return 5;
  if (begun.size() > 1 && begun[1] == (function::read | modbus::refusal_bit)) return 5;
  if (request.registers != 2) return 5u + 2u * request.registers;
  return begun.size() > 2 && begun[2] == 3 ? 8 : 9;
}

// ---- Protocol of the host

/// Timeout of a reply, assumed: the document gives no reply time.
inline constexpr Time answer_limit = std::chrono::milliseconds(50);

/// Types, frames, lengths and times that the classes in absenc/protocol/author require.
struct Protocol {
  /// Frame layout and settings of one encoder, as the unit's options select them.
  using Format = rtu::Format;
  /// C++ type of the requests to the encoder.
  using Request = rtu::Request;
  /// C++ type of the encoder's replies.
  using Reply = rtu::Reply;
  static constexpr std::size_t longest_reply = 9;  ///< Greatest length of a reply in bytes.

  /// Returns a host's timeouts and pauses on a line with this baud rate.
  static constexpr author::HostTimes host_times(const Format&, std::uint32_t rate) {
    return modbus::client_times({.rate = rate}, answer_limit);
  }
  /// Returns a host's timeouts and pauses on a line with the baud rate of the format.
  static constexpr author::HostTimes host_times(const Format& format) { return host_times(format, format.line().rate); }
  /// Returns how a request is sent: once, unless a procedure repeats it, because each setting wears the memory.
  static constexpr author::Manner manner(const Format&, const Request&) { return {}; }
  /// Returns the bytes of `request` as they are sent.
  static constexpr RequestBytes encode(const Format&, const Request& request) { return encode_request(request); }
  /// Decodes a request; returns an error if its bytes are invalid.
  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) { return rtu::decode_request(bytes); }
  /// Returns the probable length in bytes of the complete reply to `request`; `reply` has the bytes received so far.
  static constexpr std::size_t expected(const Format&, const Request& request, Bytes reply) {
    return reply_length(request, reply);
  }
  /// Returns false: a reply with an error may be incomplete, so the host awaits more bytes.
  static constexpr bool is_whole(const Format&, Error) { return false; }
  /// Decodes a reply with all checks; returns the first error if one fails.
  static constexpr Result<Reply> decode(const Format& format, const Request& request, Bytes bytes) {
    return decode_reply(format, request, bytes);
  }
  /// Converts a reply to a reading; the reading is empty for other functions than `read`.
  static constexpr Reading reading(const Format& format, const Request& request, const Reply& reply) {
    if (request.function != function::read) return {};
    return author::position_reading(reply.singleturn, format.bits);
  }
  /// Returns `sent_at`, the end of the request, as the time at which the encoder latched the position; the document
  /// does not state that time.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }
  /// Returns whether a second reply must confirm this reply, because its length is in doubt.
  static constexpr bool needs_another(const Format&, const Reply& reply) { return reply.doubtful_size != 0; }
  /// Returns wrong_length if the length of the first reply is still in doubt after the second reply, otherwise none.
  static constexpr Error agree(const Format&, const Reply& first, const Reply& second, Time) {
    return differ_doubtfully(first, second) ? Error::wrong_length : Error::none;
  }
};

/// Reads a position with function 03, twice if the CRC does not prove the length of the reply.
using ReadPosition = author::ReadConfirmed<Protocol>;

}  // namespace absenc::raa38::rtu
