// SPDX-License-Identifier: Apache-2.0
// Fuzz test: parses any text as a word format, and decodes and encodes words with it.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "absenc/protocol/word.hpp"

namespace {

using namespace absenc;

void require(bool condition) {
  if (!condition) std::abort();
}

// Decodes a word, encodes it again, and compares.
void decode_and_encode(const WordFormat& format, Bytes bits) {
  const BitView view{bits, bits.size() * 8};
  const Result<Word> word = decode_word(format, view);
  if (!word) return;
  BitBuffer<WordFormat::maximum_bits> again;
  require(encode_word(format, *word, again) && again.size() == format.bits());
  const Result<Word> same = decode_word(format, again.view());
  require(same && *same == *word);
  std::size_t at = 0;
  for (const WordField& field : format.fields()) {
    if (field.meaning != Meaning::skip && field.meaning != Meaning::parity) {
      require(again.view().load(at, field.bits) == view.load(at, field.bits));
    }
    at += field.bits;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (std::size_t split = 0; split <= size; split += 1 + size / 16) {
    const std::string_view text(reinterpret_cast<const char*>(data), split);
    WordFormat format;
    const WordFormatError error = parse_word_format(text, format);
    require(error.at <= text.size());
    require(error.reason.empty() == (format.bits() > 0));
    if (error.reason.empty()) decode_and_encode(format, Bytes(data, size).subspan(split));
  }
  static constexpr WordFormat everything =
      "a=value:3! multiturn:12 skip:2 position:20 error:1! warning:1 parity:1! gray"_word;
  decode_and_encode(everything, {data, size});
  return 0;
}
