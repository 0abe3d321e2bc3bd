// SPDX-License-Identifier: Apache-2.0
// RAA38S6 on CAN: frames of 8 bytes, called CANopen but its own. README.md, section CAN, draws them.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/bits.hpp"
#include "absenc/core/result.hpp"
#include "absenc/link/can.hpp"
#include "absenc/link/line.hpp"

namespace absenc::raa38::can {

inline constexpr std::uint8_t frame_size = 8;

/// What a node is told, in byte 0.
namespace command {
inline constexpr std::uint8_t start = 0x01;
inline constexpr std::uint8_t zero = 0x20;
inline constexpr std::uint8_t direction = 0x22;
inline constexpr std::uint8_t cyclic = 0x31;
inline constexpr std::uint8_t read = 0x80;
}  // namespace command

/// What all nodes are told on 7E5, in byte 0.
namespace configuration {
inline constexpr std::uint8_t enter = 0x04;
inline constexpr std::uint8_t node = 0x11;
inline constexpr std::uint8_t rate = 0x13;
}  // namespace configuration

/// Who a frame is for, by its identifier (the table of COB-IDs, its two wrong figures put right).
enum class Function : std::uint8_t {
  nmt,                  // 000
  sync,                 // 080
  emergency,            // 081 to 0FF
  reply,                // 101 to 1FF: from the node
  command,              // 201 to 2FF: to the node
  sdo_reply,            // 581 to 5FF: from the node
  sdo_request,          // 601 to 67F: to the node
  configuration_reply,  // 7E4: where slaves of CiA 305 answer
  configuration,        // 7E5: to all nodes; these answer here too
  unknown,
};

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
[[nodiscard]] constexpr Function function_of(const CanFrame& frame) {
  return frame.extended ? Function::unknown : function_of(frame.id);
}

/// Of a frame that has one in its identifier.
[[nodiscard]] constexpr std::uint8_t node_of(const CanFrame& frame) {
  const Function function = function_of(frame);
  const bool has_eight_bits = function == Function::reply || function == Function::command;
  return static_cast<std::uint8_t>(frame.id & (has_eight_bits ? 0xFF : 0x7F));
}

/// Those that CANopen has and this encoder only lists.
[[nodiscard]] constexpr bool is_only_named(Function function) {
  return function == Function::nmt || function == Function::sync || function == Function::emergency ||
         function == Function::sdo_reply || function == Function::sdo_request;
}

/// The bit rates of the document, by their numbers in the table of CiA 305.
struct Rate {
  std::uint8_t index;
  std::uint32_t bits_per_second;
};
inline constexpr std::array<Rate, 3> rates{{{0, 1'000'000}, {2, 500'000}, {3, 250'000}}};

/// Null for an index that the document does not have.
[[nodiscard]] constexpr const Rate* rate_of_index(std::uint8_t index) {
  for (const Rate& rate : rates) {
    if (rate.index == index) return &rate;
  }
  return nullptr;
}
[[nodiscard]] constexpr const Rate* rate_of_bits(std::int64_t bits_per_second) {
  for (const Rate& rate : rates) {
    if (rate.bits_per_second == bits_per_second) return &rate;
  }
  return nullptr;
}

struct Format {
  unsigned bits = 14;         // 10 to 21
  std::uint8_t node = 0x20;   // 1 to 255
  std::uint8_t rate = 2;      // index into `rates`
  bool listens = false;       // reads what the node sends by itself
  std::uint8_t positive = 0;  // what 22 carries to count up, and to count down: the document does not say
  std::uint8_t negative = 1;
  std::uint8_t cyclic = 10;     // virtual: readings a second after power on, unasked; 0: none
  bool answers_on_7e4 = false;  // virtual: its answers to configurations, else on 7E5

  [[nodiscard]] constexpr std::uint32_t bit_rate() const { return rates[rate].bits_per_second; }
  [[nodiscard]] constexpr std::uint32_t answer_id() const { return answers_on_7e4 ? 0x7E4 : 0x7E5; }
};

// ---- Frames

[[nodiscard]] constexpr CanFrame encode_command(std::uint8_t node, std::uint8_t code, std::uint8_t value = 0) {
  return {.id = 0x200u | node, .size = frame_size, .data = {code, node, value}};
}

[[nodiscard]] constexpr CanFrame encode_configuration(std::uint8_t code, std::uint8_t first, std::uint8_t second = 0) {
  return {.id = 0x7E5, .size = frame_size, .data = {code, first, second}};
}

/// `counts` least significant byte first.
[[nodiscard]] constexpr CanFrame encode_position(std::uint8_t node, std::uint64_t counts) {
  CanFrame frame{.id = 0x100u | node, .size = frame_size};
  store_little_endian(frame.data, counts);
  return frame;
}

/// The answer to zero, direction and cyclic. It is bit for bit the position `code`.
[[nodiscard]] constexpr CanFrame encode_answer(std::uint8_t node, std::uint8_t code) {
  return encode_position(node, code);
}

/// `error`: 0 for success.
[[nodiscard]] constexpr CanFrame encode_configuration_answer(std::uint32_t id, std::uint8_t code, std::uint8_t error) {
  return {.id = id, .size = frame_size, .data = {code, error}};
}

/// What every frame must be before it is looked at. Errors: bad_framing (a remote frame), wrong_length,
/// unexpected_reply (a 29-bit identifier).
[[nodiscard]] constexpr Error check_shape(const CanFrame& frame) {
  if (frame.remote) return Error::bad_framing;
  if (frame.size != frame_size) return Error::wrong_length;
  return frame.extended ? Error::unexpected_reply : Error::none;
}

/// The position of a reply, in counts. Errors: those of `check_shape`, unexpected_reply, out_of_range (more bits than
/// the encoder has).
[[nodiscard]] constexpr Result<std::uint32_t> decode_position(const Format& format, const CanFrame& frame) {
  if (const Error error = check_shape(frame); error != Error::none) return error;
  if (function_of(frame) != Function::reply) return Error::unexpected_reply;
  const std::uint64_t counts = load_little_endian(frame.bytes());
  if (counts > low_mask(format.bits)) return Error::out_of_range;
  return static_cast<std::uint32_t>(counts);
}

/// The error code (0: success) in the answer to a configuration command. Errors: those of `check_shape`,
/// unexpected_reply (an answer to something else), out_of_range.
[[nodiscard]] constexpr Result<std::uint8_t> decode_configuration_answer(std::uint8_t code, const CanFrame& frame) {
  if (const Error error = check_shape(frame); error != Error::none) return error;
  const Function function = function_of(frame);
  if (function != Function::configuration && function != Function::configuration_reply) return Error::unexpected_reply;
  if (frame.data[0] != code) return Error::unexpected_reply;
  for (std::size_t i = 2; i < frame_size; ++i) {
    if (frame.data[i] != 0) return Error::out_of_range;
  }
  return frame.data[1];
}

/// Whether the frame has the identifier of this node's replies.
[[nodiscard]] constexpr bool is_from(const CanFrame& frame, std::uint8_t node) {
  return function_of(frame) == Function::reply && node_of(frame) == node;
}

}  // namespace absenc::raa38::can
