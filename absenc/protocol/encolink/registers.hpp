// SPDX-License-Identifier: Apache-2.0
// Channel 3 of EncoLink carries register accesses: the registers of an AksIM-2, and the bytes of an access.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"
#include "absenc/protocol/encolink/frame.hpp"

namespace absenc::encolink {

/// Values of the channel 3 byte that show the state of the encoder.
namespace channel3 {
inline constexpr std::uint8_t idle = 0x33;  ///< Idle: the encoder executes no register access.
inline constexpr std::uint8_t busy = 0x66;  ///< Busy: the encoder is executing a register access.
/// The encoder's answer to a read begins: status and data follow, one byte per cycle.
inline constexpr std::uint8_t read_ready = 0x88;
/// The encoder's answer to a write begins: the status follows in the next cycle.
inline constexpr std::uint8_t write_ready = 0x99;
}  // namespace channel3

/// Status byte in the encoder's answer to a register access.
enum class AccessStatus : std::uint8_t {
  ok = 0x09,
  no_such_register = 0x26,
  out_of_range = 0x56,
  denied = 0x96,
  read_checksum = 0xE4,
  /// Status with the same meaning as read_checksum; some of the vendor's code has this value instead.
  read_checksum_too = 0xE6,
  byte_count = 0xEE,
  locked = 0xF6,
  write_checksum = 0xF9,
};

/// Returns whether the status means that the encoder received damaged bytes, so that a repetition may help.
[[nodiscard]] constexpr bool is_damaged(AccessStatus status) {
  return status == AccessStatus::read_checksum || status == AccessStatus::read_checksum_too ||
         status == AccessStatus::write_checksum;
}

/// Returns the meaning of the encoder's status byte as a sentence.
[[nodiscard]] constexpr std::string_view text_of(AccessStatus status) {
  constexpr auto texts = std::to_array<std::pair<AccessStatus, std::string_view>>({
      {AccessStatus::ok, "done"},
      {AccessStatus::no_such_register, "the encoder has no register at this address"},
      {AccessStatus::out_of_range, "the value is outside the range of this register"},
      {AccessStatus::denied, "access denied: this register cannot be written"},
      {AccessStatus::byte_count, "the register has another number of bytes"},
      {AccessStatus::locked, "the configuration is locked: write 0 to the register write_lock first"},
  });
  if (is_damaged(status)) return "the request reached the encoder with a wrong CRC";
  for (const auto& [one, text] : texts) {
    if (one == status) return text;
  }
  return "the encoder answered with an unknown status";
}

/// Whether hosts can read and write a register.
enum class Access : std::uint8_t { read_only, read_write, write_only };

/// How the bytes of a register are decoded. All numbers are big endian.
// Values of the kinds celsius and rpm are signed, in tenths of 1 degC and of 1 rpm.
enum class Content : std::uint8_t { number, celsius, rpm, flags, text };

/// Description of a register of the encoder: a row of the table `registers`.
struct Register {
  std::string_view name;              ///< Name of the register, as fields and commands have it.
  std::uint16_t address;              ///< Address of the register.
  std::uint8_t size;                  ///< Number of bytes of the register.
  Access access;                      ///< Whether hosts can read and write the register.
  Content content = Content::number;  ///< How the bytes of the register are decoded.
  bool in_info = false;               ///< Whether the command `info` reads the register.
};

/// Index of a register in the table `registers`.
enum RegisterIndex : std::size_t {
  position_offset,
  position_filter,
  position_filter_speed,
  velocity_filter,
  velocity_filter_speed,
  multiturn_preset,
  calibration_range,
  eccentricity,
  eccentricity_phase,
  radial_displacement,
  write_lock,
  firmware_major,
  firmware_minor,
  protocol_register,
  revision,
  command_register,
  temperature,
  speed,
  calibration_status,
  serial_number,
  part_number,
  serial_number_extended,
};

/// Table of the registers. Addresses and sizes are from rls-encolink 1.0.1, product_aksim2_map.h. README.md lists the
/// assumptions.
inline constexpr auto registers = [] {
  using enum Access;
  using enum Content;
  return std::to_array<Register>({
      {"position_offset", 0x00, 4, read_write},
      {"position_filter", 0x04, 4, read_write},
      {"position_filter_speed", 0x08, 4, read_write},
      {"velocity_filter", 0x0C, 4, read_write},
      {"velocity_filter_speed", 0x10, 4, read_write},
      {"multiturn_preset", 0x14, 4, read_write},
      {"calibration_range", 0x19, 2, read_write},
      {"eccentricity", 0x1B, 2, read_only},
      {"eccentricity_phase", 0x1D, 2, read_only},
      {"radial_displacement", 0x1F, 2, read_only},
      {"write_lock", 0x2E, 1, read_write, number, true},
      {"firmware_major", 0x2F, 2, read_only, number, true},
      {"firmware_minor", 0x31, 2, read_only, number, true},
      {"protocol_register", 0x33, 4, read_only},
      {"revision", 0x35, 4, read_only},
      {"command", 0x49, 1, write_only},
      {"temperature_c", 0x4C, 2, read_only, celsius, true},
      {"speed_rpm", 0x50, 4, read_only, rpm, true},
      {"calibration_status", 0x52, 1, read_only, flags},
      {"serial_number", 0x5C, 8, read_only, text, true},
      {"order_number", 0x64, 20, read_only, text, true},
      {"serial_number_extended", 0x100, 16, read_only, text, true},
      {"temperature_compensation_k", 0x120C, 4, read_only},
      {"temperature_compensation_n", 0x1210, 4, read_only},
      {"voltage_compensation_k", 0x1214, 4, read_only},
      {"voltage_compensation_n", 0x1218, 4, read_only},
  });
}();
inline constexpr std::size_t largest_register = 20;  ///< Number of bytes of the largest register in the table.

/// Values that a host writes to the command register.
namespace commands {
inline constexpr std::uint8_t save = 0x63;  ///< Command that stores the configuration in the non-volatile memory.
/// Command that restores the values at shipping; without `save` they are lost at power off.
inline constexpr std::uint8_t reset = 0x72;
inline constexpr std::uint8_t self_calibrate = 0x41;  ///< Command that starts the self-calibration.
}  // namespace commands

/// Bits of the register calibration_status.
namespace calibration {
inline constexpr std::uint8_t count = 0x03;  ///< Mask of the counter of finished self-calibrations, modulo 4.
/// Bit: the shaft did not turn far enough in time for the last self-calibration.
inline constexpr std::uint8_t timed_out = 0x04;
inline constexpr std::uint8_t out_of_range = 0x08;  ///< Bit: the last self-calibration found the ring too eccentric.
}  // namespace calibration

/// Returns the register at `address`; null if the table has no register with this address.
[[nodiscard]] constexpr const Register* find_register(std::uint32_t address) {
  for (const Register& one : registers) {
    if (one.address == address) return &one;
  }
  return nullptr;
}

/// Greatest number of data bytes of one register access; limit of the vendor's library.
inline constexpr std::size_t access_capacity = 100;

/// A register access: read or write.
struct RegisterRequest {
  /// Operation codes in the bytes of a register access.
  enum class Operation : std::uint8_t { write = 0x58, read = 0x59 };
  Operation operation = Operation::read;  ///< Whether the register access reads or writes.
  std::uint32_t address = 0;              ///< Address of the accessed register.
  std::uint16_t length = 0;               ///< Number of bytes to read or write.
  ByteBuffer<access_capacity> data{};     ///< Bytes to write, `length` in number; empty for a read.
};

/// First bytes of every register access, by which the encoder recognises it.
inline constexpr std::array<std::uint8_t, 5> access_keys{0x00, 0xCD, 0xEF, 0x89, 0xAB};
/// Number of bytes before the data: keys, operation, length and address.
inline constexpr std::size_t access_header = access_keys.size() + 1 + 2 + 4;
/// Buffer for all bytes of a register access.
using AccessBytes = ByteBuffer<access_header + access_capacity + 1>;

/// Returns a register access that reads `length` bytes at `address`.
[[nodiscard]] constexpr RegisterRequest read_request(std::uint32_t address, std::uint16_t length) {
  return {RegisterRequest::Operation::read, address, length};
}

/// Returns a register access that writes `value` as `size` bytes, 1 to 8.
[[nodiscard]] constexpr RegisterRequest write_request(std::uint32_t address, std::uint16_t size, std::uint64_t value) {
  RegisterRequest request{RegisterRequest::Operation::write, address, size};
  std::array<std::uint8_t, 8> bytes{};
  store_big_endian(bytes, value);
  request.data.append(Bytes(bytes).last(size));
  return request;
}

/// Returns all bytes of a register access; successive requests carry them as their second bytes (`ra`).
[[nodiscard]] constexpr AccessBytes encode_access(const RegisterRequest& request) {
  AccessBytes bytes;
  bytes.append(access_keys);
  bytes.push_back(static_cast<std::uint8_t>(request.operation));
  std::array<std::uint8_t, 6> numbers{};
  store_big_endian(numbers, std::uint64_t{request.length} << 32 | request.address);
  bytes.append(numbers);
  if (request.operation == RegisterRequest::Operation::write) bytes.append(request.data);
  bytes.push_back(checksum(bytes.view().subspan(access_keys.size() + 1)));
  return bytes;
}

/// Returns whether `request` is the bytes of a register access: it has a byte other than 0 behind its first two.
[[nodiscard]] constexpr bool is_access(Bytes request) {
  if (request.size() <= request_bytes) return false;
  const Bytes behind = request.subspan(request_bytes);
  return std::any_of(behind.begin(), behind.end(), [](std::uint8_t byte) { return byte != 0; });
}

/// Decodes the bytes of a register access, collected from the second bytes (`ra`) of requests. Errors: bad_framing,
/// unsupported, wrong_length, bad_checksum.
[[nodiscard]] constexpr Result<RegisterRequest> decode_access(Bytes bytes) {
  for (std::size_t i = 0; i < access_keys.size(); ++i) {
    if (i == bytes.size()) return Error::wrong_length;
    if (bytes[i] != access_keys[i]) return Error::bad_framing;
  }
  if (bytes.size() <= access_header) return Error::wrong_length;
  RegisterRequest request;
  request.operation = static_cast<RegisterRequest::Operation>(bytes[access_keys.size()]);
  const bool writes = request.operation == RegisterRequest::Operation::write;
  if (!writes && request.operation != RegisterRequest::Operation::read) return Error::unsupported;
  const Bytes body = bytes.subspan(access_keys.size() + 1);
  request.length = static_cast<std::uint16_t>(load_big_endian(body.first(2)));
  request.address = static_cast<std::uint32_t>(load_big_endian(body.subspan(2, 4)));
  if (bytes.size() != access_header + (writes ? request.length : 0) + 1) return Error::wrong_length;
  if (!is_sealed(body)) return Error::bad_checksum;
  if (writes && !request.data.append(body.subspan(6, request.length))) return Error::wrong_length;
  return request;
}

/// Decodes the answer to a register access, and returns the data that was read. Errors: wrong_length, unexpected_reply,
/// request_rejected.
[[nodiscard]] constexpr Result<Bytes> decode_answer(const RegisterRequest& request, Bytes answer) {
  if (answer.size() < 2) return Error::wrong_length;
  const bool reads = request.operation == RegisterRequest::Operation::read;
  if (answer[0] != (reads ? channel3::read_ready : channel3::write_ready)) return Error::unexpected_reply;
  if (static_cast<AccessStatus>(answer[1]) != AccessStatus::ok) return Error::request_rejected;
  if (answer.size() != 2u + (reads ? request.length : 0u)) return Error::wrong_length;
  return answer.subspan(2);
}

}  // namespace absenc::encolink
