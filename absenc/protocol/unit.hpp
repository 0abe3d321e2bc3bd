// SPDX-License-Identifier: Apache-2.0
// The descriptor of one protocol unit, for the layers and commands that know no protocol.
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

/// Purpose of a unit's command. Programs that do not know the unit find its commands by this.
enum class Verb : std::uint8_t {
  read,  ///< reads the position; `absenc read` uses the first such command
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
  scan,  ///< finds the encoders on the line: each record begins with the encoder's address
  run,   ///< none of the purposes above; `absenc run` starts the command by name
};

/// Description of an argument of a command.
struct Argument {
  std::string_view name;           ///< Name of the argument, as in `NAME=VALUE`.
  std::string_view meaning;        ///< Meaning of the argument, with its unit of measure, as a phrase.
  std::int64_t minimum;            ///< Lowest permitted value of the argument.
  std::int64_t maximum;            ///< Highest permitted value of the argument.
  std::int64_t default_value = 0;  ///< Value of an argument that is not `required`, if the user does not give it.
  bool required = true;            ///< Whether the user must give the argument.
  Role role = Role::other;         ///< Role by which programs that do not know the unit find the argument.
};

/// Values of all arguments of a command, in the order of Command::arguments; those that the user left out have their
/// defaults.
using Arguments = std::span<const std::int64_t>;

/// Description of a command of a unit.
struct Command {
  std::string_view name;                  ///< Name of the command.
  Verb verb;                              ///< Purpose of the command, by which the command line finds it.
  std::uint8_t id;                        ///< number of the command within its unit: index into Unit::commands
  std::string_view meaning;               ///< Purpose of the command, as a phrase.
  std::span<const Argument> arguments{};  ///< Arguments of the command, in their order.
  /// Whether programs treat the command as one that changes the encoder.
  bool changes_encoder = false;
  bool repeatable = true;  ///< Whether the same command may be sent again after an error.
  /// For verb config_set: name of the config_get command that reads the setting; "": none.
  std::string_view reads_back{};
  /// For verb config_set: option that the command changes to its first argument; "": none.
  std::string_view changes_option{};
  /// Warning about other devices on the line, a sentence without its full stop; "": none.
  std::string_view disturbs{};
  /// For verb read_part: whether the reading has all alarms.
  bool reads_alarms = false;
};

/// A range of bytes or words in the encoder's memory. In a field with Role::data the low byte of each word is first.
struct MemoryArea {
  std::uint32_t page;            ///< first page of the area; 0 if the memory has no pages
  std::uint32_t first;           ///< First address of the area on its page.
  std::uint32_t count;           ///< Number of addresses of the area on each page.
  std::string_view meaning;      ///< Content of the area, as a phrase.
  bool writable = true;          ///< Whether hosts may write the bytes or words of the area.
  bool in_dump = true;           ///< whether a copy of the memory (`absenc memory dump`) includes the area
  std::uint32_t write_life = 0;  ///< number of writes that the document permits; 0: the document states none
  /// Why memory_write needs its argument with the role force for this area; "": it needs none.
  std::string_view protection{};
  /// Whether `write_life` counts the writes of all bytes together; false: the document does not state that.
  bool life_in_total = false;
  std::uint32_t pages = 1;  ///< number of pages, from `page` on, that have this area; an encoder may have fewer
  std::uint8_t word = 1;    ///< bytes of the word at each address: 1, 2 or 4, the same in all areas of a unit

  /// Returns whether the area includes the byte or word at `address` of the page `on_page`.
  [[nodiscard]] constexpr bool has(std::uint32_t on_page, std::uint32_t address) const {
    return on_page - page < pages && address >= first && address - first < count;
  }
};

/// A register of the encoder, accessed as a whole at its address.
struct RegisterInfo {
  std::string_view name;  ///< Name of the register.
  std::uint32_t address;  ///< Address of the register.
  std::uint32_t size;     ///< size of the register in bytes
  bool readable = true;   ///< Whether hosts may read the register.
  bool writable = false;  ///< Whether hosts may write the register.
};

