// SPDX-License-Identifier: Apache-2.0
// The memory of an encoder as an image: read, compare, write and verify.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absenc/client/change.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// Place of a byte in the memory of an encoder.
struct MemoryAddress {
  std::uint32_t page = 0;     ///< Page, 0 where the memory has no pages.
  std::uint32_t address = 0;  ///< Address within the page.
  /// Compares page and address.
  friend constexpr bool operator==(const MemoryAddress&, const MemoryAddress&) = default;
  /// Orders by page, then by address.
  friend constexpr bool operator<(const MemoryAddress& one, const MemoryAddress& other) {
    return one.page != other.page ? one.page < other.page : one.address < other.address;
  }
};

/// Bytes of a memory by their places.
using MemoryImage = std::map<MemoryAddress, std::uint8_t>;

/// Consecutive addresses of one page.
struct MemoryRun {
  MemoryAddress first;              ///< Place of the first byte.
  std::vector<std::uint8_t> bytes;  ///< The bytes, all on one page.
};

/// Returns the bytes as runs in order of address, each of at most `longest` bytes.
[[nodiscard]] std::vector<MemoryRun> runs(const MemoryImage& image, std::size_t longest = SIZE_MAX);

/// Returns all addresses of a dump of the unit's memory, with values 0.
[[nodiscard]] MemoryImage dump_addresses(const Unit& unit);

/// Returns the bytes of `wanted` that are missing or different in `found`.
[[nodiscard]] MemoryImage differing(const MemoryImage& wanted, const MemoryImage& found);

/// Returns "page 2 address 0x05", or "address 0x05" for a memory without pages.
[[nodiscard]] std::string to_text(const Unit& unit, MemoryAddress at);

/// Returns "page 0 to 5: 0x00 to 0x7E; page 7: 0x04, 0x06".
[[nodiscard]] std::string addresses_in_words(const Unit& unit, const MemoryImage& image);

/// Whether bytes are read or written.
enum class MemoryAccess : std::uint8_t {
  read,
  write,
  force,  ///< also write protected bytes
};

/// Returns the reason why this access to the address is impossible, or "".
[[nodiscard]] std::string closed(const Unit& unit, MemoryAddress at, MemoryAccess access);

/// Throws UsageError if the unit has no memory that can be read or written.
void require_memory(const Unit& unit, MemoryAccess access);
/// Throws UsageError if a byte of `image` is not open to this access.
void require_open(const Unit& unit, const MemoryImage& image, MemoryAccess access);

class Encoder;

/// Called with the number of finished bytes and the number of all bytes.
using MemoryProgress = std::function<void(std::size_t done, std::size_t all)>;

/// The memory of an open encoder, from Encoder::memory. Functions throw EncoderFailure if a command fails, and
/// exceptions of the port.
class Memory {
 public:
  /// Reads and writes the memory of `encoder`, which must outlive this object.
  explicit Memory(Encoder& encoder) : encoder_(&encoder) {}

  /// Returns the unit of the encoder.
  [[nodiscard]] const Unit& unit() const;

  /// Checks the configured model by a reading of the position. The memory itself does not show a wrong model and would
  /// accept the bytes.
  void check_model();

  /// Reads the bytes at the addresses of `image`; dump_addresses returns all readable ones. Throws UsageError for
  /// addresses that cannot be read.
  [[nodiscard]] MemoryImage read(const MemoryImage& image, const MemoryProgress& progress = {});

  /// Writes a byte and reads it back. `before` is the stored value, if it is known.
  void write(MemoryAddress at, std::uint8_t value, MemoryAccess access, std::optional<std::uint8_t> before = {});

 private:
  [[nodiscard]] std::vector<std::uint8_t> read_run(MemoryAddress at, std::size_t count);

  Encoder* encoder_;
};

/// Changes the memory to a wanted image: look, write, verify. After an exception the images still state which bytes
/// were written and which were not. A repetition writes only bytes that still differ.
class MemoryChange {
 public:
  /// Prepares the change. Throws UsageError for addresses that cannot be written.
  MemoryChange(Memory memory, MemoryImage wanted, MemoryAccess access);

  /// Reads the stored bytes at the wanted addresses.
  void look(const MemoryProgress& progress = {});
  /// Writes the differing bytes one by one and reads each back.
  void write(const MemoryProgress& progress = {});
  /// Reads all written bytes again, because a later write may have changed an earlier byte. Throws Failure.
  void verify(const MemoryProgress& progress = {});
  /// Reads the byte whose write was interrupted by a failure.
  void settle();

  /// Returns the wanted bytes.
  [[nodiscard]] const MemoryImage& wanted() const { return wanted_; }
  /// Returns the bytes that `look` read at the wanted addresses.
  [[nodiscard]] const MemoryImage& found() const { return found_; }
  /// Returns the bytes that differ, with their wanted values.
  [[nodiscard]] const MemoryImage& differing() const { return differing_; }
  /// Returns the bytes that were written and verified.
  [[nodiscard]] const MemoryImage& written() const { return written_; }
  /// Returns the wanted bytes that were not written.
  [[nodiscard]] MemoryImage not_written() const;
  /// Returns the state of the last byte that was written; not_sent before the first.
  [[nodiscard]] ChangeState state() const { return state_; }
  /// Returns the byte for which it is unknown whether it was written; at most one.
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
