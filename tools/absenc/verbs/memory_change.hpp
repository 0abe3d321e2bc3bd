// SPDX-License-Identifier: Apache-2.0
// Writes bytes to an encoder's memory: shows the differences, asks, writes them and reads them back.
#pragma once

#include "absenc/client/memory.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/json.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Returns which memory may be written: with --force also protected memory.
[[nodiscard]] inline MemoryAccess write_access(const Invocation& invocation) {
  return invocation.has("--force") ? MemoryAccess::force : MemoryAccess::write;
}

/// Writes the bytes of `wanted` that differ from the encoder's, as the options --yes, --json and --dry-run state;
/// returns the exit status. If writing ends early, it prints which bytes were written, which were not, and which may
/// have been. All addresses of `wanted` must be writable. Throws UsageError if it must ask without a terminal, and the
/// exceptions of `open_encoder`.
int change_memory(const Invocation& invocation, const EncoderAddress& uri, const MemoryImage& wanted,
                  MemoryAccess access);

/// Reads and returns the encoder's bytes at the addresses of `image`, and shows the progress on a terminal.
[[nodiscard]] MemoryImage read_memory(Memory& memory, const MemoryImage& image);

/// Returns a table of differing bytes with the columns WHERE, ENCODER (the bytes `found`) and `wanted_name` (the bytes
/// `differing`), with one row for up to 8 consecutive bytes.
[[nodiscard]] std::string difference_table(const Unit& unit, std::string_view wanted_name, const MemoryImage& differing,
                                           const MemoryImage& found);
[[nodiscard]] Json differences_json(const MemoryImage& differing, const MemoryImage& found);

}  // namespace absenc::tool
