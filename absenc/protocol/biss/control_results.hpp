// SPDX-License-Identifier: Apache-2.0
// Results of BiSS control communication and their fields.
#pragma once

#include <algorithm>
#include <optional>
#include <string_view>

#include "absenc/core/angle.hpp"
#include "absenc/protocol/author/field.hpp"
#include "absenc/protocol/biss/control.hpp"
#include "absenc/protocol/biss/frame.hpp"
#include "absenc/protocol/biss/registers.hpp"

namespace absenc::biss {

/// A list of numbers as text, separated by spaces.
class NumberList {
 public:
  /// Appends a number, at most 99999, to the list.
  constexpr void add(unsigned number) {
    if (!empty()) text_.push_back(' ');
    std::array<char, 5> digits{};
    std::size_t size = 0;
    do digits[size++] = static_cast<char>('0' + number % 10);
    while ((number /= 10) != 0 && size < digits.size());
    while (size > 0) text_.push_back(digits[--size]);
  }
  /// Returns whether the list has no number.
  [[nodiscard]] constexpr bool empty() const { return text_.empty(); }
  /// Returns the list as text.
  [[nodiscard]] constexpr std::string_view view() const { return {text_.view().data(), text_.size()}; }

 private:
  Buffer<char, 96> text_;  // Text of the list; characters that do not fit are dropped.
};

/// The two characters of a manufacturer as text; a character that cannot be printed is shown as `\x` and two
/// hexadecimal digits.
class MakerName {
 public:
  /// Appends `bytes`, which are values of the manufacturer registers.
  constexpr void append(Bytes bytes) {
    constexpr std::string_view hex = "0123456789ABCDEF";
    for (const std::uint8_t byte : bytes) {
      if (byte > ' ' && byte < 0x7F && byte != '\\') {
        text_.push_back(static_cast<char>(byte));
        continue;
      }
      for (const char c : {'\\', 'x', hex[byte >> 4], hex[byte & 15]}) text_.push_back(c);
    }
  }
  /// Returns whether no byte was appended.
  [[nodiscard]] constexpr bool empty() const { return text_.empty(); }
  /// Returns the manufacturer's characters as text.
  [[nodiscard]] constexpr std::string_view view() const { return {text_.view().data(), text_.size()}; }

