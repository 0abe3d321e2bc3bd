// SPDX-License-Identifier: Apache-2.0
// The descriptor of one protocol: all its properties for the neutral layers and the command, as data and functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>

#include "absenc/core/shaft.hpp"
#include "absenc/link/can.hpp"
#include "absenc/link/line.hpp"
#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/field.hpp"
#include "absenc/protocol/options.hpp"

namespace absenc {

/// The purpose of a command. The verbs of the command line find a unit's commands by it.
enum class Verb : std::uint8_t {
  read,  ///< the position, with all alarms that the unit can report; `read` uses the first such command
  read_part,
  info,
  temperature,
  clear_alarms,
  zero,
  reset_multiturn,
  memory_read,
  memory_write,
  config_get,
  config_set,
  scan,  ///< finds the encoders on the line: for each, a record that begins with its address
  run,   ///< a procedure that only this unit has
};

/// Description of an argument of a command.
struct Argument {
  std::string_view name;           ///< Name, as `NAME=VALUE` takes it.
  std::string_view meaning;        ///< Meaning of the value, with its unit.
  std::int64_t minimum;            ///< Lowest value.
  std::int64_t maximum;            ///< Highest value.
  std::int64_t default_value = 0;  ///< Value if the argument is not given and not `required`.
  bool required = true;            ///< Whether the argument must be given.
  Role role = Role::other;         ///< Role by which generic programs find it.
};

/// One value for each Argument of the command, with defaults filled in.
using Arguments = std::span<const std::int64_t>;

/// Description of a command of a unit.
struct Command {
  std::string_view name;                  ///< Name of the command.
  Verb verb;                              ///< The verb of the command line that runs it.
  std::uint8_t id;                        ///< the unit's own number of the command
  std::string_view meaning;               ///< Purpose of the command, as a phrase.
  std::span<const Argument> arguments{};  ///< Arguments in their order.
  bool changes_encoder = false;           ///< Whether it changes anything in the encoder.
  bool repeatable = true;                 ///< the same request may be sent again after an error
  /// Config_set: name of the config_get command that reads the setting; "": no command reads it, the setting has the
  /// name of this command, which checks the effect itself.
  std::string_view reads_back{};
  /// Config_set: option that gets the value of the first argument; later commands use the new value on the same open
  /// port.
  std::string_view changes_option{};
  /// Possible effect of its requests on other devices on the line, a sentence without its end; "": none. People are
  /// asked before it is sent.
  std::string_view disturbs{};
  bool reads_alarms = false;  ///< read_part: its reading has all alarms by name, although that of Verb::read may not
};

/// A range of bytes in the encoder's memory. The commands memory_read and memory_write access it by their arguments
/// with the roles address, page, count, value and force; memory_read reports a field with the role data, or value for a
/// single byte.
struct MemoryArea {
  std::uint32_t page;             ///< first page; 0 without pages
  std::uint32_t first;            ///< First address.
  std::uint32_t count;            ///< Number of bytes.
  std::string_view meaning;       ///< Content of the area, as a phrase.
  bool writable = true;           ///< Whether hosts may write it.
  bool in_dump = true;            ///< a copy of the memory includes it
  std::uint32_t write_life = 0;   ///< writes that the document permits; 0: unknown
  std::string_view protection{};  ///< why memory_write needs its argument of the role force here; "": it needs none
  bool life_in_total = false;     ///< write_life is for all bytes together; false: the document does not say
  std::uint32_t pages = 1;        ///< number of pages from `page` on that are alike; an encoder may have fewer

  /// Returns whether the area has this byte.
  [[nodiscard]] constexpr bool has(std::uint32_t on_page, std::uint32_t address) const {
    return on_page - page < pages && address >= first && address - first < count;
  }
};

/// A register of the encoder, accessed as a whole at its address. The commands memory_read and memory_write access it
/// by their arguments with the roles address and value.
struct RegisterInfo {
  std::string_view name;  ///< Name of the register.
  std::uint32_t address;  ///< Address of the register.
  std::uint32_t size;     ///< size in bytes
  bool readable = true;   ///< Whether hosts may read it.
  bool writable = false;  ///< Whether hosts may write it.
};

/// A property of a virtual encoder's environment that its document mentions: a temperature, a battery, a fault of one
/// channel.
struct Condition {
  std::string_view name;     ///< Name of the condition.
  std::string_view unit;     ///< unit as of a field; "" for yes (1) or no (0) and plain numbers
  std::string_view meaning;  ///< Meaning of the value, with its unit.
  std::int64_t minimum;      ///< Lowest value.
  std::int64_t maximum;      ///< Highest value.
  std::int64_t normal;       ///< initial value, that of a healthy installation
};

/// A frame in the form that its link carries.
struct Frame {
  Bytes bytes{};                  ///< The bytes; for a bit stream the bytes that contain it.
  std::size_t bits = 0;           ///< clocked links: number of valid bits in `bytes`
  const CanFrame* can = nullptr;  ///< the frame of CAN links

