// SPDX-License-Identifier: Apache-2.0
// Host side of a memory that is busy for a while: repeats a request until the encoder executes it.
#pragma once

#include <algorithm>

#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// How long a host waits for a busy memory, and how.
struct BusyWait {
  Time limit;               ///< Longest time from the first valid reply to the last attempt.
  Time pause;               ///< Pause between two attempts.
  unsigned attempts = 1;    ///< Attempts of each request until a valid reply.
  bool after_busy = false;  ///< Whether a reply counts only when it follows a busy one.
};

/// Returns the first valid reply whose member `busy` is false. A busy encoder has not executed the request, so even a
/// write may be repeated. Errors: busy, or that of the last attempt.
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
