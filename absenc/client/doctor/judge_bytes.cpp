// SPDX-License-Identifier: Apache-2.0
// Finds changes that adapters and drivers make to the bytes of replies.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absenc/client/doctor/damage.hpp"
#include "absenc/client/doctor/judges.hpp"
#include "absenc/client/doctor/words.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::client {

namespace {

using ByteList = std::vector<std::uint8_t>;

constexpr std::uint8_t xon = 0x11;
constexpr std::uint8_t xoff = 0x13;
constexpr std::uint8_t lf = 0x0A;
constexpr std::uint8_t cr = 0x0D;

/// A received reply, and ways to undo changes of its bytes.
class Mender {
 public:
  // longest reply for which all combinations of 8th bits are tried, in bytes
  static constexpr std::size_t most_bytes = 12;

  /// Takes a damaged reply. With `random`, the object makes random changes, to measure how often chance mends a reply.
  Mender(const Case& one, const Attempted& attempt, sim::Random* random)
      : one_(one), request_(attempt.exchange.request.frame()), raw_(attempt.raw), random_(random) {}

  [[nodiscard]] const ByteList& raw() const { return raw_; }
  [[nodiscard]] sim::Random* random() const { return random_; }
  [[nodiscard]] bool is_good(Bytes bytes) const { return decodes(one_, request_, {.bytes = bytes}); }

  /// Returns whether the first `size` received bytes are the whole request.
  [[nodiscard]] bool begins_with_request(std::size_t size) const {
    const Bytes sent = request_.bytes;
    return sent.size() == size && raw_.size() >= size && std::equal(sent.begin(), sent.end(), raw_.begin());
  }

  /// Returns whether the reply becomes good without the bytes at `places` or, with `random`, without as many random
  /// ones.
  [[nodiscard]] bool without(const std::vector<std::size_t>& places) const {
    if (places.empty() || places.size() >= raw_.size()) return false;
    std::vector<bool> removed(raw_.size(), false);
    for (const std::size_t place : places) removed[place] = true;
    if (random_ != nullptr) {
      if (places.size() * 2 > raw_.size()) return false;
      std::vector<bool> others(raw_.size(), false);
      for (std::size_t count = 0; count < places.size();) {
        const std::size_t place = random_->below(raw_.size());
        if (others[place] || removed[place]) continue;
        others[place] = true;
        ++count;
      }
      removed = others;
    }
    ByteList rest;
    for (std::size_t i = 0; i < raw_.size(); ++i) {
      if (!removed[i]) rest.push_back(raw_[i]);
    }
    return is_good(rest);
  }

  /// Returns whether the reply becomes good if up to `most` bytes with one of these `values` are inserted; decodes at
  /// most 5000 changed replies.
  [[nodiscard]] bool with(Bytes values, std::size_t most, std::size_t& put) const {
    ByteList used(values.begin(), values.end());
    if (random_ != nullptr) {
      for (std::uint8_t& value : used) value = static_cast<std::uint8_t>(0x20 + random_->below(0xE0));
    }
    std::size_t tries = most_tries;
    // If the beginning of the reply states the length of the frame, tries first to insert as many bytes as are missing.
    const FrameEnd end = one_.unit.frame_end(one_.options, Direction::reply, raw_);
    const bool is_cut = end.kind == FrameEnd::Kind::incomplete && end.size > raw_.size();
    for (put = is_cut ? std::min(end.size - raw_.size(), most) : 1; put <= most && tries > 0; ++put) {
      ByteList bytes = raw_;
      if (insert(bytes, used, 0, put, tries)) return true;
    }
    return false;
  }

  /// Returns whether the reply may be damaged because the 8th bits of its bytes were lost.
  [[nodiscard]] bool with_eighth_bits(std::size_t& set) const {
    ByteList bytes = raw_;
    if (random_ != nullptr && bytes.size() > 2) {
      for (int i = 0; i < 2; ++i)
        bytes[random_->below(bytes.size())] ^= static_cast<std::uint8_t>(1u << random_->below(7));
    }
    // A longer reply has too many combinations of 8th bits, so only its length is checked.
    if (bytes.size() > most_bytes) {
      const FrameEnd end = one_.unit.frame_end(one_.options, Direction::reply, bytes);
      set = bytes.size();
      return end.kind == FrameEnd::Kind::complete && end.size == bytes.size();
    }
    const std::size_t count = bytes.size();
    for (unsigned mask = 1; mask < 1u << count; ++mask) {
      for (std::size_t i = 0; i < count; ++i) {
        const auto bit = static_cast<std::uint8_t>((mask >> i & 1u) << 7);
        bytes[i] = static_cast<std::uint8_t>((bytes[i] & 0x7F) | bit);
      }
      if (!is_good(bytes)) continue;
      set = static_cast<std::size_t>(std::popcount(mask));
      return true;
    }
    return false;
  }

