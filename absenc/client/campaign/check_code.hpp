// SPDX-License-Identifier: Apache-2.0
// Finds the errors that a unit's checksum misses, as a linear code.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// A good reply with its request, on lines that carry bytes or bits.
struct GoodReply {
  std::vector<std::uint8_t> request;
  std::vector<std::uint8_t> reply;
  std::size_t bits = 0;  // number of bits of `reply` on a clocked link; 0: the reply consists of whole bytes

  [[nodiscard]] std::size_t bit_count() const { return bits != 0 ? bits : reply.size() * 8; }
};

/// Returns whether `reply` decodes without an error and contains a position.
[[nodiscard]] bool has_position(const Unit& unit, const Options& options, const GoodReply& reply);

/// An estimated value and its standard deviation.
struct Estimated {
  double value = 0;
  double deviation = 0;
};

/// The linear code of the errors that a checksum misses. Bits of a frame are numbered in the order of the bytes, from
/// the most significant bit.
class CheckCode {
 public:
  /// Derives the code from the decoder; returns nothing if that fails. `replies` must not be empty.
  [[nodiscard]] static std::optional<CheckCode> learn(const Unit& unit, const Options& options,
                                                      std::span<const GoodReply> replies);

  [[nodiscard]] std::size_t bits() const { return syndromes_.size(); }
  [[nodiscard]] unsigned check_bits() const { return static_cast<unsigned>(check_.size()); }
  /// Returns the number of bits of a reply that are not part of the code, because the checksum does not cover them or
  /// because the decoder demands a fixed value.
  [[nodiscard]] std::size_t fixed_bits() const { return fixed_; }
  /// Returns, for each weight (number of ones) from 0 to `most`, the number of code words of this weight.
  [[nodiscard]] std::vector<double> weights(unsigned most) const;
  /// Returns the chance that bit errors hit only bits that the checksum covers, and that the checksum does not detect
  /// them.
  [[nodiscard]] double unseen(double bit_errors) const;
  /// Estimates the share of all replies that are damaged, yet accepted with a position other than the true one.
  [[nodiscard]] Estimated taken(const Unit& unit, const Options& options, std::span<const GoodReply> replies,
                                double bit_errors, unsigned samples) const;

 private:
  CheckCode() = default;
  class AlteredReply;
  bool find_check(AlteredReply& asked);
  [[nodiscard]] std::optional<std::uint32_t> syndrome_of(AlteredReply& asked, std::size_t bit) const;
  [[nodiscard]] bool is_check(std::size_t bit) const;
  [[nodiscard]] bool is_linear(const Unit& unit, const Options& options, std::span<const GoodReply> replies) const;
  [[nodiscard]] std::vector<std::uint32_t> dual_weights() const;
  [[nodiscard]] std::size_t free_bits() const { return syndromes_.size() - fixed_; }

  // syndrome of each bit of the frame; bit n of a syndrome stands for the check bit with the index `check_[n]`
  std::vector<std::uint32_t> syndromes_;
  std::vector<bool> is_fixed_;
  std::vector<std::size_t> check_;  // indexes of the check bits in the frame
  std::size_t fixed_ = 0;
};

}  // namespace absenc::client
