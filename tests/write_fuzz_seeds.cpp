// SPDX-License-Identifier: Apache-2.0
// Program that writes the fuzz seeds, one file each, into the folder given as its argument.
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/fuzz_seeds.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: write_fuzz_seeds FOLDER\n", stderr);
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  std::size_t number = 0;
  for (const absenc::Seed& seed : absenc::fuzz_seeds()) {
    std::ofstream file(folder / std::to_string(number++), std::ios::binary);
    for (const std::uint8_t byte : seed) file.put(static_cast<char>(byte));
    if (!file.flush()) return 1;
  }
}
