// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/campaign/check_code.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "absenc/sim/place.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::client {

namespace {

// greatest width of a checksum, in bits: all 2^width words of its dual code are computed
constexpr unsigned most_check_bits = 16;

struct ReadingSink final : FieldSink {
  void put(const FieldValue&) override {}
  void put_reading(const Reading& one) override { reading = one; }
  std::optional<Reading> reading;
};

bool is_of_others(Error error) { return error != Error::none && error != Error::bad_checksum; }

}  // namespace

bool has_position(const Unit& unit, const Options& options, const GoodReply& reply) {
  if (reply.reply.empty()) return false;
  ReadingSink seen;
  const Frame frame{.bytes = reply.reply, .bits = reply.bits};
  return unit.decode(options, {.bytes = reply.request}, frame, seen) == Error::none && seen.reading.has_value();
}

/// A copy of a good reply, in which a search flips bits to learn what the decoder detects.
class CheckCode::AlteredReply {
 public:
  AlteredReply(const Unit& unit, const Options& options, const GoodReply& good)
      : unit_(unit), options_(options), good_(good), frame_(good.reply) {}

  void flip(std::size_t bit) { frame_[bit / 8] = static_cast<std::uint8_t>(frame_[bit / 8] ^ (0x80u >> (bit % 8))); }
  void restore() { frame_ = good_.reply; }
  [[nodiscard]] Error decode(FieldSink& sink) const {
    return unit_.decode(options_, {.bytes = good_.request}, {.bytes = frame_, .bits = good_.bits}, sink);
  }
  [[nodiscard]] Error error() const {
    return unit_.check(options_, {.bytes = good_.request}, {.bytes = frame_, .bits = good_.bits});
  }
  [[nodiscard]] bool passes() const { return error() != Error::bad_checksum; }

 private:
  const Unit& unit_;
  const Options& options_;
  const GoodReply& good_;
  std::vector<std::uint8_t> frame_;
};

std::optional<CheckCode> CheckCode::learn(const Unit& unit, const Options& options,
                                          std::span<const GoodReply> replies) {
  const std::size_t bits = replies.front().bit_count();
  for (const GoodReply& reply : replies) {
    if (reply.bit_count() != bits) return {};
  }
  CheckCode code;
  code.syndromes_.resize(bits);
  code.is_fixed_.resize(bits);
  AlteredReply asked(unit, options, replies.front());
  for (std::size_t bit = 0; bit < bits; ++bit) {
    asked.flip(bit);
    code.is_fixed_[bit] = is_of_others(asked.error());
    asked.flip(bit);
    if (code.is_fixed_[bit]) ++code.fixed_;
  }
  if (!code.find_check(asked) || 2 * code.fixed_ >= bits) return {};
  if (!code.is_linear(unit, options, replies)) return {};
  return code;
}

// Selects the check bits of the code, beginning at the end of the frame, where most checksums are. Any other linearly
// independent bits of the frame could serve as check bits.
bool CheckCode::find_check(AlteredReply& asked) {
  bool complete = false;
  bool before = false;
  for (std::size_t bit = bits(); bit-- > 0;) {
    if (is_fixed_[bit]) continue;
    const std::optional<std::uint32_t> syndrome = before ? std::nullopt : syndrome_of(asked, bit);
    if (syndrome) {
      syndromes_[bit] = *syndrome;
      complete = complete || *syndrome != 0;
    } else if (complete) {
      before = true;
      is_fixed_[bit] = true;
      ++fixed_;
    } else if (check_.size() == most_check_bits) {
      return false;
    } else {
      syndromes_[bit] = std::uint32_t{1} << check_.size();
      check_.push_back(bit);
    }
  }
  return true;
}

// Returns the check bits that must be flipped together with the bit number `bit`, so that the checksum stays right;
// nothing if no choice of check bits does that.
std::optional<std::uint32_t> CheckCode::syndrome_of(AlteredReply& asked, std::size_t bit) const {
  asked.restore();
  asked.flip(bit);
  std::uint32_t pattern = 0;
  if (asked.passes()) return pattern;
  // In Gray code order, consecutive patterns of check bits differ in one bit, so each step flips only one.
  for (std::uint32_t i = 1; i < std::uint32_t{1} << check_.size(); ++i) {
    const auto changed = static_cast<unsigned>(std::countr_zero(i));
    asked.flip(check_[changed]);
    pattern ^= std::uint32_t{1} << changed;
    if (asked.passes()) return pattern;
  }
  return {};
}