 private:
  static constexpr std::size_t most_tries = 5000;  // greatest number of decodings of one reply with changed bytes

  // Each decoding decrements `tries`; the search for a good reply ends at 0.
  [[nodiscard]] bool insert(ByteList& bytes, const ByteList& values, std::size_t from, std::size_t count,
                            std::size_t& tries) const {
    if (count == 0) {
      if (tries == 0) return false;
      --tries;
      return is_good(bytes);
    }
    for (std::size_t place = from; place <= bytes.size(); ++place) {
      for (const std::uint8_t value : values) {
        // Inserting a value before or after an equal byte gives the same bytes, so only one of the two is tried.
        if (place < bytes.size() && bytes[place] == value) continue;
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(place), value);
        const bool good = insert(bytes, values, place + 1, count - 1, tries);
        bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(place));
        if (good) return true;
        if (tries == 0) return false;
      }
    }
    return false;
  }

  const Case& one_;
  Frame request_;
  const ByteList& raw_;
  sim::Random* random_;
};

bool contains(const ByteList& bytes, std::uint8_t value) {
  return std::find(bytes.begin(), bytes.end(), value) != bytes.end();
}

/// A change that an adapter may make to the bytes of replies, and how to undo it.
struct Suspicion {
  FindingKind finding_kind;
  bool (*fits)(const ByteList& raw);  // returns false if this reply, good or not, proves that the change is not made
  bool (*undo)(const Mender& mender, std::size_t& count);
  std::size_t most_tried;      // greatest number of replies that are decoded again with the change undone
  bool of_each_reply = false;  // whether the change affects each reply, independent of its bytes
};

// ---- The changes, each with functions `fits` and `undo`

bool fits_any(const ByteList&) { return true; }

// Returns whether the reply becomes good without its first bytes; false if these are the whole request, which is an
// echo.
template <std::size_t size>
bool undo_bytes_before(const Mender& mender, std::size_t& count) {
  count = size;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < size; ++i) places.push_back(i);
  return !mender.begins_with_request(size) && mender.without(places);
}

template <std::size_t size>
bool undo_bytes_after(const Mender& mender, std::size_t& count) {
  count = size;
  if (mender.raw().size() <= size) return false;
  std::vector<std::size_t> places;
  for (std::size_t i = mender.raw().size() - size; i < mender.raw().size(); ++i) places.push_back(i);
  return mender.without(places);
}

bool fits_newline(const ByteList& raw) {
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] == lf && (i == 0 || raw[i - 1] != cr)) return false;
  }
  return true;
}
bool undo_newline(const Mender& mender, std::size_t& count) {
  std::vector<std::size_t> places;
  for (std::size_t i = 1; i < mender.raw().size(); ++i) {
    if (mender.raw()[i] == lf) places.push_back(i - 1);
  }
  count = places.size();
  return mender.without(places);
}

// Returns the indexes at which the second byte of a pair FF FF stands.
std::vector<std::size_t> doubled(const ByteList& raw) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i + 1 < raw.size(); ++i) {
    if (raw[i] == 0xFF && raw[i + 1] == 0xFF) places.push_back(++i);
  }
  return places;
}
bool fits_telnet(const ByteList& raw) {
  return static_cast<std::size_t>(std::count(raw.begin(), raw.end(), 0xFF)) == 2 * doubled(raw).size();
}
bool undo_telnet(const Mender& mender, std::size_t& count) {
  const std::vector<std::size_t> places = doubled(mender.raw());
  count = places.size();
  return mender.without(places);
}

bool fits_flow_control(const ByteList& raw) { return !contains(raw, xon) && !contains(raw, xoff); }
bool undo_flow_control(const Mender& mender, std::size_t& count) {
  constexpr std::array<std::uint8_t, 2> taken{xon, xoff};
  return mender.with(taken, 3, count);
}

