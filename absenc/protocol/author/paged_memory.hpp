// SPDX-License-Identifier: Apache-2.0
// Device side of a paged memory with an EEPROM and registers, for any protocol.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/memory_map.hpp"

namespace absenc::author {

/// Properties of a paged memory, as the encoder's document states them.
struct PagedMemory {
  std::span<const MemoryArea> areas;  ///< Areas of the memory, in the order of its pages.
  /// Address that selects pages: writing it selects a page, reading it returns the selected page.
  std::uint8_t select_address;
  std::uint8_t start_page;  ///< Page that is selected after power on.
  Time page_time;           ///< Time for which the memory is busy after a page change.
  Time write_time;          ///< Time for which the memory is busy after a write, except a write of an immediate byte.
  /// Shortest time from fetching a byte to reading it; 0: bytes are read without fetching.
  Time fetch_time{};
  /// Whether a page change ends the busy time that a write began, and a write the busy time that a page change began;
  /// false: both busy times may run at once.
  bool exclusive = true;
  /// Returns whether a byte is immediate: accessed without fetching, and during writes; null: no byte is.
  bool (*is_immediate)(unsigned page, unsigned address) = nullptr;
  std::string_view page_rule;          ///< Rule for the host: after a page change it waits for `page_time`.
  std::string_view write_rule;         ///< Rule for the host: it waits for `write_time` between two writes.
  std::string_view refused_rule{};     ///< Rule: a read that came during a write is repeated; "": no such rule.
  std::string_view fetch_rule{};       ///< Rule: a byte that is being fetched is read again; "": no such rule.
  std::string_view fetch_time_rule{};  ///< Rule: a fetched byte is read only after `fetch_time`; "": no such rule.
};

/// A virtual encoder with a paged memory; a subclass stores the bytes.
class PagedMemoryDevice : public Responder {
 protected:
  /// A request to read or write a byte of the selected page.
  struct Access {
    bool writes;           ///< Whether the byte is written; false: it is read.
    std::uint8_t address;  ///< Address of the byte on the selected page, or the address that selects pages.
    std::uint8_t value;    ///< Value to be written; unused when reading.
  };
  /// Content of the reply to a memory request.
  struct MemoryAnswer {
    bool busy;           ///< Whether the memory is busy: the request was not executed, or only began to fetch the byte.
    std::uint8_t value;  ///< The byte that was read or written; 0 if busy.
  };

  /// Constructs an encoder with these times and this memory; `memory` must outlive it.
  PagedMemoryDevice(const DeviceTimes& times, const PagedMemory& memory) : Responder(times), memory_(&memory) {}
  ~PagedMemoryDevice() = default;

  /// Returns the value of a byte of the memory, stored or measured.
  [[nodiscard]] virtual std::uint8_t load(std::uint8_t page, std::uint8_t address) = 0;
  /// Stores a byte in a writable area of the memory.
  virtual void store(std::uint8_t page, std::uint8_t address, std::uint8_t value) = 0;

  /// Executes a request that was received at `at`, unless the memory is busy. Returns the content of the reply; no
  /// value if the memory is ready and `exists` is false. A busy time that the request causes begins at `since`.
  std::optional<MemoryAnswer> access(const Access& request, Time at, Time since);
  /// Returns whether the memory has the byte, or the page to be selected, and permits the access.
  [[nodiscard]] bool exists(const Access& request) const;
  /// Makes the memory busy until the time `until`, as a write does.
  void write_lasts(Time until);
  /// Returns the end of the busy time of the last write; 0: there is none.
  [[nodiscard]] Time written_at() const { return written_at_; }
  /// Selects the start page and ends all busy times; to be called at power on.
  void restart_memory();

 private:
  void check_rules(const Access& request, bool immediate, Time at);
  [[nodiscard]] bool fetches(std::uint8_t address, Time at, Time since);
  void select(std::uint8_t page, Time since);

  const PagedMemory* memory_;
  std::uint8_t page_ = 0;
  bool page_changed_ = false;  // the host has not accessed the memory since the busy time of the last page change ended
  Time page_ready_at_{};
  Time written_at_{};  // end of the busy time of the last write; 0: none
  // If the last request was a read during the busy time of a write: its address, needed to check `refused_rule`.
  std::optional<std::uint8_t> refused_address_{};
  bool fetching_ = false;
  std::uint8_t fetch_address_ = 0;
  Time fetch_begin_{};
};

}  // namespace absenc::author
