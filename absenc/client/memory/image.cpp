// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/memory.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "absenc/client/error.hpp"

namespace absenc::client {

namespace {

const MemoryArea* find_area(const Unit& unit, MemoryAddress at) {
  const auto found = std::find_if(unit.memory.begin(), unit.memory.end(),
                                  [&](const MemoryArea& area) { return area.has(at.page, at.address); });
  return found == unit.memory.end() ? nullptr : &*found;
}

bool has_pages(const Unit& unit) {
  return std::any_of(unit.memory.begin(), unit.memory.end(), [](const MemoryArea& area) { return area.page != 0; });
}

void add(MemoryImage& image, const MemoryArea& area) {
  for (std::uint32_t page = area.page; page < area.page + area.pages; ++page) {
    for (std::uint32_t i = 0; i < area.count; ++i) image[{page, area.first + i}] = 0;
  }
}

}  // namespace

std::vector<MemoryRun> runs(const MemoryImage& image, std::size_t longest) {
  std::vector<MemoryRun> all;
  MemoryAddress next;
  for (const auto& [at, value] : image) {
    if (all.empty() || at != next || all.back().words.size() == longest) all.push_back({at, {}});
    all.back().words.push_back(value);
    next = {at.page, at.address + 1};
  }
  return all;
}

unsigned word_bytes(const Unit& unit) { return unit.memory.empty() ? 1 : unit.memory.front().word; }

std::string_view word_noun(const Unit& unit, std::size_t count) {
  if (word_bytes(unit) > 1) return count == 1 ? "word" : "words";
  return count == 1 ? "byte" : "bytes";
}

std::string words_in_hex(const Unit& unit, std::span<const std::uint32_t> words) {
  std::string text;
  for (const std::uint32_t word : words) {
    text += fmt::format("{}{:0{}X}", text.empty() ? "" : " ", word, 2 * word_bytes(unit));
  }
  return text;
}

std::string words_in_json(const Unit& unit, std::span<const std::uint32_t> words) {
  std::string text;
  for (const std::uint32_t word : words) text += fmt::format("{:0{}x}", word, 2 * word_bytes(unit));
  return text;
}

MemoryImage dump_addresses(const Unit& unit) {
  MemoryImage image;
  for (const MemoryArea& area : unit.memory) {
    if (area.in_dump) add(image, area);
  }
  return image;
}

MemoryImage differing(const MemoryImage& wanted, const MemoryImage& found) {
  MemoryImage image;
  for (const auto& [at, value] : wanted) {
    const auto there = found.find(at);
    if (there == found.end() || there->second != value) image[at] = value;
  }
  return image;
}

std::string to_text(const Unit& unit, MemoryAddress at) {
  const std::string address = fmt::format("address 0x{:02X}", at.address);
  return has_pages(unit) ? fmt::format("page {} {}", at.page, address) : address;
}

std::string addresses_in_words(const Unit& unit, const MemoryImage& image) {
  // for each page, its address ranges as text, as "0x00 to 0x7E"
  std::map<std::uint32_t, std::vector<std::string>> ranges;
  for (const MemoryRun& run : runs(image)) {
    std::string text = fmt::format("0x{:02X}", run.first.address);
    if (run.words.size() > 1) text += fmt::format(" to 0x{:02X}", run.first.address + run.words.size() - 1);
    ranges[run.first.page].push_back(text);
  }
  std::vector<std::string> pages;
  for (auto page = ranges.begin(); page != ranges.end();) {
    auto last = page;  // the last one of several consecutive pages whose address ranges are the same
    auto after = std::next(page);
    while (after != ranges.end() && after->first == last->first + 1 && after->second == page->second) last = after++;
    std::string text = fmt::format("{}", fmt::join(page->second, ", "));
    if (has_pages(unit)) {
      const std::string to = last == page ? "" : fmt::format(" to {}", last->first);
      text.insert(0, fmt::format("page {}{}: ", page->first, to));
    }
    pages.push_back(text);
    page = after;
  }
  return fmt::format("{}", fmt::join(pages, "; "));
}

std::string closed(const Unit& unit, MemoryAddress at, MemoryAccess access) {
  const MemoryArea* area = find_area(unit, at);
  if (area != nullptr) {
    if (access == MemoryAccess::read) return {};
    const std::string where = fmt::format("{} ({})", to_text(unit, at), area->meaning);
    if (!area->writable) return fmt::format("{} can only be read", where);
    if (access == MemoryAccess::force || area->protection.empty()) return {};
    return fmt::format("{} is written only with --force: {}", where, area->protection);
  }
  MemoryImage all;
  for (const MemoryArea& one : unit.memory) add(all, one);
  return fmt::format("{} has no {}; it has {}", unit.id, to_text(unit, at), addresses_in_words(unit, all));
}

void require_memory(const Unit& unit, MemoryAccess access) {
  const bool for_writing = access != MemoryAccess::read;
  const Verb verb = for_writing ? Verb::memory_write : Verb::memory_read;
  if (!unit.memory.empty() && find_command(unit, verb) != nullptr) return;
  if (!unit.registers.empty()) {
    throw UsageError(
        fmt::format("{} has registers: `absenc memory read` and `write` take one by name or address, and "
                    "`absenc list {}` shows them",
                    unit.id, unit.id));
  }
  throw UsageError(fmt::format("the memory of a {} encoder cannot be {}", unit.id, for_writing ? "written" : "read"));
}

void require_open(const Unit& unit, const MemoryImage& image, MemoryAccess access) {
  for (const auto& [at, value] : image) {
    if (const std::string why = closed(unit, at, access); !why.empty()) throw UsageError(why);
  }
}

}  // namespace absenc::client
