// SPDX-License-Identifier: Apache-2.0
// Device side of a line of characters: recognizes requests, ignores those of other encoders, answers in time, checks
// the rules that hosts must follow, and has a memory. It knows no protocol, and is compiled once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absenc/core/bits.hpp"
#include "absenc/core/bytes.hpp"
#include "absenc/core/shaft.hpp"
#include "absenc/protocol/author/encoder.hpp"
#include "absenc/protocol/interruption.hpp"

namespace absenc::author {

/// Times of a virtual encoder, as its document has them.
struct DeviceTimes {
  Time character{};    ///< time of a character; a pause of two ends an incomplete request
  Time answer_time{};  ///< from the end of a request to its reply
  Time start_time{};   ///< from power on to the first request that is answered
  Time gap{};          ///< pause that ends an incomplete request; 0: two characters
  /// Full duplex: requests received during a transmission are stored and answered afterwards.
  bool keeps_requests = false;
};

/// A virtual encoder whose subclass recognizes requests and answers them. BusDevice makes one from a protocol.
class Responder : public EncoderOn<std::uint8_t> {
 public:
  /// Takes an event of the port.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns the next step of the port.
  Step<std::uint8_t> next(Time now) override;

  /// Switches the encoder off.
  void power_off(Time now) override;

 protected:
  /// Replies with these times.
  explicit Responder(const DeviceTimes& times) : EncoderOn(times.start_time), times_(times) {}
  ~Responder() = default;

  /// Transmits without a request on the line: after chip select, or unsolicited.
  void transmit(Bytes bytes, Time at);
  /// Returns whether the encoder is sending.
  [[nodiscard]] bool is_transmitting() const { return transmitting_; }
  /// Returns the earliest time at which bytes delivered at `at` may have arrived, because the carrier may have been
  /// delayed. Times that a host must wait count from here.
  [[nodiscard]] Time earliest(Time at) const { return at - late_; }

  /// Returns the length of the request that begins with these bytes, or how many bytes are needed to know it, at least
  /// one; 0: no request begins with them, and the search continues at the next byte.
  [[nodiscard]] virtual std::size_t request_size(Bytes begin) const = 0;
  /// Returns the length of the reply to this request, which is for another encoder.
  [[nodiscard]] virtual std::size_t others_reply_size(Bytes request) const = 0;
  /// Returns whether the other encoder's reply may begin with this byte; if not, the other encoder did not answer and a
  /// request follows.
  [[nodiscard]] virtual bool begins_others_reply(std::uint8_t) const { return true; }
  /// Whether and how a request is answered.
  enum class Answer : std::uint8_t {
    sent,
    none,
    for_others,
    refused,  ///< when the line is silent: see `refuse`
  };
  /// Delays the present reply by `time`. Call it from `respond`.
  void take_longer(Time time) { longer_ = time; }
  /// Answers a complete request. The reply goes to `reply`.
  virtual Answer respond(Bytes request, Time at, ByteBuffer<64>& reply) = 0;
  /// Error of a request.
  enum class Flaw : std::uint8_t {
    damaged,    ///< damaged character
    unknown,    ///< no request begins with these bytes
    cut_short,  ///< ended by silence
  };
  /// Returns whether an invalid request is refused; otherwise it is ignored. For a damaged one, `heard` has the bytes
  /// before the damage, possibly none.
  virtual bool is_refused(Flaw, Bytes /*heard*/) { return false; }
  /// Makes the reply to a refused request, when the line is silent.
  virtual void refuse(Time, ByteBuffer<64>& /*reply*/) {}

 private:
  void receive_byte(std::uint8_t byte, Time at);
  void search_again(Time at);
  void receive_while_transmitting(std::uint8_t byte, Time at);
  void begin_reply(Time at);
  void ended(Answer answer, Time at);
  void damage(Time at);
  void end_run(Time at);
  void forget();

