// SPDX-License-Identifier: Apache-2.0
// Device side of a line of characters (UART).
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

/// Times of a virtual encoder: those of its document, or assumed where it states none.
struct DeviceTimes {
  /// Duration of one byte on the line: `format.line().byte_time()`. A character of more than 8 bits counts as two
  /// bytes.
  Time character{};
  Time answer_time{};  ///< time from the end of a request to the begin of its reply
  Time start_time{};   ///< time from power on until requests are answered
  /// Pause that ends an incomplete request, or the reply of another encoder; 0: the duration of two bytes. It is longer
  /// than `frame_pause`.
  Time gap{};
  std::uint8_t frame = 0;         ///< number of bytes of each frame of a request; 0: a request is one frame
  Time frame_pause{};             ///< shortest pause between two frames of a request
  std::string_view frame_rule{};  ///< text of the rule that hosts keep `frame_pause`
  /// Whether requests received during a transmission are stored and answered afterwards.
  bool keeps_requests = false;
};

/// A virtual encoder on a line of characters; a subclass recognizes and answers requests.
class Responder : public EncoderOn<std::uint8_t> {
 public:
  /// Handles an event that the port reports.
  void feed(const Event<std::uint8_t>& event) override;
  /// Returns the next step that the port must take.
  Step<std::uint8_t> next(Time now) override;

  /// Switches the encoder off at `now`.
  void power_off(Time now) override;

 protected:
  /// Constructs an encoder that keeps the times `times`, such as that from a request to its reply.
  explicit Responder(const DeviceTimes& times) : EncoderOn(times.start_time), times_(times) {}
  ~Responder() = default;

  /// Sets that `bytes` are sent at `at` without a request on the line.
  void transmit(Bytes bytes, Time at);
  /// Returns whether the encoder is sending, or is about to send a reply.
  [[nodiscard]] bool is_transmitting() const { return transmitting_; }
  /// Returns the earliest time at which the last received bytes, delivered at `at`, may have arrived.
  [[nodiscard]] Time earliest(Time at) const { return at - late_; }

  /// Returns the length of the request that begins with `begin`, or the number of bytes that are needed to know this
  /// length; 0: no request begins with these bytes.
  [[nodiscard]] virtual std::size_t request_size(Bytes begin) const = 0;
  /// Returns the length of the reply to `request`, which is for another encoder; 0: none.
  [[nodiscard]] virtual std::size_t others_reply_size(Bytes request) const = 0;
  /// Returns whether the reply of another encoder may begin with this byte. By default true.
  [[nodiscard]] virtual bool begins_others_reply(std::uint8_t) const { return true; }
  /// Whether and how a request is answered.
  enum class Answer : std::uint8_t {
    sent,
    none,
    for_others,
    refused,  ///< the reply is made by `refuse` when the line is silent
  };
  /// Sets that the present reply begins later by `time`. To be called from `respond`.
  void take_longer(Time time) { longer_ = time; }
  /// States that all encoders on the line answer the present request in turn: this encoder `delay` later than usual,
  /// and all of them within the time `all`. To be called from `respond`.
  void take_turn(Time delay, Time all) {
    longer_ = delay;
    turns_ = all;
  }
  /// Handles the end of a transmission of this encoder.
  virtual void replied(Time) {}
  /// Answers `request`, received at `at`: writes the reply, and returns how it is answered.
  virtual Answer respond(Bytes request, Time at, ByteBuffer<64>& reply) = 0;
  /// Reason why received bytes are no valid request.
  enum class Flaw : std::uint8_t {
    damaged,    ///< a character was damaged
    unknown,    ///< no request begins with these bytes
    cut_short,  ///< silence ended the request before it was complete
  };
  /// Returns whether the encoder replies to an invalid request. `heard`: the received bytes. By default false.
  virtual bool is_refused(Flaw, Bytes /*heard*/) { return false; }
  /// Writes the reply to a refused request, when the line is silent. By default writes nothing.
  virtual void refuse(Time, ByteBuffer<64>& /*reply*/) {}

 private:
  void receive_byte(std::uint8_t byte, Time at);
  void check_frame_pause(Time at, Time before);
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
  Time late_{};               // the last bytes were delivered at most this long after they had arrived
  std::size_t skipping_ = 0;  // number of characters still to be received of another encoder's reply
  bool skip_begins_ = false;  // the first character of another encoder's reply is still to be received
  bool refusing_ = false;     // a request was refused; `refuse` writes the reply when the line is silent
  ByteBuffer<64> reply_;
  Time reply_at_{};
  Time longer_{};
  Time turns_{};  // duration of the replies of all encoders to the present request; 0: only one answers
  // bytes received before this time belong to replies of other encoders to a request for all
  Time turns_end_{};
  ByteBuffer<64> stored_;     // bytes received during the present transmission, if DeviceTimes::keeps_requests is true
  unsigned interrupted_ = 0;  // number of requests received during the present transmission
  // Number of consecutive transmissions, before the present one, during which a request was received.
  unsigned interruptions_in_a_row_ = 0;
  bool reply_pending_ = false;
  bool transmitting_ = false;
  Interruption interruption_;
};

/// A virtual encoder of a protocol with requests and replies. Its `memory_size` bytes survive power off. Besides the
/// functions of dialog.hpp the protocol needs these:
///
///   static DeviceTimes device_times(const Format&);
///   static std::size_t request_size(const Format&, Bytes begin);       // 0: no request begins with these bytes
///   static std::size_t reply_size(const Format&, const Request&);      // 0: it is not answered
///   static Result<Request> decode_request(const Format&, Bytes);
///   static ByteBuffer<N> encode_reply(const Format&, const Request&, const Reply&);
///
/// `Derived` has `bool is_mine(const Request&)` and `std::optional<Reply> answer(const Request&, Time at)`.
template <class P, class Derived, std::size_t memory_size>
class BusDevice : public Responder {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;
  /// C++ type of the protocol's replies.
  using Reply = typename P::Reply;

  /// Constructs an encoder that is off until `power_on`. `shaft` must outlive it.
  BusDevice(const Format& format, const Shaft& shaft)
      : Responder(P::device_times(format)), format_(format), shaft_(&shaft) {}
  /// Returns the bytes of the encoder's memory, which survive power off.
  [[nodiscard]] MutableBytes memory() final { return memory_; }

 protected:
  ~BusDevice() = default;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns position and motion of the shaft at the time `at`.
  [[nodiscard]] ShaftState shaft(Time at) const { return shaft_->at(at); }
  /// Returns the position of the shaft at `at`, in counts of 2^-bits revolution, from the zero that the memory has at
  /// `zero_address`.
  [[nodiscard]] std::int64_t counts(Time at, unsigned bits, std::size_t zero_address) const {
    const auto zero = static_cast<std::int64_t>(load_little_endian(Bytes(memory_).subspan(zero_address, 4)));
    return (shaft(at).position - zero) >> (32 - bits);
  }
  /// Stores the position within the turn at `at` as the zero, in four bytes at `zero_address`.
  void store_zero(Time at, std::size_t zero_address) {
    const auto here = static_cast<std::uint64_t>(shaft(at).position) & low_mask(32);
    store_little_endian(MutableBytes(memory_).subspan(zero_address, 4), here);
    change_memory();
  }
  /// Returns the byte of the memory at `address`.
  [[nodiscard]] std::uint8_t stored(std::size_t address) const { return memory_[address]; }
  /// Writes `value` to the byte of the memory at `address`.
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
