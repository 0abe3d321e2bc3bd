// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/annotation_text.hpp"

#include <fmt/format.h>

#include <iterator>
#include <span>

#include "absenc/capture/lines/can_line.hpp"
#include "absenc/client/port/diagnosis.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "tools/absenc/text/bit_text.hpp"
#include "tools/absenc/text/field_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"

namespace absenc::tool {

using namespace client;

namespace {

using capture::Annotation;
using capture::Remark;
using Kind = Annotation::Kind;

constexpr std::size_t enough_to_print = 1 << 16;

// Returns the fields of a frame as text "data_id=3 singleturn=INVALID(74565)".
std::string field_words(const capture::Contents& contents) {
  std::string words;
  for (const FieldValue& field : contents.fields) {
    const Validity validity =
        contents.reading == nullptr ? Validity::valid : validity_of(*field.info, *contents.reading);
    const std::string_view mark = validity == Validity::valid     ? ""
                                  : validity == Validity::unknown ? "unknown("
                                                                  : "INVALID(";
    if (!words.empty()) words += ' ';
    words.append(field.info->name).append("=").append(mark).append(to_text(field)).append(mark.empty() ? "" : ")");
  }
  return words;
}

// Indexes of the CSV columns. The values of Behind count from the first column after the columns of the reading.
enum ColumnPosition : std::size_t { at_time, at_kind, at_request, at_reply, at_turnaround, at_reading };
enum Behind : std::size_t { at_fields, at_error, at_message, behind_all };

}  // namespace

bool raises_alarm(const Annotation& annotation) {
  const Reading* const reading = annotation.contents.reading;
  return reading != nullptr && (reading->alarms & reading->alarms_reported) != 0;
}

AnnotationPrinter::AnnotationPrinter(const Unit& unit, const Options& options, const TickClock& clock,
                                     AnnotationFormat format, ShowBits bits, MarkAlarms marks)
    : unit_(unit),
      options_(options),
      clock_(clock),
      format_(format),
      bits_(bits),
      marks_(marks),
      time_format_(clock.format()),
      reading_(unit, options) {
  if (format != AnnotationFormat::csv) return;
  const bool has_time = clock.has_time();
  columns_ = {{has_time ? "time_s" : "tick",
               "",
               has_time ? ColumnType::real : ColumnType::uint64,
               "",
               {.format = time_format_}},
              {"kind", "", ColumnType::text, ""},
              {"request", "", ColumnType::text, ""},
              {"reply", "", ColumnType::text, ""},
              {"turnaround_us", "us", ColumnType::real, "", {.format = "{:.3f}"}}};
  columns_.insert(columns_.end(), reading_.columns().begin(), reading_.columns().end());
  columns_.push_back({"fields", "", ColumnType::text, ""});
  columns_.push_back({"error", "", ColumnType::text, ""});
  columns_.push_back({"message", "", ColumnType::text, ""});
  row_.columns = columns_;
  kept_ = csv_header(columns_) + '\n';
}

void AnnotationPrinter::put(const Annotation& annotation) {
  kept_ += format_ == AnnotationFormat::text   ? text(annotation)
           : format_ == AnnotationFormat::json ? json(annotation)
                                               : csv(annotation);
  kept_ += '\n';
  if (kept_.size() >= enough_to_print) flush();
}

void AnnotationPrinter::flush() {
  if (!kept_.empty()) print_line(kept_);
  kept_.clear();
}

std::string AnnotationPrinter::text(const Annotation& annotation) const {
  std::string line = fmt::format("{:>14}  ", clock_.text(annotation.begin));
  if (marks_ == MarkAlarms::yes) line += annotation.error != Error::none || raises_alarm(annotation) ? "! " : "  ";
  if (annotation.kind != Kind::noise && unit_.link != LinkKind::clocked) {
    if (!annotation.request.empty()) line += to_wire_text(unit_.link, annotation.request) + ' ';
    line += annotation.kind == Kind::request ? ">" : "> ";
  }
  if (!annotation.reply.empty()) line += to_wire_text(unit_.link, annotation.reply);
  if (annotation.turnaround && clock_.has_time()) {
    line += fmt::format("  ({})", client::to_text(clock_.time(*annotation.turnaround)));
  }
  if (annotation.contents.reading != nullptr) {
    line += "   " + reading_text(unit_, *annotation.contents.reading);
  } else if (has_fields(annotation)) {
    line += "   " + field_words(annotation.contents);
  }
  if (bits_ == ShowBits::yes && has_fields(annotation)) {
    const std::string places =
        FieldPlaces(unit_, options_, annotation.request, annotation.reply, annotation.contents).text();
    if (!places.empty()) line += fmt::format("   [{}]", places);
  }
  const std::string message = message_of(unit_, options_, annotation);
  if (annotation.error != Error::none) line += fmt::format("   {}", text_of(annotation.error).name);
  if (!message.empty()) line += fmt::format("{}{}", annotation.error != Error::none ? ": " : "   ", message);
  return line;
}

std::string AnnotationPrinter::json(const Annotation& annotation) const {
  Json json = Json::object();
  if (clock_.has_time()) {
    json.set("time_s", clock_.seconds(annotation.begin)).set("end_s", clock_.seconds(annotation.end));
  } else {
    json.set("tick", annotation.begin).set("end_tick", annotation.end);
  }
  json.set("protocol", unit_.id).set("kind", name_of(annotation.kind));
  if (!annotation.request.empty()) json.set("request", to_compact_wire_text(unit_.link, annotation.request));
  if (!annotation.reply.empty()) json.set("reply", to_compact_wire_text(unit_.link, annotation.reply));
  if (annotation.turnaround && clock_.has_time()) {
    json.set("turnaround_us", static_cast<double>(clock_.time(*annotation.turnaround).count()) / 1000);
  }
  json.set("ok", annotation.error == Error::none);
  if (has_fields(annotation)) {
    JsonFields fields;
    for (const FieldValue& field : annotation.contents.fields) fields.put(field);
    json.set("fields", fields.fields);
    if (bits_ == ShowBits::yes) {
      json.set("bits", FieldPlaces(unit_, options_, annotation.request, annotation.reply, annotation.contents).json());
    }
  }
  if (annotation.contents.reading != nullptr && annotation.contents.reading->singleturn_bits != 0) {
    const Reading& reading = *annotation.contents.reading;
    const bool valid = reading.singleturn_valid() && reading.ready;
    const bool linear = reading.unit_um > 0;
    const double position = linear ? micrometres(reading.singleturn, reading.unit_um) / 1000
                                   : degrees(reading.singleturn, reading.singleturn_bits);
    json.set(linear ? "position_mm" : "angle_deg", valid ? Json(position) : Json());
    if (reading.multiturn_bits != 0) json.set("turns", reading.multiturn_valid ? Json(reading.turns()) : Json());
  }
  if (annotation.contents.reading != nullptr) set_state(json, unit_, *annotation.contents.reading);
  if (annotation.error != Error::none) json.set("error", text_of(annotation.error).name);
  const std::string message = message_of(unit_, options_, annotation);
  if (!message.empty()) json.set("message", message);
  return json.line();
}

std::string AnnotationPrinter::csv(const Annotation& annotation) {
  std::vector<Value>& values = row_.values;
  values.assign(columns_.size(), {});
  const std::span<Value> behind = std::span(values).last(behind_all);
  if (clock_.has_time()) {
    values[at_time] = clock_.seconds(annotation.begin);
  } else {
    values[at_time] = annotation.begin;
  }
  values[at_kind] = std::string(name_of(annotation.kind));
  if (!annotation.request.empty()) values[at_request] = to_compact_wire_text(unit_.link, annotation.request);
  if (!annotation.reply.empty()) values[at_reply] = to_compact_wire_text(unit_.link, annotation.reply);
  if (annotation.turnaround && clock_.has_time()) {
    values[at_turnaround] = static_cast<double>(clock_.time(*annotation.turnaround).count()) / 1000;
  }
  if (const Reading* reading = annotation.contents.reading; reading != nullptr) {
    reading_.fill(*reading, std::span(values).subspan(at_reading, reading_.columns().size()));
  }
  if (has_fields(annotation)) behind[at_fields] = field_words(annotation.contents);
  if (annotation.error != Error::none) behind[at_error] = std::string(text_of(annotation.error).name);
  behind[at_message] = message_of(unit_, options_, annotation);
  return to_csv(row_);
}

}  // namespace absenc::tool
