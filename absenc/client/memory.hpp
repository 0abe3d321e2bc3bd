// SPDX-License-Identifier: Apache-2.0
// The memory of an encoder as an image that can be read, compared, written and verified.
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

using MemoryImage = std::map<MemoryAddress, std::uint8_t>;

/// Consecutive addresses of one page.
struct MemoryRun {
  MemoryAddress first;              ///< Place of the first byte.
  std::vector<std::uint8_t> bytes;  ///< The bytes, all on one page.
};

/// In order; a run ends after `longest` bytes.
[[nodiscard]] std::vector<MemoryRun> runs(const MemoryImage& image, std::size_t longest = SIZE_MAX);

/// What a copy of the unit's memory has; the values are 0.
[[nodiscard]] MemoryImage dump_addresses(const Unit& unit);

/// The bytes of `wanted` that `found` has not, with the values of `wanted`.
[[nodiscard]] MemoryImage differing(const MemoryImage& wanted, const MemoryImage& found);

/// "page 2 address 0x05", or "address 0x05" where there are no pages
[[nodiscard]] std::string to_text(const Unit& unit, MemoryAddress at);

/// "page 0 to 5: 0x00 to 0x7E; page 7: 0x04, 0x06"
[[nodiscard]] std::string addresses_in_words(const Unit& unit, const MemoryImage& image);

enum class Access : std::uint8_t {
  read,
  write,
  force,  // write also what is protected
};

/// Why this address cannot be reached so, or "".
[[nodiscard]] std::string closed(const Unit& unit, MemoryAddress at, Access access);

/// Throws UsageError.
void require_memory(const Unit& unit, Access access);
void require_open(const Unit& unit, const MemoryImage& image, Access access);

class Encoder;

/// Called with how many bytes of how many are done.
using MemoryProgress = std::function<void(std::size_t done, std::size_t all)>;

/// Of an open encoder (Encoder::memory), which must outlive it. Everything throws EncoderFailure when the encoder
/// fails, and what the port throws.
class Memory {
 public:
  /// Reads and writes the memory of `encoder`, which must outlive this object.
  explicit Memory(Encoder& encoder) : encoder_(&encoder) {}

  /// Returns the unit of the encoder.
  [[nodiscard]] const Unit& unit() const;

  /// Reads the position: an encoder of another model than was said shows itself by that. Its memory does not tell, and
  /// would take the bytes all the same.
  void check_model();

  /// What the encoder has at the addresses of `image`, as dump_addresses has all of them. Throws UsageError for those
  /// that cannot be read.
  [[nodiscard]] MemoryImage read(const MemoryImage& image, const MemoryProgress& progress = {});

  /// Returns when it was read back. `before`: what is there, where that is known.
  void write(MemoryAddress at, std::uint8_t value, Access access, std::optional<std::uint8_t> before = {});

 private:
  [[nodiscard]] std::vector<std::uint8_t> read_run(MemoryAddress at, std::size_t count);

  Encoder* encoder_;
};

/// Brings the memory to what is wanted: look, write, verify. Whatever one of them throws, the images say which bytes
/// are written, and which are not; to do all of it again writes only what still differs.
class MemoryChange {
 public:
  /// Throws UsageError for what cannot be written.
  MemoryChange(Memory memory, MemoryImage wanted, Access access);

  /// Reads what is there.
  void look(const MemoryProgress& progress = {});
  /// Writes what differs, byte by byte, each read back.
  void write(const MemoryProgress& progress = {});
  /// Reads all that was written once more: a later byte may have changed an earlier one. Throws Failure.
  void verify(const MemoryProgress& progress = {});
  /// After a failure: asks whether the byte is there whose write was cut short.
  void settle();

  /// Returns the wanted bytes.
  [[nodiscard]] const MemoryImage& wanted() const { return wanted_; }
  /// What the encoder had at the addresses of `wanted`.
  [[nodiscard]] const MemoryImage& found() const { return found_; }
  /// What it had not, as it is wanted.
  [[nodiscard]] const MemoryImage& differing() const { return differing_; }
  /// Returns the bytes that were written and verified.
  [[nodiscard]] const MemoryImage& written() const { return written_; }
  /// Returns the wanted bytes that were not written.
  [[nodiscard]] MemoryImage not_written() const;
  /// The state of the last byte to be written; not_sent before the first.
  [[nodiscard]] ChangeState state() const { return state_; }
  /// At most one byte, of which nobody knows whether it was written.
  [[nodiscard]] MemoryImage unknown() const;

 private:
  Memory memory_;
  MemoryImage wanted_;
  Access access_;
  MemoryImage found_{};
  MemoryImage differing_{};
  MemoryImage written_{};
  MemoryImage left_{};
  std::optional<MemoryAddress> in_flight_{};
  ChangeState state_ = ChangeState::not_sent;
};

}  // namespace absenc::client
