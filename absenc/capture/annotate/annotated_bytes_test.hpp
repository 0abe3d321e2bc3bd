// SPDX-License-Identifier: Apache-2.0
// Shared by tests of the Annotator: collects what it reports, with copies of the bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"

namespace absenc::capture::testing {

/// A copy of an annotation's kind, remark, error and bytes.
struct AnnotatedBytes {
  Annotation::Kind kind;
  Remark remark;
  Error error;
  std::vector<std::uint8_t> request;
  std::vector<std::uint8_t> reply;

  [[nodiscard]] bool is_good_exchange() const { return kind == Annotation::Kind::exchange && error == Error::none; }
};

struct BytesCollector final : AnnotationSink {
  void put(const Annotation& one) override {
    found.push_back({one.kind,
                     one.remark,
                     one.error,
                     {one.request.bytes.begin(), one.request.bytes.end()},
                     {one.reply.bytes.begin(), one.reply.bytes.end()}});
  }
  std::vector<AnnotatedBytes> found;
};

}  // namespace absenc::capture::testing
