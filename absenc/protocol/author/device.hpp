// SPDX-License-Identifier: Apache-2.0
// Device side of a line of characters: finds requests, leaves those of others alone, answers in time, lists the rules
// that its host breaks, and keeps its memory. It knows no protocol, and is compiled once.
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

/// The times of a virtual encoder, as its document has them.
struct DeviceTimes {
  Time character{};    ///< of its line: a pause of two ends a request that is not whole
  Time answer_time{};  ///< from the end of a request to its reply
  Time start_time{};   ///< from power on to the first request that is answered
  Time gap{};          ///< the pause that ends a request, where it is not two characters
  /// Full duplex with a memory for what comes while it sends: that is answered afterwards.
  bool keeps_requests = false;
};

/// A subclass says what a request is, and what is answered. BusDevice makes one from a protocol.
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

  /// Sends what no request on a line of characters asks for: what a chip select does, or nobody.
  void transmit(Bytes bytes, Time at);
  /// Returns whether the encoder is sending.
  [[nodiscard]] bool is_transmitting() const { return transmitting_; }
  /// When what was heard at `at` may have come: earlier than that, where the carrier was kept from looking. What a host
  /// must wait for counts from here.
  [[nodiscard]] Time earliest(Time at) const { return at - late_; }

  /// How many bytes the request has that begins so, one at least, or how many tell more; 0: none begins so, and the
  /// search goes on behind the first byte.
  [[nodiscard]] virtual std::size_t request_size(Bytes begin) const = 0;
  /// How many bytes follow this request, which is another encoder's.
  [[nodiscard]] virtual std::size_t others_reply_size(Bytes request) const = 0;
  /// Whether the reply to the last request of others may begin so; if not, nobody answers it, and a request follows.
  [[nodiscard]] virtual bool begins_others_reply(std::uint8_t) const { return true; }
  /// Whether and how a request is answered.
  enum class Answer : std::uint8_t {
    sent,
    none,
    for_others,
    refused,  ///< when the line is silent: see `refuse`
  };
  /// For `respond`: this reply takes so much longer.
  void take_longer(Time time) { longer_ = time; }
  /// A whole request. Its reply goes to `reply`.
  virtual Answer respond(Bytes request, Time at, ByteBuffer<64>& reply) = 0;
  /// What is wrong with a request.
  enum class Flaw : std::uint8_t {
    damaged,    ///< a character
    unknown,    ///< no request begins so
    cut_short,  ///< by silence
  };
  /// Whether what is no request is refused. What is not is as if it had not come. Of a damaged one `heard` is what came
  /// before the damage, perhaps nothing.
  virtual bool is_refused(Flaw, Bytes /*heard*/) { return false; }
  /// The line is silent after something that is refused: the reply to it.
  virtual void refuse(Time, ByteBuffer<64>& /*reply*/) {}

 private:
  void hear(std::uint8_t byte, Time at);
  void search_on(Time at);
  void hear_while_transmitting(std::uint8_t byte, Time at);
  void begin_reply(Time at);
  void ended(Answer answer, Time at);
  void damage(Time at);
  void end_run(Time at);
  void forget();

  DeviceTimes times_;
  ByteBuffer<32> request_;
  bool damaged_ = false;  // a character of it: the rest is none until the line is silent
  Time heard_at_{};
  Time late_{};               // what was heard last may have come so much earlier
  std::size_t skipping_ = 0;  // characters of another encoder's reply
  bool skip_begins_ = false;  // none of them has come yet
  bool refusing_ = false;     // what was heard is answered when the line is silent
  ByteBuffer<64> reply_;
  Time reply_at_{};
  Time longer_{};
  ByteBuffer<64> kept_;                  // what came while it sends
  unsigned interrupted_ = 0;             // requests that came while it sends
  unsigned interruptions_in_a_row_ = 0;  // replies during which some came
  bool reply_pending_ = false;
  bool transmitting_ = false;
  Interruption interruption_;
};

/// A virtual encoder of a protocol with requests and replies (dialog.hpp), with `memory_size` bytes that survive power
/// off. Of the protocol it needs besides:
///
///   static DeviceTimes device_times(const Format&);
///   static std::size_t request_size(const Format&, Bytes begin);       // 0: no request begins so
///   static std::size_t reply_size(const Format&, const Request&);      // 0: it is not answered
///   static Result<Request> decode_request(const Format&, Bytes);
///   static ByteBuffer<N> encode_reply(const Format&, const Request&, const Reply&);
///
/// `Derived` answers: `bool is_mine(const Request&)`, and `std::optional<Reply> answer(const Request&, Time at)`, where
/// none is no reply.
template <class P, class Derived, std::size_t memory_size>
class BusDevice : public Responder {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// A request of the protocol.
  using Request = typename P::Request;
  /// A reply of the protocol.
  using Reply = typename P::Reply;

  /// Switched off until `power_on`. `shaft` must outlive the encoder.
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
  /// Counts of 2^-bits revolution since the zero that `store_zero` keeps in four bytes from this address on; they go on
  /// from turn to turn, and are negative below zero.
  [[nodiscard]] std::int64_t counts(Time at, unsigned bits, std::size_t zero_address) const {
    const auto zero = static_cast<std::int64_t>(load_little_endian(Bytes(memory_).subspan(zero_address, 4)));
    return (shaft(at).position - zero) >> (32 - bits);
  }
  /// The zero is here.
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