  /// Returns whether the frame has neither bytes nor a CAN frame.
  [[nodiscard]] constexpr bool empty() const { return bytes.empty() && can == nullptr; }
};

/// The expected value of a field in a vector.
struct Expected {
  std::string_view field;   ///< Name of the field.
  std::int64_t number = 0;  ///< Wanted value of an integer field.
  double real = 0;          ///< Wanted value of a field with a fraction.
  std::string_view text{};  ///< text and bytes fields: the bytes themselves
};

/// A frame and its decoded fields. `options` is "name=value name=value". Clocked links: request and reply are texts of
/// 0 and 1; CAN links: texts such as "1ff:022b000000000000".
struct Vector {
  std::string_view id;                 ///< Identifier of the vector, unique within the unit.
  std::string_view meaning;            ///< The case that the vector shows, as a phrase.
  std::string_view source;             ///< Document and paragraph of the frame.
  std::string_view options;            ///< Options of the encoder, as `name=value` separated by blanks.
  Bytes request;                       ///< Bytes of the request; empty: none.
  Bytes reply;                         ///< Bytes of the reply.
  std::span<const Expected> fields{};  ///< Wanted values of fields.
  Error error = Error::none;           ///< Wanted error; `Error::none`: the reply is valid.
};

/// A captured request and reply on a link that carries bytes. Without a request the reply alone must show it; an empty
/// reply: none was received.
struct Capture {
  Bytes request{};  ///< Bytes of the request; empty: none was captured.
  Bytes reply{};    ///< Bytes of the reply; empty: none was captured.
};

/// Evidence of captures about one value of one option.
struct OptionEvidence {
  std::size_t option;    ///< index into the unit's options
  std::int64_t value;    ///< Value of the option.
  bool possible;         ///< Whether an encoder with this value may have sent the captured frames.
  std::size_t capture;   ///< if not possible: the first capture that contradicts the value
  std::string_view why;  ///< the reason, a sentence
};

/// Receives the values of an option with their evidence.
struct EvidenceSink {
  /// Takes one value of an option.
  virtual void put(const OptionEvidence& evidence) = 0;

 protected:
  ~EvidenceSink() = default;
};

/// The bits of a value, or of a part of it, in a frame. Bits are numbered as for `Unit::is_checked`; the last bit of a
/// range is the most significant on lines of characters, the first on clocked links.
struct BitRange {
  std::size_t first = 0;  ///< Index of the first bit.
  std::size_t count = 0;  ///< Number of bits.
  bool inverted = false;  ///< a 0 on the wire is a 1 of the value
};

/// The parts of one value, the least significant first.
using BitRanges = Buffer<BitRange, 8>;

/// A frame that several exchanges carried, one byte each. It is decoded as other frames are.
struct Composed {
  Bytes request{};            ///< Bytes of the request.
  Bytes reply{};              ///< Bytes of the reply; empty: none.
  std::uint64_t first = 0;    ///< number of the exchange with which it began
  Error error = Error::none;  ///< an error that its bytes alone do not show: it contradicts the frames that carried it
};

/// Finds composed frames in the valid exchanges of one encoder, in the order of a capture.
struct Follower {
  /// Takes a valid exchange, or a reply without a request. `number` counts them.
  virtual void follow(std::uint64_t number, Bytes request, Bytes reply) = 0;
  /// Notes that frames were lost or damaged here.
  virtual void lose() = 0;
  /// Returns in `one` a composed frame that ended with the last exchange; false: there is no other. Valid until the
  /// next exchange.
  virtual bool take(Composed& one) = 0;

 protected:
  ~Follower() = default;
};

/// Direction of a frame.
enum class Direction : std::uint8_t { request, reply };

/// Where a frame ends in a sequence of bytes.
struct FrameEnd {
  /// Whether the end of a frame is known.
  enum class Kind : std::uint8_t {
    complete,            ///< the first `size` bytes are one frame
    incomplete,          ///< a frame may have begun; at least `size` bytes in all are needed
    no_frame,            ///< no frame begins with the first byte
  } kind;                ///< Whether the end of the frame is known.
  std::size_t size = 0;  ///< Length of the frame in bytes, if known.
};

/// A machine with the item that its link carries. Exactly one pointer is set; none if the machine could not be made.
template <template <class> class Role>
struct Any {
  Role<std::uint8_t>* bytes = nullptr;  ///< The machine, if its items are bytes; else null.
  Role<CanFrame>* frames = nullptr;     ///< The machine, if its items are CAN frames; else null.

