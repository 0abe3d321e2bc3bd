// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/annotation_rows.hpp"

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/angle.hpp"

namespace absenc::client {

namespace {

using capture::Annotation;

/// Indexes of the columns that every unit has, and of the first column of the unit's own fields.
enum At : std::size_t { at_begin, at_end, at_kind, at_request, at_reply, at_turnaround, at_position, first_field };

std::vector<Column> columns_of(const Unit& unit, const Options& options, bool has_time) {
  const bool is_linear = unit.resolution(options).unit_um > 0;
  const ColumnType wire = unit.link == LinkKind::can || carries_bits(unit.link) ? ColumnType::text : ColumnType::bytes;
  const ColumnType time = has_time ? ColumnType::real : ColumnType::uint64;
  std::vector<Column> columns{
      {has_time ? "time_s" : "tick", has_time ? "s" : "", time, "when its first bit began"},
      {has_time ? "end_s" : "end_tick", has_time ? "s" : "", time, "when its last bit ended"},
      {"kind", "", ColumnType::text, "exchange, request, reply or noise"},
      {"request", "", wire, "what was asked"},
      {"reply", "", wire, "what came back"},
      {"turnaround_us", "us", ColumnType::real, "from the end of the request to the begin of its reply"},
      {is_linear ? "position_mm" : "angle_deg", is_linear ? "mm" : "deg", ColumnType::real,
       "where the encoder stands"}};
  for (const FieldInfo& field : unit.fields) columns.push_back(column_of(field));
  columns.push_back({"error", "", ColumnType::text, "why the exchange is not good"});
  columns.push_back({"message", "", ColumnType::text, "the same in words, and what to try"});
  return columns;
}

}  // namespace

AnnotationRows::AnnotationRows(const Unit& unit, const Options& options, const TickClock& clock)
    : unit_(unit), clock_(clock), columns_(columns_of(unit, options, clock.has_time())) {}

Value AnnotationRows::wire(const Frame& frame) const {
  if (frame.empty()) return {};
  if (columns_[at_request].type == ColumnType::bytes) return ByteVector(frame.bytes.begin(), frame.bytes.end());
  return to_wire_text(unit_.link, frame);
}

void AnnotationRows::fill(const Annotation& annotation, const Options& options, Row& row) const {
  row.columns = columns_;
  row.values.assign(columns_.size(), {});
  const bool has_time = clock_.has_time();
  const auto time = [&](capture::Tick tick) { return has_time ? Value(clock_.seconds(tick)) : Value(tick); };
  row.values[at_begin] = time(annotation.begin);
  row.values[at_end] = time(annotation.end);
  row.values[at_kind] = std::string(name_of(annotation.kind));
  row.values[at_request] = wire(annotation.request);
  row.values[at_reply] = wire(annotation.reply);
  if (annotation.turnaround && has_time) {
    row.values[at_turnaround] = static_cast<double>(clock_.time(*annotation.turnaround).count()) / 1000;
  }
  const std::string message = message_of(unit_, options, annotation);
  if (!message.empty()) row.values.back() = message;
  if (annotation.error != Error::none) row.values[columns_.size() - 2] = std::string(text_of(annotation.error).name);
  if (!has_fields(annotation)) return;
  fill_fields(annotation.contents, row.values);
  if (annotation.contents.reading == nullptr || annotation.contents.reading->singleturn_bits == 0) return;
  const Reading& reading = *annotation.contents.reading;
  if (!reading.ready || !reading.singleturn_valid()) return;
  row.values[at_position] = reading.unit_um > 0 ? micrometres(reading.singleturn, reading.unit_um) / 1000
                                                : degrees(reading.singleturn, reading.singleturn_bits);
}

// Returns the index, in the unit's list of fields, of the given field or of another field with the same name; the
// length of the list if there is neither.
std::size_t AnnotationRows::place_of(const FieldInfo& info) const {
  const std::span<const FieldInfo> fields = unit_.fields;
  std::size_t place = 0;
  while (place < fields.size() && &fields[place] != &info) ++place;
  if (place < fields.size()) return place;
  place = 0;
  while (place < fields.size() && fields[place].name != info.name) ++place;
  return place;
}

void AnnotationRows::fill_fields(const capture::Contents& contents, std::vector<Value>& values) const {
  for (const FieldValue& field : contents.fields) {
    const std::size_t place = place_of(*field.info);
    if (place == unit_.fields.size()) continue;
    const Validity validity =
        contents.reading == nullptr ? Validity::valid : validity_of(*field.info, *contents.reading);
    values[first_field + place] = validity == Validity::valid     ? value_of(field)
                                  : validity == Validity::unknown ? Value(Unknown{})
                                                                  : Value(Invalid{});
  }
  if (contents.reading != nullptr) fill_alarms(*contents.reading, values);
}

// Alarms that this reply does not report are those of an earlier reply of the same encoder.
void AnnotationRows::fill_alarms(const Reading& reading, std::vector<Value>& values) const {
  for (const Flags& flags : alarms_of(unit_, reading)) {
    const std::size_t place = place_of(*flags.field);
    if (place != unit_.fields.size()) values[first_field + place] = value_of(flags);
  }
}

}  // namespace absenc::client
