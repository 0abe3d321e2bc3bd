// SPDX-License-Identifier: Apache-2.0
// A virtual encoder of Nikon's A-format.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/in_a_row.hpp"
#include "absenc/protocol/nikon/protocol.hpp"

namespace absenc::nikon {

/// Conditions of the virtual encoder's environment that users can set.
inline constexpr auto conditions = std::array{Condition{"temperature", "degC", "of the encoder", 0, 125, 35}};

/// Returns the rules for the eight requests of a reset to an encoder of this format.
[[nodiscard]] constexpr author::InARow reset_row(const Format& format) {
  return {.requests = 8,
          .interval = frame_pause,
          .accepted = frame_pause + format.line().character(),
          .number_rule = "reset not sent eight times in a row",
          .interval_rule = "reset sent less than 10 us after the reply before"};
}

/// A virtual encoder with a memory of EEPROM words, zero, turns, identification and address.
class VirtualEncoder final : public author::Responder {
 public:
  /// Constructs an encoder that is off until `power_on`. `shaft` must outlive it.
  VirtualEncoder(const Format& format, const Shaft& shaft)
      : Responder(Protocol::device_times(format)), format_(format), shaft_(&shaft) {
    store_little_endian(MutableBytes(memory_).subspan(identity_at, 4), 0x00ABCDEF);
    memory_[address_at] = format.address;
  }
  [[nodiscard]] MutableBytes memory() override { return memory_; }
  /// Ends the alarms `bits`. Without a call of this function, an alarm ends when a reset clears it or the power goes
  /// off.
  void lower_alarms(std::uint32_t bits) override { latches_ &= static_cast<std::uint16_t>(~bits); }
  /// Raises the alarms `bits`.
  void raise_alarms(std::uint32_t bits) override { latches_ |= static_cast<std::uint16_t>(bits & alarm::all); }
  void set_condition(std::size_t, std::int64_t value, Time) override { temperature_ = value; }

 private:
  static constexpr std::size_t zero_at = 2 * user_words;
  static constexpr std::size_t turns_at = zero_at + 4;
  static constexpr std::size_t identity_at = turns_at + 8;
  static constexpr std::size_t address_at = identity_at + 4;
  static constexpr std::size_t memory_size = address_at + 1;

  // ---- Requests

  [[nodiscard]] std::size_t request_size(Bytes begin) const override { return Protocol::request_size(format_, begin); }
  [[nodiscard]] std::size_t others_reply_size(Bytes bytes) const override {
    const Result<Request> request = decode_request(format_, bytes);
    return request ? reply_length(request->code) : 0;
  }
  [[nodiscard]] bool is_mine(const Request& request) const {
    if (request.code == Code::assign_address) return request.value == identity();
    return is_for_all(request.code) || is_for_any_address(request.code) || request.address == address();
  }
  Answer respond(Bytes bytes, Time at, ByteBuffer<64>& reply) override {
    const Result<Request> request = decode_request(format_, bytes);
    if (!request) return Answer::none;
    if (!is_mine(*request)) return Answer::for_others;
    if (is_for_all(request->code)) {
      const Time one = slot(format_, request->code);
      take_turn(one * address(), one * encoder_count);
    }
    if (!is_reset(request->code)) resets_.end();
    // The reply to a request of a reset, or to command code 20 (give an address), shows address and alarms as they were
    // before this request.
    const OneReply before{.address = address(), .status = status(at), .data = data_for(*request, at)};
    reply.append(encode_reply(request->code, before).view());
    if (is_reset(request->code)) count_reset(*request, at);
    if (request->code == Code::assign_address) set_address(request->address, at);
    return Answer::sent;
  }
  void replied(Time at) override { resets_.measure_from(at); }
  bool is_refused(Flaw, Bytes) override {
    resets_.forget();
    return false;
  }

  // ---- Data of replies

  // Returns the status bits (ES). No source states their meanings; this encoder sends 1 if an alarm is raised,
  // otherwise 0.
  [[nodiscard]] std::uint8_t status(Time at) const { return alarms_at(at) != 0 ? 1 : 0; }
  [[nodiscard]] std::uint64_t data_for(const Request& request, Time at) {
    const std::uint64_t counts = position(at);
    switch (single(request.code)) {
      case Code::position:
        return counts;
      case Code::lower:
        return counts & low_mask(24);
      case Code::upper:
        return counts >> 16;
      case Code::short_position:
        return counts & low_mask(short_bits);
      case Code::with_alarms:
        return (counts & low_mask(24)) | std::uint64_t{alarms_at(at)} << 24;
      case Code::with_temperature:
        return (counts & low_mask(24)) | quarters() << 24;
      case Code::temperature:
        return quarters();
      case Code::read_memory:
      case Code::write_memory:
        return access_memory(request, at);
      case Code::write_identity:
      case Code::write_only_identity:
        write_identity(request.value, at);
        break;
      default:
        break;
    }
    if (has_identity(request.code)) return in_bit_order(format_, request.code, identity());
    return alarms_at(at);
  }
  // Returns the encoder's temperature in quarters of a degree.
  [[nodiscard]] std::uint64_t quarters() const { return static_cast<std::uint64_t>(4 * temperature_); }

