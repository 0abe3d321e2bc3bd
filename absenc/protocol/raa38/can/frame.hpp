// SPDX-License-Identifier: Apache-2.0
// Frames, orders and settings of the RAA38S6 on CAN (README.md, section CAN).
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

/// Purpose of a frame, which its identifier decides (table of COB-IDs).
enum class Function : std::uint8_t {
  nmt,                  ///< Network management of CANopen: identifier 000 (hex).
  sync,                 ///< SYNC of CANopen: identifier 080 (hex).
  emergency,            ///< Emergency message of CANopen: identifiers 081 to 0FF (hex).
  reply,                ///< Reply or position from a node: identifiers 101 to 1FF (hex).
  command,              ///< Order to a node: identifiers 201 to 2FF (hex).
  sdo_reply,            ///< SDO of CANopen from a node: identifiers 581 to 5FF (hex).
  sdo_request,          ///< SDO of CANopen to a node: identifiers 601 to 67F (hex).
  configuration_reply,  ///< Answer to a setting on the identifier that CiA 305 gives, 7E4 (hex).
  configuration,        ///< Setting for all nodes, or an RAA38S6's answer to a setting: identifier 7E5 (hex).
  unknown,
};

/// Returns the purpose of a frame with the 11-bit identifier `id`.
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
/// Returns the purpose of a frame; `unknown` for a 29-bit identifier.
[[nodiscard]] constexpr Function function_of(const CanFrame& frame) {
  return frame.extended ? Function::unknown : function_of(frame.id);
}

/// Returns the node number in the identifier of a frame; only for frames of a purpose whose identifiers contain a node
/// number.
[[nodiscard]] constexpr std::uint8_t node_of(const CanFrame& frame) {
  const Function function = function_of(frame);
  const bool has_eight_bits = function == Function::reply || function == Function::command;
  return static_cast<std::uint8_t>(frame.id & (has_eight_bits ? 0xFF : 0x7F));
}

/// Names of the CANopen functions that this encoder does not use; empty for the functions that it uses.
inline constexpr std::array<std::string_view, 10> function_names{"NMT", "SYNC", "EMCY", "", "", "SDO RX", "SDO TX"};
/// Returns whether `function` is a function of CANopen that the document names without describing its frames.
[[nodiscard]] constexpr bool is_only_named(Function function) {
  return !function_names[static_cast<std::size_t>(function)].empty();
}

/// Returns whether a frame with this function is a setting or the answer to a setting.
[[nodiscard]] constexpr bool is_setting(Function function) {
  return function == Function::configuration || function == Function::configuration_reply;
}

/// A bit rate of the encoder with its index in the table of CiA 305.
struct Rate {
  std::uint8_t index;             ///< Index of the rate in the table of CiA 305.
  std::uint32_t bits_per_second;  ///< Bit rate in bits per second.
};
/// All bit rates of the encoder.
inline constexpr std::array<Rate, 3> rates{{{0, 1'000'000}, {2, 500'000}, {3, 250'000}}};

/// Returns the bit rate that has this index in the table of CiA 305; null if the encoder does not have the rate.
[[nodiscard]] constexpr const Rate* rate_of_index(std::uint8_t index) {
  for (const Rate& rate : rates) {
    if (rate.index == index) return &rate;
  }
  return nullptr;
}
/// Returns the bit rate of this number of bits per second; null if the encoder does not have the rate.
[[nodiscard]] constexpr const Rate* rate_of_bits(std::int64_t bits_per_second) {
  for (const Rate& rate : rates) {
    if (rate.bits_per_second == bits_per_second) return &rate;
  }
  return nullptr;
}

/// Frame layout and settings of one encoder, as the unit's options select them.
struct Format {
  unsigned bits = 14;        ///< Number of bits of the position, 10 to 21.
  std::uint8_t node = 0x20;  ///< Number of the node, 1 to 255.
  std::uint8_t rate = 2;     ///< Index of the bit rate in `rates`.
  bool listens = false;      ///< Host: whether to read the positions that the node sends without a request.
  /// Value in order 22 that makes the encoder count up; the document does not state the value.
  std::uint8_t positive = 0;
  /// Value in order 22 that makes the encoder count down; the document does not state the value.
  std::uint8_t negative = 1;
  /// Virtual encoder: number of positions per second that it sends without a request after power on; 0: it sends none.
  std::uint8_t cyclic = 10;
  bool answers_on_7e4 = false;  ///< Whether the virtual encoder answers settings on identifier 7E4 instead of 7E5.