bool fits_nul_lost(const ByteList& raw) { return !contains(raw, 0); }
bool undo_nul_lost(const Mender& mender, std::size_t& count) {
  constexpr std::array<std::uint8_t, 1> taken{0};
  return mender.with(taken, 16, count);
}

bool fits_seven_bits(const ByteList& raw) {
  return std::all_of(raw.begin(), raw.end(), [](std::uint8_t byte) { return byte < 0x80; });
}
bool undo_seven_bits(const Mender& mender, std::size_t& count) { return mender.with_eighth_bits(count); }

constexpr std::size_t cheap = 24;  // greatest number of replies that are decoded again with a change undone
// greatest number of replies that are decoded again, if undoing the change takes thousands of decodings for each reply
constexpr std::size_t dear = 10;

// The first change that explains the replies is reported, so changes whose search takes long come last.
constexpr auto suspicions = std::to_array<Suspicion>({
    {FindingKind::telnet_doubled, fits_telnet, undo_telnet, cheap},
    {FindingKind::newline_translated, fits_newline, undo_newline, cheap},
    {FindingKind::byte_before, fits_any, undo_bytes_before<1>, cheap, true},
    {FindingKind::byte_before, fits_any, undo_bytes_before<2>, cheap, true},
    {FindingKind::byte_after, fits_any, undo_bytes_after<1>, cheap, true},
    {FindingKind::byte_after, fits_any, undo_bytes_after<2>, cheap, true},
    {FindingKind::flow_control, fits_flow_control, undo_flow_control, dear},
    {FindingKind::nul_lost, fits_nul_lost, undo_nul_lost, dear},
    {FindingKind::seven_bits, fits_seven_bits, undo_seven_bits, dear},
});

std::string bytes_of(std::size_t count) { return count == 1 ? "a byte" : fmt::format("{} bytes", count); }

std::size_t variety(const All& all) {
  std::vector<std::set<std::uint8_t>> values;
  for (const Attempted* attempt : all) {
    if (values.size() < attempt->raw.size()) values.resize(attempt->raw.size());
    for (std::size_t i = 0; i < attempt->raw.size(); ++i) values[i].insert(attempt->raw[i]);
  }
  std::size_t sum = 0;
  for (const std::set<std::uint8_t>& one : values) sum += one.empty() ? 0 : one.size() - 1;
  return sum;
}

// Returns the finding if undoing the change mends far more replies than random changes do, because chance mends some,
// too.
std::optional<Finding> suspected(const Case& one, const All& all, const Suspicion& suspicion) {
  constexpr std::size_t enough = 4;
  const bool of_nearly_all = all.size() * 10 >= one.seen.readings.size() * 8;
  if (suspicion.of_each_reply && !of_nearly_all) return {};
  // A long reply that stays good without the 8th bits of its bytes is very rare.
  const auto is_long = [](const Attempted* attempt) { return attempt->raw.size() > Mender::most_bytes; };
  if (suspicion.finding_kind == FindingKind::seven_bits && !of_nearly_all && std::ranges::any_of(all, is_long))
    return {};
  const bool fits = std::all_of(one.seen.readings.begin(), one.seen.readings.end(),
                                [&](const Attempted& attempt) { return suspicion.fits(attempt.raw); });
  if (!fits) return {};
  sim::Random random(1);
  std::size_t tried = 0;
  std::size_t mended = 0;
  std::size_t by_chance = 0;
  std::size_t concerned = 0;
  const Attempted* example = nullptr;
  for (const Attempted* attempt : all) {
    if (attempt->raw.empty()) continue;
    if (++tried > suspicion.most_tried) break;
    std::size_t count = 0;
    std::size_t ignored = 0;
    if (suspicion.undo(Mender(one, *attempt, nullptr), count)) {
      ++mended;
      concerned = std::max(concerned, count);
      example = attempt;
    }
    by_chance += suspicion.undo(Mender(one, *attempt, &random), ignored) ? 1 : 0;
    // If undoing the change mends none of the first four replies, the change is taken for the wrong one.
    if (tried >= enough && mended == 0) return {};
  }
  tried = std::min(tried, suspicion.most_tried);
  if (tried < enough || mended * 10 < tried * 8) return {};
  constexpr std::size_t varied = 24;
  const bool is_seen = suspicion.finding_kind == FindingKind::seven_bits && variety(all) >= varied;
  if (!is_seen && mended < by_chance + tried / 2) return {};
  return finding(suspicion.finding_kind,
                 {fmt::format("{}", mended), fmt::format("{}", tried), bytes_of(concerned),
                  to_hex(Bytes(example->raw).first(std::min<std::size_t>(example->raw.size(), 24)))});
}

