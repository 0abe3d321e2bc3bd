// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/annotate/annotate_frames.hpp"

#include <algorithm>
#include <utility>

namespace absenc::capture {

// ---- Bursts

// Returns the encoder's word in a burst; `with_last` appends the level of the data line after the last clock as one
// more bit.
Frame BurstAnnotator::word_of(const Burst& burst, bool with_last) {
  const bool rises = burst.low_before && judge_.unit().control_bit != nullptr;
  const std::size_t idle = judge_.unit().line.idle_clocks + (rises ? 1u : 0u);
  if (!with_last && (idle == 0 || burst.bits <= idle)) return {.bytes = burst.in, .bits = burst.bits};
  const std::size_t bits = burst.bits - std::min(idle, burst.bits) + (with_last ? 1 : 0);
  shifted_.assign((bits + 7) / 8, 0);
  for (std::size_t i = 0; i < bits; ++i) {
    const std::size_t from = i + idle;
    const unsigned bit = from < burst.bits ? burst.in[from / 8] >> (7 - from % 8) & 1u : burst.last ? 1u : 0u;
    shifted_[i / 8] = static_cast<std::uint8_t>(shifted_[i / 8] | bit << (7 - i % 8));
  }
  return {.bytes = shifted_, .bits = bits};
}

void BurstAnnotator::put(const Burst& burst) {
  if (burst.bits == 0) return;
  if (control_.settle(burst.fell_before)) sink_.put(control_.annotation(judge_));
  Annotation annotation{.kind = Annotation::Kind::reply, .begin = burst.begin, .end = burst.end};
  if (judge_.unit().link == LinkKind::clocked_bidirectional) {
    decode_both_ways(burst, annotation);
  } else if (judge_.unit().link == LinkKind::clocked) {
    decode_word(burst, annotation);
  } else {
    decode_exchange(burst, annotation);
  }
  if (annotation.error == Error::none) {
    annotation.contents = judge_.contents();
  } else if (burst.cut) {
    annotation.error = Error::none;
    annotation.remark = Remark::cut;
  }
  sink_.put(annotation);
}

// Decodes a burst as a word; sets `answered` to whether the encoder's control bit was sampled as 1.
Error BurstAnnotator::decode_as(const Burst& burst, bool with_last, Frame& word, bool& answered) {
  word = word_of(burst, with_last);
  const std::optional<std::size_t> place = judge_.control_bit(word);
  answered = place && (word.bytes[*place / 8] >> (7 - *place % 8) & 1) != 0;
  if (answered && control_.may_answer()) {
    silenced_.assign(word.bytes.begin(), word.bytes.end());
    silenced_[*place / 8] = static_cast<std::uint8_t>(silenced_[*place / 8] & ~(0x80u >> *place % 8));
    word.bytes = silenced_;
  }
  return judge_.decode({}, word);
}

void BurstAnnotator::decode_word(const Burst& burst, Annotation& annotation) {
  bool answered = false;
  annotation.error = decode_as(burst, false, annotation.reply, answered);
  // A host that gives only one clock per bit samples the word's last bit behind the last clock.
  if (annotation.error != Error::none && burst.has_last && !burst.cut) {
    const bool good = decode_as(burst, true, annotation.reply, answered) == Error::none;
    annotation.error = good ? Error::none : decode_as(burst, false, annotation.reply, answered);
  }
  if (judge_.unit().control_bit != nullptr) control_.put(burst, answered, annotation.error);
}

void BurstAnnotator::finish() {
  if (control_.settle(false)) sink_.put(control_.annotation(judge_));
  if (!control_.finish()) return;
  Annotation annotation = control_.annotation(judge_);
  if (annotation.error != Error::none) {
    annotation.error = Error::none;
    annotation.remark = Remark::cut;
    annotation.contents = {};
  }
  sink_.put(annotation);
}

void ControlFrames::CollectedBits::add(bool bit) {
  if (size % 8 == 0) bytes.push_back(0);
  if (bit) bytes.back() = static_cast<std::uint8_t>(bytes.back() | 0x80u >> size % 8);
  ++size;
}

void ControlFrames::put(const Burst& burst, bool answered, Error error) {
  pending_ = {burst.begin, burst.end, burst.low_after, answered, error};
}

bool ControlFrames::settle(bool fell) {
  if (!pending_) return false;
  const Pending word = *std::exchange(pending_, std::nullopt);
  const bool asks = word.low_after || fell;
  const unsigned before = zeros_seen_;
  zeros_seen_ = asks ? 0 : std::min(zeros_seen_ + 1, zeros);
  if (!open_) {
    if (!asks || before < zeros) return false;
    open_ = true;
    request_bits_ = {};
    reply_bits_ = {};
    begin_ = word.begin;
    error_ = Error::none;
  }
  request_bits_.add(asks);
  reply_bits_.add(word.answered);
  end_ = word.end;
  if (error_ == Error::none) error_ = word.error;
  open_ = zeros_seen_ < zeros;
  return !open_;
}

// Returns the annotation of a control frame. If words of the frame are bad, it has the error of the first of them.
Annotation ControlFrames::annotation(Judge& judge) const {
  Annotation annotation{.kind = Annotation::Kind::exchange,
                        .error = error_,
                        .begin = begin_,
                        .end = end_,
                        .request = request_bits_.frame(),
                        .reply = reply_bits_.frame()};
  if (error_ != Error::none) return annotation;
  annotation.error = judge.decode(annotation.request, annotation.reply);
  annotation.contents = judge.contents();
  return annotation;
}

void BurstAnnotator::decode_exchange(const Burst& burst, Annotation& annotation) {
  annotation.reply.bytes = burst.in;
  if (!burst.out.empty()) {
    annotation.kind = Annotation::Kind::exchange;
    const std::size_t size = judge_.request_size(burst.out);
    annotation.request.bytes = size != 0 ? Bytes(burst.out).first(size) : Bytes(burst.out);
  }
  annotation.error = judge_.decode(annotation.request, annotation.reply);
  // A host may send more clocks than the reply needs, so the reply may be shorter than the burst.
  const std::size_t size = judge_.frame_size(Direction::reply, burst.in);
  const Frame shorter{.bytes = Bytes(burst.in).first(size)};
  if (annotation.error != Error::none && size != 0 && judge_.decode(annotation.request, shorter) == Error::none) {
    annotation.reply = shorter;
    annotation.error = Error::none;
  }
  if (burst.bits % 8 != 0) annotation.error = Error::bad_framing;
}

namespace {

/// A sequence of bits that grows, packed like those of a Burst.
void append_bit(std::vector<std::uint8_t>& bytes, std::size_t& count, bool bit) {
  if (count % 8 == 0) bytes.push_back(0);
  if (bit) bytes.back() = static_cast<std::uint8_t>(bytes.back() | 0x80u >> count % 8);
  ++count;
}
void set_bit(std::vector<std::uint8_t>& bytes, std::size_t bit, bool level) {
  const auto mask = static_cast<std::uint8_t>(0x80u >> bit % 8);
  bytes[bit / 8] = static_cast<std::uint8_t>(level ? bytes[bit / 8] | mask : bytes[bit / 8] & ~mask);
}
bool bit_of(const std::vector<std::uint8_t>& bytes, std::size_t bit) {
  return bit / 8 < bytes.size() && (bytes[bit / 8] >> (7 - bit % 8) & 1) != 0;
}

}  // namespace

// The first sample of a burst is the idle level before the first clock; the last bits (`last` and `tail`) are sampled
// behind the last clock.
void BurstAnnotator::decode_both_ways(const Burst& burst, Annotation& annotation) {
  annotation.kind = Annotation::Kind::exchange;
  line_.clear();
  std::size_t bits = 0;
  for (std::size_t i = 1; i < burst.bits; ++i) append_bit(line_, bits, bit_of(burst.in, i));
  if (burst.has_last) append_bit(line_, bits, burst.last);
  for (unsigned i = burst.tail_bits; i-- > 0;) append_bit(line_, bits, (burst.tail >> i & 1) != 0);
  if (!burst.out.empty()) take_host_wire(burst, bits);
  const BitRanges ranges = judge_.host_bits({.bytes = line_, .bits = bits});
  const auto is_of_host = [&](std::size_t bit) {
    return std::any_of(ranges.view().begin(), ranges.view().end(),
                       [bit](const BitRange& range) { return bit >= range.first && bit - range.first < range.count; });
  };
  request_.clear();
  reply_.clear();
  std::size_t request_bits = 0;
  std::size_t reply_bits = 0;
  for (std::size_t i = 0; i < bits; ++i) {
    if (is_of_host(i)) {
      append_bit(request_, request_bits, bit_of(line_, i));
    } else {
      append_bit(reply_, reply_bits, bit_of(line_, i));
    }
  }
  annotation.request = {.bytes = request_, .bits = request_bits};
  annotation.reply = {.bytes = reply_, .bits = reply_bits};
  annotation.error = judge_.decode(annotation.request, annotation.reply);
}

// Replaces the bits in `line_` that the host has sent by the bits of the host's own wire. The direction wire shows
// which bits the host has sent. Without that wire the unit finds them: first from the host's wire alone, which carries
// the mode command, then from the bits of both wires.
void BurstAnnotator::take_host_wire(const Burst& burst, std::size_t bits) {
  if (!burst.direction.empty()) {
    for (std::size_t i = 0; i < bits; ++i) {
      if (bit_of(burst.direction, i + 1)) set_bit(line_, i, bit_of(burst.out, i + 1));
    }
    return;
  }
  request_.clear();
  std::size_t count = 0;
  while (count < bits) append_bit(request_, count, bit_of(burst.out, count + 1));
  for (Frame known{.bytes = request_, .bits = bits}; const int round : {0, 1}) {
    const BitRanges ranges = judge_.host_bits(known);
    const std::size_t used = round == 0 ? std::min<std::size_t>(1, ranges.size()) : ranges.size();
    for (const BitRange& range : ranges.view().first(used)) {
      for (std::size_t i = range.first; i < std::min(range.first + range.count, bits); ++i) {
        set_bit(line_, i, bit_of(burst.out, i + 1));
      }
    }
    known.bytes = line_;
  }
}

// ---- CAN

void CanAnnotator::put(const CanRecord& record) {
  using Kind = Annotation::Kind;
  while (request_count_ != 0 && record.at > requests_[0].at + ticks_.limit) report_unanswered(0, Remark::unanswered);
  if (record.error_frame) return report(Kind::noise, record, Error::bad_framing, Remark::damaged);
  if (pair_reply(record)) return;
  const Frame frame{.bytes = record.frame.bytes(), .can = &record.frame};
  const Error as_reply = judge_.decode({}, frame);
  if (as_reply == Error::none) return report(Kind::reply, record, Error::none, Remark::none, judge_.contents());
  if (judge_.decode(frame, {}) != Error::none) {
    return pair_bad_reply(record) ? void() : report(Kind::noise, record, as_reply, Remark::none);
  }
  if (!judge_.is_answered(frame)) return report(Kind::request, record, Error::none, Remark::none, judge_.contents());
  end_earlier_requests(record.frame);
  if (request_count_ == capacity) report_unanswered(0, Remark::unanswered);
  requests_[request_count_++] = record;
}

void CanAnnotator::finish(Tick end) {
  while (request_count_ != 0)
    report_unanswered(0, end > requests_[0].at + ticks_.limit ? Remark::unanswered : Remark::cut);
}

// Pairs a reply with the oldest outstanding request that it answers; returns false if there is none.
bool CanAnnotator::pair_reply(const CanRecord& record) {
  const Frame reply{.bytes = record.frame.bytes(), .can = &record.frame};
  for (std::size_t i = 0; i < request_count_; ++i) {
    const Frame request{.bytes = requests_[i].frame.bytes(), .can = &requests_[i].frame};
    if (judge_.decode(request, reply) != Error::none) continue;
    report_exchange(i, record, Error::none);
    return true;
  }
  return false;
}

// Pairs a bad reply with the newest outstanding request that it may answer; returns false if there is none.
bool CanAnnotator::pair_bad_reply(const CanRecord& record) {
  const Frame reply{.bytes = record.frame.bytes(), .can = &record.frame};
  for (std::size_t i = request_count_; i-- > 0;) {
    const Error error = judge_.decode({.bytes = requests_[i].frame.bytes(), .can = &requests_[i].frame}, reply);
    if (error == Error::unexpected_reply) continue;
    report_exchange(i, record, error);
    return true;
  }
  return false;
}

// Reports earlier requests with the identifier of `request` as unanswered.
void CanAnnotator::end_earlier_requests(const CanFrame& request) {
  for (std::size_t i = 0; i < request_count_;) {
    const CanFrame& sent = requests_[i].frame;
    const bool same = sent.id == request.id && sent.extended == request.extended;
    if (same) {
      report_unanswered(i, Remark::unanswered);
    } else {
      ++i;
    }
  }
}

void CanAnnotator::report_exchange(std::size_t index, const CanRecord& record, Error error) {
  const CanRecord sent = take(index);
  sink_.put({.kind = Annotation::Kind::exchange,
             .error = error,
             .begin = sent.at,
             .end = record.at,
             .request = {.bytes = sent.frame.bytes(), .can = &sent.frame},
             .reply = {.bytes = record.frame.bytes(), .can = &record.frame},
             .contents = judge_.contents(),
             .turnaround = record.at - sent.at});
}

CanRecord CanAnnotator::take(std::size_t index) {
  const CanRecord sent = requests_[index];
  const auto first = requests_.begin() + static_cast<std::ptrdiff_t>(index);
  std::copy(first + 1, requests_.begin() + static_cast<std::ptrdiff_t>(request_count_), first);
  --request_count_;
  return sent;
}

void CanAnnotator::report(Annotation::Kind kind, const CanRecord& record, Error error, Remark remark,
                          const Contents& contents) {
  Annotation annotation{
      .kind = kind, .remark = remark, .error = error, .begin = record.at, .end = record.at, .contents = contents};
  const Frame frame{.bytes = record.frame.bytes(), .can = &record.frame};
  (kind == Annotation::Kind::request ? annotation.request : annotation.reply) = frame;
  sink_.put(annotation);
}

void CanAnnotator::report_unanswered(std::size_t index, Remark remark) {
  const CanRecord sent = take(index);
  report(Annotation::Kind::request, sent, remark == Remark::cut ? Error::none : Error::timeout, remark);
}

}  // namespace absenc::capture
