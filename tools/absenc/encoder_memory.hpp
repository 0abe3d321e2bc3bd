// SPDX-License-Identifier: Apache-2.0
// The memory of an opened encoder, by the commands that its protocol has for it.
#pragma once

#include "tools/absenc/encoder.hpp"
#include "tools/absenc/memory_image.hpp"

namespace absenc::tool {

/// Everything throws CommandFailure when the encoder fails, and what the port throws.
class EncoderMemory {
 public:
  explicit EncoderMemory(Encoder& encoder) : encoder_(&encoder) {}

  /// Reads the position: an encoder of another model than was said shows itself by that, its memory does not tell.
  void check_model();

  /// What the encoder has at the addresses of `image`, which must be open.
  [[nodiscard]] MemoryImage read(const MemoryImage& image);

  /// Returns when it was read back.
  void write(MemoryAddress at, std::uint8_t value, Access access);

 private:
  [[nodiscard]] std::vector<std::uint8_t> read_run(MemoryAddress at, std::size_t count);

  Encoder* encoder_;
};

}  // namespace absenc::tool