// Finds good replies that lost the 8th bits of their bytes: with an XOR checksum, a reply can be good without them.
std::optional<Finding> seven_bits_of_good(const Case& one) {
  constexpr std::size_t enough = 40;
  constexpr std::size_t least_wraps = 2;
  constexpr std::uint8_t high = 0x60;
  constexpr std::uint8_t low = 0x20;
  std::vector<std::size_t> wraps;
  const Attempted* before = nullptr;
  std::size_t good = 0;
  for (const Attempted& attempt : one.seen.readings) {
    if (!fits_seven_bits(attempt.raw)) return {};
    if (attempt.error != Error::none) continue;
    ++good;
    const bool is_alike = before != nullptr && before->raw.size() == attempt.raw.size();
    wraps.resize(std::max(wraps.size(), attempt.raw.size()));
    for (std::size_t i = 0; is_alike && i < attempt.raw.size(); ++i) {
      const auto [least, most] = std::minmax(before->raw[i], attempt.raw[i]);
      wraps[i] += least < low && most >= high ? 1 : 0;
    }
    before = &attempt;
  }
  const bool is_seen = std::ranges::any_of(wraps, [](std::size_t count) { return count >= least_wraps; });
  if (good < enough || !is_seen) return {};
  return finding(FindingKind::seven_bits,
                 {fmt::format("{}", good), fmt::format("{}", one.seen.readings.size()), "any bytes",
                  to_hex(Bytes(before->raw).first(std::min<std::size_t>(before->raw.size(), 24)))});
}

std::optional<Finding> false_echo(const Case& one) {
  std::size_t good = 0;
  std::size_t wrong = 0;
  std::size_t longest = 0;
  const Attempted* example = nullptr;
  for (const Attempted& attempt : one.seen.readings) {
    const ByteList& request = attempt.exchange.request.bytes;
    const ByteList& reply = attempt.exchange.reply.bytes;
    if (attempt.error != Error::none || request.empty()) continue;
    ++good;
    if (attempt.raw.size() <= reply.size()) continue;
    const Bytes before = Bytes(attempt.raw).first(attempt.raw.size() - reply.size());
    if (before.size() != request.size() || std::equal(before.begin(), before.end(), request.begin())) continue;
    ++wrong;
    longest = std::max(longest, before.size());
    example = &attempt;
  }
  if (good < 4 || wrong * 10 < good * 8) return {};
  return finding(FindingKind::byte_before,
                 {fmt::format("{}", wrong), fmt::format("{}", good), bytes_of(longest),
                  to_hex(Bytes(example->raw).first(std::min<std::size_t>(example->raw.size(), 24)))});
}

// Finds one or two further bytes that follow at least 8 of 10 good replies, and are too few for a reply of a second
// encoder.
std::optional<Finding> byte_behind_good(const Case& one) {
  const Observations& seen = one.seen;
  if (seen.overfull * 10 < one.good * 8 || one.good < 4 || seen.most_behind == 0 || seen.most_behind > 2) return {};
  const ByteList& example = seen.overfull_example;
  if (example.size() < 3 * seen.most_behind) return {};
  return finding(FindingKind::byte_after,
                 {fmt::format("{}", seen.overfull), fmt::format("{}", seen.readings.size()), bytes_of(seen.most_behind),
                  to_hex(Bytes(example).first(std::min<std::size_t>(example.size(), 24)))});
}

}  // namespace

std::optional<Finding> damage_by_adapter(const Case& one, const All& all) {
  if (one.unit.link != LinkKind::half_duplex && one.unit.link != LinkKind::full_duplex) return {};
  if (std::optional<Finding> found = false_echo(one)) return found;
  if (std::optional<Finding> found = byte_behind_good(one)) return found;
  if (std::optional<Finding> found = seven_bits_of_good(one)) return found;
  for (const Suspicion& suspicion : suspicions) {
    if (std::optional<Finding> found = suspected(one, all, suspicion)) return found;
  }
  return {};
}

}  // namespace absenc::client
