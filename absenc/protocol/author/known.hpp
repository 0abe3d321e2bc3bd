// SPDX-License-Identifier: Apache-2.0
// Reads the position of an encoder whose format and request are known at compile time.
#pragma once

#include <cstddef>

#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// The protocol P for an encoder whose `format` and `request` are constants; the types Format and Request of this class
/// are empty.
template <class P, const typename P::Format& format, const typename P::Request& request>
struct Known {
  struct Format {};
  struct Request {};
  /// C++ type of the protocol's replies.
  using Reply = typename P::Reply;
  static constexpr std::size_t longest_reply = P::longest_reply;  ///< Greatest length of a reply in bytes.

  /// Returns the time limits and pauses of a host.
  static constexpr HostTimes host_times(const Format&) { return P::host_times(format); }
  /// Returns how the request is sent and repeated, and how its reply ends.
  static constexpr Manner manner(const Format&, const Request&) { return P::manner(format, request); }
  /// Returns the bytes of the request.
  static constexpr auto encode(const Format&, const Request&) { return P::encode(format, request); }
  /// Returns the length in bytes of the reply that begins with `so_far`; 0: unknown.
  static constexpr std::size_t expected(const Format&, const Request&, Bytes so_far) {
    return P::expected(format, request, so_far);
  }
  /// Returns the decoded reply, or the error of a failed check.
  [[gnu::flatten]] static constexpr Result<Reply> decode(const Format&, const Request&, Bytes bytes) {
    return P::decode(format, request, bytes);
  }
  /// Returns whether a reply with this error is complete, so that no more bytes are awaited.
  static constexpr bool is_whole(const Format&, Error error) { return P::is_whole(format, error); }
  /// Returns the position and turns of a valid reply.
  [[gnu::flatten]] static constexpr Reading reading(const Format&, const Request&, const Reply& reply) {
    return P::reading(format, request, reply);
  }
  /// Returns the latch time that P gives for a request that was sent at `sent_at`.
  static constexpr Time latched(const Format&, Time sent_at) { return P::latched(format, sent_at); }
};

/// Conversation that reads the position with a constant format and request.
template <class P, const typename P::Format& format, const typename P::Request& request>
requires(!requires { P::needs_another; }) class ReadKnownPosition final
    : public ReadPosition<Known<P, format, request>> {
 public:
  ReadKnownPosition() : ReadPosition<Known<P, format, request>>({}, {}) {}
};

}  // namespace absenc::author
