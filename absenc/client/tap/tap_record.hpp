// SPDX-License-Identifier: Apache-2.0
// Writes requests and replies of a tap to a file that `decode` reads.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/captures/received_characters.hpp"
#include "absenc/os/line_file.hpp"

namespace absenc::client {

class TapRecord final : public capture::AnnotationSink {
 public:
  /// Creates the file. Throws os::Failure, with kind `in_use` if the file already exists.
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
  /// Writes the buffered lines to the file. Throws os::Failure.
  void flush() {
    if (!lines_.empty()) file_.append(lines_);
    lines_.clear();
  }
  [[nodiscard]] const std::string& path() const { return file_.path(); }

 private:
  // Adds a line with a time later than that of the line before, because `decode` joins lines of the same time to one
  // frame.
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
