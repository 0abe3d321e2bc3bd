// SPDX-License-Identifier: Apache-2.0
// Completes each reading of a capture by what earlier replies of the same encoder reported, as a host that reads live
// does.
#pragma once

#include <cstdint>
#include <map>

#include "absenc/capture/annotate/annotation.hpp"

namespace absenc::capture {

/// Hands annotations on. Behind the annotators, where replies are in their order whoever decoded them.
///
/// An encoder that is switched off and on says so in no frame: it is taken to stay on for the whole capture. What it
/// reported before holds until a reply reports otherwise, also for alarms that the host has cleared meanwhile.
class Remembering final : public AnnotationSink {
 public:
  /// `unit` and `sink` must outlive it.
  Remembering(const Unit& unit, AnnotationSink& sink) : unit_(&unit), sink_(&sink) {}

  void put(const Annotation& annotation) override {
    const Reading* const now = annotation.contents.reading;
    const bool is_good = annotation.error == Error::none && annotation.remark != Remark::cut;
    if (unit_->remembered == nullptr || now == nullptr || !is_good) return sink_->put(annotation);
    Reading& last = last_[address_of(annotation.contents)];
    last = unit_->remembered(last, *now);
    Annotation completed = annotation;
    completed.contents.reading = &last;
    sink_->put(completed);
  }

 private:
  [[nodiscard]] static std::int64_t address_of(const Contents& contents) {
    for (const FieldValue& field : contents.fields) {
      if (field.info->role == Role::encoder) return field.number;
    }
    return 0;
  }

  const Unit* unit_;
  AnnotationSink* sink_;
  std::map<std::int64_t, Reading> last_;  // by the address of the encoder
};

}  // namespace absenc::capture