  /// Returns the machine of this item; null if there is none.
  template <class Item>
  [[nodiscard]] constexpr Role<Item>* of() const {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      return frames;
    } else {
      return bytes;
    }
  }
};

inline constexpr std::size_t longest_encoded = 1024;  ///< bytes of a request that `encode` writes, at most

/// Bits of a position; 0: it has no such part.
struct Resolution {
  unsigned singleturn_bits = 0;   ///< Bits of the single-turn position; 0: none.
  unsigned multiturn_bits = 0;    ///< Bits of the turns; 0: none.
  double unit_um = 0;             ///< linear encoders: micrometres per count; 0: a rotary encoder
  bool multiturn_signed = false;  ///< turns below zero are counted
};

/// Wires beside the data on which a host sends requests as pulses.
struct ExtraWires {
  bool trigger = false;  ///< each frame needs a trigger pulse
  bool clear = false;    ///< a pulse sets the zero
};

/// Times of an asynchronous line, which decoding its captures needs.
struct LineTiming {
  unsigned pause_bits = 15;  ///< silence in bits that ends a frame; a shorter pause does not
  Time turnaround{};  ///< time from the end of a request to the begin of its reply, as the document has it; 0: unknown
  Time turnaround_limit = std::chrono::milliseconds(100);  ///< longest time that hosts wait for a reply to begin
};

/// Description of a protocol. All layers above know a protocol only by this.
struct Unit {
  std::string_view id;        ///< Identifier: the part of an address before the colon.
  std::string_view name;      ///< maker and protocol, for people
  std::string_view document;  ///< title of the document
  /// Makers and families to find the unit by: "Tamagawa", "Smart-Abs". Its models are in `models`.
  std::span<const std::string_view> known_as{};
  LinkKind link;                         ///< Kind of link between host and encoder.
  LineSettings line;                     ///< rate 0: the document states none, so the user must
  std::span<const Option> options;       ///< Options that an address may set.
  std::span<const Model> models;         ///< Models, which set several options by one name.
  std::span<const FieldInfo> fields;     ///< Fields that replies can have.
  std::span<const Command> commands;     ///< Commands of the encoder.
  std::span<const MemoryArea> memory{};  ///< areas that the commands memory_read and memory_write access, in order
  /// Registers that these commands access, of an encoder without bytes of memory.
  std::span<const RegisterInfo> registers{};
  std::span<const Vector> vectors;  ///< Frames with their meaning, from documents.
  const FieldInfo* status;          ///< flags of Reading::status; null: the unit has none
  const FieldInfo* alarms;          ///< flags of Reading::alarms
  /// Returns the alarms that an encoder with these options can report. Null: all.
  std::uint32_t (*reportable)(const Options& options) = nullptr;
  /// Flags of the second channel of an encoder with two. Their bits follow those of the first in one number, so
  /// comparing alarms compares both channels; people see the names of each.
  const FieldInfo* second_status = nullptr;
  const FieldInfo* second_alarms = nullptr;  ///< Field of the second alarms; null: none.
  std::size_t host_storage;                  ///< bytes that `host` needs, aligned for any type
  std::size_t device_storage;                ///< bytes that `device` needs

