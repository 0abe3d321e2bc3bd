// SPDX-License-Identifier: Apache-2.0
// Host side of a line of characters on which one request at a time is answered by one reply: sends, receives, settles,
// repeats, gives up. It knows no protocol, and is compiled once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/noise.hpp"

namespace absenc::author {

/// The times of a host on its line, as the document has them.
struct HostTimes {
  Time answer_limit{};          ///< from the end of a request to the first character of its reply, at the most
  Time gap_limit{};             ///< between two characters of it, at the most
  Time silence{};               ///< of the line before each request; what is heard meanwhile begins it anew
  Time patience = noise_limit;  ///< a line on which something goes on for so long is never silent
  Time pause{};                 ///< from a reply to the next request, at least: so short that nobody listens meanwhile
};

/// How one request is sent, and how its reply ends.
struct Manner {
  unsigned repeats = 0;          ///< how often it is sent again before its error counts
  Time pause{};                  ///< before it is repeated: from what was last sent or heard
  bool expects_reply = true;     ///< false: no reply is due, and none is waited for
  bool ends_by_silence = false;  ///< a reply is taken only when silence follows: its check is too weak to trust alone
  bool any_reply = false;  ///< no document says what its reply is, or whether there is one: what comes is not looked
                           ///< at, and that it ends by silence is enough
  Time answer_limit{};     ///< in place of that of the line; 0: that
  Time hold{};             ///< after an error: so long the encoder may be busy with it all the same
  Time pulse{};            ///< in place of bytes a pulse so long on `wire`, whose edge is the request
  ExtraWire wire{};        ///< Wire that is pulsed instead of a request.
};

/// A subclass says what a whole reply is, and what becomes of it. DialogOf makes one from a protocol. CAN and clocked
/// lines have engines of their own, because something else ends a reply there.
///
/// After a wrong reply it waits for silence before it ends or sends again: sending while an encoder sends can destroy
/// its driver. A good reply ends the exchange at once.
class Engine : public Conversation<std::uint8_t> {
 public:
  /// Takes an event of the port.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step of the port.
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  /// Nothing: the names and texts of fields are not linked where nobody asks for them. Told (command.hpp) has them, and
  /// the words about a line that is never silent.
  void report(FieldSink&) const override {}
  /// Returns the items of the last exchange.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final { return {out_, reply(), sent_at_, received_at_}; }

  /// Begin of the last request, which an SPI link answers with what holds at that time.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// End of the last request; of the last characters of its reply, before them that of the request.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Returns when the last item was received.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// What came since the last request, good or bad.
  [[nodiscard]] Bytes reply() const { return Bytes(storage_).first(size_); }
  /// Whether the last exchange was given up because the line is never silent: asking once more is of no use.
  [[nodiscard]] bool is_noisy() const { return noisy_; }
  /// Whether characters of the last exchange were damaged, or came before its request was out.
  [[nodiscard]] bool is_disturbed() const { return disturbed_; }

 protected:
  /// `storage`: for a reply, longer than the longest, so that one that is too long is noticed.
  Engine(const HostTimes& times, MutableBytes storage) : storage_(storage), times_(times) {}
  ~Engine() = default;

  /// Sends `request`, which must stay until it is answered, not before `earliest`.
  void send(Bytes request, const Manner& manner, Time earliest);
  /// Hands out an intermediate result before anything else.
  void emit() { emitting_ = true; }
  /// This end of the line is set to `rate` before anything else is sent, and before the end.
  void set_rate(std::uint32_t rate) { rate_ = rate; }
  /// Its times are others from here on, as they are at another rate.
  void set_times(const HostTimes& times) { times_ = times; }
  /// Nothing is sent until `time`; then `woken`.
  void sleep(Time time);
  /// Nothing is sent for `duration`, which the next step begins: `heard` for all that comes, `woken` at the end. The
  /// limit is compared when bytes come, too: a port hands them out before it tells a timer.
  void listen(Time duration);
  /// From within `heard`: goes on.
  void listen_on() { state_ = State::listening; }
  /// The conversation is over; so long after what was last sent or heard the encoder must not be disturbed.
  void finish(Error error, Time hold = {});
  /// Returns the manner of the request.
  [[nodiscard]] const Manner& manner() const { return manner_; }

  /// How many bytes the reply has that begins with `reply()`; 0: that is not known yet, or silence alone tells.
  [[nodiscard]] virtual std::size_t expected() const = 0;
  /// Judges the whole `reply()`, and keeps what it says.
  [[nodiscard]] virtual Error check() = 0;
  /// Whether a reply with this error is whole all the same, as a refusal is: nothing follows it. After anything else
  /// that is wrong more may be coming, which must not meet the next request.
  [[nodiscard]] virtual bool is_whole(Error error) const = 0;
  /// `none`, or why the last attempt failed. Calls `send`, `sleep` or `finish`.
  virtual void concluded(Error error) = 0;
  /// Is called when a wait has ended.
  virtual void woken() {}
  /// While it listens; nothing: a damaged character.
  virtual void heard(Bytes) {}

 private:
  enum class State : std::uint8_t {
    receiving,  ///< the reply is due
    settling,   ///< something is wrong: until the line is silent
    ready,      ///< the next request is to be sent
    sending,    ///< until its last bit is out
    sleeping,
    listening,
    ending,  ///< the result is known, but told only after a time the encoder needs
    over,
  };

  void wake(Time now);
  [[nodiscard]] Time rest_end() const;
  void go_on(Step<std::uint8_t>& step, Time now);
  // What no longer fits changes nothing: it is too long already.
  void keep(Bytes bytes) {
    const MutableBytes room = storage_.subspan(size_);
    const std::size_t fitting = std::min(bytes.size(), room.size());
    for (std::size_t i = 0; i < fitting; ++i) room[i] = bytes[i];
    size_ += fitting;
  }
  [[nodiscard]] bool came_unasked(const Event<std::uint8_t>& event);
  void end_noise(State before);
  void look();
  void sent(Time at);
  [[nodiscard]] bool is_awaited() const { return state_ <= State::settling; }
  void conclude();
  void conclude_with(Error error);
  void start(Time earliest);

  // First what every character needs: a Cortex-M0+ reaches the first 32 bytes of an object in one instruction.
  State state_ = State::over;
  bool disturbed_ = false;
  bool heard_ = false;  // something, in this exchange
  bool noisy_ = false;  // things still come long after the first of them
  bool begun_ = false;
  bool emitting_ = false;
  Error error_ = Error::none;
  std::size_t size_ = 0;
  std::size_t due_ = 0;  // of the reply, while it is received
  MutableBytes storage_;
  HostTimes times_;
  Time noise_end_{};  // what comes then makes the line a noisy one. No timer: otherwise silence is told
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
