// SPDX-License-Identifier: Apache-2.0
// Decoding an SSI word into named values.
#pragma once

#include "absenc/protocol/ssi/frame.hpp"

namespace absenc::ssi {

constexpr Error decode(const Format& format, BitView bits, FieldSink& sink) {
  const Result<Word> word = decode(format, bits);
  if (word) put_position(sink, format.word, *word, format.scale);
  return word.error();
}

}  // namespace absenc::ssi
