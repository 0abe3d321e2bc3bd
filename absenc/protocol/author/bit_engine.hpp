// SPDX-License-Identifier: Apache-2.0
// Host side of a bidirectional clocked line: the host sends bits, then clocks the reply out of the encoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absenc/core/bit_view.hpp"
#include "absenc/protocol/author/engine.hpp"
#include "absenc/protocol/conversation.hpp"

namespace absenc::author {

/// Bits that a host sends: a request, and for some requests a supplement behind the reply.
using HostBits = BitBuffer<64>;

/// A request on a bidirectional clocked line, and how the reply is clocked.
struct BitRequest {
  HostBits bits{};        ///< Bits of the request, from the first clock on.
  HostBits supplement{};  ///< Bits that the host sends in the clocks behind a valid reply; empty: none.
  /// Number of clocks behind the request. If a supplement follows: the number for the shortest complete reply; the host
  /// then adds clocks until the reply is complete.
  std::size_t clocks = 0;
  /// If a supplement follows: greatest number of clocks that a reply is expected to need beyond `clocks`.
  std::size_t late_clocks = 0;
  std::uint32_t rate = 0;  ///< Rate of the clock in Hz.
  Time rest{};             ///< Shortest time from the last exchange to this one.
  /// Shortest time from this exchange to the next one; also to that of another conversation, whose `rest` may be
  /// shorter.
  Time hold{};

  /// Returns whether there are no bits to send: the request has no encoding.
  [[nodiscard]] constexpr bool empty() const { return bits.size() == 0; }
};

/// Conversation on a bidirectional clocked line; a subclass provides the protocol.
///
///   | state    | next step                                       | continues with        |
///   |----------|-------------------------------------------------|-----------------------|
///   | ready    | the request, and the first clocks of the reply  | clocking              |
///   | clocking | none: the received bits are awaited             | missing, adding, over |
///   | missing  | the clocks that the reply still needs           | clocking              |
///   | adding   | the supplement; one clock behind a bad reply    | added                 |
///   | added    | none: the end of the exchange is awaited        | over                  |
///   | sleeping | none: a time is awaited                         | ready, over           |
///   | ending   | none: the encoder may still execute the request | over                  |
///
/// Between two transfers of one exchange the clock rests low.
class BitEngine : public Conversation<std::uint8_t> {
 public:
  /// Not copyable: requests and replies are views into the conversation itself.
  BitEngine(const BitEngine&) = delete;
  BitEngine& operator=(const BitEngine&) = delete;

  /// Handles an event that the port reports.
  void feed(const Event<std::uint8_t>& event) final;
  /// Returns the next step that the port must take.
  Step<std::uint8_t> next(Time now) final;
  [[nodiscard]] Error error() const final { return error_; }
  /// Puts no fields of a result; the subclass Reported (command.hpp) puts them, so that a program without it links no
  /// names and texts of fields.
  void report(FieldSink&) const override {}
  /// Returns the bits of the last request with its supplement, and those of the reply, as bytes.
  [[nodiscard]] Exchange<std::uint8_t> exchange() const final {
    return {sent_bits_.bytes(), Bytes(storage_).first((size_ + 7) / 8), sent_at_, received_at_};
  }

  /// Returns the time of the first clock edge of the last exchange.
  [[nodiscard]] Time begun_at() const { return begun_at_; }
  /// Returns the time at which the last bit of the last request was sent.
  [[nodiscard]] Time sent_at() const { return sent_at_; }
  /// Returns the end of the last exchange.
  [[nodiscard]] Time received_at() const { return received_at_; }
  /// Returns the time from the edge at which the encoder changes a bit until the port samples it, in the last transfer;
  /// 0: half a period of the clock.
  [[nodiscard]] Time sampled_after() const { return sampled_after_; }
  /// Returns the bits received last, valid or not.
  [[nodiscard]] BitView reply() const { return {Bytes(storage_).first((size_ + 7) / 8), size_}; }
  /// Returns false: an encoder on a clocked line cannot send without a clock.
  [[nodiscard]] static constexpr bool is_noisy() { return false; }

 protected:
  /// Constructs an engine. `storage`: room for the longest reply, which must outlive the engine.
  explicit BitEngine(MutableBytes storage) : storage_(storage) {}
  ~BitEngine() = default;

  /// Sets that `request` is sent next, not before `earliest`. The engine uses only the members `repeats`, `pause`
  /// and `holds_line` of `manner`.
  void send(const BitRequest& request, const Manner& manner, Time earliest);
  /// Sets that the caller gets the present result, by the step `emit`.
  void emit() { emitting_ = true; }
  /// Sets that nothing is sent until `time`, and that `woken` is called then.
  void sleep(Time time);
  /// Sets that the conversation ends with `error`, at the earliest `hold` after `received_at()`.
  void finish(Error error, Time hold = {});
  /// Returns the manner of the present request, with the repetitions that are left.
  [[nodiscard]] const Manner& manner() const { return manner_; }

  /// Returns how many more bits the reply needs to be complete; 0: it is complete, or can never be.
  [[nodiscard]] virtual std::size_t missing() const = 0;
  /// Checks the reply in `reply()`, and stores its content if it is valid. Returns the first error.
  [[nodiscard]] virtual Error check() = 0;
  /// Handles the end of an exchange. `error` is that of the last attempt, or none.
  virtual void concluded(Error error) = 0;
  /// Is called when the time of `sleep` has passed.
  virtual void woken() {}

 private:
  enum class State : std::uint8_t { ready, clocking, missing, adding, added, sleeping, ending, over };

  [[nodiscard]] bool goes_on() const { return request_.supplement.size() != 0; }
  void begin_transfer(Step<std::uint8_t>& step, Time now);
  void received(const Event<std::uint8_t>& event);
  void append(BitView bits);
  void conclude_with(Error error);

  State state_ = State::over;
  bool started_ = false;
  bool emitting_ = false;
  Error error_ = Error::none;
  Error reply_error_ = Error::none;  // error of the reply, found before the supplement is sent
  std::size_t size_ = 0;             // number of bits of the reply
  std::size_t awaited_ = 0;          // number of bits that the host receives in the present transfer
  MutableBytes storage_;
  Manner manner_{};
  BitRequest request_{};
  HostBits sent_bits_{};  // bits of the request, and of the supplement if it was sent
  HostBits out_{};        // bits that the host sends in the present transfer
  Time earliest_{};
  Time begun_at_{};
  Time sent_at_{};
  Time received_at_{};
  Time sampled_after_{};
};

}  // namespace absenc::author
