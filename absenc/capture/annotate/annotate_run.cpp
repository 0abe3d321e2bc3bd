// SPDX-License-Identifier: Apache-2.0
// Splits the characters between two pauses into frames: finds requests, replies, and the extent of bytes that are
// neither.
#include <algorithm>

#include "absenc/capture/annotate/annotate.hpp"

namespace absenc::capture {

namespace {

// number of characters that are examined beyond a frame to judge it: more than two frames of usual length
constexpr std::size_t lookahead = 160;

}  // namespace

// ---- Checks, which consume nothing

Piece Annotator::piece(std::size_t size) const {
  const Run& run = channel_->run;
  return {rest(at_).first(size), run.begin(at_), run.end(at_ + size - 1)};
}

// Returns the size of a good reply to `request` at index `from`, or 0 if there is none. `usual`: likely size of the
// reply, or 0.
std::size_t Annotator::reply_at(Bytes request, std::size_t from, std::size_t usual) {
  const Bytes bytes = rest(from);
  const auto is_good = [&](std::size_t size) {
    return channel_->run.clean(from, size) &&
           judge_.decode({.bytes = request}, {.bytes = bytes.first(size)}) == Error::none;
  };
  if (bytes.empty()) return 0;
  if (whole_ && bytes.size() <= lookahead && is_good(bytes.size())) return bytes.size();
  if (usual != 0 && usual <= bytes.size() && is_good(usual)) return usual;
  // With arrival times, the missing characters of the reply may still arrive.
  if (settings_.by_arrival && !whole_ && usual > bytes.size()) return 0;
  const std::size_t size = judge_.frame_size(Direction::reply, bytes);
  return size != 0 && size <= bytes.size() && is_good(size) ? size : 0;
}

std::size_t Annotator::request_at(std::size_t from) {
  const Bytes bytes = rest(from);
  if (bytes.empty()) return 0;
  const std::size_t size = judge_.request_size(bytes);
  return size != 0 && channel_->run.clean(from, size) ? size : 0;
}

// Returns whether several good frames follow each other from index `from` on: a single one may be an accident.
bool Annotator::good_from(std::size_t from) {
  const std::size_t end = channel_->run.size();
  const auto is_end = [&](std::size_t at) { return whole_ && at == end; };
  if (channel_->carries != Carries::replies) {
    const std::size_t first = request_at(from);
    const bool requests = channel_->carries == Carries::requests;
    std::size_t second = 0;
    if (first != 0 && requests) second = request_at(from + first);
    if (first != 0 && !requests && may_turn(from + first)) {
      second = reply_at(rest(from).first(first), from + first);
    }
    const std::size_t third = from + first + second;
    if (second != 0 && (is_end(third) || request_at(third) != 0)) return true;
  }
  if (channel_->carries == Carries::requests) return false;
  const std::size_t first = reply_at({}, from);
  const std::size_t second = first == 0 ? 0 : reply_at({}, from + first);
  const std::size_t third = from + first + second;
  return second != 0 && (is_end(third) || reply_at({}, third) != 0);
}

bool Annotator::may_turn(std::size_t at) const {
  const Run& run = channel_->run;
  return at < run.size() && run.begin(at) - std::min(run.begin(at), run.end(at - 1)) >= settings_.ticks.turnaround / 4;
}

// ---- Parsing, which consumes characters

std::size_t Annotator::next_frame() {
  if (!whole_ && channel_->run.size() - at_ <= lookahead) return settings_.by_arrival ? whole_frame() : 0;
  std::size_t taken = 0;
  if (channel_->carries != Carries::requests) {
    taken = match_reply();
    if (taken == 0) taken = match_repeated();
  }
  const auto waiting = exchanges_.waiting();
  if (taken == 0 && !waiting.empty() && exchanges_.overdue(waiting[0], channel_->run.begin(at_))) {
    exchanges_.report_unanswered(1);
  }
  if (taken == 0 && channel_->carries != Carries::replies) taken = match_request();
  if (taken == 0 && channel_->carries != Carries::requests) taken = match_unsolicited();
  return taken != 0 ? taken : take_bad();
}

// Returns the index of the newest outstanding request that ended at the tick `begin` or earlier; nothing if there is
// none.
std::optional<std::size_t> Annotator::request_before(Tick begin) const {
  const auto waiting = exchanges_.waiting();
  for (std::size_t i = waiting.size(); i-- > 0;) {
    if (waiting[i].end <= begin) return i;
  }
  return std::nullopt;
}

std::size_t Annotator::match_reply() {
  const Tick begin = channel_->run.begin(at_);
  const std::optional<std::size_t> which = request_before(begin);
  if (!which) return 0;
  const Exchanges::PendingRequest& pending = exchanges_.waiting()[*which];
  const bool overdue = exchanges_.overdue(pending, begin);
  if (pending.error != Error::none) {
    // The outstanding request is damaged; a good reply in time shows that an encoder answered it all the same.
    const std::size_t size = overdue ? 0 : reply_at({}, at_);
    if (size != 0) exchanges_.report_reply(*which, piece(size), pending.error, pending.remark, {});
    return size;
  }
  std::size_t& usual = reply_sizes_[size_index(pending.bytes())];
  const std::size_t size = reply_at(pending.bytes(), at_, usual);
  const bool leaves_rest = whole_ && size < rest(at_).size();
  if (size == 0 || leaves_rest) {
    // Some replies equal their requests, and an encoder may send a reply twice: such bytes are no echo.
    const bool may_be_accident = size == 0 || size > pending.bytes().size();
    // Bytes that equal the request but come late are a repetition of the request, no echo.
    const bool is_late = settings_.ticks.turnaround != 0 && begin > pending.end + 2 * settings_.ticks.turnaround;
    // A tap, whose characters have arrival times, receives no echo: bytes that equal the request are a repeated
    // request.
    const bool may_be_echo = !is_late && !settings_.by_arrival;
    const std::size_t echoed = may_be_accident && may_be_echo ? echoed_reply_size(pending.bytes(), at_) : 0;
    if (echoed != 0 && (size == 0 || echoed == rest(at_).size())) return match_echoed_reply(*which, echoed);
    if (size == 0) return 0;
  }
  // Some replies equal their requests. If the reply is overdue, such bytes are more likely a request.
  if (overdue && channel_->carries == Carries::both && request_at(at_) == size) return 0;
  if (leaves_rest && usual != 0 && size != usual && !is_followed_by_frame(size)) return 0;
  last_reply_at_ = at_;
  last_reply_size_ = usual = size;
  if (settings_.by_arrival) {
    channel_->at_frame_start = true;
    channel_->last_size = 0;  // the host sent a request, so a stream of unsolicited frames has ended
  }
  // Looking ahead may have changed the content stored in `judge_`, so this reply is decoded again.
  if (leaves_rest || overdue) {
    static_cast<void>(judge_.decode({.bytes = pending.bytes()}, {.bytes = rest(at_).first(size)}));
  }
  exchanges_.report_reply(*which, piece(size), Error::none, Remark::none, judge_.contents());
  return size;
}

// Returns whether the `size` bytes at `at_` are followed by a good request, or by the same bytes again.
bool Annotator::is_followed_by_frame(std::size_t size) {
  const Bytes behind = rest(at_ + size);
  const Bytes reply = rest(at_).first(size);
  return request_at(at_ + size) != 0 ||
         (behind.size() >= size && std::equal(reply.begin(), reply.end(), behind.begin()));
}

// Returns whether all characters from index `from` to the next pause are the encoder's refusal of `request`.
bool Annotator::is_refusal(Bytes request, std::size_t from) {
  const Bytes bytes = rest(from);
  return channel_->run.clean(from, bytes.size()) &&
         judge_.decode({.bytes = request}, {.bytes = bytes}) == Error::request_rejected;
}

// Returns the total size of an echo of `request` at index `from` and the reply or refusal behind the echo; 0 if there
// is no echo.
std::size_t Annotator::echoed_reply_size(Bytes request, std::size_t from) {
  const Bytes bytes = rest(from);
  if (bytes.size() <= request.size() || !std::equal(request.begin(), request.end(), bytes.begin())) return 0;
  if (whole_ && is_refusal(request, from + request.size())) return bytes.size();
  const std::size_t size = reply_at(request, from + request.size());
  return size == 0 ? 0 : request.size() + size;
}

std::size_t Annotator::match_echoed_reply(std::size_t which, std::size_t size) {
  const Bytes request = exchanges_.waiting()[which].bytes();
  const std::size_t echo = request.size();
  at_ += echo;
  const Piece reply = piece(size - echo);
  const Error error = judge_.decode({.bytes = request}, {.bytes = reply.bytes});
  exchanges_.report_reply(which, reply, error, Remark::echo, judge_.contents());
  at_ -= echo;
  return size;
}

std::size_t Annotator::match_repeated() {
  const std::size_t size = last_reply_size_;
  if (size == 0 || last_reply_at_ + size != at_ || rest(at_).size() < size) return 0;
  const Bytes before = channel_->run.bytes().subspan(last_reply_at_, size);
  if (!std::equal(before.begin(), before.end(), rest(at_).begin())) return 0;
  if (judge_.streams()) return 0;
  // A request may equal the reply before it; a good reply after these bytes shows that they are a request.
  if (channel_->carries == Carries::both && may_turn(at_ + size) && reply_at(rest(at_).first(size), at_ + size) != 0) {
    return 0;
  }
  exchanges_.report_unpaired(Annotation::Kind::reply, piece(size), Error::unexpected_reply, Remark::repeated);
  return size;
}

std::size_t Annotator::match_request() {
  const std::size_t size = request_at(at_);
  if (size == 0 || !is_request(size)) return 0;
  if (channel_->carries == Carries::both) exchanges_.report_unanswered(exchanges_.waiting().size());
  // At the begin of a capture, the bytes may be a reply that equals its request.
  const bool may_be_reply = is_first_ && channel_->carries == Carries::both && reply_at({}, at_) == size;
  exchanges_.add_request(piece(size), Error::none, may_be_reply ? Remark::cut : Remark::none, true);
  last_reply_size_ = 0;
  return size;
}

// Returns whether the good request of `size` bytes at `at_` was sent by the host: the same bytes may also begin a
// reply.
bool Annotator::is_request(std::size_t size) {
  const Channel& channel = *channel_;
  const bool is_rest = whole_ && size == rest(at_).size();
  if (channel.carries == Carries::requests) return channel.at_frame_start || good_from(at_);
  if (is_rest) {
    const auto waiting = exchanges_.waiting();
    if (waiting.empty() || at_ != 0) return channel.at_frame_start;
    // No host is expected to repeat a request within twice the turnaround time.
    const Tick silence = channel.run.begin(at_) - std::min(channel.run.begin(at_), waiting.back().end);
    return settings_.ticks.turnaround == 0 || silence > 2 * settings_.ticks.turnaround;
  }
  // After a complete exchange the host sends next, unless the encoder sends unsolicited frames.
  const bool is_turn_of_host = settings_.by_arrival && channel.at_frame_start && channel.last_size == 0 &&
                               exchanges_.has_request() && exchanges_.waiting().empty() && !judge_.streams();
  if (is_turn_of_host) return true;
  const bool turns = may_turn(at_ + size);
  const Bytes request = rest(at_).first(size);
  const bool answered = turns && (reply_at(request, at_ + size) != 0 ||
                                  echoed_reply_size(request, at_ + size) == rest(at_ + size).size() ||
                                  (whole_ && is_refusal(request, at_ + size)));
  const std::size_t as_reply = reply_at({}, at_);
  if (as_reply != 0 && (!answered || channel.last_size != 0)) return false;
  if (answered) return true;
  if (settings_.by_arrival && channel.at_frame_start && stands_alone(size)) return true;
  const auto waiting = exchanges_.waiting();
  const bool expects_reply = !waiting.empty() && judge_.is_answered({.bytes = waiting.back().bytes()});
  return turns && channel.at_frame_start && exchanges_.has_request() && !expects_reply && !judge_.streams();
}

std::size_t Annotator::match_unsolicited() {
  const bool streams = judge_.streams();
  // After an outstanding request no frame is taken as unsolicited, unless the encoder is known to stream.
  if (!streams && request_before(channel_->run.begin(at_))) return 0;
  const std::size_t size = reply_at({}, at_, channel_->last_size);
  if (size == 0) return 0;
  const bool trusted = channel_->at_frame_start || good_from(at_);
  if (!trusted) return 0;
  channel_->at_frame_start = true;
  channel_->last_size = channel_->stream_size = size;
  last_reply_size_ = 0;
  const bool good = streams || !exchanges_.has_request();
  // Looking ahead may have changed the content stored in `judge_`, so this frame is decoded again.
  static_cast<void>(judge_.decode({}, {.bytes = rest(at_).first(size)}));
  exchanges_.report_unpaired(Annotation::Kind::reply, piece(size), good ? Error::none : Error::unexpected_reply,
                             good ? Remark::none : Remark::unsolicited, good ? judge_.contents() : Contents{});
  return size;
}

std::size_t Annotator::take_bad() {
  const std::size_t size = bad_size();
  report_bad(size);
  last_reply_size_ = 0;
  channel_->at_frame_start = true;  // bad bytes mostly end where a good frame begins, or at the next pause
  if (!whole_ && !good_from(at_ + size)) channel_->at_frame_start = false;
  return size;
}

std::size_t Annotator::bad_size() {
  const std::size_t left = rest(at_).size();
  // In a stream of unsolicited frames a bad frame mostly has the size of the good frames.
  const std::size_t period = channel_->last_size;
  if (channel_->at_frame_start && period != 0 && period < left && reply_at({}, at_ + period) != 0) return period;
  // If a good unsolicited frame ends at the next pause, all bytes before this frame are the bad ones.
  const std::size_t last = channel_->stream_size;
  if (judge_.streams() && whole_ && last != 0 && last < left && reply_at({}, at_ + left - last) == last)
    return left - last;
  // Returns whether exactly one good request follows `size` bad bytes and ends at the next pause.
  const auto ends_before_request = [&](std::size_t size) {
    return size != 0 && size < left && request_at(at_ + size) == left - size;
  };
  if (channel_->carries == Carries::both && whole_) {
    const std::optional<std::size_t> which = request_before(channel_->run.begin(at_));
    const std::size_t usual = which ? reply_sizes_[size_index(exchanges_.waiting()[*which].bytes())] : 0;
    if (ends_before_request(usual)) return usual;
    const std::size_t size = judge_.frame_size(Direction::reply, rest(at_));
    if (ends_before_request(size)) return size;
  }
  // A damaged reply may still have the usual length of a reply to this request, with a pause after it.
  if (const auto pending = request_before(channel_->run.begin(at_)); settings_.by_arrival && pending) {
    const std::size_t usual = reply_sizes_[size_index(exchanges_.waiting()[*pending].bytes())];
    for (const std::size_t size : {usual, judge_.frame_size(Direction::reply, rest(at_))}) {
      if (size != 0 && size < left && has_gap(at_ + size)) return size;
    }
  }
  const std::size_t most = whole_ ? left : left - lookahead / 2;
  for (std::size_t i = 1; i < most; ++i) {
    if (has_gap(at_ + i) || good_from(at_ + i)) return i;
  }
  return most;
}

void Annotator::report_bad(std::size_t size) {
  using Kind = Annotation::Kind;
  const Piece bad = piece(size);
  const bool is_end = whole_ && size == rest(at_).size();
  const bool damaged = !channel_->run.clean(at_, size);
  const auto error_of = [&](const Frame& request, const Frame& reply) {
    const Error error = damaged ? Error::bad_framing : judge_.decode(request, reply);
    return error == Error::none ? Error::bad_framing : error;
  };
  Remark remark = damaged ? Remark::damaged : Remark::none;
  const bool cut = is_first_ || (cut_ && is_end);
  if (cut) remark = Remark::cut;
  const auto unless_cut = [cut](Error error) { return cut ? Error::none : error; };

  if (channel_->carries == Carries::requests) {
    return exchanges_.report_unpaired(Kind::request, bad, unless_cut(error_of({.bytes = bad.bytes}, {})), remark);
  }
  const std::optional<std::size_t> which = request_before(bad.begin);
  if (which) {
    const Error error = error_of({.bytes = exchanges_.waiting()[*which].bytes()}, {.bytes = bad.bytes});
    return exchanges_.report_reply(*which, bad, unless_cut(error), remark, {});
  }
  const bool may_be_request = channel_->carries == Carries::both && is_end && at_ == 0 && !judge_.streams();
  if (may_be_request && !cut && exchanges_.has_request()) {
    return exchanges_.add_request(bad, error_of({.bytes = bad.bytes}, {}), remark, false);
  }
  const Kind kind = channel_->carries == Carries::both && !judge_.streams() ? Kind::noise : Kind::reply;
  exchanges_.report_unpaired(kind, bad, unless_cut(error_of({}, {.bytes = bad.bytes})), remark);
}

}  // namespace absenc::capture
