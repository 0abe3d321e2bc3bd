// SPDX-License-Identifier: Apache-2.0
// The requests of one line whose replies may still arrive. Used by ReplyGuard.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// A list of the requests of one line whose replies are outstanding.
template <class Item>
class OutstandingRequests {
 public:
  /// Whether the items are CAN frames; otherwise they are bytes.
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;
  /// Items of a request: at most 16 bytes or one CAN frame.
  using Request = Buffer<Item, is_can ? 1 : 16>;
  /// A view of items that were sent or received.
  using Items = std::span<const Item>;

  /// Requests with the same bytes, which may have been sent several times.
  struct Entry {
    Request request;         ///< Items of the request.
    std::size_t expect = 0;  ///< Number of items of the reply to this request; 0: unknown before it ends.
    /// Times at which the requests of this entry that do not count as lost were sent, the oldest first.
    Buffer<Time, 4> sent_at{};
    /// Time at which the oldest lost request is assumed to have been sent.
    Time lost_first{};
    Time lost_last{};   ///< Time at which the newest lost request was sent.
    unsigned lost = 0;  ///< Number of requests of this entry that count as lost, but may still be answered.

    /// Returns the time at which the newest request of this entry was sent.
    [[nodiscard]] Time newest() const { return sent_at.empty() ? lost_last : sent_at[sent_at.size() - 1]; }
    /// Returns the time at which the oldest request was sent, or counts as sent if it is lost.
    [[nodiscard]] Time oldest() const { return lost != 0 ? lost_first : sent_at[0]; }
    /// Returns how often the request of this entry is outstanding, lost ones included.
    [[nodiscard]] std::size_t count() const { return lost + sent_at.size(); }
  };

  /// Sets the unit that decides which reply belongs to which request. `unit` and `options` must outlive this object's
  /// use.
  void use(const Unit& unit, const Options& options) {
    unit_ = &unit;
    options_ = &options;
  }
  /// Returns whether `request` is one that an encoder answers.
  [[nodiscard]] bool is_answered(Items request) const;
  /// Returns for how long after the last received item `request` must not be sent again.
  [[nodiscard]] Time pause_after(Items request) const;
  /// Returns the duration of a character on the line, in nanoseconds; 0 on CAN.
  [[nodiscard]] Time character() const;
  /// Returns whether `reply` is a valid reply to `request`.
  [[nodiscard]] bool is_reply(Items request, Items reply) const;
  /// Returns whether `reply`, valid or not, may belong to `request`; always true for bytes.
  [[nodiscard]] bool may_answer(Items request, Items reply) const;

  /// Returns whether no reply is outstanding.
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  /// Returns whether no further entry can be stored.
  [[nodiscard]] bool full() const { return entries_.size() == most; }
  /// Returns the number of entries, one for each different request.
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  /// Returns the entry at `index`, which is less than `size()`.
  [[nodiscard]] Entry& operator[](std::size_t index) { return entries_[index]; }
  /// Returns the entry of `request`, or null if it is not outstanding.
  [[nodiscard]] Entry* find(Items request);
  /// Returns the first entry whose request `reply` could answer, or null if no entry matches.
  [[nodiscard]] Entry* find_by_reply(Items reply);

  /// Adds `request`, sent at `sent_at`; its reply has `expect` items. A full list takes only requests that it has
  /// already.
  void add(Items request, std::size_t expect, Time sent_at);
  /// Marks all requests equal to `request` as lost. The oldest counts as sent at most `longest` before the newest.
  void mark_lost(Items request, Time longest);
  /// Removes the oldest request of `entry`, because its reply was received.
  void remove_oldest(Entry& entry);
  /// Removes all entries.
  void clear() { entries_.clear(); }
  /// Returns the longest time between two consecutive requests since the list was empty, the time from the last request
  /// until `now` included.
  [[nodiscard]] Time longest_interval(Time now) const { return std::max(longest_interval_, now - newest_); }
  /// Removes the entries whose newest request was sent before `before`.
  void remove_older(Time before);

 private:
  static constexpr std::size_t most = 8;

  void remove(const Entry& entry);

  const Unit* unit_ = nullptr;
  const Options* options_ = nullptr;
  Buffer<Entry, most> entries_{};
  Time newest_{};            // time at which the last added request was sent
  Time longest_interval_{};  // longest time between two consecutively added requests since the list was empty
};

/// Removes the first `count` items of `buffer`, which must have at least as many.
template <class Buffer>
void drop_first(Buffer& buffer, std::size_t count = 1) {
  const Buffer all = buffer;
  buffer.clear();
  buffer.append(all.view().subspan(count));
}

extern template class OutstandingRequests<std::uint8_t>;
extern template class OutstandingRequests<CanFrame>;

}  // namespace absenc::host
