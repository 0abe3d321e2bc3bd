// SPDX-License-Identifier: Apache-2.0
// Completes the readings of a capture with alarms of earlier replies of the same encoder.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/core/bits.hpp"

namespace absenc::capture {

/// Completes good readings with the encoder's earlier alarms, using Unit::remembered, and passes all annotations on. If
/// Unit::remembered is null, readings stay as they are. An unanswered request clears the stored alarms of all encoders.
class CompletedReadings final : public AnnotationSink {
 public:
  /// Passes annotations of frames of `unit` to `sink`. Both must outlive this object.
  CompletedReadings(const Unit& unit, const Options& options, AnnotationSink& sink) : unit_(&unit), sink_(&sink) {
    if (unit.remembered == nullptr) return;
    for (const Command& command : unit.commands) {
      if (command.verb != Verb::clear_alarms && command.verb != Verb::reset_multiturn) continue;
      std::array<std::uint8_t, longest_request> bytes{};
      const Result<std::size_t> size = unit.encode(options, command, {}, bytes);
      if (size && *size != 0) clearing_.emplace_back(bytes.data(), bytes.data() + *size);
    }
  }

  void put(const Annotation& annotation) override {
    if (annotation.remark == Remark::unanswered && annotation.error == Error::timeout) last_.clear();
    const Reading* const now = annotation.contents.reading;
    const bool is_good = annotation.error == Error::none && annotation.remark != Remark::cut;
    if (unit_->remembered == nullptr || !is_good) return sink_->put(annotation);
    const std::int64_t address = address_of(annotation.contents);
    if (now != nullptr) {
      Reading& last = last_[address];
      last = unit_->remembered(last, *now);
      Annotation completed = annotation;
      completed.contents.reading = &last;
      sink_->put(completed);
    } else {
      take_alarms(annotation.contents);
      sink_->put(annotation);
    }
    if (clears(annotation.request.bytes)) last_.erase(address);
  }

 private:
  static constexpr std::size_t longest_request = 64;

  // Stores the alarms that a reply reports, for each encoder in this reply.
  void take_alarms(const Contents& contents) {
    std::int64_t address = 0;
    for (const FieldValue& field : contents.fields) {
      if (field.info->role == Role::encoder) address = field.number;
      if (field.info != unit_->alarms) continue;
      const auto all = static_cast<std::uint32_t>(low_mask(static_cast<unsigned>(unit_->alarms->flags.size())));
      const Reading reported{.alarms = static_cast<std::uint32_t>(field.number), .alarms_reported = all};
      Reading& last = last_[address];
      last = unit_->remembered(last, reported);
    }
  }
  [[nodiscard]] static std::int64_t address_of(const Contents& contents) {
    for (const FieldValue& field : contents.fields) {
      if (field.info->role == Role::encoder) return field.number;
    }
    return 0;
  }
  [[nodiscard]] bool clears(Bytes request) const {
    return std::any_of(clearing_.begin(), clearing_.end(), [&](const auto& one) {
      return std::equal(one.begin(), one.end(), request.begin(), request.end());
    });
  }

  const Unit* unit_;
  AnnotationSink* sink_;
  // byte sequences of the requests that clear alarms or reset the turns
  std::vector<std::vector<std::uint8_t>> clearing_;
  // Last completed reading of each encoder, by the encoder's address; without a reading, only its alarms are set.
  std::map<std::int64_t, Reading> last_;
};

}  // namespace absenc::capture
