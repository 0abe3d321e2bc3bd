// SPDX-License-Identifier: Apache-2.0
// Requests of the HIPERFACE parameter channel: encoding, decoding, lengths. README.md draws the requests.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/hiperface/format.hpp"

namespace absenc::hiperface {

/// Length in bytes of the shortest frame: address, command, checksum.
inline constexpr std::size_t shortest_frame = 3;
/// Length in bytes of the longest request, which stores a whole data field.
inline constexpr std::size_t request_capacity = 7 + field_capacity;
/// Length in bytes of the longest reply, which has a whole data field.
inline constexpr std::size_t reply_capacity = 6 + field_capacity;
/// Buffer for the bytes of a request.
using RequestBytes = ByteBuffer<request_capacity>;
/// Buffer for the bytes of a reply.
using ReplyBytes = ByteBuffer<reply_capacity>;
/// Buffer for the bytes of a data field.
using FieldBytes = ByteBuffer<field_capacity>;

/// Returns the checksum of `bytes`, their exclusive OR; 0 if `bytes` is a frame with its right checksum.
[[nodiscard]] constexpr std::uint8_t checksum(Bytes bytes) {
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : bytes) sum ^= byte;
  return sum;
}

/// Returns whether a frame can begin with this byte: the address of an encoder, or the address that all encoders
/// answer.
[[nodiscard]] constexpr bool is_address(std::uint8_t byte) {
  return (byte >= first_address && byte <= last_address) || byte == broadcast_address;
}

/// A request. Members that its command does not carry are 0.
struct Request {
  CommandCode command = CommandCode::position;  ///< Command of the request.
  std::uint8_t address = first_address;         ///< Address of the encoder, or `broadcast_address`.
  /// The first byte behind the command: an analog channel, a data field, the number of an access code, a new address or
  /// a new interface setting.
  std::uint8_t subject = 0;
  std::uint8_t first = 0;  ///< If the command reads or stores data: first address in the data field.
  std::uint8_t count = 0;  ///< If the command reads or stores data: number of bytes, 1 to 128.
  std::uint8_t code = 0;   ///< Access code that the command needs; for command 4F (change an access code) the old code.
  /// For command 4D (create a data field): its status; for 4F (change an access code): the new code.
  std::uint8_t new_value = 0;
  std::uint32_t position = 0;  ///< For command 43 (set position): the position that the encoder shall have.
  FieldBytes data{};           ///< For command 4B (store data): the bytes to store.
  /// For command 42 (read position): number of requests for the status that a capture joins to this request; 0 in a
  /// request of a host.
  std::uint8_t statuses = 0;
  /// For type label and description: whether a reply with another resolution than that of the options is accepted. This
  /// is not sent.
  bool any_resolution = false;
};

/// Returns whether requests with this command store something in the encoder.
[[nodiscard]] constexpr bool stores(CommandCode command) {
  switch (command) {
    case CommandCode::set_position:
    case CommandCode::count_up:
    case CommandCode::clear_counter:
    case CommandCode::store_data:
    case CommandCode::create_field:
    case CommandCode::access_code:
    case CommandCode::set_address:
    case CommandCode::interface:
      return true;
    default:
      return false;
  }
}

/// Numbers of bytes between the command code and the checksum, in the request and the reply of one command.
struct DataSizes {
  std::uint8_t request = 0;  ///< Number of bytes in the request; for command 4B without the bytes to store.
  std::uint8_t reply = 0;    ///< Number of bytes in the reply; for command 4A without the bytes that were read.
  /// Least number of bytes in the reply. It is smaller than `reply` for commands of which no source shows a reply: such
  /// a reply may or may not repeat bytes of the request.
  std::uint8_t least = 0;
};

/// Returns the numbers of bytes of the command with this code; no value if there is no such command.
[[nodiscard]] constexpr std::optional<DataSizes> data_sizes(const Format& format, std::uint8_t code) {
  switch (static_cast<CommandCode>(code)) {
    case CommandCode::position:
      return DataSizes{0, 4, 4};
    case CommandCode::set_position:
      return DataSizes{5, 0, 0};
    case CommandCode::analog_value:
      return DataSizes{1, 3, 3};
    case CommandCode::counter:
      return DataSizes{0, format.counter_bytes, format.counter_bytes};
    case CommandCode::count_up:
    case CommandCode::reset:
      return DataSizes{0, 0, 0};
    case CommandCode::clear_counter:
      return DataSizes{1, 0, 0};
    case CommandCode::read_data:
    case CommandCode::store_data:
      return DataSizes{4, 3, 3};
    case CommandCode::field_status:
      return DataSizes{1, 2, 2};
    case CommandCode::create_field:
      return DataSizes{3, 2, 0};
    case CommandCode::free_memory:
      return DataSizes{0, format.free_bytes, format.free_bytes};
    case CommandCode::access_code:
      return DataSizes{3, 1, 0};
    case CommandCode::status:
      return DataSizes{0, format.status_bytes, format.status_bytes};
    case CommandCode::type_label:
      return DataSizes{0, 4, 4};
    case CommandCode::set_address:
    case CommandCode::interface:
      return DataSizes{2, 1, 0};
    case CommandCode::serial_number: {
      const auto size = static_cast<std::uint8_t>(format.serial_bytes + format.version_bytes);
      return DataSizes{0, size, size};
    }
  }
  return std::nullopt;
}

