// SPDX-License-Identifier: Apache-2.0
// Keeps replies with their requests on a line where one may come late: no protocol of ours numbers them, so a reply
// that comes after its host gave up would answer the next request, whose own reply would answer the one after, for
// ever.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/bytes.hpp"
#include "absenc/host/owed_replies.hpp"
#include "absenc/link/step.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// Stands between a conversation and its line. Before each request it takes in what waits, and drops it. A request that
/// was not answered is owed its reply, until that came, or until a good reply to the present request came that cannot
/// be one to the owed: a line keeps the order. Where it could be either, time tells:
///
/// 1. the same request is sent again only when the line was quiet for twice the limit that was missed, and for half as
///    much again as the latest reply was late;
/// 2. what then comes first is not taken: it may be the owed reply;
/// 3. the line is listened to for four times the limit, and for a quarter more than that reply would have been late: if
///    it was, the present request's own is coming. Where nothing was nearly so late before, half a second and
///    a quarter more than their requests were apart is enough: a line that is always late keeps their distance;
/// 4. the request is sent once more where it may be, and its reply is taken; elsewhere the conversation is told that
///    none came.
///
/// It knows no protocol: whether a reply could be that to another request is asked of Unit::decode. On CAN a node that
/// sends by itself cannot be told from a late answer. Tests compare with the true shaft (tests/late_reply_test.cpp) and
/// excuse nothing because it was late.
template <class Item>
class ReplyGuard final : public Machine<Item> {
 public:
  /// Serves this conversation from now on; `unit` and `options` must outlive it. `may_repeat`: whether each of its
  /// requests may be sent once more.
  void attach(Machine<Item>& inner, const Unit& unit, const Options& options, bool may_repeat);
  /// Returns whether this guard belongs to `inner`.
  [[nodiscard]] bool serves(const Machine<Item>& inner) const { return inner_ == &inner; }
  /// The conversation has ended, or is not gone on with.
  void conclude() { close(); }

  /// Takes an event of the port.
  void feed(const Event<Item>& event) override;
  /// Returns the next step of the port.
  Step<Item> next(Time now) override;

  /// Replies that came after their time and were dropped.
  [[nodiscard]] std::uint64_t late() const { return late_; }
  /// How long after its request the latest of them came; 0: none did.
  [[nodiscard]] Time lateness() const { return latest_reply_; }

 private:
  static constexpr bool is_can = OwedReplies<Item>::is_can;
  using Request = typename OwedReplies<Item>::Request;
  using Owed = typename OwedReplies<Item>::Owed;
  using Reply = Buffer<Item, is_can ? 1 : 64>;

  enum class Phase : std::uint8_t {
    passing,  // the conversation is on the line itself
    before,   // its request waits until the line is quiet
    asking,   // its request is out, and what comes is not passed on before it is known whose it is
    holding,  // what came may be late: is the request's own still coming?
  };

  void close();
  [[nodiscard]] bool is_request(const Step<Item>& step) const;
  [[nodiscard]] Time quiet_time() const;
  [[nodiscard]] Time longest_wait() const;

  Step<Item> pass(Time now);
  Step<Item> next_passing(Time now);
  bool deliver();
  void begin(const Step<Item>& request, Time now);
  Step<Item> send(Time now);
  void feed_passing(const Event<Item>& event);
  void feed_asking(const Event<Item>& event);
  void take(std::span<const Item> items, Time at);
  void keep_stranger(const Item& item);
  void strip_late(Time at);
  void count_late(Owed* owed, Time at);
  void take_late(std::span<const Item> items, Time at);
  void pause_late(Time at);
  [[nodiscard]] bool ends_with_reply(std::span<const Item> request, std::size_t expect) const;
  void end_late(Owed* owed, Time at);
  void conclude_asking(bool silent);
  [[nodiscard]] Time holding_time() const;
  void conclude_noise();
  Step<Item> end_holding(Time now);

  Machine<Item>* inner_ = nullptr;
  bool may_repeat_ = false;

  Phase phase_ = Phase::passing;
  Step<Item> pending_{};  // of the conversation, which waits for its `sent`
  Time until_{};          // before, asking, holding: no longer than that
  Time latest_{};         // no wait before or after the request is longer

  Request request_{};   // the last one that went out; of a pulse empty
  bool asked_ = false;  // there was one
  std::size_t expect_ = 0;
  bool open_ = false;      // it may still be answered
  bool heard_ = false;     // something came that may be its reply
  bool doubtful_ = false;  // what came was none, while others were owed
  Time sent_at_{};
  Time received_at_{};
  Time first_at_{};
  Time heard_at_{};  // before: when something came that was not asked for
  Time noise_end_ = never;
  Time suspected_{};  // holding: how late what came is, if it is

  Reply reply_{};     // asking: what came; before and holding: the end of it
  Reply stranger_{};  // asking: what would be a reply but for its identifier of 29 bits: it explains a silence
  bool damaged_ = false;
  // What the conversation is still to be told.
  bool tell_sent_ = false;
  bool tell_error_ = false;
  bool tell_reply_ = false;
  bool tell_silence_ = false;

  OwedReplies<Item> owed_;
  Time limit_{};     // the longest that was waited for a reply in vain
  Time lateness_{};  // that is allowed for: fades
  Time latest_reply_{};
  std::uint64_t late_ = 0;
};

extern template class ReplyGuard<std::uint8_t>;
extern template class ReplyGuard<CanFrame>;

}  // namespace absenc::host
