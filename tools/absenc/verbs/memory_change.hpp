// SPDX-License-Identifier: Apache-2.0
// Brings bytes of an encoder's memory to what they should be: shows, asks, writes what differs, reads back.
#pragma once

#include "absenc/client/memory.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/json.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// What --force makes of it.
[[nodiscard]] inline Access write_access(const Invocation& invocation) {
  return invocation.has("--force") ? Access::force : Access::write;
}

/// Heeds --yes, --json and --dry-run; returns the exit status. When it ends too early it says which bytes were written
/// and which were not. `wanted` must be open. Throws UsageError when nobody can be asked.
int change_memory(const Invocation& invocation, const EncoderAddress& uri, const MemoryImage& wanted, Access access);

/// What the encoder has at the addresses of `image`, with progress on a terminal.
[[nodiscard]] MemoryImage read_memory(Memory& memory, const MemoryImage& image);

/// WHERE, FILE, ENCODER: a row for up to 8 bytes that follow each other.
[[nodiscard]] std::string difference_table(const Unit& unit, std::string_view wanted_name, const MemoryImage& differing,
                                           const MemoryImage& found);
[[nodiscard]] Json differences_json(const MemoryImage& differing, const MemoryImage& found);

}  // namespace absenc::tool
