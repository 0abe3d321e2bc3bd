// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/recording.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <utility>
#include <vector>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/encoder_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/reading_text.hpp"

namespace absenc::tool {

namespace {

namespace fs = std::filesystem;

struct Column {
  std::string_view name;
  std::string_view unit;
};

using Columns = std::vector<Column>;

// Those of `read --csv` and more.
Columns columns_of(const Unit& unit, bool linear) {
  Columns columns{{"time_s", "seconds after `started`"}};
  const auto add = [&columns](const Columns& more) { columns.insert(columns.end(), more.begin(), more.end()); };
  if (linear) {
    add({{"position_mm", "millimetres, empty when not valid"}, {"position_um", "micrometres, empty when not valid"}});
  } else {
    add({{"angle_deg", "degrees within the turn, empty when not valid"}});
  }
  add({{"singleturn", "counts"},
       {"singleturn_valid", ""},
       {"multiturn", "revolutions as the encoder counts them"},
       {"multiturn_valid", ""}});
  for (const std::string_view flags : csv_flag_names(unit)) add({{flags, "names, separated by spaces"}});
  add({{"position", "counts, continued past the end of the encoder's own counter"}});
  if (linear) {
    add({{"unwrapped_mm", "the same in millimetres"}, {"speed_mm_s", "mean over twice speed_delay_s"}});
  } else {
    add({{"speed_rpm", "mean over twice speed_delay_s"}});
  }
  add({{"speed_delay_s",
        linear ? "how long before time_s it was so fast" : "how long before time_s the shaft had that speed"},
       {"missed", "of a gap: how many readings were due and were not taken"},
       {"event",
        "empty for a reading; restarted: a reading so long after the one before that the way between them is not "
        "known: position starts again; lost or back: the port; gap; otherwise the error that came in its place"}});
  return columns;
}

std::string date_and_time() {
  const auto now = std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto milliseconds = now.time_since_epoch().count() % 1000;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                     milliseconds);
}

}  // namespace

Recording::Recording(const RecordingSettings& settings, const EncoderAddress& uri)
    : settings_(settings),
      unit_(uri.unit),
      options_(uri.options),
      unit_um_(uri.unit->resolution(uri.options).unit_um),
      start_(os::now()),
      started_(date_and_time()) {
  const std::string ending = fs::path(settings.path).extension();
  if (ending != ".csv" && ending != ".jsonl" && ending != ".ndjson") {
    throw UsageError(
        fmt::format("\"{}\" does not say how to write it: the name must end in .csv, or in .jsonl for JSON "
                    "lines",
                    settings.path));
  }
  format_ = ending == ".csv" ? Format::csv : Format::json_lines;
  if (settings_.part_size || settings_.part_time) refuse_parts_of_another_recording();
  open_part();
}

std::string Recording::part_path(unsigned part) const {
  if (!settings_.part_size && !settings_.part_time) return settings_.path;
  const fs::path path(settings_.path);
  const std::string name = fmt::format("{}-{:04}{}", path.stem().string(), part, path.extension().string());
  return path.parent_path() / name;
}

// Later parts of an older recording would stand in the way in the middle of this one.
void Recording::refuse_parts_of_another_recording() const {
  const fs::path path(settings_.path);
  const std::string begin = path.stem().string() + "-";
  const std::string ending = path.extension();
  std::error_code error;  // a folder that cannot be read will be told when the file is made
  for (const fs::directory_entry& entry :
       fs::directory_iterator(path.has_parent_path() ? path.parent_path() : ".", error)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with(begin) || !name.ends_with(ending) || name.size() < begin.size() + ending.size() + 4) continue;
    const std::string number = name.substr(begin.size(), name.size() - begin.size() - ending.size());
    if (!std::all_of(number.begin(), number.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) continue;
    throw UsageError(
        fmt::format("there is already a part of another recording, {}: choose another name", entry.path().string()));
  }
}

void Recording::open_part() {
  if (file_) {
    file_->sync();
    finished_bytes_ += file_->size();
  }
  ++part_;
  part_start_ = os::now();
  file_.emplace(part_path(part_));
  file_->append(header());
}

