// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/doctor/damage.hpp"

#include <cstdint>

#include "absenc/sim/random.hpp"

namespace absenc::client {

namespace {

bool has_characters(const Case& one) {
  return one.unit.link == LinkKind::half_duplex || one.unit.link == LinkKind::full_duplex;
}

// Returns whether flipping a single bit of the reply can make it good.
bool is_mended(const Case& one, const Frame& request, std::vector<std::uint8_t> bytes, std::size_t bits) {
  const std::size_t count = bits != 0 ? bits : bytes.size() * 8;
  for (std::size_t bit = 0; bit < count; ++bit) {
    // A frame of bits begins with the most significant bit of its first byte.
    bytes[bit / 8] ^= static_cast<std::uint8_t>(0x80u >> (bit % 8));
    const bool is_good = decodes(one, request, {.bytes = bytes, .bits = bits});
    bytes[bit / 8] ^= static_cast<std::uint8_t>(0x80u >> (bit % 8));
    if (is_good) return true;
  }
  return false;
}

}  // namespace

All damaged(const std::vector<Attempted>& attempts) {
  All all;
  for (const Attempted& attempt : attempts) {
    if (attempt.error != Error::none && attempt.heard) all.push_back(&attempt);
  }
  return all;
}

bool decodes(const Case& one, const Frame& request, const Frame& reply) {
  return one.unit.check(one.options, request, reply) == Error::none;
}

bool has_good_part(const Case& one, const Attempted& attempt) {
  if (!has_characters(one) || attempt.raw.empty()) return false;
  const Frame request = attempt.exchange.request.frame();
  const auto is_frame = [&](Bytes bytes) {
    const FrameEnd end = one.unit.frame_end(one.options, Direction::reply, bytes);
    return end.kind == FrameEnd::Kind::complete && end.size == bytes.size() && decodes(one, request, {.bytes = bytes});
  };
  const Bytes raw = attempt.raw;
  if (is_frame(raw)) return false;  // the received bytes are exactly one good frame, so there are no further bytes
  const Bytes sent = request.bytes;
  if (!sent.empty() && raw.size() > sent.size() && std::equal(sent.begin(), sent.end(), raw.begin()) &&
      is_frame(raw.subspan(sent.size()))) {
    return true;
  }
  // Searches two good frames that make up the reply, or one good frame with at least two thirds of all bytes.
  for (std::size_t size = 2; size < raw.size(); ++size) {
    const bool is_long = size * 3 >= raw.size() * 2;
    if (is_long ? is_frame(raw.first(size)) || is_frame(raw.last(size))
                : is_frame(raw.first(size)) && is_frame(raw.subspan(size))) {
      return true;
    }
  }
  return false;
}

bool is_cut(const Case& one, const Attempted& attempt) {
  const Bytes reply = attempt.exchange.reply.bytes;
  if (!has_characters(one) || reply.empty()) return false;
  const FrameEnd end = one.unit.frame_end(one.options, Direction::reply, reply);
  return end.kind == FrameEnd::Kind::incomplete && end.size > reply.size();
}

std::size_t mended_by_one_bit(const Case& one, const All& all) {
  constexpr std::size_t enough = 5;
  constexpr std::size_t most_tried = 24;
  if (one.unit.link == LinkKind::can) return 0;
  sim::Random random(1);
  std::size_t tried = 0;
  std::size_t mended = 0;
  std::size_t by_chance = 0;
  for (const Attempted* attempt : all) {
    const auto& reply = attempt->exchange.reply;
    if (reply.bytes.empty()) continue;
    if (++tried > most_tried) break;
    const Frame request = attempt->exchange.request.frame();
    mended += is_mended(one, request, reply.bytes, reply.bits) ? 1 : 0;
    std::vector<std::uint8_t> noise(reply.bytes.size());
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random.below(256));
    by_chance += is_mended(one, request, noise, reply.bits) ? 1 : 0;
  }
  tried = std::min(tried, most_tried);
  return tried >= enough && mended > 2 * by_chance + tried / 8 ? mended : 0;
}

}  // namespace absenc::client
