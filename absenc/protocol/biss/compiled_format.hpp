// SPDX-License-Identifier: Apache-2.0
// BiSS formats that are chosen once and then decode many frames, compiled.
#pragma once

#include "absenc/protocol/biss/compiled_channel.hpp"
#include "absenc/protocol/biss/safety.hpp"

namespace absenc::biss {

/// A BiSS format whose word and check are compiled, so that many frames are decoded fast.
class CompiledFormat {
 public:
  /// Compiles `format`, which is copied.
  constexpr explicit CompiledFormat(const Format& format) : format_(format), channel_(format) {}
  /// Returns the format that was compiled.
  constexpr operator const Format&() const { return format_; }

  /// Decodes a frame with the same result as biss::decode with the format that was compiled.
  [[nodiscard]] constexpr Result<Reply> decode(const BitView& samples, Cds cds) const {
    if (!channel_.is_possible()) return decode_otherwise(samples, cds);
    return detail::decode_compiled<Word>(channel_, samples, cds, [&] { return decode_otherwise(samples, cds); });
  }

 private:
  // Decodes a frame that the compiled format cannot decode: a long word, unusual bits before the word, or an error.
  [[nodiscard, gnu::noinline]] constexpr Result<Reply> decode_otherwise(const BitView& samples, Cds cds) const {
    return biss::decode(format_, samples, cds);
  }

  Format format_;
  CompiledChannel<> channel_;
};

/// Decodes a frame with the same result as by the format that `compiled` was made of.
[[nodiscard]] constexpr Result<Reply> decode(const CompiledFormat& compiled, const BitView& samples,
                                             Cds cds = Cds::zero) {
  return compiled.decode(samples, cds);
}

/// A format of BiSS Safety with both words and checks compiled, as CompiledFormat.
class CompiledSafetyFormat {
 public:
  /// Compiles `format`, which is copied.
  constexpr explicit CompiledSafetyFormat(const SafetyFormat& format)
      : format_(format),
        cpw_(format.cpw),
        spw_(format.spw),
        is_possible_(is_usable(format) && cpw_.is_possible() && spw_.is_possible()) {}
  /// Returns the format that was compiled.
  constexpr operator const SafetyFormat&() const { return format_; }

  /// Decodes a frame with the same result as biss::decode with the format that was compiled.
  [[nodiscard]] constexpr Result<SafetyReply> decode(const BitView& samples, Cds cds) const {
    detail::Head head;
    if (!is_possible_ || !detail::find_data(samples, cpw_.bits() + spw_.bits(), cds, head)) {
      return decode_otherwise(samples, cds);
    }
    const Bits cpw = cpw_.load(samples, head.first());
    const Bits spw = spw_.load(samples, head.first() + cpw_.bits());
    if (!is_good(cpw, spw)) return decode_otherwise(samples, cds);
    return Result<SafetyReply>([&] {
      return SafetyReply{.ack_bits = head.ack_bits,
                         .cpw = data_of(cpw_, cpw),
                         .spw = data_of(spw_, spw),
                         .delay_bits = head.delay_bits(),
                         .cds = head.cds};
    });
  }

 private:
  using Bits = CompiledChannel<>::Bits;

  [[nodiscard]] static constexpr ChannelData data_of(const CompiledChannel<>& channel, const Bits& sent) {
    return {channel.values_of<Word>(sent), channel.life_counter_of(sent), sent.crc};
  }
  // Returns false if the word has a CRC and all its bits are 0, because zeros alone are no word: see take_channel.
  [[nodiscard]] static constexpr bool is_sent(const CompiledChannel<>& channel, const Bits& bits) {
    return !channel.has_crc() || (bits.covered | bits.crc) != 0;
  }
  [[nodiscard]] constexpr bool is_good(const Bits& cpw, const Bits& spw) const {
    return is_sent(cpw_, cpw) && is_sent(spw_, spw) && cpw_.is_right(cpw) && spw_.is_right(spw) &&
           life_counter_follows(format_, spw_.life_counter_of(spw)) &&
           positions_agree(format_, cpw_.values_of<WordWith<0>>(cpw), spw_.values_of<WordWith<0>>(spw));
  }
  // Decodes a frame that the compiled format cannot decode: a long word, unusual bits before the word, or an error.
  [[nodiscard, gnu::noinline]] constexpr Result<SafetyReply> decode_otherwise(const BitView& samples, Cds cds) const {
    return biss::decode(format_, samples, cds);
  }

  SafetyFormat format_;
  CompiledChannel<> cpw_;
  CompiledChannel<> spw_;
  bool is_possible_;
};

/// Decodes a frame with the same result as by the format that `compiled` was made of.
[[nodiscard]] constexpr Result<SafetyReply> decode(const CompiledSafetyFormat& compiled, const BitView& samples,
                                                   Cds cds = Cds::zero) {
  return compiled.decode(samples, cds);
}

}  // namespace absenc::biss
