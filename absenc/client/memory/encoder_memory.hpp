// SPDX-License-Identifier: Apache-2.0
// The memory of an opened encoder, by the commands that its protocol has for it.
#pragma once

#include <functional>

#include "absenc/client/memory/image.hpp"
#include "absenc/client/way/connection.hpp"

namespace absenc::client {

/// Everything throws EncoderFailure when the encoder fails, and what the port throws.
class EncoderMemory {
 public:
  /// Called with how many bytes of how many are read.
  using Progress = std::function<void(std::size_t done, std::size_t all)>;

  explicit EncoderMemory(Connection& encoder) : encoder_(&encoder) {}

  /// Reads the position: an encoder of another model than was said shows itself by that, its memory does not tell.
  void check_model();

  /// What the encoder has at the addresses of `image`, which must be open.
  [[nodiscard]] MemoryImage read(const MemoryImage& image, const Progress& progress = {});

  /// Returns when it was read back.
  void write(MemoryAddress at, std::uint8_t value, Access access);

 private:
  [[nodiscard]] std::vector<std::uint8_t> read_run(MemoryAddress at, std::size_t count);

  Connection* encoder_;
};

}  // namespace absenc::client
