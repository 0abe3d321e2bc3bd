// SPDX-License-Identifier: Apache-2.0
// Keeps late replies from answering the wrong request. No supported protocol numbers its requests: a reply that arrives
// after its timeout would answer the next request, whose own reply would answer the one after, without end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/bytes.hpp"
#include "absenc/host/outstanding_requests.hpp"
#include "absenc/link/step.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// A filter between a conversation and its line. A request without a reply is outstanding until its reply arrives, or a
/// reply that can only answer a later request (a line keeps the order of replies), until listening ends, or for ten
/// seconds. If eight different requests are outstanding, all are given up after a silence.
///
///   phase       entered when                     received items       left when                             next phase
///   ----------  -------------------------------  -------------------  ------------------------------------  ----------
///   forwarding  a conversation is attached; a    go to the            the conversation wants to send a      delaying
///               request is sent and none is      conversation         request
///               outstanding; or matching or
///               listening has ended
///   delaying    a request is to be sent          are dropped, late    the line was silent long enough, or noisy
///                                                replies counted      for 100 ms and the duration of 64
///                                                                     characters: the request is sent;
///                                                                       no request is outstanding           forwarding
///                                                                       others are outstanding              matching
///   matching    a request was sent while others  are stored           a reply answers this request only;
///               are outstanding                                       silence, noise, or the time limit:
///                                                                     the result is reported                forwarding
///                                                                     a reply may answer an older request   listening
///   listening   the stored reply may be late     are dropped, late    its time is over: the request is
///                                                replies counted      repeated where it may be, else a
///                                                                     timeout is reported                   forwarding
///
/// Delaying ends at once for a request that is not outstanding, unless it demands a pause of more than 1 ms, items
/// still arrive (not on CAN), or the list of outstanding requests is full. An outstanding request is sent again after
/// four times the longest timeout, but not before 3/2 of the expected lateness, with an upper limit of 2.5 to 10 s;
/// late replies prolong this, except on CAN. Where no reply was late yet, half of that time is enough, and the guard
/// does not wait for an encoder that did not answer twice.
///
/// Listening lasts for 5/4 of the lateness that the stored reply would have, but at least four times the longest
/// timeout and 3/2 of the expected lateness, with the upper limit above: if the stored reply was late, the reply of the
/// present request follows within that time. Except on CAN, a shorter time is enough where the expected lateness is at
/// most half of the stored reply's: 5/4 of the longest interval between the requests after the stored reply, and at
/// least half a second, because a line that delays every reply keeps their intervals.
///
/// The guard knows no protocol: Unit::check decides whether a reply can answer a request. On CAN an unsolicited reply
/// cannot be told from a late one. Tests compare each reading with the true shaft (tests/late_reply_test.cpp) and
/// accept no wrong reading.
template <class Item>
class ReplyGuard final : public Machine<Item> {
 public:
  /// Serves the conversation `inner` from now on; `inner`, `unit` and `options` must live until another one is
  /// attached. `may_repeat`: whether each request of the conversation may be sent once more.
  void attach(Machine<Item>& inner, const Unit& unit, const Options& options, bool may_repeat);
  /// Returns whether this guard serves the conversation `inner`.
  [[nodiscard]] bool serves(const Machine<Item>& inner) const { return inner_ == &inner; }
  /// Ends the exchange of a conversation that is over, or that its caller abandons.
  void conclude() { end_exchange(); }

  /// Processes an event that the port reports.
  void feed(const Event<Item>& event) override;
  /// Returns the next step that the port must carry out.
  Step<Item> next(Time now) override;

  /// Returns the number of replies that arrived after their timeout and were dropped.
  [[nodiscard]] std::uint64_t late() const { return late_replies_; }
  /// Returns the longest time, as estimated, between a request and its dropped late reply, at most 10 s; 0 if `late()`
  /// is 0.
  [[nodiscard]] Time lateness() const { return greatest_lateness_; }

 private:
  static constexpr bool is_can = OutstandingRequests<Item>::is_can;
  using Request = typename OutstandingRequests<Item>::Request;
  using Entry = typename OutstandingRequests<Item>::Entry;
  using Items = std::span<const Item>;

