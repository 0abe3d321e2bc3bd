// SPDX-License-Identifier: Apache-2.0
// Any bytes as a stream in pieces.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absenc/protocol/raa38/serial/listen.hpp"
#include "tests/fuzz_toys.hpp"

namespace {

using namespace absenc;
using namespace absenc::raa38::serial;
using namespace absenc::fuzz;

Settings settings_of(std::uint8_t byte) {
  Settings settings;
  settings.format.bits = least_bits + byte % (most_bits - least_bits + 1);
  settings.format.second_byte = static_cast<SecondByte>(byte % 3);
  settings.mode = static_cast<Mode>(byte / 3 % 3);
  settings.zeroing = settings.mode == Mode::bus ? Zeroing::command : Zeroing::line;
  if (byte % 2 != 0) settings.period = std::chrono::milliseconds(1);
  if (byte % 8 == 7) settings.maximum_rpm = 3000;
  return settings;
}

// In whatever pieces, the same positions, each of them in the bytes as a good frame.
void stream(const Settings& settings, Bytes input) {
  const auto hear = [&](std::size_t piece) {
    std::vector<std::uint32_t> positions;
    StreamDecoder decoder(settings.format, settings.second_byte());
    for (std::size_t at = 0; at < input.size(); at += piece) {
      decoder.feed(input.subspan(at, std::min(piece, input.size() - at)), Time{}, [&](const Found& found) {
        if (found.error == Error::none) positions.push_back(found.singleturn);
      });
    }
    return positions;
  };
  const std::vector<std::uint32_t> whole = hear(input.size());
  require(hear(1) == whole && hear(3) == whole);
  std::size_t from = 0;
  for (const std::uint32_t position : whole) {
    const FrameBytes frame = encode_position(settings.format, {position, settings.second_byte()});
    const auto rest = input.subspan(from);
    const auto found = std::search(rest.begin(), rest.end(), frame.view().begin(), frame.view().end());
    require(found != rest.end());
    from += static_cast<std::size_t>(found - rest.begin()) + frame.size();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes input(data, size);
  const Settings settings = settings_of(data[0]);
  stream(settings, input);
  stream({}, input);
  return 0;
}
