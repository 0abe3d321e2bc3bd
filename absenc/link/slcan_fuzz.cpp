// SPDX-License-Identifier: Apache-2.0
// Feeds arbitrary bytes to the reader as the output of a CAN adapter. It must find a valid frame that follows them.
#include "absenc/link/slcan.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace {

using namespace absenc;

void require(bool condition) {
  if (!condition) std::abort();
}

// Converts digits a to f to upper case, as `encode` writes them.
std::uint8_t upper(std::uint8_t byte) {
  return byte >= 'a' && byte <= 'f' ? static_cast<std::uint8_t>(byte - 'a' + 'A') : byte;
}

void check(Bytes line) {
  const Result<CanFrame> frame = slcan::decode(line);
  if (!frame) return;
  require(frame->size <= 8 && frame->id <= (frame->extended ? 0x1FFFFFFFu : 0x7FFu));
  const slcan::LineText again = slcan::encode(*frame);
  require(again.size() - 1 == line.size() || again.size() + 3 == line.size());
  for (std::size_t i = 0; i + 1 < again.size(); ++i) require(again[i] == upper(line[i]));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  check({data, size});
  slcan::LineReader reader;
  for (std::size_t i = 0; i < size; ++i) {
    if (reader.feed(data[i]) != slcan::LineReader::LineEvent::line) continue;
    require(reader.line().size() <= slcan::line_capacity);
    check(reader.line());
  }
  const CanFrame frame{.id = 0x120, .size = 1, .data = {0x47}};
  slcan::LineReader::LineEvent found{};
  const slcan::LineText text = slcan::encode(frame);
  for (const std::uint8_t byte : text.view()) found = reader.feed(byte);
  require(found == slcan::LineReader::LineEvent::line);
  const Result<CanFrame> read = slcan::decode(reader.line());
  require(read && *read == frame);
  return 0;
}
