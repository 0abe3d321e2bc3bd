// SPDX-License-Identifier: Apache-2.0
// Replies of the HIPERFACE parameter channel: encoding, decoding, all checks, and the reading of a valid reply.
// README.md draws the replies.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/hiperface/request.hpp"

namespace absenc::hiperface {

/// A decoded reply. Members that its command does not carry are 0.
struct Reply {
  std::uint8_t address = first_address;  ///< Address of the encoder that sent the reply.
  bool has_error = false;  ///< Whether the reply has the error bit: the encoder has an error or a warning.
  /// Value of the reply, by command: position, analog value, counter, free memory, status code, or status of a data
  /// field.
  std::uint32_t value = 0;
  std::array<std::uint8_t, 4> label{};  ///< Type label: interface setting, type, memory in blocks of 16 bytes, options.
  FieldBytes data{};                    ///< Bytes of a data field, or characters of serial number and program version.
  std::uint32_t alarms = 0;  ///< Mask of the alarms in the status replies that a capture joins to a position.
  /// For a position that is joined to status replies: whether the encoder may report another status code that makes the
  /// position invalid, because the last joined code names an alarm for the first time or is in no source.
  bool is_open = false;
};

/// Returns whether `reply` begins like a refusal: it has the command of the status, although another command was
/// requested.
[[nodiscard]] constexpr bool begins_refusal(CommandCode asked, Bytes reply) {
  return asked != CommandCode::status && reply.size() > 1 &&
         (reply[1] & ~error_bit) == static_cast<unsigned>(CommandCode::status);
}

/// Returns the greatest length in bytes of a reply to `request` that is no refusal; 0 if the encoder does not answer
/// the request.
[[nodiscard]] constexpr std::size_t reply_length(const Format& format, const Request& request) {
  if (request.command == CommandCode::reset) return 0;
  const std::size_t size = data_sizes(format, static_cast<std::uint8_t>(request.command))->reply;
  return shortest_frame + size + (request.command == CommandCode::read_data ? request.count : 0u);
}

/// Returns the bytes of `request` that the encoder's reply may repeat behind its command.
[[nodiscard]] constexpr ByteBuffer<3> echo_of(const Request& request) {
  ByteBuffer<3> echo;
  switch (request.command) {
    case CommandCode::read_data:
    case CommandCode::store_data:
      for (const std::uint8_t byte : {request.subject, request.first, request.count}) echo.push_back(byte);
      break;
    case CommandCode::create_field:
      echo.push_back(request.subject);
      echo.push_back(request.new_value);
      break;
    case CommandCode::analog_value:
    case CommandCode::field_status:
    case CommandCode::access_code:
    case CommandCode::set_address:
    case CommandCode::interface:
      echo.push_back(request.subject);
      break;
    default:
      break;
  }
  return echo;
}

/// Returns the bytes of a reply.
[[nodiscard]] constexpr ReplyBytes encode_reply(const Format& format, const Request& request, const Reply& reply) {
  ReplyBytes bytes;
  bytes.push_back(reply.address);
  bytes.push_back(
      static_cast<std::uint8_t>(static_cast<unsigned>(request.command) | (reply.has_error ? error_bit : 0)));
  bytes.append(echo_of(request).view());
  switch (request.command) {
    case CommandCode::position:
      detail::append_big_endian(bytes, reply.value, 4);
      break;
    case CommandCode::analog_value:
      detail::append_big_endian(bytes, reply.value, 2);
      break;
    case CommandCode::counter:
      detail::append_big_endian(bytes, reply.value, format.counter_bytes);
      break;
    case CommandCode::field_status:
      detail::append_big_endian(bytes, reply.value, 1);
      break;
    case CommandCode::free_memory:
      detail::append_big_endian(bytes, reply.value, format.free_bytes);
      break;
    case CommandCode::status:
      detail::append_big_endian(bytes, reply.value, format.status_bytes);
      break;
    case CommandCode::type_label:
      bytes.append(reply.label);
      break;
    case CommandCode::read_data:
    case CommandCode::serial_number:
      bytes.append(reply.data);
      break;
    default:
      break;
  }
  bytes.push_back(checksum(bytes));
  return bytes;
}

/// Returns the bytes with which an encoder refuses a request: a status with the error bit instead of the reply.
[[nodiscard]] constexpr ReplyBytes encode_refusal(const Format& format, std::uint8_t address, std::uint8_t code) {
  return encode_reply(format, {.command = CommandCode::status}, {.address = address, .has_error = true, .value = code});
}

namespace detail {
constexpr bool is_sender(const Request& request, std::uint8_t address) {
  if (address == request.address) return true;
  // The reply to a request that assigns an address may already have the new address.
  if (request.command == CommandCode::set_address && address == request.subject) return true;
  return request.address == broadcast_address && is_address(address);
}

constexpr Error check_frame(const Format& format, const Request& request, Bytes bytes) {
  const bool refused = begins_refusal(request.command, bytes);
  const std::size_t length = refused ? shortest_frame + format.status_bytes : reply_length(format, request);
  const DataSizes sizes = *data_sizes(format, static_cast<std::uint8_t>(request.command));
  const bool open =
      !refused && sizes.least < sizes.reply && bytes.size() >= shortest_frame + sizes.least && bytes.size() <= length;
  if (!open && bytes.size() != length) return Error::wrong_length;
  if (checksum(bytes) != 0) return Error::bad_checksum;
  if (!is_sender(request, bytes[0])) return Error::unexpected_reply;
  if (refused) return Error::request_rejected;
  return (bytes[1] & ~error_bit) == static_cast<unsigned>(request.command) ? Error::none : Error::unexpected_reply;
}
}  // namespace detail

/// Returns the numbers of bits of position and turns that the description in data field FF states; 0 and 0 if they are
/// no powers of two or are outside the range of the unit.
[[nodiscard]] constexpr Resolution resolution_in(Bytes description) {
  const std::uint64_t periods = load_big_endian(description.subspan(2, 4));
  const std::uint64_t turns = std::max<std::uint64_t>(load_big_endian(description.subspan(6, 4)), 1);
  if (!std::has_single_bit(periods) || !std::has_single_bit(turns)) return {};
  const auto singleturn_bits = static_cast<unsigned>(std::countr_zero(periods)) + least_singleturn_bits;
  const auto multiturn_bits = static_cast<unsigned>(std::countr_zero(turns));
  if (singleturn_bits > most_singleturn_bits || multiturn_bits > most_multiturn_bits) return {};
  return {singleturn_bits, multiturn_bits};
}

namespace detail {
// Returns the resolution that a type label or a description reports and that must agree with the options; 0 and 0 if
// the reply reports none or any resolution is accepted.
constexpr Resolution reported_resolution(const Request& request, const Reply& reply) {
  if (request.any_resolution) return {};
  if (request.command == CommandCode::type_label) return resolution_of_type(reply.label[1]);
  const bool is_description = request.command == CommandCode::read_data && request.subject == description_field &&
                              request.first == 0 && reply.data.size() >= description_size;
  return is_description ? resolution_in(reply.data) : Resolution{};
}
}  // namespace detail

namespace detail {
// Checks and decodes one frame, which has at least one byte.
[[nodiscard]] constexpr Result<Reply> decode_frame(const Format& format, const Request& request, Bytes bytes) {
  if (const Error error = check_frame(format, request, bytes); error != Error::none) return error;
  const Bytes data = bytes.subspan(2, bytes.size() - shortest_frame);
  const ByteBuffer<3> echo = echo_of(request);
  const std::size_t repeated = std::min(echo.size(), data.size());
  for (std::size_t i = 0; i < repeated; ++i) {
    if (data[i] != echo[i]) return Error::unexpected_reply;
  }
  Reply reply{.address = bytes[0], .has_error = (bytes[1] & error_bit) != 0};
  const Bytes rest = data.subspan(repeated);
  switch (request.command) {
    case CommandCode::position:
      reply.value = static_cast<std::uint32_t>(load_big_endian(rest));
      if (std::uint64_t{reply.value} >> format.position_bits() != 0) return Error::out_of_range;
      break;
    case CommandCode::status:
      reply.value = static_cast<std::uint32_t>(load_big_endian(rest));
      if (reply.value > 0xFF) return Error::out_of_range;
      break;
    case CommandCode::analog_value:
    case CommandCode::counter:
    case CommandCode::field_status:
    case CommandCode::free_memory:
      reply.value = static_cast<std::uint32_t>(load_big_endian(rest));
      break;
    case CommandCode::type_label:
      std::copy_n(rest.begin(), reply.label.size(), reply.label.begin());
      break;
    case CommandCode::read_data:
    case CommandCode::serial_number:
      reply.data.append(rest);
      break;
    default:
      break;
  }
  if (format.contradicts(reported_resolution(request, reply))) return Error::unexpected_reply;
  return reply;
}
}  // namespace detail

/// Checks and decodes a reply. Checks in this order: length, checksum, address, refusal, command, repeated bytes,
/// range, and that a type label or a description agrees with the resolution of the options. Returns the decoded reply,
/// or the error of the first failed check.
[[nodiscard]] constexpr Result<Reply> decode_reply(const Format& format, const Request& request, Bytes bytes) {
  if (bytes.empty()) return Error::timeout;
  if (request.statuses == 0) return detail::decode_frame(format, request, bytes);
  const Request position{.address = request.address};
  const Request status{.command = CommandCode::status, .address = request.address};
  const std::size_t first = reply_length(format, position);
  const std::size_t each = reply_length(format, status);
  if (bytes.size() != first + request.statuses * each) return Error::wrong_length;
  Result<Reply> joined = detail::decode_frame(format, position, bytes.first(first));
  for (std::size_t at = first; joined && at < bytes.size(); at += each) {
    const Result<Reply> code = detail::decode_frame(format, status, bytes.subspan(at, each));
    if (!code) return code.error();
    const auto number = static_cast<std::uint8_t>(code->value);
    joined->is_open = (alarm_of(number) & ~joined->alarms) != 0 || is_unexplained(number);
    joined->alarms |= alarm_of(number);
  }
  return joined;
}

/// Sets the alarms of the reading, and makes the parts invalid that these alarms affect.
constexpr void judge(Reading& reading, std::uint32_t raised, std::uint32_t reported) {
  reading.alarms = raised;
  reading.alarms_reported = reported;
  const std::uint32_t errors = raised & ~warnings;
  reading.singleturn_valid_bits = (errors & ~turns_lost) == 0 ? reading.singleturn_bits : 0;
  reading.multiturn_valid = errors == 0;
  reading.singleturn_known = reading.multiturn_known = true;
}

/// Sets the validity of position and turns in a reading to unknown where they count as valid.
constexpr void doubt(Reading& reading) {
  if (std::exchange(reading.singleturn_valid_bits, 0) != 0) reading.singleturn_known = false;
  if (std::exchange(reading.multiturn_valid, false)) reading.multiturn_known = false;
}

/// Returns the position and turns of a valid reply to the command 42 (read position); an empty reading for any other
/// reply. If the reply has the error bit, only the status that is joined to it can show whether the position is valid.
[[nodiscard]] constexpr Reading to_reading(const Format& format, const Request& request, const Reply& reply) {
  if (request.command != CommandCode::position) return {};
  const Resolution bits = format.resolution();
  Reading reading{.singleturn = reply.value & low_mask(bits.singleturn_bits),
                  .multiturn = std::uint64_t{reply.value} >> bits.singleturn_bits,
                  .singleturn_bits = bits.singleturn_bits,
                  .multiturn_bits = bits.multiturn_bits,
                  .status = reply.has_error ? 1u : 0u,
                  .status_reported = 1};
  if (reply.alarms != 0) {
    judge(reading, reply.alarms, reply.alarms);
    if (reply.is_open) doubt(reading);
  } else {
    judge(reading, 0, reply.has_error ? 0 : all_alarms);
    if (reply.has_error) doubt(reading);
  }
  return reading;
}

/// The functions of HIPERFACE that the engines and virtual encoders of absenc/protocol/author require.
struct Protocol {
  /// Format of the encoder: the values of its options.
  using Format = hiperface::Format;
  /// C++ type of the protocol's requests.
  using Request = hiperface::Request;
  /// C++ type of the protocol's replies.
  using Reply = hiperface::Reply;
  static constexpr std::size_t longest_reply = reply_capacity;  ///< Greatest length of a reply in bytes.

