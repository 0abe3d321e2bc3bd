// SPDX-License-Identifier: Apache-2.0
// Statistics of an encoder's line: latencies, readings per second, and the last bad exchanges.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "absenc/core/bytes.hpp"
#include "absenc/core/result.hpp"
#include "absenc/core/time.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::host {

/// A distribution of reply latencies in about 4 kB of memory. Percentiles below 68.7 s are at most 1/32 too long.
class Latencies {
 public:
  /// Adds the latency of a reply.
  constexpr void add(Time latency) {
    const std::int64_t nanoseconds = std::clamp<std::int64_t>(latency.count(), 0, most);
    ++counts_[bucket(static_cast<std::uint64_t>(nanoseconds))];
    ++count_;
    sum_ += Time(nanoseconds);
    longest_ = std::max(longest_, latency);
  }

  /// Returns the number of replies whose latencies were added.
  [[nodiscard]] constexpr std::uint64_t count() const { return count_; }
  /// Returns the longest latency.
  [[nodiscard]] constexpr Time longest() const { return longest_; }
  /// Returns the sum of all latencies, each limited to 0 to 68.7 s.
  [[nodiscard]] constexpr Time sum() const { return sum_; }

  /// For each of the ascending `limits`, all below 68 s, returns how many latencies surely do not exceed it.
  template <std::size_t Size>
  [[nodiscard]] constexpr std::array<std::uint64_t, Size> within(const std::array<Time, Size>& limits) const {
    std::array<std::uint64_t, Size> counts{};
    std::uint64_t below = 0;
    for (std::size_t limit = 0, i = 0; limit < Size; counts[limit++] = below) {
      for (; i < counts_.size() && last_of(i) <= limits[limit]; ++i) below += counts_[i];
    }
    return counts;
  }

  /// Returns the percentile `share` (0 to 1) of the latencies; 0 without latencies.
  [[nodiscard]] constexpr Time percentile(double share) const {
    const auto rank = static_cast<std::uint64_t>(share * static_cast<double>(count_));
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      below += counts_[i];
      if (below > rank) return std::min(longest_, last_of(i));
    }
    return longest_;
  }

 private:
  static constexpr unsigned fine_bits = 5;  // There are 32 buckets for each power of two from 32 ns on.
  static constexpr unsigned most_bits = 36;
  static constexpr std::int64_t most = (std::int64_t{1} << most_bits) - 1;

  // Returns the number of the bucket for a latency of `value` ns.
  [[nodiscard]] static constexpr std::size_t bucket(std::uint64_t value) {
    const auto width = static_cast<unsigned>(std::bit_width(value));
    if (width <= fine_bits) return static_cast<std::size_t>(value);
    const unsigned shift = width - fine_bits - 1;
    return (std::size_t{shift} << fine_bits) + static_cast<std::size_t>(value >> shift);
  }
  [[nodiscard]] static constexpr Time last_of(std::size_t bucket) {
    if (bucket < std::size_t{2} << fine_bits) return Time(static_cast<std::int64_t>(bucket));
    const std::size_t shift = (bucket >> fine_bits) - 1;
    const std::uint64_t top = bucket - (shift << fine_bits) + 1;
    return Time(static_cast<std::int64_t>((top << shift) - 1));
  }

  std::array<std::uint32_t, std::size_t{most_bits - fine_bits + 1} << fine_bits> counts_{};
  std::uint64_t count_ = 0;
  Time sum_{};
  Time longest_{};
};

/// The rate of events per second: a mean in which older events count less, with a time constant of one second.
class Rate {
 public:
  /// Adds an event that happened at `at`.
  constexpr void add(Time at) {
    if (seen_) {
      fade(at - last_);
      ++events_;
    }
    last_ = at;
    seen_ = true;
  }

  /// Returns the rate, which falls when the next event is overdue. 0 before the second event.
  [[nodiscard]] constexpr double per_second(Time now) const {
    if (events_ == 0) return 0;
    Rate faded = *this;
    if (static_cast<double>((now - last_).count()) * events_ > nanoseconds_) faded.fade(now - last_);
    return faded.events_ * 1e9 / faded.nanoseconds_;
  }

 private:
  constexpr void fade(Time step) {
    const auto nanoseconds = static_cast<double>(step.count());
    const double kept = 1e9 / (1e9 + nanoseconds);
    events_ *= kept;
    nanoseconds_ = nanoseconds_ * kept + nanoseconds;
  }

  bool seen_ = false;
  Time last_{};
  double events_ = 0;       // number of events, of which older ones count as less than one
  double nanoseconds_ = 0;  // time in nanoseconds in which these events happened; the older a time, the less it counts
};

/// A failed exchange with its bytes, which are cut at the size of the buffers.
template <class Item>
struct BadExchange {
  BadExchange() = default;
  /// Stores the error `why` and the first bytes of request and reply.
  BadExchange(Error why, const Exchange<Item>& exchange) : error(why), at(exchange.received_at) {
    sent.append(exchange.sent.first(std::min(exchange.sent.size(), sent.capacity())));
    received.append(exchange.received.first(std::min(exchange.received.size(), received.capacity())));
  }

  Error error = Error::none;  ///< Error with which the exchange failed.
  Time at{};  ///< time at which the last item of the exchange was received; without a reply, time of sending
  /// First items of the request, at most 64 bytes.
  Buffer<Item, 64 / sizeof(Item)> sent{};
  /// First items of the reply, at most 64 bytes.
  Buffer<Item, 64 / sizeof(Item)> received{};
};

/// Statistics of one encoder's conversations.
template <class Item>
class Statistics {
 public:
  /// Greatest number of stored failed exchanges; only the last ones are stored.
  static constexpr std::size_t most_stored = 8;

  /// Adds the result of a conversation. Without an error, the time from its last request to the reply is counted as a
  /// latency, if it had both; with an error, its last exchange is stored as a failed exchange.
  void add(const Conversation<Item>& conversation) {
    const Exchange<Item> exchange = conversation.exchange();
    if (conversation.error() == Error::none) {
      if (exchange.received_at > exchange.sent_at) latencies_.add(exchange.received_at - exchange.sent_at);
    } else {
      add({conversation.error(), exchange});
    }
  }
  /// Adds a failed exchange, which replaces the oldest one if `most_stored` are stored.
  void add(const BadExchange<Item>& bad) { bad_[bad_count_++ % most_stored] = bad; }

  /// Returns the distribution of the times from the end of a request to the end of its reply.
  [[nodiscard]] const Latencies& latencies() const { return latencies_; }
  /// Returns how many failed exchanges are stored, at most `most_stored`.
  [[nodiscard]] std::size_t kept() const { return std::min<std::size_t>(bad_count_, most_stored); }
  /// Returns a stored failed exchange; `number` 0 is the last one, `kept()` - 1 the oldest.
  [[nodiscard]] const BadExchange<Item>& bad(std::size_t number) const {
    return bad_[(bad_count_ - 1 - number) % most_stored];
  }

 private:
  Latencies latencies_;
  std::array<BadExchange<Item>, most_stored> bad_{};
  std::size_t bad_count_ = 0;
};

}  // namespace absenc::host
