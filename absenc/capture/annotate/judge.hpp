// SPDX-License-Identifier: Apache-2.0
// Asks a unit about bytes of a capture: whether they are a frame, and what position it carries.
#pragma once

#include <cstddef>
#include <optional>

#include "absenc/core/angle.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::capture {

class Judge {
 public:
  /// `unit` must outlive it.
  Judge(const Unit& unit, const Options& options) : unit_(&unit), options_(options) {}

  [[nodiscard]] const Unit& unit() const { return *unit_; }

  /// As the unit decodes it; `reading` then tells the position.
  Error decode(const Frame& request, const Frame& reply) {
    sink_.found = false;
    return unit_->decode(options_, request, reply, sink_);
  }
  /// Of the last good reply that was decoded; null when it carries none.
  [[nodiscard]] const Reading* reading() const { return sink_.found ? &sink_.reading : nullptr; }

  /// The size of the frame that the first byte begins, or 0.
  [[nodiscard]] std::size_t frame_size(Direction direction, Bytes bytes) const {
    const FrameEnd end = unit_->frame_end(options_, direction, bytes);
    return end.kind == FrameEnd::Kind::complete && end.size <= bytes.size() ? end.size : 0;
  }
  /// The size of the good request that the first byte begins, or 0.
  [[nodiscard]] std::size_t request_size(Bytes bytes) {
    const std::size_t size = frame_size(Direction::request, bytes);
    return size != 0 && decode({.bytes = bytes.first(size)}, {}) == Error::none ? size : 0;
  }

  /// See Unit.
  [[nodiscard]] std::optional<std::size_t> control_bit(const Frame& reply) const {
    return unit_->control_bit != nullptr ? unit_->control_bit(options_, reply) : std::nullopt;
  }

  [[nodiscard]] bool is_answered(const Frame& request) const {
    return unit_->is_answered == nullptr || unit_->is_answered(options_, request);
  }
  [[nodiscard]] bool streams() const { return unit_->streams != nullptr && unit_->streams(options_); }

 private:
  struct ReadingSink final : FieldSink {
    void put(const FieldValue&) override {}
    void put_reading(const Reading& one) override {
      reading = one;
      found = true;
    }
    Reading reading{};
    bool found = false;
  };

  const Unit* unit_;
  Options options_;
  ReadingSink sink_;
};

}  // namespace absenc::capture
