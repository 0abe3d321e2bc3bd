// SPDX-License-Identifier: Apache-2.0
// Reads the position of an encoder whose format and request are known at compile time, as a drive knows them: values
// that follow from them are not computed at run time, and cases that they exclude are not linked.
#pragma once

#include <cstddef>

#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// A protocol made of the protocol P with the constants `format` and `request`; its own Format and Request are empty.
template <class P, const typename P::Format& format, const typename P::Request& request>
struct Known {
  struct Format {};
  struct Request {};
  /// Type of the protocol's replies.
  using Reply = typename P::Reply;
  static constexpr std::size_t longest_reply = P::longest_reply;  ///< Greatest length of a reply in bytes.

  /// Returns the time limits and pauses of a host.
  static constexpr HostTimes host_times(const Format&) { return P::host_times(format); }
  /// Returns how the request is sent and repeated, and how its reply ends.
  static constexpr Manner manner(const Format&, const Request&) { return P::manner(format, request); }
  /// Returns the bytes of the request.
  static constexpr auto encode(const Format&, const Request&) { return P::encode(format, request); }
  /// Returns the length of the reply in bytes, as far as its first bytes `so_far` show it; 0: unknown.
  static constexpr std::size_t expected(const Format&, const Request&, Bytes so_far) {
    return P::expected(format, request, so_far);
  }
  /// Checks and decodes the bytes of a reply. Returns the reply, or the error of the first failed check.
  [[gnu::flatten]] static constexpr Result<Reply> decode(const Format&, const Request&, Bytes bytes) {
    return P::decode(format, request, bytes);
  }
  /// Returns whether a reply with this error is complete, so that no more bytes are awaited.
  static constexpr bool is_whole(const Format&, Error error) { return P::is_whole(format, error); }
  /// Returns the position and turns of a valid reply.
  [[gnu::flatten]] static constexpr Reading reading(const Format&, const Request&, const Reply& reply) {
    return P::reading(format, request, reply);
  }
  /// Returns the latch time that P states or assumes for the reply to a request that was sent at `sent_at`.
  static constexpr Time latched(const Format&, Time sent_at) { return P::latched(format, sent_at); }
};

/// Conversation that reads the position with a format and a request that are constants: `static constexpr Format
/// format{...}; static constexpr Request request{...};`. It is for protocols in which one reply proves the position.
template <class P, const typename P::Format& format, const typename P::Request& request>
requires(!requires { P::needs_another; }) class ReadKnownPosition final
    : public ReadPosition<Known<P, format, request>> {
 public:
  ReadKnownPosition() : ReadPosition<Known<P, format, request>>({}, {}) {}
};

}  // namespace absenc::author