  /// Returns the bit rate in bits per second.
  [[nodiscard]] constexpr std::uint32_t bit_rate() const { return rates[rate].bits_per_second; }
  /// Returns the identifier on which the virtual encoder answers settings.
  [[nodiscard]] constexpr std::uint32_t answer_id() const { return answers_on_7e4 ? 0x7E4 : 0x7E5; }
};

/// Values that a frame contains, or that a command gives as its result. Only members that have a value are reported.
struct Values {
  /// C++ type of the members that are numbers; such a member is empty if it has no value.
  using Number = std::optional<std::int64_t>;
  Number node{};  ///< Number of the node, 1 to 255.
  /// Meaning of the identifier in CANopen, for frames that this encoder does not use.
  std::optional<std::string_view> function{};
  std::optional<Bytes> data{};                ///< Data bytes of a frame that this encoder does not use.
  std::optional<std::string_view> command{};  ///< Name of the order that is requested or answered.
  Number value{};                             ///< Counting direction: the value that order 22 carries.
  Number new_node{};                          ///< Node number that a setting gives to the node.
  Number bit_rate{};                          ///< Bit rate that a setting gives to the node, in bits per second.
  std::optional<bool> clash{};  ///< Scan: true if two nodes seem to share the number `node`, or the line is bad.
  Number readings_per_s{};      ///< Positions per second that the node sends without a request.
  std::optional<std::uint64_t> singleturn{};  ///< Position within one revolution, in counts.
  std::optional<double> angle{};              ///< Position within one revolution, in degrees.
  std::optional<bool> written{};  ///< True if the command wrote a setting; false if the encoder had this value already.
  std::optional<bool> answered{};  ///< Whether the node answered the order.
  /// Whether order 22 has mirrored the position, because it has changed the counting direction.
  std::optional<bool> mirrored{};
  std::optional<std::uint64_t> before{};  ///< Position before order 20 (zero) or 22 (direction), in counts.
  std::optional<std::uint64_t> after{};   ///< Position after order 20 (zero) or 22 (direction), in counts.
};

// ---- Orders to a node

/// Orders that a host can send to nodes.
enum class Order : std::uint8_t { start, zero, direction, cyclic, read, enter, node, rate };

/// Kinds of answers to an order: no answer, a position, the code of the order, or an error code.
enum class Answer : std::uint8_t { none, position, code, error };

/// Description of an order, from the document's command tables.
struct OrderInfo {
  Order order;            ///< Order that this description is for.
  std::uint8_t code;      ///< Value of byte 0, which identifies the order.
  std::string_view name;  ///< Name of the order, as the field `command` reports it.
  /// True: the order is sent on 7E5 to all nodes; false: it is sent on 2NN to node NN, with NN also in byte 1.
  bool for_all;
  Answer answer;              ///< Kind of the answer to the order.
  std::uint8_t value_at = 0;  ///< Index of the data byte that carries the order's value; 0: the order has no value.
  std::uint8_t least = 0;     ///< Lowest value that the order may carry.
  std::uint8_t most = 255;    ///< Highest value that the order may carry.
  /// Member of Values in which the value that the order carries is reported; null: this value is not reported.
  Values::Number Values::*shown = nullptr;
};
/// Descriptions of all orders; the index of a description is the number of its enumerator in `Order`.
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

/// Returns the order that byte 0 and the identifier of a frame give; null if they give no order.
[[nodiscard]] constexpr const OrderInfo* order_of(const CanFrame& frame) {
  const bool for_all = is_setting(function_of(frame));
  for (const OrderInfo& info : orders) {
    if (info.code == frame.data[0] && info.for_all == for_all) return &info;
  }
  return nullptr;
}

