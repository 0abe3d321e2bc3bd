// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>

#include "absenc/protocol/protocol_name/frame.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static_cast<void>(absenc::protocol_name::decode_reply({data, size}));
  return 0;
}
