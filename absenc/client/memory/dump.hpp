// SPDX-License-Identifier: Apache-2.0
// Reads and writes dumps: text files with a copy of an encoder's memory, described in docs/dump-format.md.
#pragma once

#include <string>
#include <string_view>

#include "absenc/client/memory.hpp"

namespace absenc::client {

struct Dump {
  MemoryImage image;
  // Whether the dump is known to be complete: it has a checksum line, which is right or states "edited".
  bool checked = false;
};

[[nodiscard]] std::string to_dump(const Unit& unit, const Options& options, const MemoryImage& image);

/// Parses a dump and returns it. `name` is the file's name in messages. Throws Failure if the text is damaged, is from
/// another kind of encoder, or has addresses that do not permit `access`.
[[nodiscard]] Dump parse_dump(const std::string& name, std::string_view text, const Unit& unit, const Options& options,
                              MemoryAccess access);

}  // namespace absenc::client