/// Returns the value that an order's value byte stands for; no value if the document does not define the byte.
[[nodiscard]] constexpr Values::Number meaning_of(const OrderInfo& info, std::uint8_t value) {
  if (info.order != Order::rate) return value < info.least || value > info.most ? Values::Number{} : value;
  const Rate* const rate = rate_of_index(value);
  return rate != nullptr ? Values::Number(rate->bits_per_second) : Values::Number{};
}

/// Converts the argument of a command to the value byte of an order; returns no value for an unknown bit rate.
[[nodiscard]] constexpr std::optional<std::uint8_t> value_of(const Format& format, Order order, std::int64_t argument) {
  if (order == Order::direction) return argument == 0 ? format.positive : format.negative;
  if (order != Order::rate) return static_cast<std::uint8_t>(argument);
  const Rate* const rate = rate_of_bits(argument);
  return rate != nullptr ? std::optional(rate->index) : std::nullopt;
}

// ---- Frames

/// Returns the frame with an order to `node`, or to all nodes if the order is for all.
[[nodiscard]] constexpr CanFrame encode(Order order, std::uint8_t node, std::uint8_t value = 0) {
  const OrderInfo& info = info_of(order);
  CanFrame frame{.id = info.for_all ? 0x7E5u : 0x200u | node, .size = frame_size, .data = {info.code}};
  if (!info.for_all) frame.data[1] = node;
  if (info.value_at != 0) frame.data[info.value_at] = value;
  return frame;
}

/// Returns the frame in which `node` sends the position `counts`.
[[nodiscard]] constexpr CanFrame encode_position(std::uint8_t node, std::uint64_t counts) {
  CanFrame frame{.id = 0x100u | node, .size = frame_size};
  store_little_endian(frame.data, counts);
  return frame;
}

/// Returns the answer of `node` to order zero, direction or cyclic, which looks like a position.
[[nodiscard]] constexpr CanFrame encode_answer(std::uint8_t node, Order order) {
  return encode_position(node, info_of(order).code);
}

/// Returns the answer to the setting `order`, sent with identifier `id`. `error`: error code; 0 for success.
[[nodiscard]] constexpr CanFrame encode_configuration_answer(std::uint32_t id, Order order, std::uint8_t error) {
  return {.id = id, .size = frame_size, .data = {info_of(order).code, error}};
}

/// Checks that a frame is a data frame of 8 bytes with an 11-bit identifier. Errors: bad_framing, wrong_length,
/// unexpected_reply.
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

/// Returns the position in a reply, in counts. Errors: those of `check_shape`, out_of_range.
[[nodiscard]] constexpr Result<std::uint32_t> decode_position(const Format& format, const CanFrame& frame) {
  if (const Error error = check_shape(frame); error != Error::none) return error;
  if (function_of(frame) != Function::reply) return Error::unexpected_reply;
  const std::uint64_t counts = load_little_endian(frame.bytes());
  if (counts > low_mask(format.bits)) return Error::out_of_range;
  return static_cast<std::uint32_t>(counts);
}

/// Checks the answer to a setting. Errors: those of `check_shape`, out_of_range, request_rejected.
[[nodiscard]] constexpr Error check_configuration_answer(Order order, const CanFrame& frame) {
  if (const Error error = check_shape(frame); error != Error::none) return error;
  if (const OrderInfo* const info = order_of(frame); info == nullptr || info->order != order || !info->for_all) {
    return Error::unexpected_reply;
  }
  if (!is_zero_from(frame, 2)) return Error::out_of_range;
  return frame.data[1] == 0 ? Error::none : Error::request_rejected;
}

/// Returns whether the frame has the identifier with which `node` replies.
[[nodiscard]] constexpr bool is_from(const CanFrame& frame, std::uint8_t node) {
  return function_of(frame) == Function::reply && node_of(frame) == node;
}

// ---- Fields of frames

/// Returns Values with the position `counts` of `node`.
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

// Decodes a frame as the answer of `node` to an order.
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

/// Decodes `reply` as the reply to `request`; if `reply` is null, decodes `request`. Either of them may be null.
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
