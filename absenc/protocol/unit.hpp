// SPDX-License-Identifier: Apache-2.0
// The descriptor of one protocol: everything the neutral layers and the command know about it, as data and functions.
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

/// What a command is for. The command-line verbs look a unit's commands up by this.
enum class Verb : std::uint8_t {
  read,  ///< the position, with all the alarms the unit can tell; the first such command is the one `read` uses
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
  scan,  ///< who answers on a line: for each, a record that begins with its address
  run,   ///< a procedure only this unit has
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

using Arguments = std::span<const std::int64_t>;  ///< one value for each Argument of the command, defaults filled in

/// Description of a command of a unit.
struct Command {
  std::string_view name;                  ///< Name of the command.
  Verb verb;                              ///< The verb of the command line that runs it.
  std::uint8_t id;                        ///< the unit's own number for it
  std::string_view meaning;               ///< What it does, as a phrase.
  std::span<const Argument> arguments{};  ///< Arguments in their order.
  bool changes_encoder = false;           ///< Whether it changes anything in the encoder.
  bool repeatable = true;                 ///< whether the same request may be sent again after an error
  std::string_view reads_back{};  ///< config_set: the name of the config_get command that reads this setting; "": none
                                  ///< can, the setting has the name of this command, which looks at the effect itself
  std::string_view changes_option{};  ///< config_set: the option that must follow its first argument; who goes on does
                                      ///< so with the new value, on the same open port
  std::string_view disturbs{};        ///< what its requests may do to other devices on the line, a sentence without its
                                      ///< end; "": nothing. People are asked before it is sent
  bool reads_alarms = false;  ///< read_part: its reading has all the alarms by name, where that of Verb::read may not
};

/// A run of bytes in the encoder's memory. The commands memory_read and memory_write reach it by their arguments with
/// the roles address, page, count, value and force; memory_read reports a field with the role data, or value for a
/// single byte.
struct MemoryArea {
  std::uint32_t page;             ///< 0 where there are no pages
  std::uint32_t first;            ///< First address.
  std::uint32_t count;            ///< Number of bytes.
  std::string_view meaning;       ///< What the area holds, as a phrase.
  bool writable = true;           ///< Whether hosts may write it.
  bool in_dump = true;            ///< whether it belongs to a copy of the memory
  std::uint32_t write_life = 0;   ///< writes that the document permits; 0: not known
  std::string_view protection{};  ///< why only memory_write's argument of the role force writes it; "": it needs none
  bool life_in_total = false;     ///< write_life is of all bytes together; false: the document does not say of what
  std::uint32_t pages = 1;        ///< this one and those behind it, which are alike and which an encoder may lack

  /// Returns whether the area has this byte.
  [[nodiscard]] constexpr bool has(std::uint32_t on_page, std::uint32_t address) const {
    return on_page - page < pages && address >= first && address - first < count;
  }
};

/// A register of the encoder: accessed as a whole, at its address. The commands memory_read and memory_write reach it
/// by their arguments with the roles address and value.
struct RegisterInfo {
  std::string_view name;  ///< Name of the register.
  std::uint32_t address;  ///< Address of the register.
  std::uint32_t size;     ///< bytes
  bool readable = true;   ///< Whether hosts may read it.
  bool writable = false;  ///< Whether hosts may write it.
};

/// Something around a virtual encoder that its document speaks of: a temperature, a battery, a fault of one channel.
struct Condition {
  std::string_view name;     ///< Name of the condition.
  std::string_view unit;     ///< as of a field; "" for yes (1) or no (0) and plain numbers
  std::string_view meaning;  ///< Meaning of the value, with its unit.
  std::int64_t minimum;      ///< Lowest value.
  std::int64_t maximum;      ///< Highest value.
  std::int64_t normal;       ///< of a healthy installation: what it begins with
};

/// A frame in the form its link carries.
struct Frame {
  Bytes bytes{};                  ///< The bytes, or of a bit stream the bytes that hold it.
  std::size_t bits = 0;           ///< clocked links: how many bits of `bytes` count
  const CanFrame* can = nullptr;  ///< CAN links

