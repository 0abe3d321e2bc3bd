// SPDX-License-Identifier: Apache-2.0
// A main program that runs a fuzz target as an ordinary test, without a fuzzer.
#include "tests/fuzz_seeds.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <random>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

std::size_t runs = 0;

// The seed is copied into memory of exactly its size, so that the address sanitizer detects reads beyond it.
void run(absenc::Bytes input) {
  const absenc::Seed copy(input.begin(), input.end());
  LLVMFuzzerTestOneInput(copy.data(), copy.size());
  ++runs;
}

void run_near(const absenc::Seed& seed) {
  for (std::size_t size = 0; size <= seed.size(); ++size) run(absenc::Bytes(seed).first(size));
  absenc::Seed flipped = seed;
  for (std::size_t bit = 0; bit < 8 * seed.size(); ++bit) {
    const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
    flipped[bit / 8] ^= mask;
    run(flipped);
    flipped[bit / 8] ^= mask;
  }
}

}  // namespace

int main() {
  for (const absenc::Seed& seed : absenc::fuzz_seeds()) run_near(seed);
  std::mt19937 random(20240229);  // a fixed seed makes failures reproducible
  for (int i = 0; i < 4000; ++i) {
    absenc::Seed noise(random() % 64);
    std::generate(noise.begin(), noise.end(), [&] { return static_cast<std::uint8_t>(random()); });
    run(noise);
  }
  std::printf("%zu inputs\n", runs);
}
