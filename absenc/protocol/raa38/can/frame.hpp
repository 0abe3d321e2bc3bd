// SPDX-License-Identifier: Apache-2.0
// RAA38S6 on CAN: frames of 8 bytes. The document calls it CANopen, but the protocol is its own. README.md, section
// CAN, draws the frames.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/core/angle.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"
#include "absenc/link/can.hpp"

namespace absenc::raa38::can {

inline constexpr std::uint8_t frame_size = 8;  ///< Number of data bytes of a frame.

/// Purpose of a frame by its identifier; from the table of COB-IDs, with its two wrong numbers corrected.
enum class Function : std::uint8_t {
  nmt,                  ///< identifier 000
  sync,                 ///< identifier 080
  emergency,            ///< identifiers 081 to 0FF
  reply,                ///< identifiers 101 to 1FF: from the node
  command,              ///< identifiers 201 to 2FF: to the node
  sdo_reply,            ///< identifiers 581 to 5FF: from the node
  sdo_request,          ///< identifiers 601 to 67F: to the node
  configuration_reply,  ///< identifier 7E4, on which slaves of CiA 305 answer
  configuration,        ///< identifier 7E5: to all nodes; RAA38S6 also answer on it
  unknown,
};

/// Returns the function of an identifier.
[[nodiscard]] constexpr Function function_of(std::uint32_t id) {
  if (id == 0) return Function::nmt;
  if (id == 0x80) return Function::sync;
  if (id > 0x80 && id < 0x100) return Function::emergency;
  if (id > 0x100 && id < 0x200) return Function::reply;
  if (id > 0x200 && id < 0x300) return Function::command;
  if (id > 0x580 && id < 0x600) return Function::sdo_reply;
  if (id > 0x600 && id < 0x680) return Function::sdo_request;
  if (id == 0x7E4) return Function::configuration_reply;
  if (id == 0x7E5) return Function::configuration;
  return Function::unknown;
}
/// Returns the function of a frame.
[[nodiscard]] constexpr Function function_of(const CanFrame& frame) {
  return frame.extended ? Function::unknown : function_of(frame.id);
}

/// Returns the node number of a frame whose identifier contains one.
[[nodiscard]] constexpr std::uint8_t node_of(const CanFrame& frame) {
  const Function function = function_of(frame);
  const bool has_eight_bits = function == Function::reply || function == Function::command;
  return static_cast<std::uint8_t>(frame.id & (has_eight_bits ? 0xFF : 0x7F));
}

/// Names of the CANopen functions that this encoder only lists; empty for the functions it uses.
inline constexpr std::array<std::string_view, 10> function_names{"NMT", "SYNC", "EMCY", "", "", "SDO RX", "SDO TX"};
/// Returns whether the document only names a function.
[[nodiscard]] constexpr bool is_only_named(Function function) {
  return !function_names[static_cast<std::size_t>(function)].empty();
}

/// Returns whether the frame is a setting or the answer to one.
[[nodiscard]] constexpr bool is_setting(Function function) {
  return function == Function::configuration || function == Function::configuration_reply;
}

/// A bit rate of the document with its index in the table of CiA 305.
struct Rate {
  std::uint8_t index;             ///< Index of the rate in the table of CiA 305.
  std::uint32_t bits_per_second;  ///< The rate in bits per second.
};
/// Bit rates of the encoder.
inline constexpr std::array<Rate, 3> rates{{{0, 1'000'000}, {2, 500'000}, {3, 250'000}}};

/// Returns the rate of an index; null if the document does not have it.
[[nodiscard]] constexpr const Rate* rate_of_index(std::uint8_t index) {
  for (const Rate& rate : rates) {
    if (rate.index == index) return &rate;
  }
  return nullptr;
}
/// Returns the rate with these bits per second, or null.
[[nodiscard]] constexpr const Rate* rate_of_bits(std::int64_t bits_per_second) {
  for (const Rate& rate : rates) {
    if (rate.bits_per_second == bits_per_second) return &rate;
  }
  return nullptr;
}

/// Frame layout and settings of one encoder, as the unit's options select them.
struct Format {
  unsigned bits = 14;         ///< bits of the position, 10 to 21
  std::uint8_t node = 0x20;   ///< number of the node, 1 to 255
  std::uint8_t rate = 2;      ///< index into `rates`
  bool listens = false;       ///< host: read the positions that the node sends without a request
  std::uint8_t positive = 0;  ///< values of command 22 for counting up and down; the document does not state them
  std::uint8_t negative = 1;  ///< Value of the setting for a negative direction.
  /// Virtual encoder: positions per second that it sends without a request after power on; 0: none.
  std::uint8_t cyclic = 10;
  bool answers_on_7e4 = false;  ///< virtual encoder: answers settings on 7E4 instead of 7E5

