// SPDX-License-Identifier: Apache-2.0
// Opens any bytes as a capture, and valid candump logs with some bytes changed.
#include "absenc/capture/files/candump.hpp"

#include "absenc/capture/files/test_files.hpp"

namespace {

using namespace absenc::capture;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<FileBytes> good = {
      to_bytes(
          "(1436509052.249713) vcan0 044#2A366C2B\n(1436509052.449847) can1 12345678#R4\n(1436509053.0) can1 123##0\n"),
      to_bytes(" (000.000100)  can0  RX - -  123   [3]  41 42 43   'ABC'\n (000.000050)  can0  20000004   [1]  00   "
               "ERRORFRAME\n")};
  for (const FileBytes& file : good)
    fuzz_file(data, size, file, [](FileBytes bytes) { read_or_refuse(std::move(bytes)); });
  return 0;
}
