// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/recording.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <utility>
#include <vector>

#include "absenc/client/encoder/end_at.hpp"
#include "absenc/client/encoder/pace.hpp"
#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/recording/record_file.hpp"
#include "absenc/client/sample_rows.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/file_name.hpp"
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

struct Recording::Parts {
  Parts(const RecordingSettings& settings, Encoder& encoder);

  bool run(const std::function<void(const Sample&)>& on_written);
  [[nodiscard]] RecordCounts counts() const;
  [[nodiscard]] std::uint64_t bytes() const { return finished_bytes_ + file_->size(); }
  [[nodiscard]] Time start() const { return start_; }
  [[nodiscard]] std::vector<std::string> paths() const;

 private:
  [[nodiscard]] std::string part_path(unsigned part) const;
  void refuse_parts_of_another_recording() const;
  void open_part();
  [[nodiscard]] RecordHeader header() const;
  [[nodiscard]] bool wanted(const Sample& sample);
  void take(const Sample& sample);
  void miss(std::uint64_t readings);
  void write_gap();

  RecordingSettings settings_;
  Encoder& encoder_;
  Time start_;  // time at which the recording began, by os::now
  SampleRows rows_;
  std::string started_;  // date and time at which the recording began, as text
  std::unique_ptr<RecordFile> file_;
  unsigned part_ = 0;
  Time part_start_{};
  std::uint64_t finished_bytes_ = 0;  // size of the finished files of the recording, in bytes
  RecordCounts finished_;             // counts of the rows in the finished files of the recording
  std::uint64_t offered_ = 0;         // number of readings, including those that `RecordingSettings::every` leaves out
  std::uint64_t taken_ = 0;           // number of readings that were written
  std::uint64_t gap_ = 0;             // number of missed readings for which no row was written yet
  Time gap_at_{};
  std::uint32_t alarms_ = 0;  // alarms of the previous reading
  std::uint32_t alarms_reported_ = 0;
};

Recording::Parts::Parts(const RecordingSettings& settings, Encoder& encoder)
    : settings_(settings),
      encoder_(encoder),
      start_(os::now()),
      rows_(encoder.unit(), encoder.options(), start_, SampleRows::With::motion, encoder.joint()),
      started_(date_and_time()) {
  if (settings.every == 0) throw UsageError("`every` is 0, but must be at least 1: 1 writes each reading");
  static_cast<void>(record_form(settings.path));  // refuses a wrong ending of the file name before the folder is read
  if (settings_.part_bytes || settings_.part_time) refuse_parts_of_another_recording();
  open_part();
}

RecordCounts Recording::Parts::counts() const {
  RecordCounts all = finished_;
  return all += file_->counts();
}

bool Recording::Parts::run(const std::function<void(const Sample&)>& on_written) {
  const Time end = settings_.duration ? start_ + *settings_.duration : never;
  const EndAt end_at(encoder_, end);
  Pace pace(settings_.rate_hz);
  Encoder::Parts::of(encoder_).period = pace.period();
  pace.start_at(start_);
  Sample sample;
  const auto note_missed = [&] {
    const std::uint64_t missed = pace.take_missed();
    // Missed readings are counted only while the port is open: while it is lost, the row of the loss stands for them.
    const bool was_there = sample.kind == Sample::Kind::reading || sample.kind == Sample::Kind::failed;
    if (was_there) miss(missed);
  };
  bool has_all = false;
  try {
    while (os::now() < end && !os::interrupted()) {
      sample = encoder_.next();
      take(sample);
      if (on_written) on_written(sample);
      has_all = settings_.count != 0 && taken_ >= settings_.count;
      if (has_all) break;
      pace.wait(end, [this](Time time) { Encoder::Parts::of(encoder_).wait_until(time); });
      note_missed();
    }
  } catch (const os::Interrupted&) {
  } catch (const Cancelled&) {
  }
  // leaves out readings that were due while the last reading was taken, and counts them as missed
  if (!has_all) pace.leave_out(end);
  note_missed();
  write_gap();
  file_->finish();
  return sample.kind == Sample::Kind::reading;
}

std::string Recording::Parts::part_path(unsigned part) const {
  if (!settings_.part_bytes && !settings_.part_time) return settings_.path;
  const fs::path path = os::path_of(settings_.path);
  const std::string name = fmt::format("{}-{:04}{}", os::name_of(path.stem()), part, os::name_of(path.extension()));
  return os::name_of(path.parent_path() / os::path_of(name));
}