  [[nodiscard]] std::uint64_t load(std::size_t at, std::size_t size) const {
    return load_little_endian(Bytes(memory_).subspan(at, size));
  }
  void store(std::size_t at, std::size_t size, std::uint64_t value) {
    store_little_endian(MutableBytes(memory_).subspan(at, size), value);
    change_memory();
  }
  [[nodiscard]] std::uint8_t address() const { return memory_[address_at] & 7; }
  [[nodiscard]] std::uint32_t identity() const { return static_cast<std::uint32_t>(load(identity_at, 4)); }
  [[nodiscard]] std::int64_t counts(Time at) const {
    const auto zero = static_cast<std::int64_t>(load(zero_at, 4));
    return (shaft_->at(at).position - zero) >> (32 - format_.singleturn_bits);
  }
  [[nodiscard]] std::uint64_t shaft_turns(Time at) const {
    return static_cast<std::uint64_t>(counts(at) >> format_.singleturn_bits);
  }
  [[nodiscard]] std::uint64_t turns(Time at) const { return shaft_turns(at) - load(turns_at, 8); }
  void set_turns(std::uint64_t wanted, Time at) { store(turns_at, 8, shaft_turns(at) - wanted); }
  [[nodiscard]] std::uint64_t position(Time at) const {
    const std::uint64_t within = static_cast<std::uint64_t>(counts(at)) & low_mask(format_.singleturn_bits);
    return within | (turns(at) & low_mask(format_.multiturn_bits)) << format_.singleturn_bits;
  }
  [[nodiscard]] std::uint16_t alarms_at(Time at) const {
    return static_cast<std::uint16_t>(latches_ | (at < memory_ready_at_ ? alarm::memory_busy : 0));
  }

  // ---- Resets and EEPROM

  void count_reset(const Request& request, Time at) {
    // Requests that set different addresses do not count as requests of the same reset.
    const unsigned row =
        static_cast<unsigned>(request.code) << 3 | (request.code == Code::set_address ? request.address : 0u);
    if (resets_.count(row, at, at)) reset(request, at);
  }
  // Executes a reset. No source states whether setting the zero changes the turns: this encoder keeps them.
  void reset(const Request& request, Time at) {
    memory_ready_at_ = at + memory_write_time;
    const Code code = request.code;
    if (code == Code::set_address) return set_address(request.address, at);
    if (code == Code::zero) {
      const std::uint64_t before = turns(at);
      store(zero_at, 4, static_cast<std::uint64_t>(shaft_->at(at).position) & low_mask(32));
      return set_turns(before, at);
    }
    if (code != Code::clear_alarms) set_turns(0, at);
    if (code != Code::clear_turns) latches_ = 0;
  }
  void set_address(std::uint8_t address, Time at) {
    store(address_at, 1, address);
    memory_ready_at_ = at + memory_write_time;
  }
  // Returns whether the EEPROM is ready. If not, records that the host broke a rule.
  bool is_ready(Time at) { return expect(at >= memory_ready_at_, "EEPROM accessed while it is busy", at); }
  void write_identity(std::uint32_t value, Time at) {
    if (!is_ready(at)) return;
    store(identity_at, 4, value);
    memory_ready_at_ = at + memory_write_time;
  }
  [[nodiscard]] std::uint16_t word(std::uint8_t address) const {
    if (address == temperature_address) return static_cast<std::uint16_t>(quarters());
    return static_cast<std::uint16_t>(address < user_words ? load(2 * std::size_t{address}, 2) : 0);
  }
  // Executes a read or write request for the EEPROM unless the EEPROM is busy. Returns the word that the encoder has
  // fetched for the previous request, with its address.
  [[nodiscard]] std::uint64_t access_memory(const Request& request, Time at) {
    const bool ready = is_ready(at);
    if (ready && fetching_) fetched_ = {*fetching_, word(*fetching_)};
    const std::uint64_t sent = in_bit_order(format_, request.code, fetched_.value) | std::uint64_t{fetched_.address}
                                                                                         << 16;
    if (!ready) return sent;
    fetching_ = request.word;
    const bool writes = request.code == Code::write_memory && request.word < user_words;
    if (writes) store(2 * std::size_t{request.word}, 2, request.value);
    memory_ready_at_ = at + (writes ? memory_write_time : memory_read_time);
    return sent;
  }

  void stopped(Time) override {
    latches_ = 0;
    fetched_ = {};
    fetching_.reset();
    memory_ready_at_ = Time{};
    resets_.forget();
  }

  struct Word {
    std::uint8_t address = 0;
    std::uint16_t value = 0;
  };

  Format format_;
  const Shaft* shaft_;
  std::array<std::uint8_t, memory_size> memory_{};
  std::int64_t temperature_ = conditions[0].normal;
  std::uint16_t latches_ = 0;
  Word fetched_{};                          // word that the encoder has fetched for the next reply
  std::optional<std::uint8_t> fetching_{};  // address of the word that the encoder is fetching
  Time memory_ready_at_{};
  author::InARow row_ = reset_row(format_);
  author::RowCounter resets_{row_, rules()};
};

}  // namespace absenc::nikon