 private:
  Buffer<char, 8> text_;
};

/// Results of a captured control frame, or of a procedure that sends control frames.
struct ControlResults {
  // ---- Results of a control frame
  std::optional<std::uint8_t> slaves{};         ///< Number of slaves with an ID.
  std::optional<bool> more_slaves{};            ///< Whether slaves without an ID are on the line.
  std::optional<std::string_view> operation{};  ///< Operation of the request: read, write or command.
  /// ID of the slave whose register was accessed, 0 to 7; 0 is the farthest from the host.
  std::optional<std::uint8_t> slave_id{};
  std::optional<std::uint8_t> bank{};     ///< Bank that was accessed or is selected; 0 for registers outside banks.
  std::optional<std::uint8_t> address{};  ///< Address of the first register that was accessed, 0 to 127.
  std::optional<std::uint8_t> value{};    ///< Value of the accessed register; if several were accessed, of the first.
  ByteBuffer<control_most> bytes;         ///< Values of successive registers.
  bool has_data = false;                  ///< Whether the results include `bytes`, the values of successive registers.
  /// Numbers of frames by which the encoder delayed each byte; empty if they are not known.
  NumberList start_delay;
  /// Whether the encoder permits access to the register that follows the last accessed one (P = 0).
  std::optional<bool> next_address_accepted{};
  std::optional<std::uint8_t> command{};  ///< Number of the command, 0 to 3.
  std::optional<bool> broadcast{};        ///< Whether the command is for all slaves, without acknowledgement.
  NumberList slave_ids;                   ///< IDs of the slaves to which a command is addressed.
  NumberList acknowledged;                ///< IDs of the slaves that acknowledged a command.
  std::optional<bool> executed{};         ///< Whether the host let the slaves execute the command (bit EX).
  // ---- Results of procedures
  /// Whether the register was written; false: the register already had the value to be written.
  std::optional<bool> written{};
  /// True: the encoder refused to read the register; otherwise no value.
  std::optional<bool> missing{};
  std::optional<std::uint8_t> eds_bank{};        ///< Bank of the electronic data sheet; 0: the encoder has none.
  std::optional<std::uint16_t> profile{};        ///< Number of the BiSS profile that the encoder has.
  std::optional<std::uint64_t> serial_number{};  ///< Serial number of the encoder.
  ByteBuffer<6> device_id;                       ///< Device ID of the encoder, six bytes; empty if it was not read.
  MakerName manufacturer;                        ///< Manufacturer's two characters; empty if they were not read.
  /// Position of the encoder; always empty, because results of control frames have no position.
  Reading reading{};
};

namespace shown {
constexpr std::optional<Bytes> some(Bytes bytes, bool there) { return there ? std::optional(bytes) : std::nullopt; }
template <class Text>
constexpr std::optional<std::string_view> some(const Text& list) {
  return list.empty() ? std::nullopt : std::optional(list.view());
}
constexpr std::optional<Bytes> data(const ControlResults& found) { return some(found.bytes, found.has_data); }
constexpr std::optional<std::string_view> start_delay(const ControlResults& found) { return some(found.start_delay); }
constexpr std::optional<std::string_view> slave_ids(const ControlResults& found) { return some(found.slave_ids); }
constexpr std::optional<std::string_view> acknowledged(const ControlResults& found) { return some(found.acknowledged); }
constexpr std::optional<Bytes> device_id(const ControlResults& found) {
  return some(found.device_id, !found.device_id.empty());
}
constexpr std::optional<std::string_view> manufacturer(const ControlResults& found) { return some(found.manufacturer); }
}  // namespace shown

/// Fields in which register accesses and commands are reported.
inline constexpr auto register_fields = author::fields_of<ControlResults>(
    author::field<&ControlResults::slaves>("slaves", "", "number of encoders with an ID"),
    author::field<&ControlResults::more_slaves>("more_slaves", "", "whether there are encoders without an ID"),
    author::field<&ControlResults::operation>("operation", "", "operation of the request: read, write or command"),
    author::field<&ControlResults::slave_id>("slave_id", "",
                                             "whose registers: 0 is the encoder at the end of the line"),
    author::field<&ControlResults::bank>("bank", "", "bank that was selected"),
    author::field<&ControlResults::address>("address", "", "of the first register"),
    author::field<&ControlResults::value>("value", "", "the register", Role::value),
    author::field<shown::data>("data", "", "values of successive registers", Role::data),
    author::field<shown::start_delay>("start_delay", "", "frames by which each byte was delayed"),
    author::field<&ControlResults::next_address_accepted>("next_address_accepted", "",
                                                          "whether the next register could be accessed too"),
    author::field<&ControlResults::command>("command", "", "its number"),
    author::field<&ControlResults::broadcast>("broadcast", "",
                                              "whether the command is for all encoders, without acknowledgement"),
    author::field<shown::slave_ids>("slave_ids", "", "encoders that are addressed"),
    author::field<shown::acknowledged>("acknowledged", "", "encoders that acknowledged the command"),
    author::field<&ControlResults::executed>("executed", "", "whether the host had the command executed"),
    author::field<&ControlResults::written>("written", "",
                                            "whether the value was written; it is not if the register has it already"),
    author::field<&ControlResults::missing>("missing", "",
                                            "the encoder refused to read this register: it does not have it"),
    author::field<&ControlResults::eds_bank>("eds_bank", "", "bank of the electronic data sheet; 0: none"),
    author::field<&ControlResults::profile>("profile", "", "of the encoder", Role::identity),
    author::field<&ControlResults::serial_number>("serial_number", "", "of the encoder", Role::identity),
    author::field<shown::device_id>("device_id", "", "of the encoder", Role::identity),
    author::field<shown::manufacturer>("manufacturer", "", "two letters, which the BiSS Association gives",
                                       Role::identity));

/// Stores the value `bytes` of the named register at `address` in its member of `found`.
constexpr void store_register(ControlResults& found, RegisterOrder order, unsigned address, Bytes bytes) {
  const std::uint64_t number = order == RegisterOrder::big ? load_big_endian(bytes) : load_little_endian(bytes);
  switch (address) {
    case registers::bank_select:
      found.bank = bytes[0];
      break;
    case registers::eds_bank:
      found.eds_bank = bytes[0];
      break;
    case registers::profile:
      found.profile = static_cast<std::uint16_t>(number);
      break;
    case registers::serial_number:
      found.serial_number = number;
      break;
    case registers::device_id:
      found.device_id.append(bytes);
      break;
    default:
      found.manufacturer.append(bytes);
  }
}

/// Returns the results of a control frame; if `answered` is false, only those of its request.
[[nodiscard]] constexpr ControlResults results_of(const ControlFrame& frame, bool answered) {
  constexpr std::array<std::string_view, 3> names{"read", "write", "command"};
  const ControlRequest& request = frame.request;
  const auto put_mask = [](NumberList& list, std::uint8_t mask) {
    for (unsigned i = 0; i < control_slaves; ++i) {
      if ((mask >> i & 1) != 0) list.add(i);
    }
  };
  ControlResults found;
  found.operation = names[static_cast<std::size_t>(request.operation)];
  if (answered) {
    found.slaves = frame.slaves;
    found.more_slaves = frame.more_slaves;
  }
  if (request.is_command()) {
    found.command = request.command;
    found.broadcast = request.slaves == 0;
    put_mask(found.slave_ids, request.slaves);
    put_mask(found.acknowledged, frame.acknowledged);
    if (answered) found.executed = frame.executed;
    return found;
  }
  found.slave_id = request.slave;
  found.address = request.address;
  found.bytes = frame.data;
  found.has_data = answered || !frame.data.empty();
  if (answered) {
    for (const std::uint16_t delay : frame.start_delay.view()) found.start_delay.add(delay);
    found.next_address_accepted = frame.next_address_accepted;
  }
  return found;
}

}  // namespace absenc::biss
