// SPDX-License-Identifier: Apache-2.0
// Host side of a line of characters on which one reply answers one request at a time: sends, receives, settles,
// repeats, gives up. It knows no protocol, and is compiled once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/protocol/conversation.hpp"
#include "absenc/protocol/noise.hpp"

namespace absenc::author {

/// Times of a host on its line, as the document has them.
struct HostTimes {
  Time answer_limit{};          ///< longest time from the end of a request to the first character of its reply
  Time gap_limit{};             ///< longest time between two characters of a reply
  Time silence{};               ///< silence of the line required before each request; received items restart it
  Time patience = noise_limit;  ///< a line that is busy for this long counts as never silent
  Time pause{};                 ///< shortest time from a reply to the next request, too short to listen in
};

/// How one request is sent, and how its reply ends.
struct Manner {
  unsigned repeats = 0;       ///< how often the request is repeated before its error counts
  Time pause{};               ///< time before a repetition, from the last sent or received character
  bool expects_reply = true;  ///< false: no reply is awaited
  /// A reply is accepted only when silence follows, because its checksum is too weak alone.
  bool ends_by_silence = false;
  /// The document does not define the reply, or whether there is one: its bytes are not checked, and silence ends it.
  bool any_reply = false;
  Time answer_limit{};  ///< instead of the answer limit of the line; 0: that of the line
  Time hold{};          ///< after an error: how long the encoder may still be busy with the request
  Time pulse{};         ///< the request is a pulse of this length on `wire` instead of bytes
  ExtraWire wire{};     ///< Wire that is pulsed instead of a request.
};

/// An exchange of characters whose subclass recognizes a complete reply and handles it. DialogOf makes one from a
/// protocol. CAN and clocked lines have engines of their own, because replies end differently there.
///
/// After an invalid reply it waits for silence before it ends or sends again: sending while an encoder sends can
/// destroy its driver. A valid reply ends the exchange at once.
class Engine : public Conversation<std::uint8_t> {
 public:
  /// Takes an event of the port.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step of the port.
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  /// Puts nothing, so that names and texts of fields are only linked where they are used. Reported (command.hpp) puts
  /// them, and explains a line that is never silent.
  void report(FieldSink&) const override {}
  /// Returns the items of the last exchange.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final { return {out_, reply(), sent_at_, received_at_}; }

  /// Returns the begin of the last request; an SPI device answers with its state at that time.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// Returns the end of the last request.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Returns when the last item was received.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Returns the bytes received since the last request, valid or not.
  [[nodiscard]] Bytes reply() const { return Bytes(storage_).first(size_); }
  /// Returns whether the last exchange was abandoned because the line is never silent; repeating it is no use.
  [[nodiscard]] bool is_noisy() const { return noisy_; }
  /// Returns whether characters of the last exchange were damaged, or arrived before its request was sent.
  [[nodiscard]] bool is_disturbed() const { return disturbed_; }

 protected:
  /// `storage`: for a reply, longer than the longest one, so that a reply that is too long is detected.
  Engine(const HostTimes& times, MutableBytes storage) : storage_(storage), times_(times) {}
  ~Engine() = default;

  /// Sends `request`, which must stay valid until it is answered, not before `earliest`.
  void send(Bytes request, const Manner& manner, Time earliest);
  /// Emits an intermediate result before anything else.
  void emit() { emitting_ = true; }
  /// Switches this end of the line to `rate` before the next transfer, and before the end.
  void set_rate(std::uint32_t rate) { rate_ = rate; }
  /// Sets other times from now on, as for another rate.
  void set_times(const HostTimes& times) { times_ = times; }
  /// Sends nothing until `time`, then calls `woken`.
  void sleep(Time time);
  /// Listens for `duration` from the next step on: calls `heard` for all received bytes and `woken` at the end. The
  /// limit is also checked when bytes arrive, because a port delivers bytes before timers.
  void listen(Time duration);
  /// Continues to listen. Call it from `heard`.
  void listen_on() { state_ = State::listening; }
  /// Ends the conversation. The encoder must not be disturbed for `hold` after the last sent or received character.
  void finish(Error error, Time hold = {});
  /// Returns the manner of the request.
  [[nodiscard]] const Manner& manner() const { return manner_; }

  /// Returns the length of the reply that begins with `reply()`; 0: unknown yet, or only silence ends it.
  [[nodiscard]] virtual std::size_t expected() const = 0;
  /// Checks the complete `reply()` and stores its content.
  [[nodiscard]] virtual Error check() = 0;
  /// Returns whether a reply with this error is complete, as a refusal is, so that nothing follows it. After any other
  /// error more bytes may follow, which must not meet the next request.
  [[nodiscard]] virtual bool is_whole(Error error) const = 0;
  /// Handles the end of an exchange: `none`, or the error of the last attempt. Calls `send`, `sleep` or `finish`.
  virtual void concluded(Error error) = 0;
  /// Is called when a wait has ended.
  virtual void woken() {}
  /// Handles bytes received while listening; none: a damaged character.
  virtual void heard(Bytes) {}

 private:
  enum class State : std::uint8_t {
    receiving,  ///< the reply is awaited
    settling,   ///< an error was found: waits until the line is silent
    ready,      ///< the next request is to be sent
    sending,    ///< until the last bit is sent
    sleeping,
    listening,
    ending,  ///< the result is known, but reported only after a time that the encoder needs
    over,
  };

  void wake(Time now);
  [[nodiscard]] Time rest_end() const;
  void begin_or_end(Step<std::uint8_t>& step, Time now);
  // Bytes that do not fit are dropped: the reply is too long already.
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

  // Members that every received character needs come first: a Cortex-M0+ reaches the first 32 bytes of an object in one
  // instruction.
  State state_ = State::over;
  bool disturbed_ = false;
  bool item_received_ = false;  // an item was received in this exchange
  bool noisy_ = false;          // items still arrive long after the first one
  bool started_ = false;
  bool emitting_ = false;
  Error error_ = Error::none;
  std::size_t size_ = 0;
  std::size_t due_ = 0;  // bytes of the reply still to be received
  MutableBytes storage_;
  HostTimes times_;
  Time noise_end_{};  // items received after this time make the line noisy. No timer: silence is reported otherwise
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