// Throws if the folder has parts of an older recording with the same name: new parts count up, and might reach the
// number of an old part.
void Recording::Parts::refuse_parts_of_another_recording() const {
  const fs::path path = os::path_of(settings_.path);
  const std::string begin = os::name_of(path.stem()) + "-";
  const std::string ending = os::name_of(path.extension());
  std::error_code error;  // ignored: an unreadable folder is reported when the file is created
  for (const fs::directory_entry& entry :
       fs::directory_iterator(path.has_parent_path() ? path.parent_path() : ".", error)) {
    const std::string name = os::name_of(entry.path().filename());
    if (!name.starts_with(begin) || !name.ends_with(ending) || name.size() < begin.size() + ending.size() + 4) continue;
    const std::string number = name.substr(begin.size(), name.size() - begin.size() - ending.size());
    if (!std::all_of(number.begin(), number.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) continue;
    throw UsageError(fmt::format("there is already a part of another recording, {}: choose another name",
                                 os::name_of(entry.path())));
  }
}

void Recording::Parts::open_part() {
  if (file_) {
    file_->finish();
    finished_bytes_ += file_->size();
    finished_ += file_->counts();
  }
  ++part_;
  part_start_ = os::now();
  file_ = make_record_file(part_path(part_), rows_.columns(), header());
}

RecordHeader Recording::Parts::header() const {
  const Model* known = encoder_.options().model;
  return {.encoder = settings_.encoder,
          .protocol = std::string(encoder_.unit().id),
          .model = std::string(known != nullptr ? known->name : "none"),
          .options = fmt::format("{}", fmt::join(option_texts(encoder_.unit(), encoder_.options()), " ")),
          .started = started_,
          .rate_hz = settings_.rate_hz,
          .every = settings_.every,
          .part = part_};
}

bool Recording::Parts::wanted(const Sample& sample) {
  if (sample.kind == Sample::Kind::absent) return false;
  if (sample.kind != Sample::Kind::reading) return true;
  const Reading& reading = sample.reading;
  const bool other_alarms = reading.alarms != alarms_ || reading.alarms_reported != alarms_reported_;
  alarms_ = reading.alarms;
  alarms_reported_ = reading.alarms_reported;
  return offered_++ % settings_.every == 0 || other_alarms;
}

void Recording::Parts::miss(std::uint64_t readings) {
  if (readings == 0) return;
  gap_ += readings;
  gap_at_ = os::now();
}

void Recording::Parts::write_gap() {
  if (gap_ == 0) return;
  const std::uint64_t missed = std::exchange(gap_, 0);
  file_->append(rows_.of_gap(gap_at_, missed), {.gaps = 1, .missed = missed});
}

void Recording::Parts::take(const Sample& sample) {
  if (!wanted(sample)) return file_->require_there();
  const bool full = settings_.part_bytes && file_->size() >= *settings_.part_bytes;
  const bool over = settings_.part_time && os::now() - part_start_ >= *settings_.part_time;
  if (full || over) open_part();
  write_gap();
  const std::uint64_t is_reading = sample.kind == Sample::Kind::reading ? 1 : 0;
  const std::uint64_t is_failure = sample.kind == Sample::Kind::failed ? 1 : 0;
  file_->append(rows_.of(sample), {.readings = is_reading, .failures = is_failure});
  taken_ += is_reading;
}

std::vector<std::string> Recording::Parts::paths() const {
  std::vector<std::string> paths;
  for (unsigned part = 1; part <= part_; ++part) paths.push_back(part_path(part));
  return paths;
}

Recording::Recording(const RecordingSettings& settings, Encoder& encoder)
    : parts_(std::make_unique<Parts>(settings, encoder)) {}
Recording::~Recording() = default;

bool Recording::run(const std::function<void(const Sample&)>& on_written) { return parts_->run(on_written); }
RecordCounts Recording::counts() const { return parts_->counts(); }
std::uint64_t Recording::bytes() const { return parts_->bytes(); }
Time Recording::start() const { return parts_->start(); }
std::vector<std::string> Recording::paths() const { return parts_->paths(); }

std::string Recording::names() const {
  const std::vector<std::string> all = paths();
  return all.size() == 1 ? all.front() : fmt::format("{} to {}", all.front(), all.back());
}

}  // namespace absenc::client
