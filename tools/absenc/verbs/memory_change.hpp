// SPDX-License-Identifier: Apache-2.0
// Shows and makes changes of an encoder's memory.
#pragma once

#include "absenc/client/memory.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/json.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Returns which memory of the encoder may be written: with the option --force also protected memory.
[[nodiscard]] inline MemoryAccess write_access(const Invocation& invocation) {
  return invocation.has("--force") ? MemoryAccess::force : MemoryAccess::write;
}

/// Writes the bytes `wanted` to the encoder, as the options of the verb state. All addresses must be writable. Returns
/// the exit status.
int change_memory(const Invocation& invocation, const EncoderAddress& uri, const MemoryImage& wanted,
                  MemoryAccess access);

/// Reads the encoder's bytes at the addresses of `image`, and shows the progress.
[[nodiscard]] MemoryImage read_memory(Memory& memory, const MemoryImage& image);

/// Returns a table of the bytes that differ, with their addresses: the present bytes `found` and the wanted bytes
/// `differing`.
[[nodiscard]] std::string difference_table(const Unit& unit, std::string_view wanted_name, const MemoryImage& differing,
                                           const MemoryImage& found);
[[nodiscard]] Json differences_json(const MemoryImage& differing, const MemoryImage& found);

}  // namespace absenc::tool
