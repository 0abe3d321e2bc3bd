// SPDX-License-Identifier: Apache-2.0
// Prints annotations of a capture as text, JSON or CSV, one per line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/client/captures/words.hpp"
#include "absenc/client/reading_columns.hpp"

namespace absenc::tool {

using namespace client;

enum class AnnotationFormat : std::uint8_t { text, json, csv };
// Selects whether text and JSON show which bits of a frame each field occupies.
enum class ShowBits : std::uint8_t { no, yes };

// Selects whether a line of text is marked with ! after its time if it has an error or a raised alarm.
enum class MarkAlarms : std::uint8_t { no, yes };

/// Returns whether the annotation has a reading with a raised alarm.
[[nodiscard]] bool raises_alarm(const capture::Annotation& annotation);

/// Prints annotations to standard output; `flush` prints those that are still buffered.
class AnnotationPrinter final : public capture::AnnotationSink {
 public:
  AnnotationPrinter(const Unit& unit, const Options& options, const TickClock& clock, AnnotationFormat format,
                    ShowBits bits = ShowBits::no, MarkAlarms marks = MarkAlarms::no);

  void put(const capture::Annotation& annotation) override;
  /// Prints the annotations that are still buffered. Throws OutputClosed, Failure.
  void flush();

 private:
  [[nodiscard]] std::string text(const capture::Annotation& annotation) const;
  [[nodiscard]] std::string json(const capture::Annotation& annotation) const;
  [[nodiscard]] std::string csv(const capture::Annotation& annotation);

  const Unit& unit_;
  const Options& options_;
  TickClock clock_;
  AnnotationFormat format_;
  ShowBits bits_;
  MarkAlarms marks_;
  // The members from `time_format_` to `row_` are used only for CSV.
  std::string time_format_;
  ReadingColumns reading_;
  std::vector<Column> columns_;
  Row row_;
  std::string kept_;
};

}  // namespace absenc::tool
