// SPDX-License-Identifier: Apache-2.0
// Commands that an encoder executes only after several equal requests in a row.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/host_rules.hpp"

namespace absenc::author {

/// Demands of a document on a command that is executed by several equal requests in a row.
struct InARow {
  /// The two events between which hosts keep `interval`.
  enum class IntervalBounds : std::uint8_t {
    reply_and_request,  ///< from the end of a reply to the begin of the next request
    requests,           ///< from the begin of a request to the begin of the next one
  };

  unsigned requests = 0;  ///< number of equal requests that execute the command, 2 or more
  Time interval{};  ///< shortest time that hosts keep before the next request of the row, measured as `between` states
  IntervalBounds between = IntervalBounds::reply_and_request;  ///< the events between which hosts keep `interval`
  /// Shortest time from the previous request, or its reply, to a request that a virtual encoder accepts.
  Time accepted{};
  std::string_view number_rule{};    ///< rule of the virtual encoder: the host sent too few requests
  std::string_view interval_rule{};  ///< rule of the virtual encoder: the host sent two requests too fast
};

/// Counts the requests of a row in a virtual encoder.
class RowCounter {
 public:
  /// Constructs a counter. `row` and `rules` must outlive it.
  RowCounter(const InARow& row, HostRules& rules) : row_(&row), rules_(&rules) {}

  /// Counts a request of the command `code` that was delivered at `at` and may have arrived as early as `earliest`.
  /// Returns whether the encoder executes the command now.
  [[nodiscard]] bool count(unsigned code, Time at, Time earliest) {
    if (code != code_) end();
    code_ = code;
    if (++sent_ == row_->requests) rules_->note(true, row_->number_rule);
    if (counted_ > 0 && !rules_->expect(at - since_ >= row_->accepted, row_->interval_rule, at)) counted_ = 0;
    since_ = earliest;
    if (++counted_ < row_->requests) return false;
    counted_ = 0;
    return true;
  }
  /// Measures the time to the next request from `at`, the end of a reply.
  void measure_from(Time at) { since_ = at; }
  /// Ends the row; a row with too few requests breaks `number_rule`.
  void end() {
    if (sent_ > 0 && sent_ < row_->requests) rules_->note(false, row_->number_rule);
    forget();
  }
  /// Forgets the requests counted so far, after a damaged request or at power off.
  void forget() { sent_ = counted_ = 0; }

 private:
  const InARow* row_;
  HostRules* rules_;
  unsigned code_ = 0;
  unsigned sent_ = 0;  // number of equal requests received in the present row
  // Number of requests that count for the next execution; a request that is sent too fast restarts this count at 1.
  unsigned counted_ = 0;
  Time since_{};
};

/// Sends `request` as often as `row` demands, and returns whether the last reply was valid. A missing or invalid
/// earlier reply ends the procedure.
template <class P>
Part<bool> send_in_a_row(DialogOf<P>& dialog, typename P::Request request, const InARow& row) {
  Time pause = row.between == InARow::IntervalBounds::reply_and_request ? row.interval : Time{};
  for (unsigned sent = 1;; ++sent) {
    dialog.hold_line(sent < row.requests);
    const Result<typename P::Reply> reply = co_await dialog.attempt(request).once().changes().after(pause);
    if (sent == row.requests) co_return reply.error() == Error::none;
    if (!reply) {
      dialog.hold_line(false);
      co_await dialog.stop({reply.error(),
                            "one of the requests in a row was not answered well, so the encoder has most likely done "
                            "nothing: see that with `absenc read` before you try again"});
    }
    if (row.between == InARow::IntervalBounds::requests) {
      // The interval is counted from the end of the request, which may have begun later than its step said.
      pause = dialog.sent_at() + row.interval - dialog.received_at();
    }
  }
}

}  // namespace absenc::author