std::string Recording::header() const {
  const std::vector<std::string> options = option_texts(*unit_, options_);
  const Columns columns = columns_of(*unit_, unit_um_ > 0);
  const std::string_view model = options_.model != nullptr ? options_.model->name : "none";
  if (format_ == Format::json_lines) {
    Json json = Json::object().set("absenc_record", 1).set("encoder", settings_.encoder).set("protocol", unit_->id);
    json.set("model", model).set("options", fmt::format("{}", fmt::join(options, " ")));
    json.set("started", started_).set("rate_hz", settings_.rate).set("every", settings_.every).set("part", part_);
    Json units = Json::object();
    for (const Column& column : columns) {
      if (!column.unit.empty()) units.set(column.name, column.unit);
    }
    return json.set("units", units).line() + '\n';
  }
  std::string text = fmt::format(
      "# absenc record 1\n# encoder: {}\n# protocol: {}\n# model: {}\n# options: {}\n# started: {}\n# rate_hz: {}\n"
      "# every: {}\n# part: {}\n",
      settings_.encoder, unit_->id, model, fmt::join(options, " "), started_, settings_.rate, settings_.every, part_);
  std::string names;
  for (const Column& column : columns) {
    if (!column.unit.empty()) text += fmt::format("# {}: {}\n", column.name, column.unit);
    names += fmt::format("{}{}", names.empty() ? "" : ",", column.name);
  }
  return text + names + '\n';
}

std::string Recording::line_of(const Sample& sample) const {
  const double seconds = std::chrono::duration<double>(sample.at - start_).count();
  const double delay = std::chrono::duration<double>(sample.speed_delay).count();
  const bool is_reading = sample.kind == Sample::Kind::reading;
  if (format_ == Format::csv) {
    if (!is_reading) return event_line(sample.at, event_name(sample), "");
    std::string position = sample.position_valid ? fmt::format("{}", sample.position) : "";
    if (unit_um_ > 0) position += ",";
    if (unit_um_ > 0 && sample.position_valid) {
      position += fmt::format("{}", micrometres(sample.position, unit_um_) / 1000);
    }
    const std::string speed = sample.speed_valid ? fmt::format("{:.6g},{:.6f}", sample.speed, delay) : ",";
    return fmt::format("{},{},{},,{}\n", to_csv(*unit_, sample.reading, seconds), position, speed, event_name(sample));
  }
  if (is_reading) {
    Json json = to_json(*unit_, sample.reading, seconds, sample.confirmed);
    set_motion(json, sample, unit_um_);
    json.set("speed_delay_s", sample.speed_valid ? Json(delay) : Json());
    if (sample.restarted) json.set("event", event_name(sample));
    return json.line() + '\n';
  }
  Json json = Json::object().set("time_s", seconds).set("ok", false).set("event", event_name(sample));
  if (sample.kind != Sample::Kind::failed) return json.set("message", sample.message).line() + '\n';
  json.set("message", sample.trouble.message).set("sent", sample.trouble.sent).set("received", sample.trouble.received);
  return json.line() + '\n';
}

// In CSV: what is no reading.
std::string Recording::event_line(Time at, std::string_view event, std::string_view missed) const {
  const std::string commas(columns_of(*unit_, unit_um_ > 0).size() - 2, ',');
  return fmt::format("{:.6f}{}{},{}\n", std::chrono::duration<double>(at - start_).count(), commas, missed, event);
}

std::string Recording::gap_line() const {
  if (format_ == Format::csv) return event_line(gap_at_, "gap", fmt::format("{}", gap_));
  return Json::object()
             .set("time_s", std::chrono::duration<double>(gap_at_ - start_).count())
             .set("ok", false)
             .set("event", "gap")
             .set("missed", gap_)
             .set("message", "readings were due and were not taken: the line or this computer was too slow, or stopped")
             .line() +
         '\n';
}

// Of the readings every so manieth, but none with other alarms is left out; of what went wrong everything but waiting.
bool Recording::wanted(const Sample& sample) {
  if (sample.kind == Sample::Kind::absent) return false;
  if (sample.kind != Sample::Kind::reading) return true;
  const bool other_alarms = sample.reading.alarms != alarms_;
  alarms_ = sample.reading.alarms;
  return seen_++ % settings_.every == 0 || other_alarms;
}

void Recording::miss(std::uint64_t readings) {
  if (readings == 0) return;
  gap_ += readings;
  gap_at_ = os::now();
}

void Recording::write_gap() {
  if (gap_ == 0) return;
  file_->append(gap_line());
  ++gaps_;
  missed_ += std::exchange(gap_, 0);
}

void Recording::finish() {
  write_gap();
  file_->sync();
}

void Recording::take(const Sample& sample) {
  if (!wanted(sample)) return file_->require_there();
  const bool full = settings_.part_size && file_->size() >= *settings_.part_size;
  const bool over = settings_.part_time && os::now() - part_start_ >= *settings_.part_time;
  if (full || over) open_part();
  write_gap();
  file_->append(line_of(sample));
  readings_ += sample.kind == Sample::Kind::reading ? 1 : 0;
  failures_ += sample.kind == Sample::Kind::failed ? 1 : 0;
}

std::string Recording::names() const {
  return part_ == 1 ? part_path(1) : fmt::format("{} to {}", part_path(1), part_path(part_));
}

}  // namespace absenc::tool
