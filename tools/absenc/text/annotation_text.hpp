// SPDX-License-Identifier: Apache-2.0
// Annotations of a capture for people, as JSON and as CSV, one a line.
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
enum class ShowBits : std::uint8_t { no, yes };  // where in the reply its fields stand

enum class MarkAlarms : std::uint8_t { no, yes };  // an error, or an alarm that is raised, by ! before the time

/// Whether its reply reports an alarm that is raised.
[[nodiscard]] bool raises_alarm(const capture::Annotation& annotation);

/// Prints each annotation as it comes; many at a time where nobody waits for them.
class AnnotationPrinter final : public capture::AnnotationSink {
 public:
  AnnotationPrinter(const Unit& unit, const Options& options, const TickClock& clock, AnnotationFormat format,
                    ShowBits bits = ShowBits::no, MarkAlarms marks = MarkAlarms::no);

  void put(const capture::Annotation& annotation) override;
  /// Prints what is still kept. Throws OutputClosed, Failure.
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
  // Of CSV.
  std::string time_format_;
  ReadingColumns reading_;
  std::vector<Column> columns_;
  Row row_;
  std::string kept_;
};

}  // namespace absenc::tool
