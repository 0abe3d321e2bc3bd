// SPDX-License-Identifier: Apache-2.0
// Parses characters that have arrival times at a program: the transport to the program may join and split frames.
#include <algorithm>

#include "absenc/capture/annotate/annotate.hpp"

namespace absenc::capture {

void Annotator::report_complete() {
  Channel& channel = channels_[0];
  if (!channel.run.empty()) parse(channel, false, false);
}

void Annotator::report_after_silence() {
  Channel& channel = channels_[0];
  close(channel, false);
  is_first_ = false;
  exchanges_.report_unanswered(exchanges_.waiting().size());
}

bool Annotator::has_gap(std::size_t before) const {
  if (!settings_.by_arrival) return false;
  const Run& run = channel_->run;
  return before == 0 || (before < run.size() && run.begin(before) - run.begin(before - 1) >= settings_.gap);
}

bool Annotator::stands_alone(std::size_t size) const {
  const bool is_end = whole_ && size == rest(at_).size();
  return has_gap(at_) && (is_end || has_gap(at_ + size));
}

// If the characters at `at_` are a good frame, reports it and returns its size; otherwise returns 0.
std::size_t Annotator::whole_frame() {
  if (!channel_->at_frame_start) return 0;
  const auto answered = [&](std::size_t size) {
    const Bytes request = rest(at_).first(size);
    return reply_at(request, at_ + size, reply_sizes_[size_index(request)]) != 0;
  };
  const std::size_t size = request_at(at_);
  // A host that sends the same request again had a timeout, so the first request had no reply.
  const auto repeats = [&] {
    if (size == 0 || !stands_alone(size) || rest(at_ + size).size() < size) return false;
    const Bytes behind = rest(at_ + size);
    return std::equal(behind.begin(), behind.begin() + static_cast<std::ptrdiff_t>(size), rest(at_).begin());
  };
  const std::optional<std::size_t> which = request_before(channel_->run.begin(at_));
  if (which) {
    const Exchanges::PendingRequest& pending = exchanges_.waiting()[*which];
    if (pending.error != Error::none ||
        reply_at(pending.bytes(), at_, reply_sizes_[size_index(pending.bytes())]) != 0) {
      return match_reply();
    }
    if (!repeats() && judge_.is_incomplete(Direction::reply, rest(at_))) return 0;
  }
  if (repeats()) return match_request();
  const bool needs_no_reply = size != 0 && !judge_.is_answered({.bytes = rest(at_).first(size)});
  if (size != 0 && (needs_no_reply || answered(size))) return match_request();
  const bool sends_by_itself = judge_.streams() || (!exchanges_.has_request() && channel_->last_size != 0);
  return size == 0 && sends_by_itself ? match_unsolicited() : 0;
}

}  // namespace absenc::capture