  enum class Phase : std::uint8_t { forwarding, delaying, matching, listening };

  // Events that the conversation is still to be fed, in this order.
  struct Report {
    bool sent = false;
    bool line_error = false;
    bool reply = false;  // whether to feed a `received` event with the items of `received_`
    bool timeout = false;
    Time received_at{};
  };
  struct Forwarding {
    bool answerable = false;  // the last request belongs to the present exchange
    bool received = false;    // items were received that may belong to the reply to the last request
    bool doubtful = false;    // matching found no valid reply, so older requests are still outstanding
    Report report{};
  };
  struct Delaying {
    Time until{};            // earliest time at which the delayed request is sent
    Time received_at{};      // when the last item was received while delaying; at first, `gap` before
    Time noise_end = never;  // when the request is sent even if items still arrive
  };
  struct Matching {
    // End of the time limit for the reply, which starts at the end of the request.
    Time until = never;
    Time first_at{};       // when the first of the stored items was received
    Time received_at{};    // when the last of the stored items was received; if none was stored, end of the request
    bool damaged = false;  // a line error was received, or, except on CAN, the time limit passed
    // CAN: a frame that would be the reply if its identifier had 11 bits instead of 29; it explains a timeout.
    Buffer<Item, 1> foreign_frame{};
  };
  struct Listening {
    Time until{};      // end of listening: the request is then repeated, or a timeout reported
    Time suspected{};  // lateness of the stored reply, if it is late
  };
  // The request that the conversation wants to send; valid in all phases but forwarding.
  struct Pending {
    Step<Item> step{};
    Time deadline{};  // time after which late replies no longer prolong delaying and listening
  };
  struct LastRequest {
    bool exists = false;
    Request items{};  // items of the last request; empty if it was a pulse
    std::size_t expect = 0;
    Time sent_at{};  // time of the last `sent` event, even if not of a request; until then, when `send` was called
  };

  [[nodiscard]] bool is_request(const Step<Item>& step) const;
  [[nodiscard]] Time required_silence() const;
  [[nodiscard]] Time longest_wait() const;
  [[nodiscard]] Time noise_limit() const;

  void end_exchange();
  void enter_forwarding(const Forwarding& data);
  void enter_delaying(const Step<Item>& request, Time now);
  void enter_listening(const Entry& entry);
  Step<Item> send(Time now);

  Step<Item> forward(Time now);
  Step<Item> next_of_conversation(Time now);
  bool report_event();
  Step<Item> end_listening(Time now);

  void feed_forwarding(const Event<Item>& event);
  void feed_matching(const Event<Item>& event);
  void store(Items items, Time at);
  void keep_foreign(const Item& item);
  void strip_late(Time at);
  void conclude_matching(bool timed_out);
  void conclude_noise();
  [[nodiscard]] Time listening_time(Time suspected) const;

  void drop_items(Items items, Time at);
  void drop_at_silence(Time at);
  [[nodiscard]] bool ends_with_reply(Items request, std::size_t expect) const;
  void drop_late_reply(Entry* entry, Time at);
  void count_late(Entry* entry, Time at);

  Machine<Item>* inner_ = nullptr;
  bool may_repeat_ = false;

  // The data of each phase is reset when the phase is entered.
  Phase phase_ = Phase::forwarding;
  Forwarding forwarding_{};
  Delaying delaying_{};
  Matching matching_{};
  Listening listening_{};
  // One buffer for all phases, because a microcontroller has little RAM. Forwarding: the reply to report. Matching: the
  // received items that may be the reply. Delaying and listening: the last received items, which may end with a late
  // reply.
  Buffer<Item, is_can ? 1 : 64> received_{};

  Pending pending_{};
  LastRequest last_{};
  OutstandingRequests<Item> outstanding_;
  // Longest time from a request to the silence that showed that its reply is missing.
  Time longest_timeout_{};
  // Time by which a reply may be late. Each end of listening reduces it by 1/16.
  Time expected_lateness_{};
  Time greatest_lateness_{};
  std::uint64_t late_replies_ = 0;
};

extern template class ReplyGuard<std::uint8_t>;
extern template class ReplyGuard<CanFrame>;

}  // namespace absenc::host
