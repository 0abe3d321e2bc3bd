// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/annotate/exchanges.hpp"

#include <algorithm>

namespace absenc::capture {

std::string_view text_of(Remark remark) {
  switch (remark) {
    case Remark::none:
      break;
    case Remark::unanswered:
      return "no encoder answered";
    case Remark::unsolicited:
      return "an unsolicited reply";
    case Remark::repeated:
      return "the previous reply was sent again";
    case Remark::echo:
      return "the request was received again before its reply";
    case Remark::late:
      return "the reply arrived after the timeout of every host";
    case Remark::damaged:
      return "a character has a wrong parity or stop bit";
    case Remark::undocumented:
      return "no document states a reply to this request";
    case Remark::cut:
      return "the capture begins or ends here";
  }
  return {};
}

void Exchanges::add_request(const Piece& request, Error error, Remark remark, bool is_request) {
  if (count_ == capacity) report_unanswered(1);
  PendingRequest& pending = pending_[count_++];
  pending.size = std::min(request.bytes.size(), PendingRequest::capacity);
  std::copy_n(request.bytes.begin(), pending.size, pending.storage.begin());
  pending.begin = request.begin;
  pending.end = request.end;
  pending.error = error;
  pending.remark = remark;
  pending.is_request = is_request;
  if (error == Error::none) has_request_ = true;
}

void Exchanges::report_reply(std::size_t which, const Piece& reply, Error error, Remark remark,
                             const Contents& contents) {
  if (which > 0) report_unanswered(which);
  const PendingRequest& pending = pending_[0];
  Annotation annotation{.kind = Annotation::Kind::exchange,
                        .remark = remark,
                        .error = error,
                        .begin = pending.begin,
                        .end = reply.end,
                        .request = {.bytes = pending.bytes()},
                        .reply = {.bytes = reply.bytes},
                        .contents = contents};
  if (reply.begin >= pending.end) annotation.turnaround = reply.begin - pending.end;
  const bool whole = remark == Remark::none || remark == Remark::echo;
  if (error == Error::unsupported && whole && !judge_.is_answered(annotation.request)) {
    annotation.error = Error::none;
    annotation.remark = Remark::undocumented;
  } else if (error == Error::none && remark != Remark::cut && overdue(pending, reply.begin)) {
    annotation.error = Error::timeout;
    annotation.remark = Remark::late;
    annotation.contents = {};
  }
  sink_.put(annotation);
  remove(1);
}

void Exchanges::report_unanswered(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) report_request(pending_[i], false);
  remove(count);
}

void Exchanges::report_unpaired(Annotation::Kind kind, const Piece& piece, Error error, Remark remark,
                                const Contents& contents) {
  Annotation annotation{
      .kind = kind, .remark = remark, .error = error, .begin = piece.begin, .end = piece.end, .contents = contents};
  (kind == Annotation::Kind::request ? annotation.request : annotation.reply).bytes = piece.bytes;
  sink_.put(annotation);
}

void Exchanges::finish(Tick end) {
  for (const PendingRequest& pending : waiting()) report_request(pending, !overdue(pending, end));
  remove(count_);
}

void Exchanges::report_request(const PendingRequest& pending, bool cut) {
  const Piece piece{pending.bytes(), pending.begin, pending.end};
  if (pending.error != Error::none) {
    report_unpaired(pending.is_request ? Annotation::Kind::request : Annotation::Kind::noise, piece, pending.error,
                    pending.remark);
  } else if (!judge_.is_answered({.bytes = pending.bytes()})) {
    static_cast<void>(judge_.decode({.bytes = pending.bytes()}, {}));
    report_unpaired(Annotation::Kind::request, piece, Error::none, Remark::none, judge_.contents());
  } else if (cut || pending.remark == Remark::cut) {
    report_unpaired(Annotation::Kind::request, piece, Error::none, Remark::cut);
  } else {
    report_unpaired(Annotation::Kind::request, piece, Error::timeout, Remark::unanswered);
  }
}

void Exchanges::remove(std::size_t count) {
  for (std::size_t i = count; i < count_; ++i) pending_[i - count] = pending_[i];
  count_ -= count;
}

}  // namespace absenc::capture