/// A property of a virtual encoder that can be set while it runs, such as its temperature.
struct Condition {
  std::string_view name;  ///< Name of the condition.
  /// Unit of measure of the value, as in FieldInfo::unit; "" for a plain number, and for yes (1) or no (0).
  std::string_view unit;
  std::string_view meaning;  ///< Meaning of the condition, with its unit of measure, as a phrase.
  std::int64_t minimum;      ///< Lowest permitted value of the condition.
  std::int64_t maximum;      ///< Highest permitted value of the condition.
  std::int64_t normal;       ///< initial value of the condition: that of a healthy installation
};

/// A frame in the form that its link carries.
struct Frame {
  Bytes bytes{};         ///< Bytes of the frame; on clocked links the bits, packed with the most significant first.
  std::size_t bits = 0;  ///< clocked links: number of valid bits in `bytes`
  const CanFrame* can = nullptr;  ///< CAN links: the frame; null: none

  /// Returns whether the frame has neither bytes nor a CAN frame.
  [[nodiscard]] constexpr bool empty() const { return bytes.empty() && can == nullptr; }
};

/// A field of a vector with the value that decoding must give.
struct Expected {
  std::string_view field;   ///< Name of the field.
  std::int64_t number = 0;  ///< Expected value of an integer field.
  double real = 0;          ///< Expected value of a field with a fraction.
  std::string_view text{};  ///< Expected bytes of a text or bytes field.
};

/// Consecutive bytes (on clocked links: bits) of a test vector's frame whose values the vector does not state.
struct OpenBytes {
  std::size_t first = 0;  ///< Index of the first byte (clocked links: bit) without a stated value.
  std::size_t count = 0;  ///< Number of bytes (clocked links: bits) without stated values; 0: all are stated.
};

/// A test vector: frames, with the fields or the error that decoding must give. On clocked links frames are texts of 0
/// and 1; on CAN links texts such as "1ff:022b000000000000".
struct Vector {
  std::string_view id;                 ///< Identifier of the vector, unique within the unit.
  std::string_view meaning;            ///< The case that the vector shows, as a phrase.
  std::string_view source;             ///< Where the frame is from, such as document and paragraph.
  std::string_view options;            ///< Options of the encoder, as `name=value` separated by blanks.
  Bytes request;                       ///< Bytes of the request; empty: none.
  Bytes reply;                         ///< Bytes of the reply; empty: none.
  std::span<const Expected> fields{};  ///< Expected values of all fields; empty if `error` is set.
  Error error = Error::none;           ///< Expected error; `Error::none`: the frame is valid.
  /// Bytes of the request whose values the vector does not state; the tests compute them.
  OpenBytes open_request{};
  /// Bytes of the reply whose values the vector does not state; the tests compute them.
  OpenBytes open_reply{};

  /// Returns whether the vector states the values of all bytes of its frames.
  [[nodiscard]] constexpr bool is_complete() const { return open_request.count == 0 && open_reply.count == 0; }
};

/// A captured exchange on a link that carries bytes; request or reply may be missing.
struct Capture {
  Bytes request{};  ///< Bytes of the request; empty: none was captured.
  Bytes reply{};    ///< Bytes of the reply; empty: none was captured.
};

/// Result of comparing captures with one value of one option.
struct OptionEvidence {
  std::size_t option;    ///< index of the option in Unit::options
  std::int64_t value;    ///< value of the option that the evidence is about
  bool possible;         ///< Whether an encoder with this value of the option may have sent the captured frames.
  std::size_t capture;   ///< if not `possible`: index of the first capture that contradicts the value
  std::string_view why;  ///< reason why the value is possible or not, a sentence
};

/// Receiver to which Unit::probe delivers the evidence about option values, one by one.
struct EvidenceSink {
  /// Takes the evidence about one value of an option.
  virtual void put(const OptionEvidence& evidence) = 0;

 protected:
  ~EvidenceSink() = default;
};

/// Consecutive bits of a frame that carry a value or a part of it, numbered as for `Unit::is_checked`. The most
/// significant bit is the last; on clocked links it is the first.
struct BitRange {
  std::size_t first = 0;  ///< Index of the first bit in the frame.
  std::size_t count = 0;  ///< Number of bits in the range.
  bool inverted = false;  ///< true: a 0 in the frame is a 1 of the value
};

