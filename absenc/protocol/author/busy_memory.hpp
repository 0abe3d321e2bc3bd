// SPDX-License-Identifier: Apache-2.0
// Host side of an encoder memory that is busy for a while.
#pragma once

#include <algorithm>

#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// How often and how long a host repeats a request to a busy memory.
struct BusyWait {
  Time limit;               ///< Longest time from the first valid reply to one after which the request is repeated.
  Time pause;               ///< Pause before a repetition after a valid reply.
  unsigned attempts = 1;    ///< How often each request is sent, at most, until its reply is valid.
  bool after_busy = false;  ///< Whether the result must be a reply that follows a busy reply.
};

/// Repeats a request to a busy memory, and returns the last reply or an error.
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
