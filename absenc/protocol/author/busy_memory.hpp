// SPDX-License-Identifier: Apache-2.0
// Host side of an encoder memory that is busy for a while.
#pragma once

#include <algorithm>

#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// How often and how long a host repeats a request to a busy memory.
struct BusyWait {
  /// Time after the first valid reply for which the host repeats its request while the memory is busy; then it reports
  /// Error::busy.
  Time limit;
  Time pause;             ///< Pause from a valid reply to the repetition of the request.
  unsigned attempts = 1;  ///< How often each request is sent, at most, until its reply is valid.
  /// Whether the host accepts a reply as the result only after at least one reply has reported the memory busy.
  bool after_busy = false;
};

/// Sends a request, repeats it while the memory is busy, and returns the last reply or an error.
template <class P>
Part<Result<typename P::Reply>> until_ready(DialogOf<P>& dialog, typename P::Request request, BusyWait wait) {
  Time last_attempt = never;
  for (Time pause{};; pause = wait.pause) {
    const Result<typename P::Reply> reply = co_await dialog.attempt(request).repeated(wait.attempts).after(pause);
    if (!reply || (!reply->busy && !wait.after_busy)) co_return reply;
    if (reply->busy) wait.after_busy = false;
    last_attempt = std::min(last_attempt, dialog.received_at() + wait.limit);
    if (dialog.received_at() > last_attempt) co_return Error::busy;
  }
}

}  // namespace absenc::author
