// SPDX-License-Identifier: Apache-2.0
// Fuzzes opening: any bytes, and a value change dump that is changed or cut off.
#include "absenc/capture/files/vcd.hpp"

#include "absenc/capture/files/test_files.hpp"

namespace {

using namespace absenc::capture;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<FileBytes> good = {to_bytes(
      "$timescale 1 us $end $scope module a $end $var wire 1 ! tx $end $var reg 3 \" b [2:0] $end $upscope $end "
      "$enddefinitions $end #0 $dumpvars 1! b0 \" $end #3 0! #5 b101 \" 1! #7 x! bz \" #9 0! #20")};
  for (const FileBytes& file : good)
    fuzz_file(data, size, file, [](FileBytes bytes) { read_or_refuse(std::move(bytes)); });
  return 0;
}
