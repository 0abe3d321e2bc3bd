// SPDX-License-Identifier: Apache-2.0
// What a unit's checksum does not see, as a linear code that its own decoder tells.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::client {

/// A good reply with its request, on links that carry bytes.
struct GoodReply {
  std::vector<std::uint8_t> request;
  std::vector<std::uint8_t> reply;
  std::size_t bits = 0;  // clocked links: of the reply

  [[nodiscard]] std::size_t bit_count() const { return bits != 0 ? bits : reply.size() * 8; }
};

/// Whether it is good and has a position.
[[nodiscard]] bool has_position(const Unit& unit, const Options& options, const GoodReply& reply);

/// A value with its standard deviation.
struct Estimated {
  double value = 0;
  double deviation = 0;
};

/// The errors that the checksum passes are a linear code: an error is a word of it when all the syndromes of its bits
/// together are nothing. Bits are numbered in the order of the bytes, from the most significant.
class CheckCode {
 public:
  /// Asks the decoder: the last bits of the frame whose errors no other among them make good are the check's own, and
  /// of every other bit it is tried with which of these the check is right again. Nothing when the check has more than
  /// 16 bits or covers less than half of the frame (each channel has its own), is not linear (a sum, digits as text),
  /// or the replies are not of one length. At least one reply.
  [[nodiscard]] static std::optional<CheckCode> learn(const Unit& unit, const Options& options,
                                                      std::span<const GoodReply> replies);

  [[nodiscard]] std::size_t bits() const { return syndromes_.size(); }
  [[nodiscard]] unsigned check_bits() const { return static_cast<unsigned>(check_.size()); }
  /// Bits that the checksum does not speak of: those before the frame, and what is always the same.
  [[nodiscard]] std::size_t fixed_bits() const { return fixed_; }
  /// How many words of 0 to `most` bits the code has, by MacWilliams' identity from the 2^check_bits words of its dual.
  [[nodiscard]] std::vector<double> weights(unsigned most) const;
  /// How often independent errors of each bit damage a reply, none of them a fixed bit, and the checksum is right.
  [[nodiscard]] double unseen(double bit_errors) const;
  /// How often they do and the decoder, with all its checks, takes the reply for good with another position: over words
  /// of the code drawn by chance, each as often as it would come, and errors of fixed bits.
  [[nodiscard]] Estimated taken(const Unit& unit, const Options& options, std::span<const GoodReply> replies,
                                double bit_errors, unsigned samples) const;

 private:
  CheckCode() = default;
  class Asked;
  bool find_check(Asked& asked);
  [[nodiscard]] std::optional<std::uint32_t> syndrome_of(Asked& asked, std::size_t bit) const;
  [[nodiscard]] bool is_check(std::size_t bit) const;
  [[nodiscard]] bool is_linear(const Unit& unit, const Options& options, std::span<const GoodReply> replies) const;
  [[nodiscard]] std::vector<std::uint32_t> dual_weights() const;
  [[nodiscard]] std::size_t free_bits() const { return syndromes_.size() - fixed_; }

  std::vector<std::uint32_t> syndromes_;  // of each bit; bit n: check_[n]
  std::vector<bool> is_fixed_;
  std::vector<std::size_t> check_;  // the check's own bits
  std::size_t fixed_ = 0;
};

}  // namespace absenc::client
