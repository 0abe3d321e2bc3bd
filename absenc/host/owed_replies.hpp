// SPDX-License-Identifier: Apache-2.0
// The requests on one line that were not answered, and whose reply may still come: the memory of ReplyGuard.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "absenc/core/bytes.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// The requests whose replies are outstanding.
template <class Item>
class OwedReplies {
 public:
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;  ///< Whether items are CAN frames, not bytes.
  /// A request, or the beginning of a longer one.
  using Request = Buffer<Item, is_can ? 1 : 16>;
  /// Items as they were sent or received.
  using Items = std::span<const Item>;

  /// Equal requests.
  struct Owed {
    Request request;            ///< The request.
    std::size_t expect = 0;     ///< items of the reply, 0 where that is not known before
    Buffer<Time, 4> sent_at{};  ///< of each, the oldest first
    /// After these the line was quiet for so long that their replies are lost, most likely: the first and the last.
    Time lost_first{};
    Time lost_last{};   ///< Time at which the last request was sent whose reply is lost.
    unsigned lost = 0;  ///< Number of requests whose replies are lost.

    /// Returns the time at which the last of these requests was sent.
    [[nodiscard]] Time newest() const { return sent_at.empty() ? lost_last : sent_at[sent_at.size() - 1]; }
    /// Returns the time at which the first of these requests was sent.
    [[nodiscard]] Time oldest() const { return lost != 0 ? lost_first : sent_at[0]; }
    /// Returns the number of these requests.
    [[nodiscard]] std::size_t count() const { return lost + sent_at.size(); }
  };

  /// By whose rules replies are judged from now on; both must outlive that.
  void judge_by(const Unit& unit, const Options& options) {
    unit_ = &unit;
    options_ = &options;
  }
  /// Returns whether the encoder answers `request`.
  [[nodiscard]] bool is_answered(Items request) const;
  /// How long it must not be sent again.
  [[nodiscard]] Time pause_after(Items request) const;
  /// Returns whether `reply` is a valid reply to `request`.
  [[nodiscard]] bool is_reply(Items request, Items reply) const;
  /// Whether it may be a reply, good or bad: on a CAN bus others send too.
  [[nodiscard]] bool concerns(Items request, Items reply) const;

  /// Returns whether no reply is outstanding.
  [[nodiscard]] bool empty() const { return owed_.empty(); }
  /// No more requests can be kept apart.
  [[nodiscard]] bool full() const { return owed_.size() == most; }
  /// Returns the number of different requests.
  [[nodiscard]] std::size_t size() const { return owed_.size(); }
  /// Returns the entry at `index`, which is less than `size()`.
  [[nodiscard]] Owed& operator[](std::size_t index) { return owed_[index]; }
  /// Null when there is none.
  [[nodiscard]] Owed* find(Items request);
  /// To which this could be the reply.
  [[nodiscard]] Owed* owed_to(Items reply);

  /// Only while not full, or when it is there already.
  void add(Items request, std::size_t expect, Time sent_at);
  /// This request is sent again, after a pause: those before it are lost, most likely, the first of them at most so
  /// long ago.
  void sent_again(Items request, Time longest);
  /// One of them came, the oldest.
  void came(Owed& owed);
  /// Forgets all requests.
  void clear() { owed_.clear(); }
  /// The longest time between one of them and the next, whatever they ask, and from the last of them until `now`.
  [[nodiscard]] Time widest(Time now) const { return std::max(widest_, now - newest_); }
  /// All whose newest was sent before.
  void forget(Time before);

 private:
  static constexpr std::size_t most = 8;

  void remove(const Owed& owed);

  const Unit* unit_ = nullptr;
  const Options* options_ = nullptr;
  Buffer<Owed, most> owed_{};
  Time newest_{};
  Time widest_{};  // between two that were added
};

/// Without the first `count`, which there must be.
template <class Buffer>
void drop_first(Buffer& buffer, std::size_t count = 1) {
  const Buffer all = buffer;
  buffer.clear();
  buffer.append(all.view().subspan(count));
}

extern template class OwedReplies<std::uint8_t>;
extern template class OwedReplies<CanFrame>;

}  // namespace absenc::host
