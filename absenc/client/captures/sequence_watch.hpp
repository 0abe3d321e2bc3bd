// SPDX-License-Identifier: Apache-2.0
// Looks at the counters that replies carry: a reply that was seen before is good by itself, and yet says nothing new.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "absenc/capture/annotate/annotation.hpp"

namespace absenc::client {

/// Hands annotations on. A reply whose counter (a field of the role sequence) stands where that encoder's last one
/// stood becomes a `sequence_mismatch`, as a host that looks at counters would have it.
class SequenceWatch final : public capture::AnnotationSink {
 public:
  /// `sink` must outlive it.
  explicit SequenceWatch(capture::AnnotationSink& sink) : sink_(sink) {}

  void put(const capture::Annotation& annotation) override {
    ++count_;
    Counter counter;
    if (!annotation.reply.empty()) {
      for (const FieldValue& field : annotation.contents.fields) counter.put(field);
    }
    if (!counter.value) return sink_.put(annotation);
    const Seen now{*counter.value, count_};
    const auto [last, is_first] = last_.try_emplace(counter.address, now);
    const bool stands = !is_first && last->second.value == now.value && now.at - last->second.at < most_between;
    last->second = now;
    if (!stands) return sink_.put(annotation);
    capture::Annotation repeated = annotation;
    repeated.error = Error::sequence_mismatch;
    repeated.contents = {};
    sink_.put(repeated);
  }

 private:
  // With more in between, a counter of 7 bits may have come round.
  static constexpr std::uint64_t most_between = 100;

  struct Counter {
    void put(const FieldValue& field) {
      if (field.info->role == Role::encoder) address = field.number;
      if (!value && field.info->role == Role::sequence) value = field.number;
    }
    std::int64_t address = 0;
    std::optional<std::int64_t> value;
  };
  struct Seen {
    std::int64_t value;
    std::uint64_t at;
  };

  capture::AnnotationSink& sink_;
  std::map<std::int64_t, Seen> last_;  // by the address of the encoder
  std::uint64_t count_ = 0;
};

}  // namespace absenc::client
