// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/recording.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <utility>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/way/connection.hpp"
#include "absenc/client/way/pace.hpp"
#include "absenc/os/line_file.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

namespace {

namespace fs = std::filesystem;

std::string date_and_time() {
  const auto now = std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto milliseconds = now.time_since_epoch().count() % 1000;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                     milliseconds);
}

}  // namespace

Recording::Recording(const RecordingSettings& settings, Encoder& encoder)
    : settings_(settings),
      encoder_(encoder),
      start_(os::now()),
      rows_(encoder.unit(), encoder.options(), start_, SampleRows::With::motion),
      started_(date_and_time()) {
  const std::string ending = fs::path(settings.path).extension();
  if (ending != ".csv" && ending != ".jsonl" && ending != ".ndjson") {
    throw UsageError(
        fmt::format("\"{}\" does not say how to write it: the name must end in .csv, or in .jsonl for JSON "
                    "lines",
                    settings.path));
  }
  format_ = ending == ".csv" ? Format::csv : Format::json_lines;
  if (settings_.part_bytes || settings_.part_time) refuse_parts_of_another_recording();
  open_part();
}

Recording::~Recording() = default;

std::uint64_t Recording::bytes() const { return finished_bytes_ + file_->size(); }

bool Recording::run(const std::function<void(const Sample&)>& heard) {
  const Time end = settings_.duration ? start_ + *settings_.duration : never;
  encoder_.end_when([end] { return os::now() >= end; });
  Pace pace(settings_.rate_hz);
  pace.start_at(start_);
  Sample sample;
  const auto tell_missed = [&] {
    const std::uint64_t missed = pace.take_missed();
    // While the port is away, that it was lost says so.
    const bool was_there = sample.kind == Sample::Kind::reading || sample.kind == Sample::Kind::failed;
    if (was_there) miss(missed);
  };
  bool has_all = false;
  try {
    while (os::now() < end && !os::interrupted()) {
      sample = encoder_.next();
      take(sample);
      if (heard) heard(sample);
      has_all = settings_.count != 0 && readings_ >= settings_.count;
      if (has_all) break;
      pace.wait(end, [this](Time time) { encoder_.wait_until(time); });
      tell_missed();
    }
  } catch (const os::Interrupted&) {
  } catch (const Cancelled&) {
  }
  encoder_.end_when({});
  if (!has_all) pace.leave_out(end);  // the end may have come while a reading was taken
  tell_missed();
  write_gap();
  file_->sync();
  return sample.kind == Sample::Kind::reading;
}

std::string Recording::part_path(unsigned part) const {
  if (!settings_.part_bytes && !settings_.part_time) return settings_.path;
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
  file_ = std::make_unique<os::LineFile>(part_path(part_));
  file_->append(header());
}

std::string Recording::header() const {
  const std::vector<std::string> options = option_texts(encoder_.unit(), encoder_.options());
  std::vector<Column> explained;
  std::copy_if(rows_.columns().begin(), rows_.columns().end(), std::back_inserter(explained),
               [](const Column& column) { return !column.look.is_detail && !column.meaning.empty(); });
  const Model* known = encoder_.options().model;
  const std::string_view model = known != nullptr ? known->name : "none";
  if (format_ == Format::json_lines) {
    Json json =
        Json::object().set("absenc_record", 1).set("encoder", settings_.encoder).set("protocol", encoder_.unit().id);
    json.set("model", model).set("options", fmt::format("{}", fmt::join(options, " ")));
    json.set("started", started_).set("rate_hz", settings_.rate_hz).set("every", settings_.every).set("part", part_);
    Json units = Json::object();
    for (const Column& column : explained) units.set(column.name, column.meaning);
    return json.set("units", units).line() + '\n';
  }
  std::string text = fmt::format(
      "# absenc record 1\n# encoder: {}\n# protocol: {}\n# model: {}\n# options: {}\n# started: {}\n# rate_hz: {}\n"
      "# every: {}\n# part: {}\n",
      settings_.encoder, encoder_.unit().id, model, fmt::join(options, " "), started_, settings_.rate_hz,
      settings_.every, part_);
  for (const Column& column : explained) text += fmt::format("# {}: {}\n", column.name, column.meaning);
  return text + csv_header(rows_.columns()) + '\n';
}

std::string Recording::line_of(const Row& row) const {
  return format_ == Format::csv ? to_csv(row) + '\n' : to_json(row).line() + '\n';
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
  file_->append(line_of(rows_.of_gap(gap_at_, gap_)));
  ++gaps_;
  missed_ += std::exchange(gap_, 0);
}

void Recording::take(const Sample& sample) {
  if (!wanted(sample)) return file_->require_there();
  const bool full = settings_.part_bytes && file_->size() >= *settings_.part_bytes;
  const bool over = settings_.part_time && os::now() - part_start_ >= *settings_.part_time;
  if (full || over) open_part();
  write_gap();
  file_->append(line_of(rows_.of(sample)));
  readings_ += sample.kind == Sample::Kind::reading ? 1 : 0;
  failures_ += sample.kind == Sample::Kind::failed ? 1 : 0;
}

std::string Recording::names() const {
  return part_ == 1 ? part_path(1) : fmt::format("{} to {}", part_path(1), part_path(part_));
}

}  // namespace absenc::client
