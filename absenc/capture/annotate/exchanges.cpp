// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/annotate/exchanges.hpp"

#include <algorithm>

namespace absenc::capture {

std::string_view text_of(Remark remark) {
  switch (remark) {
    case Remark::none:
      break;
    case Remark::unanswered:
      return "nobody answered";
    case Remark::unsolicited:
      return "a reply that nobody asked for";
    case Remark::repeated:
      return "the reply before came once more";
    case Remark::echo:
      return "the request came back before its reply";
    case Remark::late:
      return "the reply came after any host has given up";
    case Remark::damaged:
      return "a character has a wrong parity or stop bit";
    case Remark::undocumented:
      return "no document says what this is answered";
    case Remark::cut:
      return "the capture begins or ends here";
  }
  return {};
}

void Exchanges::ask(const Piece& request, Error error, Remark remark, bool is_request) {
  if (waiting_ == capacity) give_up(1);
  Asked& asked = asked_[waiting_++];
  asked.size = std::min(request.bytes.size(), Asked::capacity);
  std::copy_n(request.bytes.begin(), asked.size, asked.storage.begin());
  asked.begin = request.begin;
  asked.end = request.end;
  asked.error = error;
  asked.remark = remark;
  asked.is_request = is_request;
  if (error == Error::none) has_asked_ = true;
}

void Exchanges::answer(std::size_t which, const Piece& reply, Error error, Remark remark, const Contents& contents) {
  if (which > 0) give_up(which);
  const Asked& asked = asked_[0];
  Annotation annotation{.kind = Annotation::Kind::exchange,
                        .remark = remark,
                        .error = error,
                        .begin = asked.begin,
                        .end = reply.end,
                        .request = {.bytes = asked.bytes()},
                        .reply = {.bytes = reply.bytes},
                        .contents = contents};
  if (reply.begin >= asked.end) annotation.turnaround = reply.begin - asked.end;
  const bool whole = remark == Remark::none || remark == Remark::echo;
  if (error == Error::unsupported && whole && !judge_.is_answered(annotation.request)) {
    annotation.error = Error::none;
    annotation.remark = Remark::undocumented;
  } else if (error == Error::none && remark != Remark::cut && overdue(asked, reply.begin)) {
    annotation.error = Error::timeout;
    annotation.remark = Remark::late;
    annotation.contents = {};
  }
  sink_.put(annotation);
  forget(1);
}

void Exchanges::give_up(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) tell_unanswered(asked_[i], false);
  forget(count);
}

void Exchanges::alone(Annotation::Kind kind, const Piece& piece, Error error, Remark remark, const Contents& contents) {
  Annotation annotation{
      .kind = kind, .remark = remark, .error = error, .begin = piece.begin, .end = piece.end, .contents = contents};
  (kind == Annotation::Kind::request ? annotation.request : annotation.reply).bytes = piece.bytes;
  sink_.put(annotation);
}

void Exchanges::finish(Tick end) {
  for (const Asked& asked : waiting()) tell_unanswered(asked, !overdue(asked, end));
  forget(waiting_);
}

void Exchanges::tell_unanswered(const Asked& asked, bool cut) {
  const Piece piece{asked.bytes(), asked.begin, asked.end};
  if (asked.error != Error::none) {
    alone(asked.is_request ? Annotation::Kind::request : Annotation::Kind::noise, piece, asked.error, asked.remark);
  } else if (!judge_.is_answered({.bytes = asked.bytes()})) {
    static_cast<void>(judge_.decode({.bytes = asked.bytes()}, {}));
    alone(Annotation::Kind::request, piece, Error::none, Remark::none, judge_.contents());
  } else if (cut || asked.remark == Remark::cut) {
    alone(Annotation::Kind::request, piece, Error::none, Remark::cut);
  } else {
    alone(Annotation::Kind::request, piece, Error::timeout, Remark::unanswered);
  }
}

void Exchanges::forget(std::size_t count) {
  for (std::size_t i = count; i < waiting_; ++i) asked_[i - count] = asked_[i];
  waiting_ -= count;
}

}  // namespace absenc::capture