  /// Returns whether there is neither a byte nor a CAN frame.
  [[nodiscard]] constexpr bool empty() const { return bytes.empty() && can == nullptr; }
};

/// One expected value of a vector.
struct Expected {
  std::string_view field;   ///< Name of the field.
  std::int64_t number = 0;  ///< Wanted value of an integer field.
  double real = 0;          ///< Wanted value of a field with a fraction.
  std::string_view text{};  ///< of text and bytes fields: the bytes themselves
};

/// A frame with what it must decode to. `options` is "name=value name=value". Clocked links: request and reply are
/// texts of 0 and 1; CAN links: texts as "1ff:022b000000000000".
struct Vector {
  std::string_view id;                 ///< Identifier of the vector, unique within the unit.
  std::string_view meaning;            ///< What the vector shows, as a phrase.
  std::string_view source;             ///< Document and paragraph of the frame.
  std::string_view options;            ///< Options of the encoder, as `name=value` separated by blanks.
  Bytes request;                       ///< Bytes of the request; empty: none.
  Bytes reply;                         ///< Bytes of the reply.
  std::span<const Expected> fields{};  ///< Wanted values of fields.
  Error error = Error::none;           ///< Wanted error; `Error::none`: the reply is valid.
};

/// A reply as it was captured on a link that carries bytes, and what had been asked. Without the request the reply
/// itself must tell; an empty reply: none came.
struct Capture {
  Bytes request{};  ///< Bytes of the request; empty: none was captured.
  Bytes reply{};    ///< Bytes of the reply; empty: none was captured.
};

/// What captures say about one value of one option.
struct OptionEvidence {
  std::size_t option;    ///< index into the unit's options
  std::int64_t value;    ///< Value of the option.
  bool possible;         ///< Whether the captured frames can come from an encoder with this value.
  std::size_t capture;   ///< not possible: the first that contradicts
  std::string_view why;  ///< a sentence
};

/// Receives the values of an option with their evidence.
struct EvidenceSink {
  /// Takes one value of an option.
  virtual void put(const OptionEvidence& evidence) = 0;

 protected:
  ~EvidenceSink() = default;
};

/// Where a value, or a part of it, stands in a frame. Bits count as those of `Unit::is_checked`: on lines of characters
/// the last of a range is the most significant, on clocked links the first.
struct BitRange {
  std::size_t first = 0;  ///< Index of the first bit.
  std::size_t count = 0;  ///< Number of bits.
  bool inverted = false;  ///< a 0 on the wire is a 1 of the value
};

/// The parts of one value, the least significant first.
using BitRanges = Buffer<BitRange, 8>;

/// Frames of which several exchanges carry a byte each. They are decoded as others are.
struct Composed {
  Bytes request{};            ///< Bytes of the request.
  Bytes reply{};              ///< Bytes of the reply; empty: none.
  std::uint64_t first = 0;    ///< number of the exchange with which it began
  Error error = Error::none;  ///< what its bytes alone do not tell: it contradicts the frames that carried it
};

/// Finds them among the good exchanges of one encoder, as a capture has them.
struct Follower {
  /// A good exchange, or a reply that came without a request. `number` counts them.
  virtual void follow(std::uint64_t number, Bytes request, Bytes reply) = 0;
  /// Frames were lost or damaged here.
  virtual void lose() = 0;
  /// Takes one that ended with the last exchange; false: there is no other. It is valid until the next exchange.
  virtual bool take(Composed& one) = 0;

