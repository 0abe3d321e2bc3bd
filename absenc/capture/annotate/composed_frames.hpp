// SPDX-License-Identifier: Apache-2.0
// Composes frames of which several exchanges carry one byte each, and annotates them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/annotate/judge.hpp"

namespace absenc::capture {

/// Passes annotations on to a sink, and inserts annotations of the frames that several exchanges compose.
class ComposedFrames final : public AnnotationSink {
 public:
  /// Passes annotations of frames of `unit` to `sink`. Both must outlive this object.
  ComposedFrames(const Unit& unit, const Options& options, AnnotationSink& sink)
      : judge_(unit, options), sink_(sink), storage_(std::make_unique<std::byte[]>(unit.follower_storage)) {
    if (unit.follower != nullptr) follower_ = unit.follower(options, {storage_.get(), unit.follower_storage});
  }

  void put(const Annotation& annotation) override {
    if (follower_ != nullptr) follow(annotation);
    sink_.put(annotation);
  }

 private:
  // Limit for the number of stored begin times: more exchanges than any composed frame consists of.
  static constexpr std::size_t most_begins = 4096;

  void follow(const Annotation& annotation) {
    const bool good = annotation.error == Error::none && !annotation.reply.empty() &&
                      annotation.remark != Remark::cut && annotation.remark != Remark::undocumented;
    if (!good) return follower_->lose();
    begins_.push_back(annotation.begin);
    if (begins_.size() > most_begins) begins_.pop_front();
    follower_->follow(count_++, annotation.request.bytes, annotation.reply.bytes);
    Composed one;
    while (follower_->take(one)) report(one, annotation.end);
  }

  void report(const Composed& one, Tick end) {
    using Kind = Annotation::Kind;
    const auto ago = static_cast<std::size_t>(count_ - one.first);
    Annotation annotation{.kind = one.request.empty() ? Kind::reply : Kind::exchange,
                          .error = one.error,
                          .composed = true,
                          .begin = ago <= begins_.size() ? begins_[begins_.size() - ago] : begins_.front(),
                          .end = end,
                          .request = {.bytes = one.request},
                          .reply = {.bytes = one.reply}};
    if (one.error == Error::none) annotation.error = judge_.decode(annotation.request, annotation.reply);
    if (annotation.error == Error::none) annotation.contents = judge_.contents();
    sink_.put(annotation);
  }

  Judge judge_;
  AnnotationSink& sink_;
  std::unique_ptr<std::byte[]> storage_;
  Follower* follower_ = nullptr;
  std::deque<Tick> begins_;  // begin times of the last good exchanges, the newest at the end
  std::uint64_t count_ = 0;
};

}  // namespace absenc::capture
