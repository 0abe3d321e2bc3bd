// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/search/stream.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <utility>

namespace absenc::capture {

namespace {

constexpr std::size_t noise_size = 1 << 15;
constexpr std::size_t least_frames = 3;  // a stream with fewer good frames than this is no evidence for a protocol

// Returns the size of the good reply that begins with the first of `bytes`, or 0 if none does.
std::size_t reply_size(const Unit& unit, const Options& options, Bytes bytes) {
  const FrameEnd end = unit.frame_end(options, Direction::reply, bytes);
  if (end.kind != FrameEnd::Kind::complete || end.size == 0 || end.size > bytes.size()) return 0;
  const ObservedExchange reply{
      .reply = {.bytes = {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(end.size)}}};
  return explains(unit, options, reply) ? end.size : 0;
}

// Estimates the probability that random bytes contain a good reply at a given position.
double acceptance_of_noise(const Unit& unit, const Options& options) {
  std::mt19937_64 random(1);
  std::vector<std::uint8_t> noise(noise_size);
  for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
  std::size_t good = 0;
  std::size_t examined = 0;
  for (std::size_t at = 0; at < noise.size(); ++examined) {
    const std::size_t size = reply_size(unit, options, Bytes(noise).subspan(at));
    good += size != 0 ? 1 : 0;
    at += std::max<std::size_t>(size, 1);
  }
  return static_cast<double>(std::max<std::size_t>(good, 1)) / static_cast<double>(examined);
}

// Returns whether each option in `of_bits` has as its value the number of single-turn or multi-turn bits of the
// resolution.
bool states_bits(const Unit& unit, const Options& options, std::span<const std::size_t> of_bits) {
  const Resolution resolution = unit.resolution(options);
  return std::all_of(of_bits.begin(), of_bits.end(), [&](std::size_t option) {
    return options[option] == resolution.singleturn_bits || options[option] == resolution.multiturn_bits;
  });
}

std::vector<Options> stream_options(const Unit& unit) {
  std::vector<Options> all = likely_options(unit, {});
  const std::vector<std::size_t> of_bits = resolution_options(unit);
  if (unit.streams == nullptr || all.empty() || of_bits.empty() || of_bits.size() > 2) return all;
  const Options base = all.front();
  std::erase_if(all, [&](const Options& one) { return !states_bits(unit, one, of_bits); });
  const Option& first = unit.options[of_bits.front()];
  const Option& second = unit.options[of_bits.back()];
  for (std::int64_t a = first.minimum; a <= first.maximum; ++a) {
    for (std::int64_t b = second.minimum; b <= second.maximum; ++b) {
      if (&first == &second && a != b) continue;
      Options options = base;
      options.values[of_bits.front()] = a;
      options.values[of_bits.back()] = b;
      options.model = nullptr;
      if (states_bits(unit, options, of_bits)) all.push_back(options);
    }
  }
  return all;
}

// Returns a key by which hypotheses are sorted in rising order: first those with the fewest single-turn bits, among
// these first those with the most multi-turn bits.
std::pair<unsigned, int> bits_of(const Unit& unit, const Hypothesis& hypothesis) {
  const Resolution resolution = unit.resolution(hypothesis.options);
  return {resolution.singleturn_bits, -static_cast<int>(resolution.multiturn_bits)};
}

// Sets `options` so that the encoder sends unsolicited frames, if the unit has options for this.
void set_streaming(const Unit& unit, Options& options, double frames_per_second) {
  if (unit.streams == nullptr || unit.streams(options)) return;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    const std::int64_t largest =
        option.choices.empty() ? option.maximum : static_cast<std::int64_t>(option.choices.size()) - 1;
    Options other = options;
    other.values[i] = std::clamp(static_cast<std::int64_t>(std::llround(frames_per_second)), std::int64_t{1},
                                 std::max<std::int64_t>(largest, 1));
    if (!unit.streams(other)) continue;
    options = other;
    return;
  }
}

}  // namespace

std::vector<ObservedExchange> split_stream(const Unit& unit, const Options& options, Bytes bytes) {
  std::vector<ObservedExchange> replies;
  std::size_t longest = 0;        // size of the longest good reply in the stream, in bytes
  std::size_t begin_of_good = 0;  // index in `replies` of the first good reply
  std::size_t end_of_good = 0;    // index in `replies` after the last good reply
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = reply_size(unit, options, bytes.subspan(at));
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const std::size_t count = std::max<std::size_t>(size, 1);
    at += count;
    replies.push_back({.reply = {.bytes = {from, from + static_cast<std::ptrdiff_t>(count)}}});
    if (size == 0) continue;
    if (longest == 0) begin_of_good = replies.size() - 1;
    longest = std::max(longest, size);
    end_of_good = replies.size();
  }
  if (replies.size() - end_of_good < longest) replies.resize(end_of_good);
  if (begin_of_good < longest)
    replies.erase(replies.begin(), replies.begin() + static_cast<std::ptrdiff_t>(begin_of_good));
  return replies;
}

std::vector<Hypothesis> find_stream_hypotheses(const Unit& unit, Bytes bytes, Time duration) {
  std::vector<Hypothesis> found;
  if (bytes.empty()) return found;
  const std::vector<Options> all = stream_options(unit);
  for (const Options& options : all) {
    const std::vector<ObservedExchange> replies = split_stream(unit, options, bytes);
    Hypothesis one{.options = options, .evidence = weigh(unit, options, replies)};
    if (one.evidence.explained < least_frames) continue;
    // The begin of the first frame was searched at as many bytes as the longest frame has. Each of these places counts
    // as a tried hypothesis.
    for (const ObservedExchange& reply : replies) one.tried = std::max(one.tried, reply.reply.bytes.size());
    one.tried *= all.size();
    found.push_back(std::move(one));
  }
  // Sorts the hypotheses: those with the fewest bytes outside of frames come first, then models, then the smallest key
  // of `bits_of`.
  std::stable_sort(found.begin(), found.end(), [&](const Hypothesis& one, const Hypothesis& other) {
    const std::size_t noise = one.evidence.tried - one.evidence.explained;
    const std::size_t other_noise = other.evidence.tried - other.evidence.explained;
    if (noise != other_noise) return noise < other_noise;
    const bool is_model = one.options.model != nullptr;
    if (is_model != (other.options.model != nullptr)) return is_model;
    return bits_of(unit, one) < bits_of(unit, other);
  });
  if (found.empty()) return found;
  Hypothesis best = found.front();
  Evidence& evidence = best.evidence;
  const std::size_t noise = evidence.tried - evidence.explained;
  evidence.frames = tail(evidence.distinct, evidence.distinct + noise, acceptance_of_noise(unit, best.options));
  best.at_least = best.options.model == nullptr && !resolution_options(unit).empty();
  set_streaming(unit, best.options,
                static_cast<double>(evidence.explained) / std::chrono::duration<double>(duration).count());
  return {best};
}

}  // namespace absenc::capture
