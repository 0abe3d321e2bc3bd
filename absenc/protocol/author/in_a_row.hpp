// SPDX-License-Identifier: Apache-2.0
// Commands that an encoder executes only after their request was sent several times in a row: resets, zero, presets.
#pragma once

#include <cstdint>
#include <string_view>

#include "absenc/protocol/author/dialog.hpp"
#include "absenc/protocol/host_rules.hpp"

namespace absenc::author {

/// The document's demands on requests that are sent in a row, and what a virtual encoder accepts.
struct InARow {
  /// From where to where hosts keep `interval`.
  enum class IntervalBounds : std::uint8_t {
    reply_and_request,  ///< from the end of a reply to the begin of the next request
    requests,           ///< from the begin of a request to the begin of the next one
  };

  unsigned requests = 0;  ///< number of equal requests that execute the command, 2 or more
  Time interval{};        ///< shortest time before the next request of the row, as hosts keep it
  IntervalBounds between = IntervalBounds::reply_and_request;  ///< the events between which hosts keep `interval`
  /// Shortest time from the end of a request, or of its reply (RowCounter::measure_from), to the end of the next
  /// request that a virtual encoder accepts. A request that follows sooner is the first of a new row.
  Time accepted{};
  std::string_view number_rule{};    ///< rule of the virtual encoder: the host sent too few requests
  std::string_view interval_rule{};  ///< rule of the virtual encoder: the host sent two requests too fast
};

/// Counts the requests of a row in a virtual encoder.
class RowCounter {
 public:
  /// Constructs a counter. `row` and `rules` must outlive it.
  RowCounter(const InARow& row, HostRules& rules) : row_(&row), rules_(&rules) {}

  /// Counts a request of a row, received at `at`. `code` distinguishes the commands of the encoder. `earliest`:
  /// earliest time at which the request may have arrived. Returns whether the encoder must execute the command now.
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
  /// Measures the time to the next request from `at`, the end of the reply, instead of from the end of the request.
  void measure_from(Time at) { since_ = at; }
  /// Ends the row, because the host sent a request that is not of the row. A row that is too short is noted as a broken
  /// rule.
  void end() {
    if (sent_ > 0 && sent_ < row_->requests) rules_->note(false, row_->number_rule);
    forget();
  }
  /// Forgets the row, after a damaged request or at power off.
  void forget() { sent_ = counted_ = 0; }

 private:
  const InARow* row_;
  HostRules* rules_;
  unsigned code_ = 0;
  unsigned sent_ = 0;     // requests of the row
  unsigned counted_ = 0;  // requests since the last execution, from the last one that was sent too fast on
  Time since_{};
};

/// Sends `request` as often as `row` demands, never more often. Without a valid reply to one before the last the
/// procedure ends, because an encoder that has missed a request does nothing. If only the last reply is missing or
/// invalid, the encoder may have executed the command, and reading shows it: the result is whether that reply was
/// valid.
template <class P>
Part<bool> send_in_a_row(DialogOf<P>& dialog, typename P::Request request, const InARow& row) {
  Time pause = row.between == InARow::IntervalBounds::reply_and_request ? row.interval : Time{};
  for (unsigned sent = 1;; ++sent) {
    const Result<typename P::Reply> reply = co_await dialog.attempt(request).once().changes().after(pause);
    if (sent == row.requests) co_return reply.error() == Error::none;
    if (!reply) {
      co_await dialog.stop({reply.error(),
                            "one of the requests in a row was not answered well, so the encoder has most likely done "
                            "nothing: see that with `absenc read` before you try again"});
    }
    if (row.between == InARow::IntervalBounds::requests) {
      pause = dialog.begun_at() + row.interval - dialog.received_at();
    }
  }
}

}  // namespace absenc::author
