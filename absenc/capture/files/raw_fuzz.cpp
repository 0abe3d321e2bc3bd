// SPDX-License-Identifier: Apache-2.0
// Opens any bytes with stated numbers of channels, which makes most of them raw samples.
#include "absenc/capture/files/raw.hpp"

#include "absenc/capture/files/test_files.hpp"

namespace {

using namespace absenc::capture;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const unsigned channels : {1u, 9u, 17u, 33u, 64u}) {
    read_or_refuse(FileBytes(data, data + size), {.channels = channels, .samples_per_second = 1000});
  }
  return 0;
}
