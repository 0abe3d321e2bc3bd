// SPDX-License-Identifier: Apache-2.0
// Frames and readings of the T-format; README.md draws the frames. Numbers of paragraphs are those of the TS5700N8500
// specification.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/crc.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/author/in_a_row.hpp"
#include "absenc/protocol/tformat/format.hpp"

namespace absenc::tformat {

inline constexpr std::uint8_t busy_bit = 0x80;  ///< busy bit in the address field (ADF) of replies
/// Number of valid bits of the position while the alarm full_absolute_status is raised (5.4.1).
inline constexpr unsigned full_absolute_bits = 5;
inline constexpr std::size_t request_capacity = 4;  ///< Length of the longest request in bytes.
inline constexpr std::size_t reply_capacity = 11;   ///< Length of the longest reply in bytes.
/// Buffer for the bytes of a request.
using RequestBytes = ByteBuffer<request_capacity>;
/// Buffer for the bytes of a reply.
using ReplyBytes = ByteBuffer<reply_capacity>;

/// Parameters of the CRC (6.3.4), which is the exclusive OR of all bytes.
inline constexpr CrcParameters crc_parameters{8, 0x01, 0, true, true, 0};

/// Returns the CRC of `bytes` (6.3.4); 0 if `bytes` is a frame with its right CRC.
[[nodiscard]] constexpr std::uint8_t checksum(Bytes bytes) {
  return std::reduce(bytes.begin(), bytes.end(), std::uint8_t{0},
                     [](std::uint8_t one, std::uint8_t other) -> std::uint8_t { return one ^ other; });
}

/// Returns the control field (CF) of a request: sync code 010, the data ID, and its even parity (6.3.1).
[[nodiscard]] constexpr std::uint8_t control_field(std::uint8_t id) {
  // Bit N of this constant is set if the data ID N has an odd number of ones.
  constexpr unsigned odd_parities = 0x6996;
  return static_cast<std::uint8_t>(0x02u | (id & 0xFu) << 3 | (odd_parities >> (id & 0xF) & 1) << 7);
}
/// Returns the control field (CF) of a request with this data ID.
[[nodiscard]] constexpr std::uint8_t control_field(DataId id) { return control_field(static_cast<std::uint8_t>(id)); }

/// Returns whether a control field has the right sync code.
[[nodiscard]] constexpr bool has_sync_code(std::uint8_t field) { return (field & 0x07) == 0x02; }

/// Returns whether requests with this data ID read or write the memory.
[[nodiscard]] constexpr bool is_memory_access(DataId id) {
  return id == DataId::read_memory || id == DataId::write_memory;
}
/// Rules for the requests of a reset (paragraph 10). The paragraph does not state from which point of a request to
/// which point of the next one the 40 us are measured.
inline constexpr author::InARow reset_row{
    .requests = reset_requests,
    .interval = reset_interval,
    .accepted = reset_interval,
    .number_rule = "reset not sent ten times in a row",
    .interval_rule = "reset sent too fast: less than 40 us after the one before",
};
/// Returns whether ten consecutive requests with this data ID are a reset (10).
[[nodiscard]] constexpr bool is_reset(DataId id) {
  return id == DataId::clear_alarms || id == DataId::zero || id == DataId::reset_multiturn;
}

namespace detail {
// Lengths in bytes of request and reply of one data ID; 0: Table 1 does not list the ID.
struct Lengths {
  std::uint8_t request = 0;
  std::uint8_t reply = 0;
};
inline constexpr std::array<Lengths, 16> lengths = [] {
  std::array<Lengths, 16> table{};
  for (const std::size_t id : {0x0u, 0x1u, 0x7u, 0x8u, 0xCu}) table[id] = {1, 6};
  table[0x2] = {1, 4};
  table[0x3] = {1, 11};
  table[0x6] = {4, 4};
  table[0xD] = {3, 4};
  return table;
}();
}  // namespace detail

/// Returns the length in bytes of a request with this data ID; 0: Table 1 does not list the ID.
[[nodiscard]] constexpr std::size_t request_length(DataId id) {
  return detail::lengths[static_cast<std::size_t>(id)].request;
}
/// Returns the length in bytes of the reply to this data ID; 0: Table 1 does not list the ID.
[[nodiscard]] constexpr std::size_t reply_length(DataId id) {
  return detail::lengths[static_cast<std::size_t>(id)].reply;
}

/// Returns the data ID in the control field `field`, whose parity is not checked. No value for an ID that Table 1 does
/// not list.
[[nodiscard]] constexpr std::optional<DataId> data_id(std::uint8_t field) {
  const auto id = static_cast<DataId>((field >> 3) & 0xF);
  return request_length(id) != 0 ? std::optional(id) : std::nullopt;
}

/// A request of the T-format.
struct Request {
  DataId id = DataId::everything;  ///< Data ID of the request.
  std::uint8_t address = 0;        ///< for data IDs that access the memory: address of the byte, 0 to 127
  std::uint8_t value = 0;          ///< for data ID write_memory: byte to be written
};

/// Returns whether a request selects a page of the memory.
[[nodiscard]] constexpr bool selects_page(const Request& request) {
  return request.id == DataId::write_memory && request.address == page_select_address;
}

/// A reply of an encoder. In a decoded reply, members that its data ID does not carry are 0.
struct Reply {
  DataId id = DataId::everything;  ///< Data ID of the reply.
  std::uint8_t status = 0;         ///< Status field (SF): bits of the namespace `status`.
  std::uint8_t address = 0;        ///< Address of the memory byte (ADF).
  bool busy = false;               ///< Whether the memory is busy, so that the request was not executed.
  std::uint32_t singleturn = 0;    ///< Position within the turn, in counts (ABS).
  std::uint32_t multiturn = 0;     ///< Number of turns (ABM).
  std::uint8_t encoder_id = 0;     ///< Kind of the encoder, its encoder id (ENID).
  std::uint8_t alarms = 0;         ///< Alarms (ALMC): bits of the namespace `alarms`.
  std::uint8_t value = 0;          ///< Value of the memory byte (EDF).
};

/// Returns the bytes of a request.
[[nodiscard]] constexpr RequestBytes encode_request(const Request& request) {
  RequestBytes bytes;
  bytes.push_back(control_field(request.id));
  if (!is_memory_access(request.id)) return bytes;
  bytes.push_back(request.address & 0x7F);
  if (request.id == DataId::write_memory) bytes.push_back(request.value);
  bytes.push_back(checksum(bytes));
  return bytes;
}

/// Decodes a request. Errors: wrong_length, bad_framing, bad_checksum, unsupported, out_of_range.
[[nodiscard]] constexpr Result<Request> decode_request(Bytes bytes) {
  if (bytes.empty()) return Error::wrong_length;
  if (!has_sync_code(bytes[0])) return Error::bad_framing;
  // The parity is checked before the length, because the length depends on the data ID.
  if (bytes[0] != control_field(bytes[0] >> 3)) return Error::bad_checksum;
  const std::optional<DataId> id = data_id(bytes[0]);
  if (!id) return Error::unsupported;
  if (bytes.size() != request_length(*id)) return Error::wrong_length;
  if (!is_memory_access(*id)) return Request{*id};
  if (checksum(bytes) != 0) return Error::bad_checksum;
  if ((bytes[1] & busy_bit) != 0) return Error::out_of_range;
  return Request{*id, bytes[1], *id == DataId::write_memory ? bytes[2] : std::uint8_t{0}};
}

/// Returns the bytes of a reply.
[[nodiscard]] constexpr ReplyBytes encode_reply(const Reply& reply) {
  std::array<std::uint8_t, reply_capacity> frame{control_field(reply.id), reply.status};
  const auto store = [&frame](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 3; ++i) frame[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  };
  if (is_memory_access(reply.id)) {
    frame[1] = static_cast<std::uint8_t>((reply.address & 0x7F) | (reply.busy ? busy_bit : 0));
    frame[2] = reply.value;
  } else if (reply.id == DataId::encoder_id) {
    frame[2] = reply.encoder_id;
  } else {
    store(2, reply.id == DataId::multiturn ? reply.multiturn : reply.singleturn);
  }
  if (reply.id == DataId::everything) {
    frame[5] = reply.encoder_id;
    store(6, reply.multiturn);
    frame[9] = reply.alarms;
  }
  const std::size_t length = reply_length(reply.id);
  frame[length - 1] = checksum(Bytes(frame).first(length - 1));
  ReplyBytes bytes;
  bytes.append(Bytes(frame).first(length));
  return bytes;
}

/// Returns the bits of the status field (SF) that the alarms `almc` set (6.3.2).
[[nodiscard]] constexpr std::uint8_t status_for(std::uint8_t almc) {
  return static_cast<std::uint8_t>(((almc & alarms::counting_error) != 0 ? status::counting_error : 0) |
                                   ((almc & alarms::shown_in_status) != 0 ? status::alarm : 0));
}

namespace detail {

// Returns the fields of a reply, whose length must be right; does not check their values.
[[nodiscard]] constexpr Reply split_reply(DataId id, Bytes bytes) {
  if (is_memory_access(id)) {
    return {.id = id,
            .address = static_cast<std::uint8_t>(bytes[1] & 0x7F),
            .busy = (bytes[1] & busy_bit) != 0,
            .value = bytes[2]};
  }
  if (id == DataId::encoder_id) return {.id = id, .status = bytes[1], .encoder_id = bytes[2]};
  const auto load = [bytes](std::size_t at) {
    return static_cast<std::uint32_t>(bytes[at] | bytes[at + 1] << 8 | bytes[at + 2] << 16);
  };
  if (id == DataId::multiturn) return {.id = id, .status = bytes[1], .multiturn = load(2)};
  const bool has_all = id == DataId::everything;
  return {.id = id,
          .status = bytes[1],
          .singleturn = load(2),
          .multiturn = has_all ? load(6) : 0,
          .encoder_id = has_all ? bytes[5] : std::uint8_t{0},
          .alarms = has_all ? bytes[9] : std::uint8_t{0}};
}

[[nodiscard]] constexpr Error check_memory_reply(const Format& format, const Request& request, const Reply& reply) {
  if (reply.address != request.address) return Error::unexpected_reply;
  // A busy encoder replies with the value 00; the reply to an accepted write echoes the written value (Table 5).
  if (reply.busy) return format.strict && reply.value != 0 ? Error::unexpected_reply : Error::none;
  if (request.id == DataId::write_memory && reply.value != request.value) return Error::unexpected_reply;
  return Error::none;
}

[[nodiscard]] constexpr Error check_data_reply(const Format& format, const Reply& reply) {
  if ((reply.status & status::rejected) != 0) return Error::request_rejected;
  if (format.strict && (reply.status & status::information) != 0) return Error::unexpected_reply;
  const bool has_id = reply.id == DataId::encoder_id || reply.id == DataId::everything;
  if (has_id && format.encoder_id >= 0 && reply.encoder_id != format.encoder_id) return Error::unexpected_reply;
  if (reply.singleturn >> format.singleturn_bits != 0) return Error::out_of_range;
  if (reply.multiturn >> format.multiturn_bits != 0) return Error::out_of_range;
  if (format.strict && reply.id == DataId::everything &&
      (reply.status & (status::counting_error | status::alarm)) != status_for(reply.alarms)) {
    return Error::cross_check_failed;
  }
  return Error::none;
}

}  // namespace detail

/// Returns whether a reply begins like a refusal (8.4, 9.4): it has data ID 3, but another ID was requested.
[[nodiscard]] constexpr bool begins_rejection(DataId asked, Bytes reply) {
  return asked != DataId::everything && !reply.empty() && reply[0] == control_field(DataId::everything);
}

namespace detail {

constexpr Error check_frame(const Request& request, Bytes bytes) {
  const bool rejection = begins_rejection(request.id, bytes);
  if (bytes.size() != reply_length(rejection ? DataId::everything : request.id)) return Error::wrong_length;
  if (checksum(bytes) != 0) return Error::bad_checksum;
  if (rejection) return Error::request_rejected;
  return bytes[0] == control_field(request.id) ? Error::none : Error::unexpected_reply;
}

constexpr Error check_reply(const Format& format, const Request& request, const Reply& reply) {
  return is_memory_access(request.id) ? check_memory_reply(format, request, reply) : check_data_reply(format, reply);
}

}  // namespace detail

/// Checks and decodes a reply to `request`. Errors: wrong_length, bad_checksum, request_rejected, unexpected_reply,
/// out_of_range, cross_check_failed. A busy memory gives no error.
[[nodiscard]] constexpr Result<Reply> decode_reply(const Format& format, const Request& request, Bytes bytes) {
  Error error = detail::check_frame(request, bytes);
  if (error != Error::none) return error;
  const Reply reply = detail::split_reply(request.id, bytes);
  error = detail::check_reply(format, request, reply);
  if (error != Error::none) return error;
  return reply;
}

/// Returns the mask of the alarms that are no faults: the battery's alarms if the format has no battery.
[[nodiscard]] constexpr unsigned expected_alarms(const Format& format) {
  return format.battery ? 0u : alarms::without_battery;
}

/// Alarms (bits of ALMC) whose state the host knows from earlier replies.
struct KnownAlarms {
  std::uint8_t reported = 0;  ///< Mask of the alarms whose state is known.
  std::uint8_t raised = 0;    ///< Mask of the alarms that are known to be raised.