 protected:
  ~Follower() = default;
};

/// Direction of a frame.
enum class Direction : std::uint8_t { request, reply };

/// Where a frame ends in a run of bytes.
struct FrameEnd {
  /// Whether the end of a frame is known.
  enum class Kind : std::uint8_t {
    complete,            ///< the first `size` bytes are one frame
    incomplete,          ///< a frame may have begun; at least `size` bytes in all are needed
    no_frame,            ///< the first byte begins no frame
  } kind;                ///< Whether the end of the frame is known.
  std::size_t size = 0;  ///< Length of the frame in bytes, if known.
};

/// A machine of whichever item its link carries; exactly one pointer is set, or none when it could not be made.
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

inline constexpr std::size_t longest_encoded = 1024;  ///< bytes of a request that `encode` writes

/// Bits of a position; 0: it has no such part.
struct Resolution {
  unsigned singleturn_bits = 0;   ///< Bits of the single-turn position; 0: none.
  unsigned multiturn_bits = 0;    ///< Bits of the turns; 0: none.
  double unit_um = 0;             ///< linear encoders: micrometres a count; 0: a rotation
  bool multiturn_signed = false;  ///< turns are counted below zero
};

/// Wires beside the data on which a host's pulses ask for something.
struct ExtraWires {
  bool trigger = false;  ///< each frame
  bool clear = false;    ///< the zero
};

/// The times of an asynchronous line by which its captures are read.
struct LineTiming {
  unsigned pause_bits = 15;  ///< a line silent for so many bits has ended the frame; shorter, the frame goes on
  Time turnaround{};  ///< from the end of a request to the begin of its reply, as the document has it; 0: not told
  Time turnaround_limit = std::chrono::milliseconds(100);  ///< no host waits longer for the reply to begin
};

/// Description of a protocol. All layers above know a protocol only by this.
struct Unit {
  std::string_view id;        ///< Identifier: the part of an address before the colon.
  std::string_view name;      ///< maker and protocol, for people
  std::string_view document;  ///< the source
  /// Makers and families by which people look for it: "Tamagawa", "Smart-Abs". Its models stand in `models`.
  std::span<const std::string_view> known_as{};
  LinkKind link;                              ///< Kind of link between host and encoder.
  LineSettings line;                          ///< rate 0: the document states none, the user must
  std::span<const Option> options;            ///< Options that an address may set.
  std::span<const Model> models;              ///< Models, which set several options by one name.
  std::span<const FieldInfo> fields;          ///< Fields that replies can have.
  std::span<const Command> commands;          ///< Commands of the encoder.
  std::span<const MemoryArea> memory{};       ///< what the commands memory_read and memory_write reach, in order
  std::span<const RegisterInfo> registers{};  ///< the same of an encoder that has registers instead of bytes
  std::span<const Vector> vectors;            ///< Frames with their meaning, from documents.
  const FieldInfo* status;                    ///< the flags of Reading::status; null when the unit has none
  const FieldInfo* alarms;                    ///< the flags of Reading::alarms
  /// The alarms that an encoder with these options can report; null: all.
  std::uint32_t (*reportable)(const Options& options) = nullptr;
  /// Of an encoder that reports in two channels, the flags of the second. Their bits follow those of the first in one
  /// number: whoever compares alarms sees both, whoever shows them names each.
  const FieldInfo* second_status = nullptr;
  const FieldInfo* second_alarms = nullptr;  ///< Field of the second alarms; null: none.
  std::size_t host_storage;                  ///< bytes that `host` needs, suitably aligned for any type
  std::size_t device_storage;                ///< bytes that `device` needs

