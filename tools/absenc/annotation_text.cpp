// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/annotation_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absenc/capture/lines/can_line.hpp"
#include "tools/absenc/bit_text.hpp"
#include "tools/absenc/diagnosis.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/reading_text.hpp"
#include "tools/absenc/unit_text.hpp"
#include "tools/absenc/wire_text.hpp"

namespace absenc::tool {

namespace {

using capture::Annotation;
using capture::Remark;
using Kind = Annotation::Kind;

constexpr std::size_t enough_to_print = 1 << 16;

// "data_id=3 singleturn=74565"; "singleturn=INVALID(74565)" where it does not hold.
std::string field_words(const Unit& unit, const Options& options, const Annotation& annotation) {
  struct Values final : FieldSink {
    void put(const FieldValue& value) override { all.push_back({std::string(value.info->name), to_text(value)}); }
    std::vector<std::pair<std::string, std::string>> all;
  };
  Values values;
  FieldsWithReading fields(values);
  static_cast<void>(unit.decode(options, annotation.request, annotation.reply, fields));
  const std::vector<std::string_view> invalid = fields.invalid();
  std::string words;
  for (const auto& [name, value] : values.all) {
    const bool is_invalid = std::find(invalid.begin(), invalid.end(), name) != invalid.end();
    words += (words.empty() ? "" : " ") + name + (is_invalid ? fmt::format("=INVALID({})", value) : "=" + value);
  }
  return words;
}

std::string quoted(std::string_view text) {
  if (text.find_first_of(",\"\n\r") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

bool has_fields(const Annotation& annotation) {
  return annotation.error == Error::none && annotation.kind != Kind::noise && annotation.remark != Remark::cut &&
         annotation.remark != Remark::undocumented;
}

std::string csv_columns(const Unit& unit, bool linear) {
  const std::string all = csv_header(unit, linear);
  return all.substr(all.find(',') + 1);
}

}  // namespace

TickClock::TickClock(std::uint64_t ticks_per_second) : ticks_per_second_(ticks_per_second) {
  for (std::uint64_t rate = 1; rate < ticks_per_second && digits_ < 12; rate *= 10) ++digits_;
}

double TickClock::seconds(capture::Tick tick) const {
  return static_cast<double>(tick) / static_cast<double>(ticks_per_second_);
}

Time TickClock::time(capture::Tick ticks) const {
  return has_time() ? Time(std::llround(seconds(ticks) * 1e9)) : Time{};
}

std::string TickClock::text(capture::Tick tick) const {
  return has_time() ? fmt::format("{:.{}f}", seconds(tick), digits_) : fmt::format("{}", tick);
}

std::string to_text(const capture::Damage& damage, const TickClock& clock) {
  return fmt::format("{}byte {}, {} {}: {}", damage.note ? "note: " : "the capture is damaged at ", damage.offset,
                     clock.has_time() ? "second" : "tick", clock.text(damage.tick), damage.what);
}

std::string_view name_of(Kind kind) {
  static constexpr std::array<std::string_view, 4> names{"exchange", "request", "reply", "noise"};
  return names[static_cast<std::size_t>(kind)];
}

std::string message_of(const Unit& unit, const Options& options, const Annotation& annotation) {
  const bool is_bus_error = annotation.remark == Remark::damaged && annotation.reply.can != nullptr;
  const std::string_view remark =
      is_bus_error ? capture::text_of_error(*annotation.reply.can) : text_of(annotation.remark);
  if (annotation.error == Error::none) return std::string(remark);
  const bool decoded = annotation.remark == Remark::none && !annotation.reply.empty();
  const Diagnosis diagnosis = decoded ? diagnose(unit, options, annotation.request, annotation.reply) : Diagnosis{};
  const Explanation explanation = decoded && unit.explain != nullptr
                                      ? unit.explain(options, annotation.error, annotation.request, annotation.reply)
                                      : Explanation{};
  if (!remark.empty()) return std::string(remark);
  std::string message = describe(annotation.error, explanation.detail, diagnosis.finding);
  const std::string_view advice = diagnosis.advice.empty() ? explanation.advice : diagnosis.advice;
  return advice.empty() ? message : fmt::format("{}: {}", message, advice);
}

AnnotationPrinter::AnnotationPrinter(const Unit& unit, const Options& options, const TickClock& clock,
                                     AnnotationFormat format, ShowBits bits)
    : unit_(unit), options_(options), clock_(clock), format_(format), bits_(bits) {
  if (format != AnnotationFormat::csv) return;
  const bool linear = unit.resolution(options).unit_um > 0;
  kept_ = fmt::format("{},kind,request,reply,turnaround_us,{},fields,error,message\n",
                      clock.has_time() ? "time_s" : "tick", csv_columns(unit, linear));
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
  if (annotation.kind != Kind::noise && unit_.link != LinkKind::clocked) {
    if (!annotation.request.empty()) line += to_wire_text(unit_.link, annotation.request) + ' ';
    line += annotation.kind == Kind::request ? ">" : "> ";
  }
  if (!annotation.reply.empty()) line += to_wire_text(unit_.link, annotation.reply);
  if (annotation.turnaround && clock_.has_time()) {
    line += fmt::format("  ({})", tool::to_text(clock_.time(*annotation.turnaround)));
  }
  if (annotation.reading != nullptr) {
    line += "   " + to_text(unit_, *annotation.reading);
  } else if (has_fields(annotation)) {
    line += "   " + field_words(unit_, options_, annotation);
  }
  if (bits_ == ShowBits::yes && has_fields(annotation)) {
    const std::string places = FieldPlaces(unit_, options_, annotation.request, annotation.reply).text();
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
    FieldsWithReading numbers(fields);  // whether they hold stands beside them
    static_cast<void>(unit_.decode(options_, annotation.request, annotation.reply, numbers));
    json.set("fields", fields.fields);
    if (bits_ == ShowBits::yes) {
      json.set("bits", FieldPlaces(unit_, options_, annotation.request, annotation.reply).json());
    }
  }
  if (annotation.reading != nullptr && annotation.reading->singleturn_bits != 0) {
    const Reading& reading = *annotation.reading;
    const bool valid = reading.singleturn_valid() && reading.ready;
    const bool linear = reading.unit_um > 0;
    const double position = linear ? micrometres(reading.singleturn, reading.unit_um) / 1000
                                   : degrees(reading.singleturn, reading.singleturn_bits);
    json.set(linear ? "position_mm" : "angle_deg", valid ? Json(position) : Json());
    if (reading.multiturn_bits != 0) json.set("turns", reading.multiturn_valid ? Json(reading.multiturn) : Json());
  }
  if (annotation.reading != nullptr) set_validity(json, *annotation.reading);
  if (annotation.error != Error::none) json.set("error", text_of(annotation.error).name);
  const std::string message = message_of(unit_, options_, annotation);
  if (!message.empty()) json.set("message", message);
  return json.line();
}

std::string AnnotationPrinter::csv(const Annotation& annotation) const {
  const auto wire = [&](const Frame& frame) {
    return frame.empty() ? std::string() : to_compact_wire_text(unit_.link, frame);
  };
  std::string row = fmt::format("{},{},{},{},", clock_.text(annotation.begin), name_of(annotation.kind),
                                wire(annotation.request), wire(annotation.reply));
  if (annotation.turnaround && clock_.has_time()) {
    row += fmt::format("{:.3f}", static_cast<double>(clock_.time(*annotation.turnaround).count()) / 1000);
  }
  if (annotation.reading != nullptr) {
    const std::string columns = to_csv(unit_, *annotation.reading, 0);
    row += columns.substr(columns.find(','));
  } else {
    const std::string columns = csv_columns(unit_, unit_.resolution(options_).unit_um > 0);
    row += std::string(static_cast<std::size_t>(std::count(columns.begin(), columns.end(), ',')) + 1, ',');
  }
  const std::string fields = has_fields(annotation) ? field_words(unit_, options_, annotation) : std::string();
  const std::string_view error = annotation.error == Error::none ? "" : text_of(annotation.error).name;
  return row + fmt::format(",{},{},{}", quoted(fields), error, quoted(message_of(unit_, options_, annotation)));
}

}  // namespace absenc::tool
