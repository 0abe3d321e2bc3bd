// SPDX-License-Identifier: Apache-2.0
// Options, commands and explanations that the three BiSS units (one word, Safety, chain) share.
#pragma once

#include <array>
#include <optional>
#include <type_traits>

#include "absenc/protocol/author/unit.hpp"
#include "absenc/protocol/biss/device.hpp"
#include "absenc/protocol/biss/procedures.hpp"

namespace absenc::biss {

/// Argument: address of a register.
inline constexpr Argument address_argument{"address", "of the register", 0, registers::end - 1, 0, true, Role::address};
/// Argument: bank in which the addresses 0 to 63 are accessed.
inline constexpr Argument bank_argument{"bank", "of addresses 0 to 63", 0, 255, 0, false, Role::page};
/// Arguments of `memory-read`.
inline constexpr std::array<Argument, 3> read_arguments{
    {address_argument,
     bank_argument,
     {"count", "registers from the address on", 1, control_most, 1, false, Role::count}}};
/// Arguments of `memory-write`.
inline constexpr std::array<Argument, 4> write_arguments{
    {address_argument,
     {"value", "the byte", 0, 255, 0, true, Role::value},
     bank_argument,
     {"force", "1: also registers that are defined by the maker", 0, 1, 0, false, Role::force}}};
/// Arguments of the command that selects a bank.
inline constexpr std::array<Argument, 1> select_arguments{{{"bank", "that addresses 0 to 63 mean", 0, 255}}};
/// Arguments of the command that sends a BiSS command to slaves.
inline constexpr std::array<Argument, 2> command_arguments{
    {{"slaves", "bit n is slave n; 0: all, without acknowledgement", 0, 255}, {"command", "its number", 0, 3}}};

/// A register that has a command of its own, which reads it by name.
struct NamedRegister {
  std::string_view name;     ///< Name of the register.
  unsigned address;          ///< Address of the register.
  std::string_view meaning;  ///< Meaning of the register's content, as words for people.
};
/// All registers that can be read by name.
inline constexpr std::array<NamedRegister, 6> named_registers{{
    {"bank", registers::bank_select, "bank of addresses 0 to 63"},
    {"eds-bank", registers::eds_bank, "the bank of its electronic data sheet; 0: none"},
    {"profile", registers::profile, "profile of the encoder"},
    {"serial-number", registers::serial_number, "its serial number"},
    {"device-id", registers::device_id, "device id of the encoder"},
    {"manufacturer", registers::manufacturer, "manufacturer of the encoder"},
}};

/// Returns the empty request of a clocked link.
template <class F>
constexpr author::NoRequest no_request(const F&, Arguments) {
  return {};
}

/// Option of all BiSS units: rate of the clock MA in kHz.
template <auto member>
inline constexpr auto clock_option = author::option<member>("ma_khz", "clock, kHz", 10, 10'000);
/// Values of the two options from which the BiSS timeout is made.
struct TimeoutSettings {
  std::uint16_t timeout_tenths = 0;  ///< Fixed BiSS timeout in 0.1 us; 0: unknown.
  bool adaptive_timeout = false;     ///< Whether the encoder adapts its timeout to the clock.

  /// Returns the BiSS timeout that the options `timeout_tenths` and `adaptive_timeout` give.
  [[nodiscard]] constexpr Timeout timeout_given() const {
    if (adaptive_timeout) return Timeout::adaptive();
    return timeout_tenths == 0 ? Timeout{} : Timeout::fixed(Time(timeout_tenths * 100));
  }
};
/// Option: fixed BiSS timeout in microseconds.
inline constexpr auto timeout_option = author::or_zero(author::decimal<
                                                       1>(author::option<&TimeoutSettings::timeout_tenths>(
    "timeout_us",
    "how long SLO stays low behind the last clock, us; 0: not known: the host leaves 40, the virtual encoder takes 20",
    125, 400, 5)));
/// Option: whether the BiSS timeout adapts to the clock.
inline constexpr auto adaptive_timeout_option = author::option<&TimeoutSettings::adaptive_timeout>(
    "adaptive_timeout", "it is one and a half periods of the clock instead, however fast that is");
/// Option of the virtual encoder: how it sets the bit P after a register (1: the next register is refused).
template <auto member>
inline constexpr auto stop_bit_option = author::option<member>(
    "stop_bit",
    "virtual encoder: the bit P behind a register: next is 1 where the one behind it would be refused, as the document "
    "has it",
    stop_bit_choices);
/// Option of the virtual encoder: delay of the line, there and back.
template <auto member>
inline constexpr auto line_delay_option = author::option<member>("line_delay_ns",
                                                                 "virtual encoder: delay of the line, there and back",
                                                                 0, 100'000);
/// Option: byte order of the registers that hold a number, such as profile and serial number.
template <auto member>
inline constexpr auto register_order_option = author::option<member>(
    "register_byte_order", "of profile and serial number: some makers have the low byte first", register_order_choices);
/// Option of the virtual encoder: time until a requested register is ready.
template <auto member>
inline constexpr auto register_delay_option = author::option<member>(
    "register_delay_us", "virtual encoder: the time until a register that is asked for is there, us", 0, 65'535);
/// Option of the virtual encoder: whether it stays idle until the host has sent the start sequence.
template <auto member>
inline constexpr auto start_sequence_option = author::option<member>(
    "start_sequence", "virtual encoder: after power on it shows nothing before the start sequence");

/// Puts the results of a command that sends control frames into `sink`.
template <class F>
constexpr void put_registers(FieldSink& sink, const F&, const ControlResults& found) {
  register_fields.put(sink, found);
}
/// Describes how the results of commands that send control frames are reported.
template <class F>
inline constexpr author::Finding<F, ControlResults> control_results{.put = put_registers<F>};

/// Returns the commands of a BiSS unit: read a position, access registers, send commands.
template <const auto& report, class F>
[[nodiscard]] constexpr auto commands_of(bool (*is_readable)(const F&)) {
  constexpr auto request = no_request<F>;
  const auto setting = [is_readable]<std::size_t index>(std::integral_constant<std::size_t, index>) {
    constexpr NamedRegister one = named_registers[index];
    return author::command<report, control_results<F>, read_setting<F>, request, one.address>(
               {one.name, Verb::config_get, 0, one.meaning})
        .only_if(is_readable);
  };
  return std::array{
      author::clocked_reading<report, FindPosition<F>>(
          {"position", Verb::read, 0, "position, turns, error and warning"})
          .only_if(is_readable),
      author::command<report, control_results<F>, read_info<F>, request>(
          {"info", Verb::info, 0, "number of encoders, profile, serial number, device id"})
          .only_if(is_readable),
      author::command<report, control_results<F>, read_memory<F>, request>(
          {"memory-read", Verb::memory_read, 0, "read registers; the bank stays selected", read_arguments})
          .only_if(is_readable),
      author::command<report, control_results<F>, write_memory<F>, request>(
          {"memory-write", Verb::memory_write, 0, "write a register; the bank stays selected", write_arguments, true,
           false})
          .only_if(is_readable),
      setting(std::integral_constant<std::size_t, 0>{}),
      author::command<report, control_results<F>, write_bank<F>, request>(
          {"set-bank", Verb::config_set, 0, "select a bank", select_arguments, true, false, "bank"})
          .only_if(is_readable),
      setting(std::integral_constant<std::size_t, 1>{}),
      setting(std::integral_constant<std::size_t, 2>{}),
      setting(std::integral_constant<std::size_t, 3>{}),
      setting(std::integral_constant<std::size_t, 4>{}),
      setting(std::integral_constant<std::size_t, 5>{}),
      author::command<report, control_results<F>, send_command<F>, request>(
          {"control-command", Verb::run, 0, "a command of control communication", command_arguments, true, false})
          .only_if(is_readable),
  };
}

/// Returns cause and advice for an error of a frame; either may be empty.
template <class F>
[[nodiscard]] Explanation explain_frame(const F& format, Error error, Bytes = {}, Bytes reply = {}) {
  switch (error) {
    case Error::invalid_argument:
      if (ProtocolOf<F>::clocks(format) <= ProtocolOf<F>::most_clocks) return {};
      return {"a frame of more than 512 clocks: lower latency_us or ma_khz"};
    case Error::truncated:
      return {"ACK and line take longer than latency_us allows at this clock: raise it, or lower the MA clock"};
    case Error::bad_checksum:
      if (typename ProtocolOf<F>::Reply head; !reply.empty() && is_empty_frame({reply, reply.size() * 8}, head)) {
        return {"zeros alone follow the start bit: the process data of the encoder are switched off",
                "switch them on: `absenc run ... control-command 1 0`, or switch the supply off and on"};
      }
      return {"the delay of the line may not suit this MA clock: try another one"};
    default:
      return {};
  }
}

/// Returns whether the checks must detect a wrong sample `bit`: false for the last idle sample, the ACK and the start
/// bit, whose errors may remain undetected.
[[nodiscard]] inline bool is_behind_ack(Frame reply, std::size_t bit) {
  const BitView samples = author::to_bits(reply);
  const std::size_t idle = samples[0] ? samples.end_of_run(0) : 0;
  return bit + 1 < idle || bit > samples.end_of_run(idle);
}

/// Returns the index of the CDS sample; no value if the reply ends before it.
[[nodiscard]] inline std::optional<std::size_t> place_of_cds(Frame reply) {
  const BitView samples = author::to_bits(reply);
  if (samples.size == 0) return std::nullopt;
  const std::size_t start = samples.end_of_run(samples[0] ? samples.end_of_run(0) : 0);
  return start + 1 < samples.size ? std::optional(start + 1) : std::nullopt;
}

// ---- Parts of the declaration that all BiSS units share

/// Writes the CDM bits of a command's control frame as '0' and '1', and returns their number; 0 for `position` and
/// `info`.
template <class F>
Result<std::size_t> encode_control(const F& format, const Command& command, Arguments arguments, MutableBytes out) {
  ControlMaster master;
  const auto value = [&](std::size_t i) { return static_cast<unsigned>(arguments[i]); };
  const auto byte = [&](std::size_t i) { return std::array{static_cast<std::uint8_t>(arguments[i])}; };
  switch (command.verb) {
    case Verb::memory_read:
      if (value(0) + value(2) > registers::end) return Error::invalid_argument;
      master.read(format.slave, value(0), value(2));
      break;
    case Verb::memory_write:
      master.write(format.slave, value(0), byte(1));
      break;
    case Verb::config_set:
      master.write(format.slave, registers::bank_select, byte(0));
      break;
    case Verb::config_get:
      for (const NamedRegister& one : named_registers) {
        if (one.name == command.name) master.read(format.slave, one.address, registers::size_of(one.address));
      }
      break;
    case Verb::run:
      master.command(static_cast<std::uint8_t>(arguments[0]), value(1));
      break;
    default:
      return std::size_t{0};
  }
  BitBuffer<1024> bits;
  append_cdm(master, control_slaves, bits);
  if (bits.size() > out.size()) return Error::buffer_too_small;
  for (std::size_t i = 0; i < bits.size(); ++i) out[i] = bits.view()[i] ? '1' : '0';
  return bits.size();
}

/// Returns the line settings of BiSS, which are the same for all formats.
template <class F>
constexpr LineSettings line_of(const F&) {
  // The rate in `line_settings` is not that of the format, because the conversation sets the clock rate itself.
  return line_settings;
}

/// Decodes a control frame into `sink`: `asked` has its CDM bits, `answered` its CDS bits.
inline Error decode_control_frame(Frame asked, Frame answered, FieldSink& sink) {
  const Result<ControlFrame> frame = decode_control(author::to_bits(asked), author::to_bits(answered));
  if (!frame) return frame.error();
  register_fields.put(sink, results_of(*frame, !answered.empty()));
  return Error::none;
}
/// Returns the index of the CDS bit in a frame; no value if the frame ends before it.
inline std::optional<std::size_t> control_bit(const Options&, Frame reply) { return place_of_cds(reply); }

}  // namespace absenc::biss
