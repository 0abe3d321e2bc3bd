// SPDX-License-Identifier: Apache-2.0
// Reads and writes dumps of an encoder's memory, which docs/dump-format.md describes.
#pragma once

#include <string>
#include <string_view>

#include "absenc/client/memory.hpp"

namespace absenc::client {

struct Dump {
  MemoryImage image;
  // whether the checksum of the dump is right, or the dump states instead that it was edited
  bool checked = false;
};

[[nodiscard]] std::string to_dump(const Unit& unit, const Options& options, const MemoryImage& image);

/// Parses a dump; `name` is the file's name in messages. Throws Failure.
[[nodiscard]] Dump parse_dump(const std::string& name, std::string_view text, const Unit& unit, const Options& options,
                              MemoryAccess access);

}  // namespace absenc::client
