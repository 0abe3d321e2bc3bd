// SPDX-License-Identifier: Apache-2.0
// Fuzzes the reader of sigrok sessions: any bytes, changed sessions, and any metadata.
#include "absenc/capture/files/sigrok.hpp"

#include <algorithm>
#include <array>

#include "absenc/capture/files/test_files.hpp"

namespace {

using namespace absenc::capture;

FileBytes session(const FileBytes& metadata, const FileBytes& samples, bool deflate) {
  return make_zip({{"version", to_bytes("2")}, {"metadata", metadata}, {"logic-1-1", samples}, {"logic-1-2", samples}},
                  deflate);
}

// Returns the file of a session that is cut off within its last archive entry.
FileBytes cut_off(FileBytes file) {
  constexpr std::string_view directory = "PK\x01\x02";
  file.erase(std::search(file.begin(), file.end(), directory.begin(), directory.end()) - 5, file.end());
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const FileBytes samples(600, 0x5A);
  static const FileBytes metadata = to_bytes(sigrok_metadata("1 MHz", 24, 3));
  static const FileBytes deflated = session(metadata, samples, true);
  static const FileBytes stored = session(metadata, samples, false);
  static const FileBytes cut_deflated = cut_off(deflated);
  static const FileBytes cut_stored = cut_off(stored);
  const std::array files{&deflated, &stored, &cut_deflated, &cut_stored};
  fuzz_file(data, size, *files[size % files.size()], [](FileBytes bytes) { read_or_refuse(std::move(bytes)); });
  fuzz_file(data, size, metadata, [](const FileBytes& text) { read_or_refuse(session(text, samples, false)); });
  return 0;
}