  /// Checks a reply against its request and puts its fields; with an empty reply, the fields of the request.
  Error (*decode)(const Options& options, Frame request, Frame reply, FieldSink& sink);
  /// Returns the error of `decode`; none: the reply is good, or with an empty reply the request.
  [[nodiscard]] Error check(const Options& values, const Frame& request, const Frame& reply) const {
    NoFields nowhere;
    return decode(values, request, reply, nowhere);
  }
  /// The request of a command, at most `longest_encoded` bytes; on CAN and clocked links its text, as in vectors. Empty
  /// where a host only clocks. Errors: invalid_argument, buffer_too_small, unsupported.
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
  /// What the options make of a position.
  Resolution (*resolution)(const Options& options);
  /// Whether a flip of this bit of this good reply must be noticed; null: every bit. Bits count from the least
  /// significant of the first byte on; on clocked links in the order of the wire.
  bool (*is_checked)(const Options& options, Frame request, Frame reply, std::size_t bit) = nullptr;
  /// Where this good reply has a field that it carries: no ranges where it has it in no fixed place, or makes it of
  /// something else (Gray code, decimal text). Null: not told of any. It may depend on options and request, so it is
  /// asked frame by frame; the kit cuts the bits out of good frames and compares them with the field.
  BitRanges (*bits)(const Options& options, Frame request, Frame reply, const FieldInfo& field) = nullptr;
  /// About a reply that `decode` refuses with `error`, what the document says; null: nothing.
  Explanation (*explain)(const Options& options, Error error, Frame request, Frame reply) = nullptr;
  /// The line as the options describe it; null: always `line`. Silences measured in characters follow its rate, and a
  /// conversation that changes the rate must know the old one.
  LineSettings (*settings)(const Options& options) = nullptr;
  /// The unit of the same encoder behind an SPI controller, where that is another one.
  const Unit* over_spi = nullptr;
  /// Puts every value of the probeable options; null: frames do not tell. Captures are in the order of time. Whether
  /// any values explain them all: then `options`, which give what is not probed, become such values, defaults where the
  /// captures do not tell.
  bool (*probe)(Options& options, std::span<const Capture> captures, EvidenceSink& sink) = nullptr;
  /// What these options need beside the data, known before a port is opened: the user must say which wire it is, and a
  /// pseudo-terminal has none. Null: nothing.
  ExtraWires (*extra_wires)(const Options& options) = nullptr;
  LineTiming timing{};  ///< Times of the line, for captures.
  /// Whether the encoder sends replies that nobody asks for; null: never. On clocked and CAN links it always may.
  bool (*streams)(const Options& options) = nullptr;
  /// Whether this request, a good one, is answered; null: every one is.
  bool (*is_answered)(const Options& options, Frame request) = nullptr;
  /// How long after what was last heard this good request may be sent again; null: at once.
  Time (*pause)(const Options& options, Frame request) = nullptr;
  std::span<const Condition> conditions{};  ///< that can be set of the virtual encoder, also while it runs
  /// Clocked links whose host says a bit by the level of its clock line in each pause, 1 when it is held low: the index
  /// of the bit in this reply with which the encoder says one too. Both together are decoded as request and reply, one
  /// bit for each frame. Nothing: this reply has none. Null: no reply of the unit has.
  std::optional<std::size_t> (*control_bit)(const Options& options, Frame reply) = nullptr;
  /// Returns `now`, the reading of one reply, completed by what earlier replies of the same encoder reported since it
  /// was switched on and this one does not carry. `before` is the reading before it, completed in the same way. Null:
  /// each reply says all that there is to say.
  Reading (*remembered)(const Reading& before, Reading now) = nullptr;
  /// In storage of `follower_storage` bytes, aligned for any type. Null: each exchange says all that it says by itself.
  Follower* (*follower)(const Options& options, std::span<std::byte> storage) = nullptr;
  std::size_t follower_storage = 0;  ///< Bytes that a channel follower needs.
};

/// Whether a word format may stand in for some of its options.
[[nodiscard]] constexpr bool takes_word(const Unit& unit) {
  for (const Option& option : unit.options) {
    if (option.describes_word) return true;
  }
  return false;
}

/// The line as these options describe it.
[[nodiscard]] inline LineSettings line_settings(const Unit& unit, const Options& options) {
  return unit.settings != nullptr ? unit.settings(options) : unit.line;
}

/// The first command with this verb, or null.
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
