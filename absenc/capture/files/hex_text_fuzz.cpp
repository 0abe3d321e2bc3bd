// SPDX-License-Identifier: Apache-2.0
// Opens any bytes as a capture, and valid hexadecimal texts with some bytes changed.
#include "absenc/capture/files/hex_text.hpp"

#include "absenc/capture/files/test_files.hpp"

namespace {

using namespace absenc::capture;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<FileBytes> good = {
      to_bytes("1A 00,0x35 # comment\n\\x01\\x02\n"),
      to_bytes("12.000250 tx 1A\n[2026-11-21 17:55:24] < 00\n250us > 01 02\n"),
      to_bytes("00000000  00 0d 1a 27  |....|\n00000004: 0011  ..\n*\n"),
      to_bytes("00000000: 000d 1a27  ....\n00000004: 0011  ..\n"),
      to_bytes("200-210 uart-1: Start bit\n210-290 uart-1: rx-data: 1A\nuart-1: 35\n")};
  for (const FileBytes& file : good)
    fuzz_file(data, size, file, [](FileBytes bytes) { read_or_refuse(std::move(bytes)); });
  return 0;
}
