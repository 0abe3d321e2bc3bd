// SPDX-License-Identifier: Apache-2.0
// Prints a capture of a logic analyser as rows of exchanges, each with its fields or its error.
#include <cstdio>
#include <exception>

#include "absenc/client/decode.hpp"

using namespace absenc::client;

int main(int argc, char** argv) try {
  if (argc < 3) return std::fprintf(stderr, "decode_capture FILE PROTOCOL [NAME=VALUE ...]\n"), 2;
  Decoded rows = decode(argv[1], argv[2], {.options = {argv + 3, argv + argc}});
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.values.size(); ++i) {
      const std::string text = to_text(row.values[i]);
      if (!text.empty()) std::printf("%s=%s ", std::string(row.columns[i].name).c_str(), text.c_str());
    }
    std::printf("\n");
  }
  for (const std::string& note : rows.notes()) std::fprintf(stderr, "note: %s\n", note.c_str());
} catch (const std::exception& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 1;
}