// Returns whether the decoder accepts or rejects 1000 replies with random errors as the syndromes of the code predict.
bool CheckCode::is_linear(const Unit& unit, const Options& options, std::span<const GoodReply> replies) const {
  sim::Random random(1);
  for (unsigned i = 0; i < 1000; ++i) {
    AlteredReply asked(unit, options, replies[random.below(replies.size())]);
    std::uint32_t syndrome = 0;
    for (std::size_t bit = 0; bit < bits(); ++bit) {
      if (is_fixed_[bit] || random.below(2) == 0) continue;
      asked.flip(bit);
      syndrome ^= syndromes_[bit];
    }
    // a check of the decoder other than the checksum may reject the reply first
    const Error error = asked.error();
    if (error == (syndrome == 0 ? Error::bad_checksum : Error::none)) return false;
    for (unsigned one = 0; one < check_.size(); ++one) {
      if ((syndrome >> one & 1) != 0) asked.flip(check_[one]);
    }
    if (!asked.passes()) return false;
  }
  return true;
}

// Counts the words of the dual code by weight.
std::vector<std::uint32_t> CheckCode::dual_weights() const {
  std::vector<std::uint32_t> count(free_bits() + 1);
  for (std::uint32_t word = 0; word < std::uint32_t{1} << check_.size(); ++word) {
    std::size_t weight = 0;
    for (std::size_t bit = 0; bit < bits(); ++bit) {
      weight += static_cast<std::size_t>(std::popcount(word & syndromes_[bit]) & 1);
    }
    ++count[weight];
  }
  return count;
}

std::vector<double> CheckCode::weights(unsigned most) const {
  const std::vector<std::uint32_t> dual = dual_weights();
  const auto n = static_cast<double>(free_bits());
  std::vector<double> words(most + 1);
  for (std::size_t weight = 0; weight < dual.size(); ++weight) {
    if (dual[weight] == 0) continue;
    // MacWilliams identity: `now` is the Krawtchouk polynomial of degree k at `weight`, computed from those of the two
    // degrees below.
    double before = 0;
    double now = 1;
    for (unsigned k = 0; k <= most; ++k) {
      words[k] += dual[weight] * now;
      const double next = ((n - 2 * static_cast<double>(weight)) * now - (n - k + 1) * before) / (k + 1);
      before = now;
      now = next;
    }
  }
  for (double& count : words) count = std::round(std::ldexp(count, -static_cast<int>(check_bits())));
  return words;
}

double CheckCode::unseen(double bit_errors) const {
  const std::vector<std::uint32_t> dual = dual_weights();
  double pass = 0;
  for (std::size_t weight = 0; weight < dual.size(); ++weight) {
    pass += dual[weight] * std::pow(1 - 2 * bit_errors, static_cast<double>(weight));
  }
  pass = std::ldexp(pass, -static_cast<int>(check_bits()));
  const double undamaged = std::pow(1 - bit_errors, static_cast<double>(free_bits()));
  return std::max(0.0, pass - undamaged) * std::pow(1 - bit_errors, static_cast<double>(fixed_));
}

bool CheckCode::is_check(std::size_t bit) const {
  const std::uint32_t syndrome = syndromes_[bit];
  return std::has_single_bit(syndrome) && check_[static_cast<unsigned>(std::countr_zero(syndrome))] == bit;
}

// Estimates the share by importance sampling: draws only errors that the checksum does not detect, because the decoder
// rejects a reply with any other error.
Estimated CheckCode::taken(const Unit& unit, const Options& options, std::span<const GoodReply> replies,
                           double bit_errors, unsigned samples) const {
  sim::Random random(2);
  std::vector<double> of_frame(replies.size());
  for (unsigned i = 0; i < samples; ++i) {
    const GoodReply& reply = replies[i % replies.size()];
    AlteredReply asked(unit, options, reply);
    std::uint32_t syndrome = 0;
    bool damaged = false;
    bool by_chance = false;
    for (std::size_t bit = 0; bit < bits(); ++bit) {
      if (is_check(bit) || !random.chance(bit_errors)) continue;
      asked.flip(bit);
      syndrome ^= syndromes_[bit];
      damaged = true;
      by_chance = by_chance || is_fixed_[bit];
    }
    if (!damaged) continue;
    for (unsigned one = 0; one < check_.size(); ++one) {
      if (by_chance ? random.chance(bit_errors) : (syndrome >> one & 1) != 0) asked.flip(check_[one]);
    }
    ReadingSink right;
    ReadingSink seen;
    if (asked.decode(seen) != Error::none) continue;
    asked.restore();
    if (asked.decode(right) != Error::none || sim::same_place(seen.reading, right.reading)) continue;
    const int flipped = std::popcount(syndrome);
    const double chance =
        by_chance ? 1
                  : std::pow(bit_errors, flipped) * std::pow(1 - bit_errors, static_cast<int>(check_bits()) - flipped);
    of_frame[i % replies.size()] += chance;
  }
  double sum = 0;
  double squares = 0;
  for (const double one : of_frame) {
    sum += one;
    squares += one * one;
  }
  const auto frames = static_cast<double>(replies.size());
  const double variance = std::max(0.0, squares / frames - sum / frames * sum / frames);
  return {sum / samples, std::sqrt(variance * frames) / samples};
}

}  // namespace absenc::client