  /// Returns the known alarms after a reply to data ID 3, whose alarm field `almc` reports all alarms.
  [[nodiscard]] static constexpr KnownAlarms all(std::uint8_t almc) { return {0xFF, almc}; }
};

/// Returns the known alarms after a reply with a status field (`sf`) and no alarm field. `sf_reported`: mask of the
/// bits of `sf` that are valid.
[[nodiscard]] constexpr KnownAlarms known_after(KnownAlarms before, std::uint8_t sf, unsigned sf_reported) {
  constexpr unsigned together = alarms::shown_in_status;
  unsigned reported = before.reported | alarms::counting_error;
  unsigned raised = before.raised & ~unsigned{alarms::counting_error};
  if ((sf & status::counting_error) != 0) raised |= alarms::counting_error;
  if ((sf_reported & status::alarm) == 0) {
    // the status bit `alarm` is not valid, so it changes nothing in the known state of the four alarms for which it
    // stands
  } else if ((sf & status::alarm) == 0) {
    reported |= together;
    raised &= ~together;
  } else if ((before.raised & together) == 0) {
    reported &= ~together;
  }
  return {static_cast<std::uint8_t>(reported), static_cast<std::uint8_t>(raised)};
}

namespace detail {

constexpr void judge(Reading& reading, const KnownAlarms& known) {
  reading.alarms = known.raised;
  reading.alarms_reported = known.reported;
  const bool counting_error =
      (reading.status & status::counting_error) != 0 || (known.raised & alarms::counting_error) != 0;
  const bool is_full = (known.reported & ~known.raised & alarms::full_absolute_status) != 0;
  const bool is_full_known = (known.reported & alarms::full_absolute_status) != 0;
  const unsigned bits = reading.singleturn_bits;
  const unsigned holding = is_full ? bits : std::min(bits, full_absolute_bits);
  reading.singleturn_valid_bits = counting_error ? 0 : holding;
  reading.singleturn_known = counting_error || is_full_known || holding == bits;
  const bool lost = (known.raised & alarms::turns_lost) != 0;
  const bool all_reported = (known.reported & alarms::turns_lost) == alarms::turns_lost;
  reading.multiturn_valid = reading.multiturn_bits != 0 && all_reported && !lost;
  reading.multiturn_known = reading.multiturn_bits == 0 || all_reported || lost;
}

// Returns the status field as a reading shows it. Without a battery the encoder always sets the bit `alarm`, so it is
// then shown only if another alarm is raised.
[[nodiscard]] constexpr std::uint8_t status_of(const Format& format, bool has_alarms, const Reply& reply) {
  if (format.battery) return reply.status;
  const bool other = has_alarms && (reply.alarms & alarms::shown_in_status & ~expected_alarms(format)) != 0;
  return static_cast<std::uint8_t>((reply.status & ~status::alarm) | (other ? status::alarm : 0));
}
constexpr unsigned reported_status(const Format& format, bool has_alarms) {
  return format.battery || has_alarms ? 0xFFu : 0xFFu & ~unsigned{status::alarm};
}

}  // namespace detail

/// Returns the position and turns of a valid reply to data ID `id`, with their validity. `known_alarms`: alarms (ALMC)
/// of the last reply to data ID 3 since power on.
[[nodiscard]] constexpr Reading to_reading(const Format& format, DataId id, const Reply& reply,
                                           std::optional<std::uint8_t> known_alarms = std::nullopt) {
  const bool has_all = id == DataId::everything;
  const bool has_status = !is_memory_access(id);
  const bool has_turns = has_all || id == DataId::multiturn;
  const bool has_position = has_all || (id != DataId::multiturn && id != DataId::encoder_id && has_status);
  Reading reading{.singleturn = reply.singleturn,
                  .multiturn = reply.multiturn,
                  .singleturn_bits = has_position ? format.singleturn_bits : 0,
                  .multiturn_bits = has_turns ? format.turns_bits() : 0,
                  .status = detail::status_of(format, has_all, reply),
                  .status_reported = has_status ? detail::reported_status(format, has_all) : 0u};
  const KnownAlarms before = known_alarms ? KnownAlarms::all(*known_alarms) : KnownAlarms{};
  detail::judge(reading, has_all      ? KnownAlarms::all(reply.alarms)
                         : has_status ? known_after(before, reply.status, reading.status_reported)
                                      : before);
  reading.alarms &= ~expected_alarms(format);
  reading.alarms_reported &= ~expected_alarms(format);
  return reading;
}
/// Returns the position and turns of a valid reply, with their validity; the reply's own data ID decides which it has.
[[nodiscard]] constexpr Reading to_reading(const Format& format, const Reply& reply,
                                           std::optional<std::uint8_t> known_alarms = std::nullopt) {
  return to_reading(format, reply.id, reply, known_alarms);
}

/// Returns the reading `now`, completed by alarms that the earlier reading `before` reports, as Unit::remembered
/// describes.
[[nodiscard]] constexpr Reading remembered(const Reading& before, Reading now) {
  // `now` is the reading of a reply to data ID 3, which reports all alarms
  if ((now.alarms_reported & alarms::full_absolute_status) != 0) return now;
  const KnownAlarms known{static_cast<std::uint8_t>(before.alarms_reported), static_cast<std::uint8_t>(before.alarms)};
  detail::judge(now, known_after(known, static_cast<std::uint8_t>(now.status), now.status_reported));
  return now;
}

// ---- Protocol, for the engine and the virtual encoder

/// The types, times and functions of the T-format that templates of absenc/protocol/author use.
struct Protocol {
  /// Format of the encoder: the values of its options.
  using Format = tformat::Format;
  /// C++ type of the protocol's requests.
  using Request = tformat::Request;
  /// C++ type of the protocol's replies.
  using Reply = tformat::Reply;
  static constexpr std::size_t longest_reply = reply_capacity;  ///< Greatest length of a reply in bytes.

