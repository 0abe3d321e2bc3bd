// SPDX-License-Identifier: Apache-2.0
// Combines the engine of a bidirectional clocked line with a protocol.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "absenc/protocol/author/bit_engine.hpp"
#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// The members that a protocol with requests and replies of bits must have:
///
///   struct Protocol {
///     using Format, Request, Reply;
///     static constexpr std::size_t longest_reply_bits;
///     static Manner manner(const Format&, const Request&);        // repeats, pause, holds_line and hold are used
///     static BitRequest encode(const Format&, const Request&);
///     static Result<Request> decode_request(const Format&, BitView);        // request and supplement
///     static std::size_t missing(const Format&, const Request&, BitView reply);          // see BitEngine
///     static Result<Reply> decode(const Format&, const Request&, BitView reply);
///     // only for `last_reading`:
///     static Reading reading(const Format&, const Request&, const Reply&);
///     // only if replies to most requests have the position: `reading` then gives it, or an empty one
///     static constexpr bool replies_carry_position;
///   };
template <class P>
concept Bitwise = requires {
  P::longest_reply_bits;
};

namespace detail {
template <class P>
struct ContentOf {
  using Type = Bytes;
};
template <Bitwise P>
struct ContentOf<P> {
  using Type = BitView;
};
}  // namespace detail

/// Type of the content of frames of the protocol `P`: BitView if frames are bits, else Bytes.
template <class P>
using ContentOf = typename detail::ContentOf<P>::Type;

/// A conversation with encoded requests and decoded replies of bits.
template <Bitwise P>
class HostOf<P> : public BitEngine {
 public:
  /// Format of the encoder: the values of its options.
  using Format = typename P::Format;
  /// C++ type of the protocol's requests.
  using Request = typename P::Request;
  /// C++ type of the protocol's replies.
  using Reply = typename P::Reply;

  /// Returns the format of the encoder.
  [[nodiscard]] const Format& format() const { return format_; }
  /// Returns the last request.
  [[nodiscard]] const Request& request() const { return request_; }
  /// Returns the last valid reply; an empty one if there was none.
  [[nodiscard]] const Reply& last() const { return last_; }
  /// Returns position and turns in the last valid reply, latched at the first clock edge of the exchange.
  [[nodiscard]] Reading last_reading() const {
    Reading reading = P::reading(format_, request_, last_);
    reading.latched = begun_at();
    reading.received = received_at();
    return reading;
  }
  /// Returns false: the unit's explanation of the last reply is always added to the texts of an error.
  [[nodiscard]] static constexpr bool is_alone() { return false; }

 protected:
  /// Constructs a conversation with an encoder of this format.
  explicit HostOf(const Format& format) : BitEngine(storage_), format_(format) {}
  ~HostOf() = default;

  /// Sets the format, when the encoder has reported properties that the options left open.
  void set_format(const Format& format) { format_ = format; }
  /// Sets that `request` is sent next, as Protocol::manner states, not before `earliest`.
  void ask(const Request& request, Time earliest = {}) { ask(request, P::manner(format_, request), earliest); }
  /// Sets that `request` is sent next, as `manner` states, not before `earliest`.
  void ask(const Request& request, const Manner& manner, Time earliest = {}) {
    request_ = request;
    send(P::encode(format_, request), manner, earliest);
  }

 private:
  [[nodiscard]] std::size_t missing() const final { return P::missing(format_, request_, reply()); }
  [[nodiscard]] Error check() final {
    const Result<Reply> result = P::decode(format_, request_, reply());
    if (result) last_ = *result;
    return result.error();
  }

  Format format_;
  Request request_{};
  Reply last_{};
  std::array<std::uint8_t, (P::longest_reply_bits + 7) / 8> storage_;
};

/// A conversation that a procedure controls, and that sends requests of bits.
template <Bitwise P>
class DialogOf<P> : public AskingDialog<P> {
 protected:
  using AskingDialog<P>::AskingDialog;
  ~DialogOf() = default;
};

}  // namespace absenc::author
