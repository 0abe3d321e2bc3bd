// SPDX-License-Identifier: Apache-2.0
// The memory of an encoder as an image, with functions that read, compare, write and verify it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/change.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Place of a byte, or of a word in a memory of words, in the memory of an encoder.
struct MemoryAddress {
  std::uint32_t page = 0;     ///< Number of the page; 0 if the memory has no pages.
  std::uint32_t address = 0;  ///< Address within the page.
  /// Returns whether two places have the same page and address.
  friend constexpr bool operator==(const MemoryAddress&, const MemoryAddress&) = default;
  /// Returns whether `one` is before `other`, by page, then by address.
  friend constexpr bool operator<(const MemoryAddress& one, const MemoryAddress& other) {
    return one.page != other.page ? one.page < other.page : one.address < other.address;
  }
};

/// Bytes or words of a memory, by their page and address.
using MemoryImage = std::map<MemoryAddress, std::uint32_t>;

/// Bytes or words at consecutive addresses of one page.
struct MemoryRun {
  MemoryAddress first;               ///< Page and address of the first byte or word.
  std::vector<std::uint32_t> words;  ///< The bytes or words, the first of them at the address `first`.
};

/// Returns the number of bytes at each address of the unit's memory: 1, 2 or 4.
[[nodiscard]] unsigned word_bytes(const Unit& unit);
/// Returns "byte" or "word" for the unit's memory, in the plural unless `count` is 1.
[[nodiscard]] std::string_view word_noun(const Unit& unit, std::size_t count);
/// Returns bytes or words of the unit's memory in hexadecimal, for people: "00 5A", "005A 1234".
[[nodiscard]] std::string words_in_hex(const Unit& unit, std::span<const std::uint32_t> words);
/// Returns bytes or words of the unit's memory in hexadecimal, for programs: "005a", "005a1234".
[[nodiscard]] std::string words_in_json(const Unit& unit, std::span<const std::uint32_t> words);

/// Returns `image` divided into series of consecutive addresses, in the order of the addresses; each series has at most
/// `longest` bytes or words.
[[nodiscard]] std::vector<MemoryRun> runs(const MemoryImage& image, std::size_t longest = SIZE_MAX);

/// Returns all addresses that a dump of the unit's memory contains, each with the value 0.
[[nodiscard]] MemoryImage dump_addresses(const Unit& unit);

/// Returns the bytes or words of `wanted` that are missing or different in `found`.
[[nodiscard]] MemoryImage differing(const MemoryImage& wanted, const MemoryImage& found);

/// Returns the address in words, as "page 2 address 0x05".
[[nodiscard]] std::string to_text(const Unit& unit, MemoryAddress at);

/// Returns all addresses of `image` in words: "page 0 to 5: 0x00 to 0x7E; page 7: 0x04, 0x06".
[[nodiscard]] std::string addresses_in_words(const Unit& unit, const MemoryImage& image);

/// Kind of access to bytes of a memory.
enum class MemoryAccess : std::uint8_t {
  read,
  write,
  force,  ///< write access, also to write-protected bytes
};

/// Returns the reason why this access to the address is impossible; "" if it is possible.
[[nodiscard]] std::string closed(const Unit& unit, MemoryAddress at, MemoryAccess access);

/// Checks that the unit has a memory for this kind of access. Throws UsageError if not.
void require_memory(const Unit& unit, MemoryAccess access);
/// Checks that this access to each byte of `image` is possible. Throws UsageError if not.
void require_open(const Unit& unit, const MemoryImage& image, MemoryAccess access);

class Encoder;

/// Function that is called with the number of finished bytes and the number of all bytes.
using MemoryProgress = std::function<void(std::size_t done, std::size_t all)>;

/// Access to the memory of a connected encoder. Functions that use the line throw EncoderFailure, Failure, UsageError
/// and the exceptions of the port.
class Memory {
 public:
  /// Reads and writes the memory of `encoder`, which must outlive this object.
  explicit Memory(Encoder& encoder) : encoder_(&encoder) {}

  /// Returns the unit of the encoder.
  [[nodiscard]] const Unit& unit() const;

  /// Reads the position, if the unit has a command for it, and throws if that fails, because a wrong model is a likely
  /// reason.
  void check_model();

  /// Returns the bytes or words at the addresses of `image`, whose values are ignored.
  [[nodiscard]] MemoryImage read(const MemoryImage& image, const MemoryProgress& progress = {});

  /// Writes a byte and reads it back. `before` is the byte that is stored now, if it is known.
  void write(MemoryAddress at, std::uint32_t value, MemoryAccess access, std::optional<std::uint32_t> before = {});

 private:
  [[nodiscard]] std::vector<std::uint32_t> read_run(MemoryAddress at, std::size_t count);

  Encoder* encoder_;
};

/// A change of the memory in three steps: `look`, `write`, `verify`. These functions throw the exceptions of Memory.
class MemoryChange {
 public:
  /// Prepares the change without sending anything. Throws UsageError.
  MemoryChange(Memory memory, MemoryImage wanted, MemoryAccess access);

  /// Checks the model, and reads the bytes that are now stored at the addresses to be written.
  void look(const MemoryProgress& progress = {});
  /// Writes the bytes that differ, one by one, and reads each back.
  void write(const MemoryProgress& progress = {});
  /// Reads all written bytes again, because later writes may have changed earlier bytes.
  void verify(const MemoryProgress& progress = {});
  /// Reads the byte of `unknown` again, to find out whether it was written. Ignores a failure.
  void settle();

  /// Returns the bytes that the memory is to contain, with their addresses.
  [[nodiscard]] const MemoryImage& wanted() const { return wanted_; }
  /// Returns the bytes that `look` read at the addresses to be written.
  [[nodiscard]] const MemoryImage& found() const { return found_; }
  /// Returns those bytes to be written that differed from the bytes that `look` read.
  [[nodiscard]] const MemoryImage& differing() const { return differing_; }
  /// Returns the bytes that were written and read back, without those that `verify` found changed.
  [[nodiscard]] const MemoryImage& written() const { return written_; }
  /// Returns the bytes that still have to be written, without the byte of `unknown`.
  [[nodiscard]] MemoryImage not_written() const;
  /// Returns the state of the last write, or `unknown` if `verify` found changed bytes; not_sent before both.
  [[nodiscard]] ChangeState state() const { return state_; }
  /// Returns the byte of which it is unknown whether it was written; empty if there is none.
  [[nodiscard]] MemoryImage unknown() const;

 private:
  Memory memory_;
  MemoryImage wanted_;
  MemoryAccess access_;
  MemoryImage found_{};
  MemoryImage differing_{};
  MemoryImage written_{};
  MemoryImage left_{};
  std::optional<MemoryAddress> in_flight_{};
  ChangeState state_ = ChangeState::not_sent;
};

}  // namespace absenc::client
