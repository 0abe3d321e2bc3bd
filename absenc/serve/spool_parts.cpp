// SPDX-License-Identifier: Apache-2.0
// Files of a spool: loading at the start, creating, dropping, deleting.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/serve/spool.hpp"

namespace absenc::serve {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view part_suffix = ".part";

// Returns the greatest size of a file of the spool in bytes. It is small on a nearly full disk, because only deleting
// a whole file frees space.
std::size_t part_bytes(std::int64_t most, const std::string& folder) {
  std::error_code error;
  const std::uintmax_t free = fs::space(os::path_of(folder), error).available;
  const std::int64_t share = error || free > 1'000'000'000 ? most : static_cast<std::int64_t>(free);
  return static_cast<std::size_t>(std::clamp<std::int64_t>(std::min(most, share) / 32, 32'000, 4'000'000));
}

}  // namespace

// A regular file at the path of the spool folder is renamed: it may be a spool of an older absenc, or no spool.
void Spool::open_folder() {
  std::error_code error;
  const fs::path path = os::path_of(path_);
  if (fs::exists(path, error) && !fs::is_directory(path, error)) set_aside(path_);
  folder_.emplace(path_);
}

void Spool::load() {
  std::vector<std::int64_t> numbers;
  std::error_code error;
  for (fs::directory_iterator entry(os::path_of(path_), error), end; !error && entry != end; entry.increment(error)) {
    const std::string stem = os::name_of(entry->path().stem());
    const bool is_number = !stem.empty() && stem.size() < 18 &&
                           std::all_of(stem.begin(), stem.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (entry->path().extension() == part_suffix && is_number) numbers.push_back(std::stoll(stem));
  }
  std::sort(numbers.begin(), numbers.end());
  for (const std::int64_t number : numbers) load_part(number);
}

void Spool::load_part(std::int64_t number) {
  next_part_ = std::max(next_part_, number + 1);
  try {
    const SpoolFile file(path_of(number));
    Part part{number};
    std::size_t offset = 0;
    while (const std::optional<SpoolFile::StoredMessage> one = file.next(offset, &facts_)) {
      if (part.first_id == 0) part.first_id = one->message.id;
      part.last_id = one->message.id;
      facts_.next_id = std::max(facts_.next_id, one->message.id + 1);
      if (one->arrived) continue;
      part.waiting += {1, one->message.readings};
      part.waiting_bytes += spool_bytes(one->message);
    }
    part.bytes = file.log().size();
    part.damaged = offset != part.bytes;
    if (part.damaged) {
      const std::lock_guard lock(shown_mutex_);
      notes_.push_back(
          fmt::format("{} of the spool cannot be read from byte {} of {} on: the messages before it are sent, then "
                      "the file is renamed",
                      path_of(number), offset, part.bytes));
    }
    parts_.push_back(part);
  } catch (const os::Failure& failure) {
    if (failure.kind() == os::Failure::Kind::unsupported) throw;
    const std::lock_guard lock(shown_mutex_);
    notes_.push_back(fmt::format("a file of the spool is not used: {}", failure.what()));
  }
}

// Opens the spool again if its folder or its newest file was removed or moved.
void Spool::check_folder() {
  if (folder_ && folder_->is_there() && (newest_ == nullptr || newest_->log().is_there())) return;
  if (folder_) {
    if (newest_ != nullptr) rescue_newest();
    const std::string why = fmt::format("the spool {} was removed", path_);
    if (!folder_->is_there()) {
      for (const Part& part : parts_) drop(part.waiting, why);
      std::erase_if(places_, [](const auto& one) { return one.second.part != 0; });
      parts_.clear();
    }
    newest_.reset();
    older_.reset();
    older_number_ = 0;
    folder_.reset();
    const std::lock_guard lock(shown_mutex_);
    notes_.push_back(why + " or replaced: it is created again");
  }
  open_folder();
  if (parts_.empty()) load();
}

void Spool::rescue_newest() {
  std::vector<Message> rescued;
  std::size_t offset = 0;
  const std::int64_t number = parts_.back().number;
  try {
    while (std::optional<SpoolFile::StoredMessage> one = newest_->next(offset, nullptr)) {
      if (!one->arrived && !unmarked_.contains(one->message.id)) rescued.push_back(std::move(one->message));
    }
  } catch (const os::Failure&) {  // after a disk error, the remaining messages of this file are lost
  }
  Counts lost = parts_.back().waiting;
  for (const Message& one : rescued) lost -= {1, one.readings};
  if (lost.messages != 0) drop(lost, "the spool's newest file cannot be read");
  parts_.pop_back();
  for (auto& [id, place] : places_) {
    if (place.part == number) place.part = 0;
  }
  for (const Message& one : rescued) {
    memory_counts_ += {1, one.readings};
    memory_bytes_ += spool_bytes(one);
  }
  memory_.insert(memory_.begin(), std::make_move_iterator(rescued.begin()), std::make_move_iterator(rescued.end()));
}

void Spool::begin_part() {
  if (newest_ != nullptr) newest_->log().sync();
  auto file = std::make_unique<SpoolFile>(path_of(next_part_), facts_);
  newest_ = std::move(file);
  unwritten_numbers_.clear();
  part_limit_ = part_bytes(most_bytes_, path_);
  parts_.push_back({next_part_++});
  parts_.back().bytes = newest_->log().size();
}

void Spool::drop_part(std::size_t index, const std::string& why) {
  const Part part = parts_[index];
  if (part.waiting.messages != 0) drop(part.waiting, why);
  std::erase_if(places_, [&](const auto& one) { return one.second.part == part.number; });
  unmarked_.erase(unmarked_.lower_bound(part.first_id), unmarked_.upper_bound(part.last_id));
  parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(index));
  if (older_number_ == part.number) {
    older_.reset();
    older_number_ = 0;
  }
  if (part.damaged) return set_aside(path_of(part.number));
  std::error_code ignored;
  fs::remove(os::path_of(path_of(part.number)), ignored);
}

// The messages of the file that cannot be read are reported as dropped.
void Spool::recount(Part& part) {
  Counts readable;
  std::int64_t bytes = 0;
  std::size_t offset = 0;
  while (const std::optional<SpoolFile::StoredMessage> one = file_of(part).next(offset, nullptr)) {
    if (one->arrived || unmarked_.contains(one->message.id)) continue;
    readable += {1, one->message.readings};
    bytes += spool_bytes(one->message);
  }
  std::erase_if(places_,
                [&](const auto& one) { return one.second.part == part.number && one.second.offset >= offset; });
  Counts lost = part.waiting;
  lost -= readable;
  part.waiting = readable;
  part.waiting_bytes = bytes;
  part.damaged = true;
  drop(lost, fmt::format("{} cannot be read from byte {} of {} on", path_of(part.number), offset, part.bytes));
}

// Deletes files without waiting messages. The last file stays, because it has the numbers of the next readings.
void Spool::tidy() {
  if (newest_ != nullptr && !condition_.trouble.empty() && parts_.back().waiting.messages == 0) {
    if (newest_->log().shrink_to(spool_head(facts_))) {
      unwritten_numbers_.clear();
      parts_.back() = {parts_.back().number};
      parts_.back().bytes = newest_->log().size();
      read_position_ = {};
    }
  }
  for (std::size_t i = 0; i + 1 < parts_.size();) {
    if (parts_[i].waiting.messages == 0) {
      drop_part(i, {});
    } else {
      ++i;
    }
  }
}

SpoolFile& Spool::file_of(const Part& part) {
  if (newest_ != nullptr && part.number == parts_.back().number) return *newest_;
  if (older_number_ != part.number) {
    older_ = std::make_unique<SpoolFile>(path_of(part.number));
    older_number_ = part.number;
  }
  return *older_;
}

Spool::Part* Spool::find_part(std::int64_t number) {
  const auto found = std::find_if(parts_.begin(), parts_.end(), [&](const Part& one) { return one.number == number; });
  return found == parts_.end() ? nullptr : &*found;
}

std::string Spool::path_of(std::int64_t number) const { return fmt::format("{}/{:010}{}", path_, number, part_suffix); }

// Renames the file at `path` within its folder, which needs no free space.
void Spool::set_aside(const std::string& path) {
  std::error_code error;
  std::string to = path + ".bad";
  for (int i = 2; fs::exists(os::path_of(to), error); ++i) to = fmt::format("{}.bad{}", path, i);
  fs::rename(os::path_of(path), os::path_of(to), error);
  const std::lock_guard lock(shown_mutex_);
  notes_.push_back(error ? fmt::format("{} cannot be read, nor renamed: {}", path, error.message())
                         : fmt::format("{} was no file of the spool, or damaged: it was renamed to {}", path, to));
}

}  // namespace absenc::serve