  /// Returns the timeouts and the pause of a host. The timeouts grow with the duration of a character, because encoders
  /// may measure their times in bits.
  static constexpr author::HostTimes host_times(const Format& format) {
    const Time character = format.line().character();
    return {.answer_limit = read_limit + reply_characters * character,
            .gap_limit = reply_characters * character,
            // The host must not give up within the longest reply, which takes 2.5 s at 600 baud.
            .patience = noise_limit + static_cast<int>(reply_capacity) * character,
            .pause = request_pause};
  }
  /// Returns how a request is sent: up to three times if it reads, once if it stores something or is the reset. A reply
  /// is accepted only if silence follows it, because an unexpected echo together with the first bytes of the reply can
  /// be a valid reply (README.md, What is checked).
  static constexpr author::Manner manner(const Format& format, const Request& request) {
    if (request.command == CommandCode::reset) return {.expects_reply = false};
    if (!stores(request.command)) return {.repeats = 2, .ends_by_silence = true};
    return {.ends_by_silence = true,
            .answer_limit = store_limit + reply_characters * format.line().character(),
            .hold = store_limit};
  }
  /// Returns the bytes of a request.
  static constexpr RequestBytes encode(const Format&, const Request& request) { return encode_request(request); }
  /// Returns the length in bytes of the reply to the request; its first bytes `so_far` show whether it is a refusal.
  static constexpr std::size_t expected(const Format& format, const Request& request, Bytes so_far) {
    return begins_refusal(request.command, so_far) ? shortest_frame + format.status_bytes
                                                   : reply_length(format, request);
  }
  /// Checks and decodes the bytes of a reply; returns the reply or the error of the first failed check.
  static constexpr auto decode = decode_reply;
  /// Returns whether a reply with this error is complete: only a refusal is.
  static constexpr bool is_whole(const Format&, Error error) { return error == Error::request_rejected; }
  /// Returns the position and turns of a valid reply.
  static constexpr auto reading = to_reading;
  /// Returns `sent_at`, the end of the request, as the time at which the encoder latched the position; no source states
  /// that time.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }

  /// Decodes a request. Returns the request, or the error of the first failed check.
  static constexpr auto decode_request = hiperface::decode_request;
  /// Returns the length in bytes of the request that begins with `begin`. Returns the number of bytes needed to know it
  /// if there are fewer, and 0 if no request begins so.
  static constexpr auto request_size = request_length;
  /// Returns the greatest length in bytes of the reply to `request`; 0 if the encoder does not answer it.
  static constexpr auto reply_size = reply_length;
  /// Returns the times of a virtual encoder: until its reply, from power on until it answers, and until it drops an
  /// incomplete request.
  static constexpr author::DeviceTimes device_times(const Format& format) {
    const Time character = format.line().character();
    return {character, answer_time, start_time, reply_characters * character};
  }
};

}  // namespace absenc::hiperface
