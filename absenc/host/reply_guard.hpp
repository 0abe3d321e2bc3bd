// SPDX-License-Identifier: Apache-2.0
// Keeps late replies from being taken for the reply to a later request.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/bytes.hpp"
#include "absenc/host/outstanding_requests.hpp"
#include "absenc/link/step.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::host {

/// A filter between a conversation and its line. A request is outstanding while its reply may still arrive.
///
///   phase       entered when                     received items       left when                             next phase
///   ----------  -------------------------------  -------------------  ------------------------------------  ----------
///   forwarding  a conversation begins or ends;   go to the            the conversation wants to send a      delaying
///               a request is sent and none is    conversation         request
///               outstanding; or matching or
///               listening has ended
///   delaying    a request is to be sent          are dropped, late    the line was silent long enough, or
///                                                replies counted      too noisy: the request is sent;
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
/// The guard knows no protocol: Unit::check decides whether a reply can answer a request. On CAN an unsolicited reply
/// cannot be told from a late one.
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
  /// Returns the longest estimated time between a request and its late reply; 0 if `late()` is 0.
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
    bool reply = false;  // whether the conversation is still to get the received items as a `received` event
    bool timeout = false;
    Time received_at{};
  };
  struct Forwarding {
    bool answerable = false;  // true: the last request was sent in the exchange that is not over yet
    bool received = false;    // items were received that may belong to the reply to the last request
    bool doubtful = false;    // matching found no valid reply, so older requests are still outstanding
    Report report{};
  };
  struct Delaying {
    Time until{};  // earliest time at which the delayed request is sent
    // time at which the last item was received while delaying; if none was, the time `gap` before delaying began
    Time received_at{};
    Time noise_end = never;  // time at which the request is sent even if items still arrive
  };
  struct Matching {
    // End of the time limit for the reply, which starts at the end of the request.
    Time until = never;
    Time first_at{};       // time at which the first of the stored items was received
    Time received_at{};    // when the last of the stored items was received; if none was stored, end of the request
    bool damaged = false;  // a line error was received, or, except on CAN, the time limit passed
    // CAN: a frame that would be the reply if its identifier had 11 bits and not 29.
    Buffer<Item, 1> foreign_frame{};
  };
  struct Listening {
    Time until{};      // end of listening: the request is then repeated, or a timeout reported
    Time suspected{};  // time from the older request to the stored reply, if this is a late reply to that request
  };
  // The request that the conversation wants to send; valid in all phases but forwarding.
  struct Pending {
    Step<Item> step{};
    Time deadline{};  // time after which late replies no longer prolong the phases delaying and listening
  };
  struct LastRequest {
    bool exists = false;
    Request items{};  // items of the last request; empty if the request was a pulse
    std::size_t expect = 0;
    // time of the last `sent` event, even if not of a request; before that, the time when the request was handed over
    Time sent_at{};
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

  // The data of each phase is reset when the guard enters it.
  Phase phase_ = Phase::forwarding;
  Forwarding forwarding_{};
  Delaying delaying_{};
  Matching matching_{};
  Listening listening_{};
  // One buffer for all phases, because a microcontroller has little RAM.
  Buffer<Item, is_can ? 1 : 64> received_{};

  Pending pending_{};
  LastRequest last_{};
  OutstandingRequests<Item> outstanding_;
  // Longest time from a request to the `silence` event that showed that its reply is missing.
  Time longest_timeout_{};
  // Time that is expected from a request to its late reply. It is reduced by 1/16 at each end of the phase listening.
  Time expected_lateness_{};
  Time greatest_lateness_{};
  std::uint64_t late_replies_ = 0;
};

extern template class ReplyGuard<std::uint8_t>;
extern template class ReplyGuard<CanFrame>;

}  // namespace absenc::host
