// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/raa38/serial/host.hpp"

#include <algorithm>

#include "absenc/protocol/author/look.hpp"

namespace absenc::raa38::serial {

// ---- Explanations

namespace {

bool is_on_bus(const Format& format, Bytes request) {
  return format.mode == Mode::bus || decode_request(request).has_value();
}

Explanation explain_other(const Format& format, Bytes request, Bytes reply) {
  if (reply.empty()) return {"a request is BC AA Bx or BC AA Cx", {}};
  const Result<Request> asked = decode_request(request);
  if (asked && asked->kind == Request::Kind::zero_clear) return {"nothing answers BC AA Cx", {}};
  if (!is_on_bus(format, request)) {
    return {"it is no frame: FF 81 is missing, or on a bus FF Bx", "check mode, baud and second_byte"};
  }
  return {"another unit answered, or no frame came: FF 81 or FF Bx answers BC AA Bx, with the same x",
          "check unit and second_byte; `absenc scan` shows who answers"};
}

// Returns cause and advice for the error with which a stream ends.
Explanation explain_stream(Error error) {
  switch (error) {
    case Error::timeout:
      return {"nothing comes: the encoder does not transmit by itself, or it was unplugged",
              "check supply, A/B polarity and baud rate; mode=handshake or mode=bus for an encoder that must be asked"};
    case Error::out_of_range:
      return {"the frames carry more bits than the option bits says", "set bits"};
    default:
      return {"something comes, but no two frames in a row",
              "check baud, parity, bits (their number of data bytes) and second_byte"};
  }
}

}  // namespace

Explanation explain(const Format& format, Error error, Bytes request, Bytes reply) {
  switch (error) {
    case Error::wrong_length:
      if (reply.empty()) return {"a request has three bytes: BC AA Bx or BC AA Cx", {}};
      return {
          "the frame has another number of bytes than the option bits makes: up to 16 bits make two data bytes, more "
          "make three",
          "check bits and baud"};
    case Error::bad_checksum:
      if (!is_on_bus(format, request)) return {};
      return {"two encoders with one number, or a bad line",
              "`absenc scan` shows who answers; check numbers, termination and baud"};
    case Error::unexpected_reply:
      return explain_other(format, request, reply);
    case Error::out_of_range:
      return {"the position has more bits than the option bits says", "set bits"};
    case Error::bad_framing:
      return format.mode == Mode::timing ? explain_stream(error) : Explanation{};
    case Error::timeout:
      if (format.mode == Mode::timing) return explain_stream(error);
      if (format.mode == Mode::bus) return {{}, "`absenc scan` shows who answers; check supply, A/B polarity and baud"};
      return {"no frame followed the pulse", "check the wire to CLK, its level, the pulse's width, supply and baud"};
    default:
      return {};
  }
}

// ---- Stream

Listen::Listen(const Format& format) : format_(format), decoder_(format) {}

ByteStep Listen::next(Time now) {
  if (taken_ < waiting_.size()) {
    take(waiting_[taken_++]);
    restart_timeout_ = true;
    return {.kind = ByteStep::Kind::emit};
  }
  // The time that the caller takes to process a result does not count towards the timeout.
  if (restart_timeout_) deadline_ = now + std::max(listen_limit, 4 * format_.period());
  restart_timeout_ = false;
  // Only emitted results extend the deadline; bytes that belong to no result do not.
  if (!done_ && now >= deadline_) end_stream();
  if (done_) return {.kind = ByteStep::Kind::done};
  return {.at = deadline_};
}

void Listen::feed(const ByteEvent& event) {
  if (done_) return;
  const auto keep = [this](const StreamFrame& found) { waiting_.push_back(found); };
  if (taken_ == waiting_.size()) {
    waiting_.clear();
    taken_ = 0;
  }
  if (event.kind == ByteEvent::Kind::received) {
    received_before_ = valid_count_ == 0 && !received_anything_ ? event.at : received_at_;
    received_at_ = event.at;
    received_anything_ = true;
    decoder_.feed(event.items, event.at, keep);
  } else if (event.kind == ByteEvent::Kind::line_error) {
    received_anything_ = true;
    decoder_.disturbed(keep);
  }
  counts_.discarded = decoder_.discarded();
}

void Listen::take(const StreamFrame& found) {
  error_ = Error::none;
  words_ = {};
  frame_.clear();
  if (found.error != Error::none) {
    frame_.append(decoder_.bad());
    return fail(found.error, {"a frame of the stream is damaged", {}});
  }
  frame_ = encode_position(format_, {found.singleturn, format_.own_second_byte()});
  const Time latched = std::max(latched_time(found), reading_.latched);
  reading_ = author::position_reading(found.singleturn, format_.bits);
  reading_.latched = latched;
  reading_.received = found.at;
  received_anything_ = false;
  ++valid_count_;
}

// Returns the time at which a frame is assumed to have been sent: frames that are received together are spread over
// their periods.
Time Listen::latched_time(const StreamFrame& found) const {
  if (found.at != received_at_) return found.at;
  const auto behind = static_cast<std::int64_t>(waiting_.size() - taken_);
  const auto together = static_cast<std::int64_t>(std::max<std::size_t>(waiting_.size(), 1));
  const Time each = format_.period() > Time{} ? format_.period() : (received_at_ - received_before_) / together;
  return received_at_ - behind * each;
}

void Listen::end_stream() {
  done_ = true;
  frame_.clear();
  const Error error = !received_anything_               ? Error::timeout
                      : decoder_.saw_larger_positions() ? Error::out_of_range
                                                        : Error::bad_framing;
  fail(error, explain_stream(error));
}

void Listen::fail(Error error, const Explanation& words) {
  error_ = error;
  words_ = words;
}

const Reading* Listen::reading() const { return error_ == Error::none && valid_count_ > 0 ? &reading_ : nullptr; }

void Listen::report(FieldSink& sink) const {
  if (reading() == nullptr) return;
  Values values = values_of(format_, {static_cast<std::uint32_t>(reading_.singleturn), format_.own_second_byte()});
  values.skipped = decoder_.skipped();
  fields.put(sink, values);
  sink.put_reading(reading_);
}

Exchange<std::uint8_t> Listen::exchange() const { return {{}, frame_.view(), received_at_, received_at_}; }

// ---- Procedures

namespace {

using namespace author;

constexpr unsigned scan_attempts = 2;

// Listens to the stream for the newest position; returns an error if no frame is found in time.
Part<Result<Position>> receive_frame(Dialog& dialog) {
  StreamDecoder decoder(dialog.format());
  Position position{.second_byte = dialog.format().own_second_byte()};
  bool found = false;
  bool anything = false;
  const auto keep = [&](const serial::StreamFrame& frame) {
    if (frame.error != Error::none) return;
    position.singleturn = frame.singleturn;
    found = true;
  };
  dialog.listen(std::max(listen_limit, 4 * dialog.format().period()));
  while (!found) {
    const Dialog::Heard heard = co_await dialog.heard();
    if (heard.over) {
      if (!anything) co_return Error::timeout;
      co_return decoder.saw_larger_positions() ? Error::out_of_range : Error::bad_framing;
    }
    anything = true;
    if (heard.bytes.empty()) decoder.disturbed(keep);
    decoder.feed(heard.bytes, dialog.received_at(), keep);
  }
  co_return position;
}

// Reads the next position: from the stream in timing mode, otherwise by a request or a pulse.
Part<Result<Position>> read_next_position(Dialog& dialog) {
  Result<Position> position = Error::timeout;
  if (dialog.format().mode == Mode::timing) {
    position = co_await receive_frame(dialog);
  } else {
    position = co_await dialog.attempt(position_request(dialog.format()));
  }
  co_return position;
}

}  // namespace

Procedure set_zero(Dialog& dialog, Values& found) {
  const Format& format = dialog.format();
  if (format.zeroing == Zeroing::none) {
    co_return {
        Error::unsupported, "nothing is known of a way to set the zero of this encoder",
        "an encoder that was ordered with zero clearing: zeroing=line (a wire to CLR) or zeroing=command (a bus)"};
  }
  if (format.zeroing == Zeroing::command && format.mode != Mode::bus) {
    co_return {Error::invalid_argument, "BC AA Cx is a command of a bus",
               "set mode=bus, or zeroing=line for a wire to CLR"};
  }
  const Result<Position> first = co_await read_next_position(dialog);
  if (!first) co_return {first.error()};
  co_await dialog.rest(between_looks);
  const Result<Position> second = co_await read_next_position(dialog);
  if (!second) co_return {second.error()};
  const Outcome objection = objection_to_zero(position_reading(first->singleturn, format.bits),
                                              position_reading(second->singleturn, format.bits));
  if (objection.error != Error::none) co_return objection;
  const Request by_command{Request::Kind::zero_clear, format.zeroed_unit()};
  co_await dialog.ask(format.zeroing == Zeroing::line ? Request{Request::Kind::clear} : by_command).changes();
  // The encoder does not confirm zero clearing, so the position is polled.
  const Time deadline = dialog.received_at() + zero_limit;
  Result<Position> now = Error::timeout;
  bool is_zero = false;
  do {
    co_await dialog.rest(zero_poll);
    now = co_await read_next_position(dialog);
    found = values_of(format, *now);
    found.before = second->singleturn;
    is_zero = now && is_near(now->singleturn, 0, format.bits, zero_millidegrees);
  } while (!is_zero && dialog.received_at() < deadline);
  if (!now) {
    co_return only(now.error(), "the zero was set, but the position could not be read back",
                   "read the encoder to see what it is now");
  }
  note_zero(dialog, second->singleturn, now->singleturn, format.bits);
  if (is_zero) co_return done;
  co_return only(Error::cross_check_failed, "the position is not zero after the zero was set",
                 "let the shaft stand still; check the wire to CLR (below 0.5 V), or zero_unit, and that the encoder "
                 "has it");
}

Procedure scan(Dialog& dialog, Units& found) {
  dialog.listen(scan_silence);
  for (Dialog::Heard heard{}; !heard.over;) {
    heard = co_await dialog.heard();
    if (heard.bytes.empty()) continue;
    co_return only(Error::unexpected_reply, "something comes although nobody asks",
                   "an encoder that transmits by itself has no number: mode=timing, and nothing to scan for");
  }
  bool any = false;
  for (unsigned i = 0; i < unit_count; ++i) {
    Result<Position> reply = Error::timeout;
    for (unsigned attempt = 0; attempt < scan_attempts && !reply; ++attempt) {
      reply = co_await dialog.attempt({Request::Kind::read, static_cast<std::uint8_t>(i)});
      if (dialog.is_noisy()) co_return {reply.error()};
      if (reply.error() == Error::timeout) break;
    }
    if (reply.error() == Error::timeout) continue;
    any = true;
    if (reply) found[i] = values_of(dialog.format(), *reply);
    found[i].encoder_address = static_cast<std::uint8_t>(i);
    found[i].clash = !reply;
  }
  if (any) co_return done;
  co_return only(Error::timeout, "no number from 0 to F is answered",
                 "check supply, A/B polarity and baud, and that the encoder is one with bus commands");
}

}  // namespace absenc::raa38::serial