/// The ranges of bits that carry one value, the least significant range first.
using BitRanges = Buffer<BitRange, 8>;

/// A frame that is composed of several exchanges. It is decoded like any other frame.
struct Composed {
  Bytes request{};          ///< Bytes of the request of the composed frame.
  Bytes reply{};            ///< Bytes of the reply of the composed frame; empty: none.
  std::uint64_t first = 0;  ///< number of the first exchange of which the frame is composed
  /// Error if the composed frame contradicts the exchanges that carried it.
  Error error = Error::none;
};

/// Finds composed frames in the valid exchanges of one encoder, in the order of the capture.
struct Follower {
  /// Takes a valid exchange with its number in the capture. `request` may be empty.
  virtual void follow(std::uint64_t number, Bytes request, Bytes reply) = 0;
  /// Notes that frames were lost or damaged between the last exchange and the next one.
  virtual void lose() = 0;
  /// Stores the next composed frame in `one`, or returns false if there is none. The frame is valid until the next
  /// exchange.
  virtual bool take(Composed& one) = 0;

 protected:
  ~Follower() = default;
};

/// Decoder for many frames of one encoder. It is constructed once from the encoder's options, and compiles the format.
struct FrameDecoder {
  /// Checks a frame and puts its fields into `sink`, as Unit::decode.
  virtual Error decode(Frame request, Frame reply, FieldSink& sink) const = 0;

 protected:
  ~FrameDecoder() = default;
};

/// Direction of a frame: from the host (request) or from the encoder (reply).
enum class Direction : std::uint8_t { request, reply };

/// Result of searching the end of the frame that begins with the first of several bytes.
struct FrameEnd {
  /// Whether the bytes contain a complete frame, could do so, or cannot.
  enum class Kind : std::uint8_t {
    complete,            ///< the first `size` bytes are one frame
    incomplete,          ///< a frame may have begun; at least `size` bytes in all are needed to decide
    no_frame,            ///< no frame begins with the first byte
  } kind;                ///< Whether the frame is complete.
  std::size_t size = 0;  ///< Length in bytes, as `kind` describes it; 0 for `no_frame`.
};

/// Pointer to a conversation or virtual encoder for bytes or for CAN frames, or to none.
template <template <class> class Role>
struct Any {
  Role<std::uint8_t>* bytes = nullptr;  ///< The machine, if its link carries bytes; else null.
  Role<CanFrame>* frames = nullptr;     ///< The machine, if its link carries CAN frames; else null.

  /// Returns the machine for links that carry `Item`; null if there is none.
  template <class Item>
  [[nodiscard]] constexpr Role<Item>* of() const {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      return frames;
    } else {
      return bytes;
    }
  }
};

/// Greatest length in bytes of a request that Unit::encode writes.
inline constexpr std::size_t longest_encoded = 1024;

/// Resolution of an encoder: bits of its position and turns, and the length of a linear count.
struct Resolution {
  unsigned singleturn_bits = 0;   ///< Number of bits of the position, within the turn or linear; 0: none.
  unsigned multiturn_bits = 0;    ///< Number of bits of the turns; 0: none.
  double unit_um = 0;             ///< linear encoders: micrometres per count; 0: rotary, or not known
  bool multiturn_signed = false;  ///< true: the number of turns is signed, so turns below zero are possible
};

/// Wires beside the data line that a host must pulse.
struct ExtraWires {
  bool trigger = false;  ///< true: the encoder sends a frame only after a trigger pulse
  bool clear = false;    ///< true: a pulse on the clear wire sets the zero
};

/// Times of an asynchronous line, which decoding its captures needs.
struct LineTiming {
  unsigned pause_bits = 15;  ///< shortest silence that ends a frame, in bit times
  Time frame_pause{};        ///< longest pause between the frames of one request; 0: a request is one frame
  /// Time from a request to its reply at the default rate of the line; 0: unknown.
  Time turnaround{};
  /// When decoding captures: longest time from a request to the begin of its reply.
  Time turnaround_limit = std::chrono::milliseconds(100);
};

