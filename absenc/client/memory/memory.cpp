// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/memory.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"

namespace absenc::client {

namespace {

/// Collects the bytes, or the value, that a command with Verb::memory_read reports.
struct ReadBytes final : FieldSink {
  void put(const FieldValue& field) override {
    if (field.info->role == Role::data) data.assign(field.bytes.begin(), field.bytes.end());
    if (field.info->role == Role::value) value = static_cast<std::uint32_t>(field.number);
  }
  // Returns the received data as words of `size` bytes, low byte first; if the reply has a single value instead, that
  // value.
  [[nodiscard]] std::vector<std::uint32_t> words(std::size_t size) const {
    if (data.empty() && value) return {*value};
    std::vector<std::uint32_t> all;
    for (std::size_t i = 0; i + size <= data.size(); i += size) {
      all.push_back(static_cast<std::uint32_t>(load_little_endian(Bytes(data).subspan(i, size))));
    }
    return all;
  }
  std::vector<std::uint8_t> data;
  std::optional<std::uint32_t> value{};
};

// Returns how many addresses from `at` on a single request can read.
std::size_t most_at_once(const Unit& unit, const Command& command, MemoryAddress at) {
  const Argument* count = find_role(command.arguments, Role::count);
  const auto most = count != nullptr ? static_cast<std::size_t>(count->maximum) : 1;
  for (const MemoryArea& area : unit.memory) {
    if (area.has(at.page, at.address)) return std::min<std::size_t>(most, area.first + area.count - at.address);
  }
  return 1;
}

}  // namespace

const Unit& Memory::unit() const { return connection_of(*encoder_).unit(); }

void Memory::check_model() {
  if (find_command(unit(), Verb::read) == nullptr) return;
  const Outcome outcome = connection_of(*encoder_).read();
  if (outcome.error != Error::none) throw EncoderFailure(connection_of(*encoder_).trouble(outcome));
}

MemoryImage Memory::read(const MemoryImage& image, const MemoryProgress& progress) {
  require_memory(unit(), MemoryAccess::read);
  require_open(unit(), image, MemoryAccess::read);
  const Command& command = *find_command(unit(), Verb::memory_read);
  MemoryImage found;
  for (const MemoryRun& run : runs(image)) {
    for (std::size_t done = 0; done < run.words.size();) {
      const MemoryAddress at{run.first.page, static_cast<std::uint32_t>(run.first.address + done)};
      const std::size_t count = std::min(run.words.size() - done, most_at_once(unit(), command, at));
      const std::vector<std::uint32_t> words = read_run(at, count);
      for (std::uint32_t i = 0; i < count; ++i) found[{at.page, at.address + i}] = words[i];
      done += count;
      if (progress) progress(found.size(), image.size());
    }
  }
  return found;
}

std::vector<std::uint32_t> Memory::read_run(MemoryAddress at, std::size_t count) {
  const Command& command = *find_command(unit(), Verb::memory_read);
  ReadBytes bytes;
  run_into(connection_of(*encoder_), command,
           role_arguments(
               command,
               {{Role::page, at.page}, {Role::address, at.address}, {Role::count, static_cast<std::int64_t>(count)}}),
           bytes);
  const std::vector<std::uint32_t> words = bytes.words(word_bytes(unit()));
  if (words.size() == count) return words;
  throw Failure(fmt::format("{} {} were to be read from {}, but {} came", count, word_noun(unit(), count),
                            to_text(unit(), at), words.size()));
}

void Memory::write(MemoryAddress at, std::uint32_t value, MemoryAccess access, std::optional<std::uint32_t> before) {
  if (before) connection_of(*encoder_).know_before(*before);
  const Command& command = *find_command(unit(), Verb::memory_write);
  ReadBytes ignored;
  run_into(connection_of(*encoder_), command,
           role_arguments(command, {{Role::page, at.page},
                                    {Role::address, at.address},
                                    {Role::value, value},
                                    {Role::force, access == MemoryAccess::force ? 1 : 0}}),
           ignored);
}

}  // namespace absenc::client