  /// Returns the bit rate in bits per second.
  [[nodiscard]] constexpr std::uint32_t bit_rate() const { return rates[rate].bits_per_second; }
  /// Returns the identifier of replies to settings.
  [[nodiscard]] constexpr std::uint32_t answer_id() const { return answers_on_7e4 ? 0x7E4 : 0x7E5; }
};

/// Fields of frames and commands, in the order of the report.
struct Values {
  /// A number that may be missing.
  using Number = std::optional<std::int64_t>;
  Number node{};                               ///< Value of the field `node`, if there is one.
  std::optional<std::string_view> function{};  ///< Value of the field `function`, if there is one.
  std::optional<Bytes> data{};                 ///< Value of the field `data`, if there is one.
  std::optional<std::string_view> command{};   ///< Value of the field `command`, if there is one.
  Number value{};                              ///< Value of the field `value`, if there is one.
  Number new_node{};                           ///< Value of the field `new_node`, if there is one.
  Number bit_rate{};                           ///< Value of the field `bit_rate`, if there is one.
  std::optional<bool> clash{};                 ///< Value of the field `clash`, if there is one.
  Number readings_per_s{};                     ///< Value of the field `readings_per_s`, if there is one.
  std::optional<std::uint64_t> singleturn{};   ///< Value of the field `singleturn`, if there is one.
  std::optional<double> angle{};               ///< Value of the field `angle`, if there is one.
  std::optional<bool> written{};               ///< Value of the field `written`, if there is one.
  std::optional<bool> answered{};              ///< Value of the field `answered`, if there is one.
  std::optional<bool> mirrored{};              ///< Value of the field `mirrored`, if there is one.
  std::optional<std::uint64_t> before{};       ///< Value of the field `before`, if there is one.
  std::optional<std::uint64_t> after{};        ///< Value of the field `after`, if there is one.
};

// ---- Orders to a node

/// An order to the encoder.
enum class Order : std::uint8_t { start, zero, direction, cyclic, read, enter, node, rate };

/// Kind of answer to an order.
enum class Answer : std::uint8_t { none, position, code, error };

/// A row of the document's command tables.
struct OrderInfo {
  Order order;                              ///< The order.
  std::uint8_t code;                        ///< value of byte 0
  std::string_view name;                    ///< Name of the order.
  bool for_all;                             ///< true: on 7E5 to all nodes; false: on 2NN with the node in byte 1
  Answer answer;                            ///< How the encoder answers it.
  std::uint8_t value_at = 0;                ///< index of the byte with the order's value; 0: the order has no value
  std::uint8_t least = 0;                   ///< Lowest value.
  std::uint8_t most = 255;                  ///< Highest value.
  Values::Number Values::*shown = nullptr;  ///< Member that shows the value; null: none.
};
/// Descriptions of the orders.
inline constexpr std::array<OrderInfo, 8> orders{{
    {Order::start, 0x01, "start", false, Answer::position},
    {Order::zero, 0x20, "zero", false, Answer::code},
    {Order::direction, 0x22, "direction", false, Answer::code, 2, 0, 255, &Values::value},
    {Order::cyclic, 0x31, "cyclic", false, Answer::code, 2, 0, 255, &Values::readings_per_s},
    {Order::read, 0x80, "read", false, Answer::position},
    {Order::enter, 0x04, "enter-configuration", true, Answer::none, 1, 0, 1},
    {Order::node, 0x11, "set-node", true, Answer::error, 1, 1, 255, &Values::new_node},
    {Order::rate, 0x13, "bitrate", true, Answer::error, 2, 0, 255, &Values::bit_rate},
}};
/// Returns the description of an order.
[[nodiscard]] constexpr const OrderInfo& info_of(Order order) { return orders[static_cast<std::size_t>(order)]; }

/// Returns the order in a frame, or the one that a frame on 7E5 or 7E4 answers; null if there is none.
[[nodiscard]] constexpr const OrderInfo* order_of(const CanFrame& frame) {
  const bool for_all = is_setting(function_of(frame));
  for (const OrderInfo& info : orders) {
    if (info.code == frame.data[0] && info.for_all == for_all) return &info;
  }
  return nullptr;
}

/// Returns the meaning of an order's value, such as a bit rate; nothing if the document does not have the value.
[[nodiscard]] constexpr Values::Number meaning_of(const OrderInfo& info, std::uint8_t value) {
  if (info.order != Order::rate) return value < info.least || value > info.most ? Values::Number{} : value;
  const Rate* const rate = rate_of_index(value);
  return rate != nullptr ? Values::Number(rate->bits_per_second) : Values::Number{};
}

/// Returns the value that an order carries for a command's argument; nothing if the document does not have it.
[[nodiscard]] constexpr std::optional<std::uint8_t> value_of(const Format& format, Order order, std::int64_t argument) {
  if (order == Order::direction) return argument == 0 ? format.positive : format.negative;
  if (order != Order::rate) return static_cast<std::uint8_t>(argument);
  const Rate* const rate = rate_of_bits(argument);
  return rate != nullptr ? std::optional(rate->index) : std::nullopt;
}

// ---- Frames

/// Returns the frame of an order to `node`, or to all nodes.
[[nodiscard]] constexpr CanFrame encode(Order order, std::uint8_t node, std::uint8_t value = 0) {
  const OrderInfo& info = info_of(order);
  CanFrame frame{.id = info.for_all ? 0x7E5u : 0x200u | node, .size = frame_size, .data = {info.code}};
  if (!info.for_all) frame.data[1] = node;
  if (info.value_at != 0) frame.data[info.value_at] = value;
  return frame;
}

/// Returns the frame of a position, `counts` least significant byte first.
[[nodiscard]] constexpr CanFrame encode_position(std::uint8_t node, std::uint64_t counts) {
  CanFrame frame{.id = 0x100u | node, .size = frame_size};
  store_little_endian(frame.data, counts);
  return frame;
}

/// Returns the answer to zero, direction and cyclic. Its bits equal those of a position with the value of its code.
[[nodiscard]] constexpr CanFrame encode_answer(std::uint8_t node, Order order) {
  return encode_position(node, info_of(order).code);
}

/// Returns the answer to a setting. `error`: 0 for success.
[[nodiscard]] constexpr CanFrame encode_configuration_answer(std::uint32_t id, Order order, std::uint8_t error) {
  return {.id = id, .size = frame_size, .data = {info_of(order).code, error}};
}

/// Checks the form that all frames share. Errors: bad_framing (a remote frame), wrong_length, unexpected_reply (a
/// 29-bit identifier).
[[nodiscard]] constexpr Error check_shape(const CanFrame& frame) {
  if (frame.remote) return Error::bad_framing;
  if (frame.size != frame_size) return Error::wrong_length;
  return frame.extended ? Error::unexpected_reply : Error::none;
}

/// Returns whether all data bytes from `first` on are 0.
[[nodiscard]] constexpr bool is_zero_from(const CanFrame& frame, std::size_t first) {
  for (std::size_t i = first; i < frame_size; ++i) {
    if (frame.data[i] != 0) return false;
  }
  return true;
}

/// Returns the position of a reply, in counts. Errors: those of `check_shape`, unexpected_reply, out_of_range (more
/// bits than the encoder has).
[[nodiscard]] constexpr Result<std::uint32_t> decode_position(const Format& format, const CanFrame& frame) {
  if (const Error error = check_shape(frame); error != Error::none) return error;
  if (function_of(frame) != Function::reply) return Error::unexpected_reply;
  const std::uint64_t counts = load_little_endian(frame.bytes());
  if (counts > low_mask(format.bits)) return Error::out_of_range;
  return static_cast<std::uint32_t>(counts);
}

/// Checks the answer to a setting. Errors: those of `check_shape`, unexpected_reply (an answer to another order),
/// out_of_range, request_rejected.
[[nodiscard]] constexpr Error check_configuration_answer(Order order, const CanFrame& frame) {
  if (const Error error = check_shape(frame); error != Error::none) return error;
  if (const OrderInfo* const info = order_of(frame); info == nullptr || info->order != order || !info->for_all) {
    return Error::unexpected_reply;
  }
  if (!is_zero_from(frame, 2)) return Error::out_of_range;
  return frame.data[1] == 0 ? Error::none : Error::request_rejected;
}

/// Returns whether the frame has the identifier of this node's replies.
[[nodiscard]] constexpr bool is_from(const CanFrame& frame, std::uint8_t node) {
  return function_of(frame) == Function::reply && node_of(frame) == node;
}

// ---- Fields of frames

/// Returns the values of a position.
[[nodiscard]] constexpr Values values_of(const Format& format, std::uint8_t node, std::uint64_t counts) {
  return {.node = node, .singleturn = static_cast<std::int64_t>(counts), .angle = degrees(counts, format.bits)};
}

namespace detail {

constexpr Values named(const CanFrame& frame) {
  const Function function = function_of(frame);
  Values values{.function = function_names[static_cast<std::size_t>(function)], .data = frame.bytes()};
  if (function != Function::nmt && function != Function::sync) values.node = node_of(frame);
  return values;
}

constexpr Result<Values> decode_request(const CanFrame& frame) {
  if (frame.remote) return Error::bad_framing;
  const Function function = function_of(frame);
  if (is_only_named(function)) return named(frame);
  if (const Error error = check_shape(frame); error != Error::none) return error;
  if (function != Function::command && function != Function::configuration) return Error::unexpected_reply;
  const OrderInfo* const info = order_of(frame);
  if (info == nullptr) return Error::unsupported;
  Values values{.command = info->name};
  CanFrame rest = frame;
  if (!info->for_all) rest.data[1] = 0;
  if (info->value_at != 0) {
    rest.data[info->value_at] = 0;
    const Values::Number meaning = meaning_of(*info, frame.data[info->value_at]);
    if (!meaning) return Error::out_of_range;
    if (info->shown != nullptr) values.*info->shown = meaning;
  }
  if (!is_zero_from(rest, 1)) return Error::out_of_range;
  if (info->for_all) return values;
  values.node = node_of(frame);
  return frame.data[1] == node_of(frame) ? Result<Values>(values) : Error::cross_check_failed;
}

// Decodes the answer of `node` to an order.
constexpr Result<Values> decode_answer(const Format& format, const OrderInfo& info, std::uint8_t node,
                                       const CanFrame& frame) {
  switch (info.answer) {
    case Answer::none:
      break;
    case Answer::position: {
      if (!is_from(frame, node)) break;
      const Result<std::uint32_t> counts = decode_position(format, frame);
      return counts ? Result<Values>(values_of(format, node, *counts)) : counts.error();
    }
    case Answer::code:
      if (!(frame == encode_answer(node, info.order))) break;
      return Values{.node = node, .command = info.name};
    case Answer::error:
      const Error error = check_configuration_answer(info.order, frame);
      return error == Error::none ? Result<Values>(Values{.command = info.name}) : error;
  }
  return Error::unexpected_reply;
}

}  // namespace detail

/// Decodes a reply to `request`, or `request` alone if `reply` is null. Both may be null. A frame of a node without a
/// request is taken as a position.
[[nodiscard]] constexpr Result<Values> decode(const Format& format, const CanFrame* request, const CanFrame* reply) {
  if (reply == nullptr) return request == nullptr ? Error::wrong_length : detail::decode_request(*request);
  if (reply->remote) return Error::bad_framing;
  const Function function = function_of(*reply);
  if (request != nullptr) {
    if (const auto asked = detail::decode_request(*request); !asked) return asked.error();
  }
  const Function asked = request != nullptr ? function_of(*request) : Function::unknown;
  const bool answers =
      asked == Function::sdo_request && function == Function::sdo_reply && node_of(*request) == node_of(*reply);
  if (request == nullptr ? is_only_named(function) : answers) return detail::named(*reply);
  if (const Error error = check_shape(*reply); error != Error::none) return error;
  if (is_only_named(asked)) return Error::unexpected_reply;
  const OrderInfo* info = &info_of(Order::read);
  if (request != nullptr || is_setting(function)) info = order_of(request != nullptr ? *request : *reply);
  if (info == nullptr) return Error::unexpected_reply;
  return detail::decode_answer(format, *info, node_of(request != nullptr ? *request : *reply), *reply);
}

}  // namespace absenc::raa38::can