/// Descriptor of a protocol, for the layers that know no protocol.
struct Unit {
  std::string_view id;        ///< Identifier: the part of an address before the colon.
  std::string_view name;      ///< names of maker and protocol, for people
  std::string_view document;  ///< title of the protocol's document
  /// Other names by which users find the unit, such as "Tamagawa" or "Smart-Abs".
  std::span<const std::string_view> known_as{};
  /// Other devices whose replies look the same, so that a reply cannot prove the encoder; empty: none is known.
  std::string_view lookalikes{};
  LinkKind link;      ///< Kind of link between host and encoder.
  LineSettings line;  ///< Default settings of the line. Rate 0: the document states none, so the user must state it.
  std::span<const Option> options;    ///< Options that the user may set in an address.
  std::span<const Model> models;      ///< Models of encoders, each of which sets several options by one name.
  std::span<const FieldInfo> fields;  ///< Fields that requests, replies and results can have.
  std::span<const Command> commands;  ///< Commands that hosts can run.
  /// Areas of the encoder's memory, in order of pages.
  std::span<const MemoryArea> memory{};
  /// Registers of encoders that have registers instead of memory.
  std::span<const RegisterInfo> registers{};
  /// Test vectors: frames with the fields or the error that decoding must give.
  std::span<const Vector> vectors;
  const FieldInfo* status;  ///< field that describes the flags of Reading::status; null: the unit has no status
  const FieldInfo* alarms;  ///< Field that describes the flags of Reading::alarms; null: the unit has no alarms.
  /// Returns the alarms that an encoder with these options can report. Null: all.
  std::uint32_t (*reportable)(const Options& options) = nullptr;
  /// Field of the status flags of the second channel; null: none. Its bits follow those of the first.
  const FieldInfo* second_status = nullptr;
  const FieldInfo* second_alarms = nullptr;  ///< Field of the alarms of the second channel; null: none.
  std::size_t host_storage;                  ///< bytes of storage that `host` needs, aligned for any type
  std::size_t device_storage;                ///< bytes of storage that `device` needs, aligned for any type