  DeviceTimes times_;
  ByteBuffer<32> request_;
  bool damaged_ = false;  // a character of the request was damaged: the rest is ignored until the line is silent
  Time received_at_{};
  Time late_{};               // longest delay with which the last bytes were delivered
  std::size_t skipping_ = 0;  // characters left of another encoder's reply
  bool skip_begins_ = false;  // the first of these characters is still to be received
  bool refusing_ = false;     // the refused request is answered when the line is silent
  ByteBuffer<64> reply_;
  Time reply_at_{};
  Time longer_{};
  ByteBuffer<64> stored_;                // bytes received during the transmission
  unsigned interrupted_ = 0;             // requests received during the transmission
  unsigned interruptions_in_a_row_ = 0;  // consecutive transmissions during which requests were received
  bool reply_pending_ = false;
  bool transmitting_ = false;
  Interruption interruption_;
};

/// A virtual encoder of a protocol with requests and replies (dialog.hpp), with `memory_size` bytes that survive power
/// off. The protocol needs these functions besides:
///
///   static DeviceTimes device_times(const Format&);
///   static std::size_t request_size(const Format&, Bytes begin);       // 0: no request begins with these bytes
///   static std::size_t reply_size(const Format&, const Request&);      // 0: it is not answered
///   static Result<Request> decode_request(const Format&, Bytes);
///   static ByteBuffer<N> encode_reply(const Format&, const Request&, const Reply&);
///
/// `Derived` has `bool is_mine(const Request&)`, and `std::optional<Reply> answer(const Request&, Time at)`, which
/// returns nothing for no reply.
template <class P, class Derived, std::size_t memory_size>
class BusDevice : public Responder {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A request of the protocol.
  using Request = typename P::Request;
  /// A reply of the protocol.
  using Reply = typename P::Reply;

  /// Constructs an encoder that is off until `power_on`. `shaft` must outlive it.
  BusDevice(const Format& format, const Shaft& shaft)
      : Responder(P::device_times(format)), format_(format), shaft_(&shaft) {}
  /// Returns the memory of the encoder, which outlasts power-off.
  [[nodiscard]] MutableBytes memory() final { return memory_; }

 protected:
  ~BusDevice() = default;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns position and motion of the shaft.
  [[nodiscard]] ShaftState shaft(Time at) const { return shaft_->at(at); }
  /// Returns counts of 2^-bits revolution since the zero that `store_zero` stored in four bytes at this address;
  /// continuous from turn to turn, negative below zero.
  [[nodiscard]] std::int64_t counts(Time at, unsigned bits, std::size_t zero_address) const {
    const auto zero = static_cast<std::int64_t>(load_little_endian(Bytes(memory_).subspan(zero_address, 4)));
    return (shaft(at).position - zero) >> (32 - bits);
  }
  /// Stores the present position as the zero.
  void store_zero(Time at, std::size_t zero_address) {
    const auto here = static_cast<std::uint64_t>(shaft(at).position) & low_mask(32);
    store_little_endian(MutableBytes(memory_).subspan(zero_address, 4), here);
    change_memory();
  }
  /// Returns a byte of the memory.
  [[nodiscard]] std::uint8_t stored(std::size_t address) const { return memory_[address]; }
  /// Writes a byte of the memory.
  void store(std::size_t address, std::uint8_t value) {
    memory_[address] = value;
    change_memory();
  }

 private:
  [[nodiscard]] std::size_t request_size(Bytes begin) const final { return P::request_size(format_, begin); }
  [[nodiscard]] std::size_t others_reply_size(Bytes bytes) const final {
    const Result<Request> request = P::decode_request(format_, bytes);
    return request ? P::reply_size(format_, *request) : 0;
  }
  Answer respond(Bytes bytes, Time at, ByteBuffer<64>& reply) final {
    auto& derived = static_cast<Derived&>(*this);
    const Result<Request> request = P::decode_request(format_, bytes);
    if (!request || !derived.is_mine(*request)) return Answer::for_others;
    const std::optional<Reply> answer = derived.answer(*request, at);
    if (!answer) return Answer::none;
    reply.append(P::encode_reply(format_, *request, *answer).view());
    return Answer::sent;
  }

  Format format_;
  const Shaft* shaft_;
  std::array<std::uint8_t, memory_size> memory_{};
};

}  // namespace absenc::author