  /// Returns the timeouts of a host.
  static constexpr author::HostTimes host_times(const Format&) {
    return {.answer_limit = answer_limit, .gap_limit = gap_limit};
  }
  /// Returns how often, and after which pause, a host repeats a request. After a page change without a valid reply the
  /// host waits for `memory_time`, because the change may still be in progress.
  static constexpr author::Manner manner(const Format&, const Request& request) {
    if (selects_page(request)) return {.repeats = 2, .pause = memory_time, .hold = memory_time};
    return {.repeats = request.id == DataId::write_memory || is_reset(request.id) ? 0u : 2u};
  }
  /// Returns the bytes of a request.
  static constexpr RequestBytes encode(const Format&, const Request& request) { return encode_request(request); }
  /// Returns the length in bytes of the reply to `request`; its first bytes `so_far` show whether it is a refusal.
  static constexpr std::size_t expected(const Format&, const Request& request, Bytes so_far) {
    return reply_length(begins_rejection(request.id, so_far) ? DataId::everything : request.id);
  }
  /// Checks and decodes the bytes of a reply.
  static constexpr auto decode = decode_reply;
  /// Returns whether a reply with this error is complete. If it may be incomplete, the host must not send yet: sending
  /// while the encoder sends can destroy the encoder's driver (11).
  static constexpr bool is_whole(const Format&, Error error) { return error == Error::request_rejected; }
  /// Returns the position and turns of a valid reply.
  static constexpr Reading reading(const Format& format, const Request& request, const Reply& reply) {
    // The data ID is taken from the request instead of the reply, because the compiler may know the request.
    return to_reading(format, request.id, reply);
  }
  /// Returns the end of the request: the document does not say when the encoder latches the position.
  static constexpr Time latched(const Format&, Time sent_at) { return sent_at; }

  /// Decodes a request. Returns the request, or the error of the first failed check.
  static constexpr Result<Request> decode_request(const Format&, Bytes bytes) { return tformat::decode_request(bytes); }
  /// Returns the length in bytes of the request that begins with `begin[0]`; 0 if no request begins with this byte.
  static constexpr std::size_t request_size(const Format&, Bytes begin) {
    const std::optional<DataId> id = data_id(begin[0]);
    return id && begin[0] == control_field(*id) ? request_length(*id) : 0;
  }
  /// Returns the length in bytes of the reply to `request`.
  static constexpr std::size_t reply_size(const Format&, const Request& request) { return reply_length(request.id); }
  /// Returns the times of a virtual encoder: until its reply, from power on until it answers, and until it drops an
  /// incomplete request.
  static constexpr author::DeviceTimes device_times(const Format&) {
    const Time character = line_settings.character();
    // the silence that ends a frame is one character: the frame ends where a start bit is missing (9.2)
    return {character, answer_time, start_up_with_battery, character};
  }
};

}  // namespace absenc::tformat
