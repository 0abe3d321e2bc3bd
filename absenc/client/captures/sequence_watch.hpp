// SPDX-License-Identifier: Apache-2.0
// Checks the counters in replies: a repeated reply is good by itself but holds no new reading.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "absenc/capture/annotate/annotation.hpp"

namespace absenc::client {

/// Forwards annotations to a sink; a reply out of sequence becomes `sequence_mismatch`.
class SequenceWatch final : public capture::AnnotationSink {
 public:
  /// Forwards to `sink`, which must outlive the object.
  explicit SequenceWatch(capture::AnnotationSink& sink) : sink_(sink) {}

  void put(const capture::Annotation& annotation) override {
    ++count_;
    const bool is_wrong = !annotation.reply.empty() && !annotation.composed && is_out_of_sequence(annotation);
    const bool is_whole = annotation.error == Error::none && annotation.remark != capture::Remark::cut;
    if (!annotation.composed && !is_whole) damaged_at_ = count_;
    if (!is_wrong) return sink_.put(annotation);
    capture::Annotation repeated = annotation;
    repeated.error = Error::sequence_mismatch;
    repeated.contents = {};
    sink_.put(repeated);
  }

 private:
  // number of frames after which an equal counter is no error, because a counter of 7 bits may have wrapped
  static constexpr std::uint64_t most_between = 100;
  static constexpr std::int64_t life_counter_end = 64;

  struct LastCounter {
    std::int64_t value;
    std::uint64_t at;
  };

  bool is_out_of_sequence(const capture::Annotation& annotation) {
    std::int64_t address = 0;
    for (const FieldValue& field : annotation.contents.fields) {
      if (field.info->role == Role::encoder) address = field.number;
    }
    bool is_wrong = false;
    bool has_sequence = false;
    for (const FieldValue& field : annotation.contents.fields) {
      const bool is_life_counter = field.info->role == Role::life_counter;
      if (!is_life_counter && (field.info->role != Role::sequence || std::exchange(has_sequence, true))) continue;
      const LastCounter now{field.number, count_};
      const auto [last, is_first] = last_.try_emplace({address, is_life_counter ? field.info : nullptr}, now);
      const LastCounter before = std::exchange(last->second, now);
      if (is_first) continue;
      const bool stands = before.value == now.value && now.at - before.at < (is_life_counter ? 64 : most_between);
      const bool follows = !is_life_counter || now.value == (before.value + 1) % life_counter_end;
      is_wrong = is_wrong || stands || (!follows && damaged_at_ < before.at);
    }
    return is_wrong;
  }

  capture::AnnotationSink& sink_;
  // Last counter values, by the encoder's address; those of life counters also by the field that holds the counter.
  std::map<std::pair<std::int64_t, const FieldInfo*>, LastCounter> last_;
  std::uint64_t count_ = 0;
  std::uint64_t damaged_at_ = 0;
};

}  // namespace absenc::client
