// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/procedure.hpp"

#include "absenc/protocol/esl/probe.hpp"
#include "absenc/protocol/esl/safety.hpp"

namespace absenc::esl {

namespace {

using ByteStep = Step<std::uint8_t>;

void add_change(Sentence& sentence, const Profile& profile, Bytes reply) {
  const Change change = find_change(profile, {.reply = reply});
  for (std::size_t i = 0; i < change.count; ++i) {
    const Option& option = options[change.options[i].option];
    sentence.add(i == 0 ? "; the reply is good with the profile " : " ");
    sentence.add(option.name).add("=").add(option.choices[static_cast<std::size_t>(change.options[i].value)]);
  }
}

}  // namespace

bool Procedure::selects_page() const {
  return request_.id == DataId::write_memory && request_.memory_address == page_select_address;
}

void Procedure::ask(const Request& request, Time earliest) {
  request_ = request;
  request_bytes_ = encode_request(profile_, request);
  const bool writes = request.id == DataId::write_memory && !selects_page();
  const bool once = writes || is_reset(request.id) || request.id == DataId::encoder_id;
  attempts_left_ = once ? 1 : read_attempts_;
  start(earliest);
}

void Procedure::start(Time earliest) {
  earliest_ = earliest;
  --attempts_left_;
  state_ = State::ready;
}

void Procedure::finish(Error error, std::string_view detail) {
  error_ = error;
  if (error == Error::none) detail_.clear();
  detail_.add_part(detail);
  state_ = State::done;
  // What was not answered well may be going on in the encoder all the same: whoever comes next must find it ended.
  if (error != Error::none && is_memory_access(request_.id) && sent_at_ != Time{}) {
    earliest_ = received_at_ + pause_before_repeat();
    state_ = State::ending;
  }
}

ByteStep Procedure::next(Time now) {
  if (emit_pending_) {
    emit_pending_ = false;
    return {.kind = ByteStep::Kind::emit};
  }
  if (state_ == State::ending) {
    if (now < earliest_) return {.at = earliest_};
    state_ = State::done;
  }
  ByteStep step{.expect = expected(), .at = never, .answer = answer_limit, .gap = gap_limit};
  switch (state_) {
    case State::ready:
      begin_request();
      reply_bytes_.clear();
      detail_.clear();
      step.kind = ByteStep::Kind::transfer;
      step.out = request_bytes_;
      step.at = earliest_;
      break;
    case State::sending:
      break;
    case State::receiving:
      step.expect -= reply_bytes_.size();
      break;
    case State::settling:
      step.expect = 0;
      break;
    case State::ending:
    case State::done:
      step.kind = ByteStep::Kind::done;
      break;
  }
  return step;
}

void Procedure::received(Bytes bytes) {
  for (const std::uint8_t byte : bytes) reply_bytes_.push_back(byte);
  if (state_ != State::receiving || reply_bytes_.size() < expected()) return;
  Reply reply;
  check_ = check_reply(profile_, request_, reply_bytes_, reply);
  // After anything that is wrong more may be coming: wait for silence before sending again.
  if (check_ == Check::passed) return answered(reply);
  state_ = State::settling;
}

void Procedure::conclude() {
  Error error = Error::wrong_length;  // disturbed: bytes that are not this reply's
  check_ = Check::length;
  if (reply_bytes_.empty()) {
    error = disturbed_ ? Error::bad_framing : Error::timeout;
  } else if (!disturbed_ && !is_noisy()) {
    Reply reply;
    check_ = check_reply(profile_, request_, reply_bytes_, reply);
    error = error_of(check_);
  }
  if (attempts_left_ > 0 && !is_noisy()) return start(received_at_ + pause_before_repeat());
  explain(error);
  failed(error);
}

// A page change that was not answered well may be going on all the same, and so may the reading of an EEPROM byte.
Time Procedure::pause_before_repeat() const {
  if (selects_page()) return page_time;
  return is_memory_access(request_.id) ? eeprom_read_time + 20us : Time{};
}

void Procedure::explain(Error error) {
  detail_.clear();
  if (error == Error::timeout) {
    detail_.add("it is also silent when request_crc, crc_bit_order or address is another");
    if (is_memory_access(request_.id))
      detail_.add_part("and to memory requests when others share its line (Figure 18)");
    return;
  }
  if (is_noisy()) {
    detail_.add(noise_explanation().found);
    return;
  }
  if (disturbed_) return;
  detail_.add(text_of(check_).sentence);
  add_change(detail_, profile_, reply_bytes_);
}

Exchange<std::uint8_t> Procedure::exchange() const { return {request_bytes_, reply_bytes_, sent_at_, received_at_}; }

Reading Procedure::reading_of(const Reply& reply) const {
  Reading reading = to_reading(reply);
  reading.latched = latch_time(profile_, sent_at_);
  reading.received = received_at_;
  return reading;
}

}  // namespace absenc::esl
