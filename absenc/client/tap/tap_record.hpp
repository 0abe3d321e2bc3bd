// SPDX-License-Identifier: Apache-2.0
// Everything that is received, as a file that decode reads again: a line for each frame, with its time of arrival.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/captures/received_characters.hpp"
#include "absenc/os/line_file.hpp"

namespace absenc::client {

/// Takes annotations as the annotator hands them out: each received byte is in one of them. Times are arrival_tick.
class TapRecord final : public capture::AnnotationSink {
 public:
  /// Makes the file. Throws os::Failure: `in_use` when there is one already.
  TapRecord(const std::string& path, const std::string& title) : file_(path) {
    lines_ = fmt::format(
        "# {}\n# seconds since its beginning, when the last byte of a frame had arrived at the computer; then the "
        "frame\n",
        title);
    flush();
  }

  void put(const capture::Annotation& annotation) override {
    add(annotation.begin, annotation.request.bytes);
    add(annotation.end, annotation.reply.bytes);
  }
  /// Hands what was put to the system. Throws os::Failure.
  void flush() {
    if (!lines_.empty()) file_.append(lines_);
    lines_.clear();
  }
  [[nodiscard]] const std::string& path() const { return file_.path(); }

 private:
  // No two frames at the same time: decode takes lines of one time for one frame.
  void add(capture::Tick at, Bytes bytes) {
    if (bytes.empty()) return;
    last_ = std::max(at, last_ + 1);
    lines_ += fmt::format("{}.{:06} 0x", last_ / arrival_ticks_per_second, last_ % arrival_ticks_per_second);
    for (const std::uint8_t byte : bytes) lines_ += fmt::format("{:02X}", byte);
    lines_ += '\n';
  }

  os::LineFile file_;
  std::string lines_;
  capture::Tick last_ = 0;
};

}  // namespace absenc::client
