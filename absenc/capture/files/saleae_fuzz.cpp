// SPDX-License-Identifier: Apache-2.0
// Fuzzes the reader of Saleae's binary exports, as captures and as single channels.
#include "absenc/capture/files/saleae.hpp"

#include "absenc/capture/files/test_files.hpp"

namespace {

using namespace absenc::capture;

FileBytes version_one() {
  BinaryWriter file = saleae_header(1);
  file.put(std::uint64_t{2});
  file.put(std::uint32_t{0}).put(1e6).put(1.0).put(2.0).put(std::uint64_t{2}).put(1.25).put(1.5);
  file.put(std::uint32_t{1}).put(1e6).put(3.0).put(4.0).put(std::uint64_t{1}).put(3.5);
  return file.bytes;
}

// Reads `bytes` as the file of one channel, together with the file of a good channel.
void read_with(const FileBytes& good, FileBytes bytes) {
  std::vector<SaleaeChannel> channels;
  channels.push_back({"good", memory_source(good)});
  channels.push_back({"other", memory_source(std::move(bytes))});
  try {
    static_cast<void>(read_all(*read_saleae(std::move(channels))));
  } catch (const OpenError&) {  // the reader has stated a reason why it cannot open the file
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const FileBytes first = saleae_file(true, -0.5, 2, {-0.25, 0, 0.5, 1.5});
  static const FileBytes second = version_one();
  for (const FileBytes& file : {first, second}) {
    fuzz_file(data, size, file, [&](FileBytes bytes) {
      read_or_refuse(bytes);
      read_with(first, std::move(bytes));
    });
  }
  return 0;
}
