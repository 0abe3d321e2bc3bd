// SPDX-License-Identifier: Apache-2.0
// Converts annotations of a capture to rows.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/captures/words.hpp"
#include "absenc/client/row.hpp"

namespace absenc::client {

/// Converts annotations to rows with the columns that decode.hpp describes.
class AnnotationRows {
 public:
  /// Makes the columns of the unit. `unit` must outlive the object.
  AnnotationRows(const Unit& unit, const Options& options, const TickClock& clock);

  [[nodiscard]] std::span<const Column> columns() const { return columns_; }
  void fill(const capture::Annotation& annotation, const Options& options, Row& row) const;

 private:
  [[nodiscard]] Value wire(const Frame& frame) const;
  [[nodiscard]] std::size_t place_of(const FieldInfo& info) const;
  void fill_fields(const capture::Contents& contents, std::vector<Value>& values) const;
  void fill_alarms(const Reading& reading, std::vector<Value>& values) const;

  const Unit& unit_;
  TickClock clock_;
  std::vector<Column> columns_;
};

}  // namespace absenc::client