  /// Checks a reply, or a request if the reply is empty, and puts its fields, and the reading of a reply, into `sink`.
  /// Returns the first error, or `Error::none`.
  Error (*decode)(const Options& options, Frame request, Frame reply, FieldSink& sink);
  /// Constructs a decoder for encoders with these options in `storage` of `decoder_storage` bytes. Null: the unit has
  /// none.
  FrameDecoder* (*decoder)(const Options& options, std::span<std::byte> storage) = nullptr;
  std::size_t decoder_storage = 0;  ///< Bytes of storage that `decoder` needs, aligned for any type.
  /// Returns the error that `decode` returns, without delivering fields.
  [[nodiscard]] Error check(const Options& values, const Frame& request, const Frame& reply) const {
    NoFields nowhere;
    return decode(values, request, reply, nowhere);
  }
  /// Writes the request of a command into `request` and returns its length, at most `longest_encoded` bytes; on CAN and
  /// clocked links a text, as in vectors. Errors: invalid_argument, buffer_too_small, unsupported.
  Result<std::size_t> (*encode)(const Options& options, const Command& command, Arguments arguments,
                                MutableBytes request);
  /// Returns where the frame ends that begins with the first of `bytes`.
  FrameEnd (*frame_end)(const Options& options, Direction direction, Bytes bytes);
  /// Constructs the conversation of a command in `storage` of `host_storage` bytes; an empty Any if that is impossible.
  Any<Conversation> (*host)(const Options& options, const Command& command, Arguments arguments,
                            std::span<std::byte> storage);
  /// Constructs a virtual encoder in `storage` of `device_storage` bytes; an empty Any if that is impossible. `shaft`
  /// must outlive it.
  Any<Device> (*device)(const Options& options, const Shaft& shaft, std::span<std::byte> storage);
  /// Returns the resolution of an encoder with these options.
  Resolution (*resolution)(const Options& options);
  /// Returns whether the checks must detect that the bit number `bit` of this valid reply is flipped. Null: all bits.
  /// Bits count from the least significant bit of the first byte on; on clocked links in the order of the wire.
  bool (*is_checked)(const Options& options, Frame request, Frame reply, std::size_t bit) = nullptr;
  /// Returns the bits of this valid reply that carry `field`; may be none. Null: the unit does not state them.
  BitRanges (*bits)(const Options& options, Frame request, Frame reply, const FieldInfo& field) = nullptr;
  /// Returns the unit's explanation of the error of an exchange. Null: the unit explains none.
  Explanation (*explain)(const Options& options, Error error, Frame request, Frame reply) = nullptr;
  /// Returns the settings of the line with these options. Null: they are always `line`.
  LineSettings (*settings)(const Options& options) = nullptr;
  /// Another unit, which describes the same encoder behind an SPI controller; null: there is none.
  const Unit* over_spi = nullptr;
  /// Compares captures, in the order of time, with values of some options, puts the evidence into `sink`, and stores in
  /// `options` the values that the captures show. Returns whether no capture contradicts the stored values. Null:
  /// frames do not show option values.
  bool (*probe)(Options& options, std::span<const Capture> captures, EvidenceSink& sink) = nullptr;
  /// Returns the wires beside the data line that an encoder with these options needs. Null: none.
  ExtraWires (*extra_wires)(const Options& options) = nullptr;
  LineTiming timing{};  ///< Times of the line, which decoding captures needs.
  /// Returns whether replies of an encoder with these options need no request. Null: they need one, except on clocked
  /// and CAN links.
  bool (*streams)(const Options& options) = nullptr;
  /// Returns whether the encoder answers this valid request. Null: it answers every request.
  bool (*is_answered)(const Options& options, Frame request) = nullptr;
  /// Returns the shortest silence between a reply and the next request. Null: the unit does not state one.
  Time (*rest)(const Options& options) = nullptr;
  bool services_carry_position = false;  ///< Whether most replies to commands also have the position.
  /// Returns the shortest pause before this valid request is repeated. Null: none.
  Time (*pause)(const Options& options, Frame request) = nullptr;
  /// Conditions of the virtual encoder's environment, which can be set while it runs.
  std::span<const Condition> conditions{};
  /// For links on which the clock line carries a bit of the host in each pause (1: low): returns the index of the bit
  /// in this reply that answers the host's bit; nothing: this reply has no such bit. Null: no reply of the unit has
  /// one.
  std::optional<std::size_t> (*control_bit)(const Options& options, Frame reply) = nullptr;
  /// Bidirectional clocked links: returns the ranges of bits of this burst that the host sends, in their order; the
  /// others are the reply. Null: other links.
  BitRanges (*host_bits)(const Options& options, Frame burst) = nullptr;
  /// Returns the reading `now`, completed by alarms of `before`, the completed reading before it. Null: readings are
  /// not completed.
  Reading (*remembered)(const Reading& before, Reading now) = nullptr;
  /// Returns `options` with the properties that this reading shows, where `options` leave it to the host to ask the
  /// encoder for them. Null: hosts ask for nothing, or readings do not show it.
  Options (*learned)(const Options& options, const Reading& reading) = nullptr;
  /// Constructs a Follower in `storage` of `follower_storage` bytes, aligned for any type. Null: the unit has none.
  Follower* (*follower)(const Options& options, std::span<std::byte> storage) = nullptr;
  std::size_t follower_storage = 0;  ///< Bytes of storage that `follower` needs; 0: there is none.
};

/// Returns whether the user may give a word format for `unit`.
[[nodiscard]] constexpr bool takes_word(const Unit& unit) {
  for (const Option& option : unit.options) {
    if (option.describes_word) return true;
  }
  return false;
}

/// Returns the settings of the line of an encoder of `unit` with these options.
[[nodiscard]] inline LineSettings line_settings(const Unit& unit, const Options& options) {
  return unit.settings != nullptr ? unit.settings(options) : unit.line;
}

/// Returns the first command of `unit` with this verb, or null.
[[nodiscard]] constexpr const Command* find_command(const Unit& unit, Verb verb) {
  for (const Command& command : unit.commands) {
    if (command.verb == verb) return &command;
  }
  return nullptr;
}

/// Returns the command of `unit` with this name, or null.
[[nodiscard]] constexpr const Command* find_command(const Unit& unit, std::string_view name) {
  for (const Command& command : unit.commands) {
    if (command.name == name) return &command;
  }
  return nullptr;
}

}  // namespace absenc
