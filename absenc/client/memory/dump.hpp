// SPDX-License-Identifier: Apache-2.0
// A copy of an encoder's memory in a file, for people to read and edit: docs/dump-format.md describes it.
#pragma once

#include <string>
#include <string_view>

#include "absenc/client/memory.hpp"

namespace absenc::client {

struct Dump {
  MemoryImage image;
  // It has a checksum, which is right, or says that it was edited; otherwise nobody knows whether it is whole.
  bool checked = false;
};

[[nodiscard]] std::string to_dump(const Unit& unit, const Options& options, const MemoryImage& image);

/// `name` is for messages. Throws Failure for a text that is damaged, was made from another kind of encoder, or
/// has what cannot be read or, if that is the purpose, written.
[[nodiscard]] Dump parse_dump(const std::string& name, std::string_view text, const Unit& unit, const Options& options,
                              Access access);

}  // namespace absenc::client