  /// Checks a reply against its request and puts its fields; with an empty reply, the fields of the request.
  Error (*decode)(const Options& options, Frame request, Frame reply, FieldSink& sink);
  /// Returns the error of `decode`; none: the reply, or with an empty reply the request, is valid.
  [[nodiscard]] Error check(const Options& values, const Frame& request, const Frame& reply) const {
    NoFields nowhere;
    return decode(values, request, reply, nowhere);
  }
  /// Writes the request of a command, at most `longest_encoded` bytes; on CAN and clocked links its text, as in
  /// vectors. Empty if a host only clocks. Errors: invalid_argument, buffer_too_small, unsupported.
  Result<std::size_t> (*encode)(const Options& options, const Command& command, Arguments arguments,
                                MutableBytes request);
  /// Returns where the frame that begins with `bytes` ends.
  FrameEnd (*frame_end)(const Options& options, Direction direction, Bytes bytes);
  /// Makes the conversation of a command in `storage`, which has `host_storage` bytes; none if the options contradict
  /// it.
  Any<Conversation> (*host)(const Options& options, const Command& command, Arguments arguments,
                            std::span<std::byte> storage);
  /// Makes a virtual encoder in `storage`, which has `device_storage` bytes; none if the options contradict each other.
  Any<Device> (*device)(const Options& options, const Shaft& shaft, std::span<std::byte> storage);
  /// Returns the bits of a position with these options.
  Resolution (*resolution)(const Options& options);
  /// Returns whether a flip of this bit in this valid reply must be detected. Null: every bit must. Bits count from the
  /// least significant of the first byte on; on clocked links in the order of the wire.
  bool (*is_checked)(const Options& options, Frame request, Frame reply, std::size_t bit) = nullptr;
  /// Returns the bits of a field in this valid reply that carries it; none if the field has no fixed place, or is
  /// computed (Gray code, decimal text). Null: unknown for all fields. The place may depend on options and request, so
  /// it is asked for each frame; the kit cuts the bits out of valid frames and compares them with the field.
  BitRanges (*bits)(const Options& options, Frame request, Frame reply, const FieldInfo& field) = nullptr;
  /// Returns the document's explanation of a reply that `decode` refuses with `error`. Null: it has none.
  Explanation (*explain)(const Options& options, Error error, Frame request, Frame reply) = nullptr;
  /// Returns the line with these options. Null: always `line`. Silences measured in characters follow its rate, and a
  /// conversation that changes the rate must know the old one.
  LineSettings (*settings)(const Options& options) = nullptr;
  /// The unit of the same encoder behind an SPI controller, if that is another one.
  const Unit* over_spi = nullptr;
  /// Puts every value of the probeable options; null: frames do not show them. Captures are in the order of time.
  /// Returns whether some values explain all captures; then `options`, which have the values of all other options, get
  /// these values, and defaults where captures leave them open.
  bool (*probe)(Options& options, std::span<const Capture> captures, EvidenceSink& sink) = nullptr;
  /// Returns the wires that these options need beside the data, before a port is opened: the user must name the wire,
  /// and a pseudo-terminal has none. Null: none.
  ExtraWires (*extra_wires)(const Options& options) = nullptr;
  LineTiming timing{};  ///< Times of the line, for captures.
  /// Returns whether the encoder sends unsolicited replies. Null: never. On clocked and CAN links it may always do so.
  bool (*streams)(const Options& options) = nullptr;
  /// Returns whether this valid request is answered. Null: every one is.
  bool (*is_answered)(const Options& options, Frame request) = nullptr;
  /// Returns how long after the last received item this valid request must not be repeated. Null: it may be repeated at
  /// once.
  Time (*pause)(const Options& options, Frame request) = nullptr;
  std::span<const Condition> conditions{};  ///< conditions of the virtual encoder, which can also be set while it runs
  /// Clocked links whose host sends a bit by the level of its clock line in each pause, 1 when it is low: returns the
  /// index of the bit in this reply with which the encoder sends one, too. Both together are decoded as request and
  /// reply, one bit per frame. Nothing: this reply has none. Null: no reply of the unit has one.
  std::optional<std::size_t> (*control_bit)(const Options& options, Frame reply) = nullptr;
  /// Returns `now`, the reading of one reply, completed by values that it does not carry and that earlier replies of
  /// the same encoder have reported since power on. `before`: the completed reading before it. Null: each reply has all
  /// values.
  Reading (*remembered)(const Reading& before, Reading now) = nullptr;
  /// Constructs a follower in storage of `follower_storage` bytes, aligned for any type. Null: no frame is carried by
  /// several exchanges.
  Follower* (*follower)(const Options& options, std::span<std::byte> storage) = nullptr;
  std::size_t follower_storage = 0;  ///< Bytes that a channel follower needs.
};

/// Returns whether a word format may replace some of the unit's options.
[[nodiscard]] constexpr bool takes_word(const Unit& unit) {
  for (const Option& option : unit.options) {
    if (option.describes_word) return true;
  }
  return false;
}

/// Returns the line with these options.
[[nodiscard]] inline LineSettings line_settings(const Unit& unit, const Options& options) {
  return unit.settings != nullptr ? unit.settings(options) : unit.line;
}

/// Returns the first command with this verb, or null.
[[nodiscard]] constexpr const Command* find_command(const Unit& unit, Verb verb) {
  for (const Command& command : unit.commands) {
    if (command.verb == verb) return &command;
  }
  return nullptr;
}

/// Returns the command with this name, or null.
[[nodiscard]] constexpr const Command* find_command(const Unit& unit, std::string_view name) {
  for (const Command& command : unit.commands) {
    if (command.name == name) return &command;
  }
  return nullptr;
}

}  // namespace absenc