namespace detail {
constexpr void append_big_endian(auto& bytes, std::uint32_t value, unsigned size) {
  for (unsigned i = size; i-- > 0;) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}
// Appends the bytes that a request has between command and checksum.
constexpr void append_data(RequestBytes& bytes, const Request& request) {
  switch (request.command) {
    case CommandCode::set_position:
      append_big_endian(bytes, request.position, 4);
      bytes.push_back(request.code);
      break;
    case CommandCode::clear_counter:
      bytes.push_back(request.code);
      break;
    case CommandCode::analog_value:
    case CommandCode::field_status:
      bytes.push_back(request.subject);
      break;
    case CommandCode::read_data:
    case CommandCode::store_data:
      for (const std::uint8_t byte : {request.subject, request.first, request.count, request.code}) {
        bytes.push_back(byte);
      }
      if (request.command == CommandCode::store_data) bytes.append(request.data);
      break;
    case CommandCode::create_field:
      for (const std::uint8_t byte : {request.subject, request.new_value, request.code}) bytes.push_back(byte);
      break;
    case CommandCode::access_code:
      for (const std::uint8_t byte : {request.subject, request.code, request.new_value}) bytes.push_back(byte);
      break;
    case CommandCode::set_address:
    case CommandCode::interface:
      bytes.push_back(request.subject);
      bytes.push_back(request.code);
      break;
    default:
      break;
  }
}
}  // namespace detail

namespace detail {
// Appends the frame of a request, without the requests for the status that a capture joins to this request.
constexpr void append_frame(RequestBytes& bytes, const Request& request) {
  const std::size_t begin = bytes.size();
  bytes.push_back(request.address);
  bytes.push_back(static_cast<std::uint8_t>(request.command));
  append_data(bytes, request);
  bytes.push_back(checksum(bytes.view().subspan(begin)));
}
}  // namespace detail

/// Returns the bytes of a request, with the requests for the status that a capture joins to it.
[[nodiscard]] constexpr RequestBytes encode_request(const Request& request) {
  RequestBytes bytes;
  detail::append_frame(bytes, request);
  const Request status{.command = CommandCode::status, .address = request.address};
  for (unsigned i = 0; i < request.statuses; ++i) detail::append_frame(bytes, status);
  return bytes;
}

/// Returns the length in bytes of the request that begins with `begin`. Returns the number of bytes needed to know it
/// if there are fewer, and 0 if no request begins so.
[[nodiscard]] constexpr std::size_t request_length(const Format& format, Bytes begin) {
  if (!is_address(begin[0])) return 0;
  if (begin.size() < 2) return 2;
  const std::optional<DataSizes> sizes = data_sizes(format, begin[1]);
  if (!sizes) return 0;
  if (begin[1] != static_cast<std::uint8_t>(CommandCode::store_data)) return shortest_frame + sizes->request;
  if (begin.size() < 5) return 5;
  if (begin[4] == 0 || begin[4] > field_capacity) return 0;
  return shortest_frame + sizes->request + begin[4];
}

/// Decodes a request for the position with joined requests for the status; no value if the bytes are anything else.
/// `bytes` must have at least 3 bytes.
[[nodiscard]] constexpr std::optional<Request> decode_joined(Bytes bytes) {
  const Request request{.address = bytes[0], .statuses = static_cast<std::uint8_t>(bytes.size() / shortest_frame - 1)};
  // The limit is one more than the number of alarms, because the last status may repeat a code.
  if (request.statuses > alarms.size() + 1) return {};
  const RequestBytes joined = encode_request(request);
  if (!std::equal(bytes.begin(), bytes.end(), joined.view().begin(), joined.view().end())) return {};
  return request;
}

/// Decodes a request. Errors: wrong_length; unexpected_reply (the first byte is no address, or there is no such
/// command); bad_checksum; out_of_range (a number of bytes that no data field has).
[[nodiscard]] constexpr Result<Request> decode_request(const Format& format, Bytes bytes) {
  if (bytes.size() < shortest_frame) return Error::wrong_length;
  if (!is_address(bytes[0]) || !data_sizes(format, bytes[1])) return Error::unexpected_reply;
  if (const std::optional<Request> joined = decode_joined(bytes)) return *joined;
  const std::size_t length = request_length(format, bytes);
  if (length != 0 && bytes.size() != length) return Error::wrong_length;
  if (checksum(bytes) != 0) return Error::bad_checksum;
  if (length == 0) return Error::out_of_range;
  Request request{.command = static_cast<CommandCode>(bytes[1]), .address = bytes[0]};
  const Bytes data = bytes.subspan(2, bytes.size() - shortest_frame);
  switch (request.command) {
    case CommandCode::set_position:
      request.position = static_cast<std::uint32_t>(load_big_endian(data.first(4)));
      request.code = data[4];
      break;
    case CommandCode::clear_counter:
      request.code = data[0];
      break;
    case CommandCode::analog_value:
    case CommandCode::field_status:
      request.subject = data[0];
      break;
    case CommandCode::read_data:
    case CommandCode::store_data:
      request.subject = data[0];
      request.first = data[1];
      request.count = data[2];
      request.code = data[3];
      if (request.count == 0 || request.count > field_capacity) return Error::out_of_range;
      if (request.command == CommandCode::store_data) request.data.append(data.subspan(4));
      break;
    case CommandCode::create_field:
      request.subject = data[0];
      request.new_value = data[1];
      request.code = data[2];
      break;
    case CommandCode::access_code:
      request.subject = data[0];
      request.code = data[1];
      request.new_value = data[2];
      break;
    case CommandCode::set_address:
    case CommandCode::interface:
      request.subject = data[0];
      request.code = data[1];
      break;
    default:
      break;
  }
  return request;
}

}  // namespace absenc::hiperface
