// SPDX-License-Identifier: Apache-2.0
// Host side of a line on which the encoder answers requests. It knows no protocol.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/noise.hpp"

namespace absenc::author {

/// Time limits and pauses of a host: those of the protocol's document, or chosen. A pause begins
/// with the last sent or received character. The member for each demand:
///
///   | the document demands                           | member                                     |
///   |------------------------------------------------|--------------------------------------------|
///   | a pause after each reply                       | HostTimes::pause                           |
///   | a silent line before each request              | HostTimes::silence: the host listens in it |
///   | a longer pause before a request is repeated    | Manner::pause                              |
///   | a pause after a failed request                 | Manner::hold                               |
///   | a pause between two requests of a procedure    | `dialog.rest`, `after` of a question       |
///   | pauses between the frames of a request         | Manner::frame_pause, with Manner::frame    |
struct HostTimes {
  Time answer_limit{};  ///< longest time from the end of a request to the first character of its reply
  Time gap_limit{};     ///< longest time between two characters of a reply
  /// Shortest silence of the line before each request; received bytes restart it.
  Time silence{};
  Time patience = noise_limit;  ///< a line without silence for this long is treated as never silent
  /// Shortest time from a reply to the next request. The host does not listen in it.
  Time pause{};
};

/// How a request is sent, repeated and timed, and how its reply ends.
struct Manner {
  unsigned repeats = 0;       ///< how often the request is sent again, at most, after an invalid or missing reply
  Time pause{};               ///< pause before a request is repeated; the pauses of HostTimes are kept, too
  bool expects_reply = true;  ///< false: the encoder does not reply, so the exchange ends with the request
  /// Whether the host checks a reply only after the silence that follows the reply.
  bool ends_by_silence = false;
  /// Whether the content of the reply is not checked, and a missing reply is no error.
  bool any_reply = false;
  bool holds_line = false;  ///< whether no other machine's request may come before the next one of this conversation
  Time answer_limit{};      ///< longest time until the reply begins; 0: HostTimes::answer_limit
  /// How long the encoder may still execute the request if no valid reply arrives: the conversation then ends this much
  /// later, so that no other command begins before. Not used after a valid reply.
  Time hold{};
  std::uint8_t frame = 0;  ///< if not 0, the request is sent in frames of this number of bytes
  Time frame_pause{};      ///< pause between two frames of the request
  Time pulse{};            ///< if not 0, the request is a pulse of this duration on `wire` instead of bytes
  ExtraWire wire{};        ///< Wire that is pulsed, if `pulse` is not 0.
};

/// Conversation on a line of characters; a subclass provides the protocol.
class Engine : public Conversation<std::uint8_t> {
 public:
  /// Not copyable: requests and replies are views into the conversation itself.
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Handles an event that the port reports.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step that the port must take.
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  /// Puts no fields of a result; the subclass Reported (command.hpp) puts them, so that a program without it links no
  /// names and texts of fields.
  void report(FieldSink&) const override {}
  /// Returns the last request, which is empty after `listen`, and the bytes received since then, as `reply` returns
  /// them.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final { return {out_, reply(), sent_at_, received_at_}; }

  /// Returns the time at which the last request was due to begin.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// Returns the end of the last sent request; for a pulse, its end minus Manner::pulse.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Returns the time from which pauses are measured: the end of the last sent or received character, or of listening.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Returns the bytes received since the last request, valid or not; bytes beyond the storage are dropped.
  [[nodiscard]] Bytes reply() const { return Bytes(storage_).first(size_); }
  /// Returns whether the last exchange was given up because the line seemed never silent.
  [[nodiscard]] bool is_noisy() const { return noisy_; }
  /// Returns whether a damaged character, or one that came too early, disturbed the last exchange.
  [[nodiscard]] bool is_disturbed() const { return disturbed_; }

 protected:
  /// Constructs an engine. `storage` must outlive it, and have more room than the longest reply needs.
  Engine(const HostTimes& times, MutableBytes storage) : storage_(storage), times_(times) {}
  ~Engine() = default;

