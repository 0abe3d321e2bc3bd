// SPDX-License-Identifier: Apache-2.0
// A virtual encoder with the HIPERFACE parameter channel: executes all its commands, and keeps position, counter, data
// fields and settings without power.
#pragma once

#include <array>
#include <cstdint>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/hiperface/frame.hpp"

namespace absenc::hiperface {

/// Conditions of the virtual encoder's environment that users can set.
inline constexpr std::array<Condition, 1> conditions{{{"temperature", "degC", "of the encoder", -40, 150, 35}}};
/// Temperature above which the virtual encoder raises its alarm `temperature`, in degC.
inline constexpr std::int64_t critical_temperature = 115;

/// A virtual encoder with its alarms, data fields, counter and settings.
class VirtualEncoder final : public author::Responder {
 public:
  /// Constructs an encoder that is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Format& format, const Shaft& shaft);

  [[nodiscard]] MutableBytes memory() override { return memory_; }
  void set_condition(std::size_t, std::int64_t value, Time) override { temperature_ = value; }
  void power_off(Time now) override;
  /// Returns what the port must do next, such as send, or change the rate of the line.
  Step<std::uint8_t> next(Time now) override;

 private:
  // The next constants are the layout of the memory. Each setting is stored as the exclusive OR with its value at
  // shipping, so that an empty memory is that of a new encoder.
  static constexpr std::size_t address_at = 0;
  static constexpr std::size_t interface_at = 1;
  static constexpr std::size_t codes_at = 2;  // index of the access codes 0 to 3 in the memory, 1 byte each
  // index in the memory of a difference, 4 bytes: the position that the encoder sends, minus that of the shaft
  static constexpr std::size_t offset_at = 6;
  static constexpr std::size_t counter_at = 10;
  // index in the memory of the data fields: one byte with the status of a field, then the bytes of the field, for each
  // field
  static constexpr std::size_t fields_at = 14;
  static constexpr std::size_t field_stride = 1 + field_capacity;
  static constexpr std::size_t memory_size = fields_at + user_fields * field_stride;
  // Data fields 0 and 1 exist at shipping. Each has 128 bytes, is writable, and needs access code 1.
  static constexpr std::uint8_t fields_at_shipping = 2;
  static constexpr std::uint8_t shipped_field =
      field_status::exists | field_status::writable | 0x10 | field_status::needs_code | field_status::size;

  // Result of a request: a status code that refuses it, or 0.
  using StatusCode = std::uint8_t;

  [[nodiscard]] std::size_t request_size(Bytes begin) const override { return request_length(format_, begin); }
  [[nodiscard]] std::size_t others_reply_size(Bytes request) const override;
  [[nodiscard]] bool begins_others_reply(std::uint8_t byte) const override { return is_address(byte); }
  Answer respond(Bytes bytes, Time at, ByteBuffer<64>& reply) override;
  bool is_refused(Flaw flaw, Bytes heard) override;
  void refuse(Time at, ByteBuffer<64>& reply) override;
  void started(Time at) override;

  StatusCode execute(const Request& request, Time at, Reply& reply);
  StatusCode set_position(const Request& request, Time at);
  StatusCode read_data(const Request& request, Reply& reply) const;
  StatusCode store_data(const Request& request);
  StatusCode create_field(const Request& request);
  StatusCode change_access_code(const Request& request);
  StatusCode set_address(const Request& request);
  StatusCode set_interface(const Request& request);
  StatusCode clear_counter(const Request& request);
  [[nodiscard]] StatusCode access(const Request& request, std::uint8_t status) const;
  [[nodiscard]] StatusCode status_now();
  [[nodiscard]] std::uint32_t alarms_now() const;

  [[nodiscard]] std::uint8_t address() const { return memory_[address_at] ^ format_.address; }
  [[nodiscard]] std::uint8_t interface_setting() const;
  // Returns access code `number`, 0 to 3. Access code 0 also protects the settings.
  [[nodiscard]] std::uint8_t access_code(std::size_t number) const;
  [[nodiscard]] std::uint8_t status_of(std::uint8_t field) const;
  [[nodiscard]] std::size_t free_memory() const;
  [[nodiscard]] std::uint32_t position(Time at) const;
  [[nodiscard]] bool is_to_me(std::uint8_t to) const { return to == address() || to == broadcast_address; }
  void change(std::size_t at, std::uint8_t value) {
    memory_[at] = value;
    change_memory();
  }

  Format format_;
  const Shaft* shaft_;
  std::array<std::uint8_t, memory_size> memory_{};
  std::int64_t temperature_ = conditions[0].normal;
  // mask of the alarms that status replies have reported already; cleared when all raised alarms are in it, so that the
  // replies report all alarms again
  std::uint32_t sent_ = 0;
  std::uint8_t refusal_ = 0;     // status code with which the encoder answers the next request that it refuses
  std::uint32_t next_rate_ = 0;  // baud rate that the line gets as soon as nothing is being sent; 0: the rate stays
};

}  // namespace absenc::hiperface
