// SPDX-License-Identifier: Apache-2.0
// Device side of a memory with pages that is busy for a while after each change: an EEPROM whose bytes have addresses
// of 7 or 8 bits. It knows no protocol, and is compiled once.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "absenc/protocol/author/device.hpp"
#include "absenc/protocol/author/memory_map.hpp"

namespace absenc::author {

/// The properties of such a memory, as its document states them.
struct PagedMemory {
  std::span<const MemoryArea> areas;  ///< Areas of the memory, in the order of its pages.
  std::uint8_t select_address;        ///< Writing this address selects the page, reading it returns the selected page.
  std::uint8_t start_page;            ///< Page after power on.
  Time page_time;                     ///< How long the memory is busy after a page change.
  Time write_time;                    ///< How long the memory is busy after a write.
  /// Time between the request that fetches a byte and the one that returns it; 0: the first request returns it.
  Time fetch_time{};
  /// Whether no page can be selected while a write lasts, and a page change makes all bytes busy.
  bool exclusive = true;
  /// Returns whether a byte is never busy or fetched. Null: no byte is so.
  bool (*is_immediate)(unsigned page, unsigned address) = nullptr;
  std::string_view page_rule;          ///< Rule for the host: access waits for `page_time`.
  std::string_view write_rule;         ///< Rule for the host: a write waits for `write_time`.
  std::string_view refused_rule{};     ///< Rule: a read that was refused as busy is repeated; "": no such rule.
  std::string_view fetch_rule{};       ///< Rule: a byte that is being fetched is read again; "": no such rule.
  std::string_view fetch_time_rule{};  ///< Rule: a fetched byte is read only after `fetch_time`; "": no such rule.
};

/// A virtual encoder with such a memory. The subclass stores the bytes.
class PagedMemoryDevice : public Responder {
 protected:
  /// A request to read or write a byte of the selected page.
  struct Access {
    bool writes;           ///< Whether the byte is written.
    std::uint8_t address;  ///< Address on the selected page, or the one that selects the page.
    std::uint8_t value;    ///< Value to be written.
  };
  /// The answer to such a request.
  struct MemoryAnswer {
    bool busy;           ///< Whether the memory is busy; the request was not executed.
    std::uint8_t value;  ///< The byte; 0 while busy.
  };

  /// Constructs the device; `memory` must outlive it.
  PagedMemoryDevice(const DeviceTimes& times, const PagedMemory& memory) : Responder(times), memory_(&memory) {}
  ~PagedMemoryDevice() = default;

  /// Returns a byte of an area, which need not be stored: it may be a temperature.
  [[nodiscard]] virtual std::uint8_t load(std::uint8_t page, std::uint8_t address) = 0;
  /// Stores a byte of a writable area.
  virtual void store(std::uint8_t page, std::uint8_t address, std::uint8_t value) = 0;

  /// Executes a request that arrived at `at`. Busy times count from `since`, which may be earlier. Returns nothing if
  /// no area has this byte, or if it is not writable.
  std::optional<MemoryAnswer> access(const Access& request, Time at, Time since);
  /// Returns whether the areas have this byte, or the page that the request selects.
  [[nodiscard]] bool exists(const Access& request) const;
  /// Makes the memory busy until this time, as a write does.
  void write_lasts(Time until);
  /// Returns the end of the last write; 0: none.
  [[nodiscard]] Time written_at() const { return written_at_; }
  /// Resets the selected page and all busy times, at power on.
  void restart_memory();

 private:
  void check_rules(const Access& request, bool immediate, Time at);
  [[nodiscard]] bool fetches(std::uint8_t address, Time at, Time since);
  void select(std::uint8_t page, Time since);

  const PagedMemory* memory_;
  std::uint8_t page_ = 0;
  bool page_changed_ = false;  // no access has waited for the page change yet
  Time page_ready_at_{};
  Time written_at_{};                              // end of the last write; 0: none
  std::optional<std::uint8_t> refused_address_{};  // address of the last request, if it was a read during a write
  bool fetching_ = false;
  std::uint8_t fetch_address_ = 0;
  Time fetch_begin_{};
};

}  // namespace absenc::author