  /// Sets that `request`, whose bytes must stay valid, is sent next, not before `earliest`.
  void send(Bytes request, const Manner& manner, Time earliest);
  /// Sets that the caller gets the present result, by the step `emit`.
  void emit() { emitting_ = true; }
  /// Sets that this end of the line is next switched to `rate` bits per second; 0: the rate stays.
  void set_rate(std::uint32_t rate) { rate_ = rate; }
  /// Replaces the host's time limits and pauses, for example after a change of the rate.
  void set_times(const HostTimes& times) { times_ = times; }
  /// Sets that nothing is sent until `time`, and that `woken` is then called.
  void sleep(Time time);
  /// Sets that the host listens for `duration` without sending; `heard` gets the received bytes.
  void listen(Time duration);
  /// Continues to listen until the duration given to `listen` is over. To be called after `heard`.
  void listen_on() { state_ = State::listening; }
  /// Sets that the conversation ends with `error`, at the earliest `hold` after `received_at()`.
  void finish(Error error, Time hold = {});
  /// Returns the manner of the present request, with the repetitions that are left.
  [[nodiscard]] const Manner& manner() const { return manner_; }

  /// Returns the length of the reply that begins with `reply()`; 0: it is not known.
  [[nodiscard]] virtual std::size_t expected() const = 0;
  /// Checks the reply in `reply()`, and stores its content if it is valid. Returns the first error.
  [[nodiscard]] virtual Error check() = 0;
  /// Returns whether a reply with this error is complete, so that nothing follows it.
  [[nodiscard]] virtual bool is_whole(Error error) const = 0;
  /// Handles the end of an exchange. `error` is that of the last attempt, or none.
  virtual void concluded(Error error) = 0;
  /// Is called when the time of `sleep` or `listen` has passed.
  virtual void woken() {}
  /// Handles bytes received while listening; an empty range stands for a damaged character.
  virtual void heard(Bytes) {}

 private:
  enum class State : std::uint8_t {
    receiving,  ///< the reply to the last request is awaited
    settling,   ///< the exchange has an error: waits until the line is silent
    ready,      ///< the next request is to be sent, as soon as pauses permit
    sending,    ///< the request is being sent
    sleeping,
    listening,
    ending,  ///< the result is known; the conversation ends when the time `hold` of `finish` is over
    over,
  };

  void wake(Time now);
  [[nodiscard]] Time rest_end() const;
  void begin_or_end(Step<std::uint8_t>& step, Time now);
  // Appends received bytes to `reply()`, and drops those for which there is no room.
  void keep(Bytes bytes) {
    const MutableBytes room = storage_.subspan(size_);
    const std::size_t fitting = std::min(bytes.size(), room.size());
    for (std::size_t i = 0; i < fitting; ++i) room[i] = bytes[i];
    size_ += fitting;
  }
  [[nodiscard]] bool handle_unawaited(const Event<std::uint8_t>& event);
  void end_noise(State before);
  void check_reply();
  void sent(Time at);
  [[nodiscard]] bool is_awaited() const { return state_ <= State::settling; }
  void conclude();
  void conclude_with(Error error);
  void start(Time earliest);

  // Byte members come first: a Cortex-M0+ loads a byte fast only from an object's first 32 bytes.
  State state_ = State::over;
  bool disturbed_ = false;
  bool item_received_ = false;  // a byte, or a damaged character, was received in this exchange
  bool noisy_ = false;          // bytes are still received at `noise_end_` or later
  bool started_ = false;
  bool emitting_ = false;
  Error error_ = Error::none;
  std::size_t size_ = 0;
  std::size_t due_ = 0;  // number of bytes of the reply still to be received
  MutableBytes storage_;
  HostTimes times_;
  // An item received at this time or later shows that the line is never silent.
  Time noise_end_{};
  Time received_at_{};
  Manner manner_{};
  Time earliest_{};
  Bytes out_{};
  std::uint32_t rate_ = 0;
  Time listening_{};
  Time begun_at_{};
  Time sent_at_{};
};

}  // namespace absenc::author
