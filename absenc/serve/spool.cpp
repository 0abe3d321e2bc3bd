// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/spool.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "absenc/client/error.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"

namespace absenc::serve {

using namespace client;
namespace fs = std::filesystem;

namespace {

// Approximate greatest size in bytes of a write to the spool; a nearly full disk may still accept a small write.
constexpr std::size_t write_size = 65536;

std::int64_t memory_bytes(std::int64_t most) { return std::clamp<std::int64_t>(most / 16, 64'000, 4'000'000); }

std::string random_text() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

}  // namespace

Spool::Counts& Spool::Counts::operator+=(const Counts& other) {
  messages += other.messages;
  readings += other.readings;
  return *this;
}

Spool::Counts& Spool::Counts::operator-=(const Counts& other) {
  messages -= other.messages;
  readings -= other.readings;
  return *this;
}

Spool::Spool(std::string path, std::int64_t bytes) : path_(std::move(path)), most_bytes_(bytes), run_(random_text()) {
  try {
    open_folder();
    load();
    if (facts_.source.empty()) facts_.source = random_text();
    begin_part();
    tidy();
  } catch (const os::Failure& failure) {
    using enum os::Failure::Kind;
    const bool is_ours = failure.kind() != in_use && failure.kind() != not_found && failure.kind() != unsupported;
    if (!is_ours) throw Failure(fmt::format("the spool {}: {}", path_, failure.what()));
    fail(failure.what());
  }
  if (facts_.source.empty()) facts_.source = random_text();
  update_counts();
}

std::map<std::string, std::uint64_t> Spool::next_numbers() {
  const std::lock_guard lock(mutex_);
  return facts_.next_numbers;
}

std::int64_t Spool::next_id() {
  const std::lock_guard lock(mutex_);
  return facts_.next_id;
}

void Spool::add(const std::vector<Message>& messages, const std::map<std::string, std::uint64_t>& next_numbers) {
  const std::lock_guard lock(mutex_);
  for (const Message& one : messages) {
    memory_.push_back(one);
    memory_counts_ += {1, one.readings};
    memory_bytes_ += spool_bytes(one);
    facts_.next_id = std::max(facts_.next_id, one.id + 1);
  }
  for (const auto& [name, next] : next_numbers) facts_.next_numbers[name] = unwritten_numbers_[name] = next;
  try {
    check_folder();
    write_waiting();
  } catch (const os::Failure& failure) {
    fail(failure.what());
  }
  drop_for_room();
  update_counts();
}

void Spool::write_waiting() {
  if (newest_ == nullptr) begin_part();
  while (write_some()) {
    const std::size_t bytes = parts_.back().bytes;
    if (bytes > part_limit_ && bytes > part_limit_ + spool_head(facts_).size()) begin_part();
  }
  const std::lock_guard lock(shown_mutex_);
  if (std::exchange(condition_.trouble, {}).empty()) return;
  notes_.push_back(fmt::format("the spool {} can be written again", path_));
}

// Writes some of the messages that wait in memory. Returns false when nothing waits.
bool Spool::write_some() {
  if (memory_.empty() && unwritten_numbers_.empty()) return false;
  std::string bytes;
  // The numbers of the next readings are written before the messages: if the write is cut short, no number is used
  // twice.
  if (!unwritten_numbers_.empty()) bytes = spool_record({facts_.source, facts_.next_id, unwritten_numbers_});
  std::vector<std::size_t> offsets;
  const std::size_t start = newest_->log().size();
  for (const Message& one : memory_) {
    if (!offsets.empty() && bytes.size() > write_size) break;
    offsets.push_back(start + bytes.size());
    bytes += spool_record(one);
  }
  if (const int error = newest_->log().append(bytes); error != 0) {
    throw os::system_failure("writing " + path_of(parts_.back().number), error);
  }
  unwritten_numbers_.clear();
  Part& part = parts_.back();
  part.bytes = newest_->log().size();
  for (const std::size_t offset : offsets) {
    const Message& one = memory_.front();
    if (part.first_id == 0) part.first_id = one.id;
    part.last_id = one.id;
    part.waiting += {1, one.readings};
    part.waiting_bytes += spool_bytes(one);
    memory_counts_ -= {1, one.readings};
    memory_bytes_ -= spool_bytes(one);
    if (const auto place = places_.find(one.id); place != places_.end()) {
      place->second.part = part.number;
      place->second.offset = offset;
    }
    memory_.pop_front();
  }
  return true;
}

void Spool::drop_for_room() {
  std::int64_t bytes = 0;
  for (const Part& part : parts_) bytes += static_cast<std::int64_t>(part.bytes);
  while (bytes > most_bytes_ && parts_.size() > 1) {
    bytes -= static_cast<std::int64_t>(parts_.front().bytes);
    drop_part(0, "the spool is full");
  }
  while (memory_bytes_ > memory_bytes(most_bytes_) && !memory_.empty()) {
    const Message& oldest = memory_.front();
    drop({1, oldest.readings}, condition_.trouble);
    memory_counts_ -= {1, oldest.readings};
    memory_bytes_ -= spool_bytes(oldest);
    places_.erase(oldest.id);
    memory_.pop_front();
  }
}

std::vector<Message> Spool::after(std::int64_t id, std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<Message> found;
  for (std::size_t i = 0; i < parts_.size() && found.size() < most; ++i) {
    Part& part = parts_[i];
    if (part.waiting.messages == 0 || part.last_id <= id) continue;
    try {
      collect_from(part, id, most, found);
    } catch (const os::Failure&) {
      std::error_code error;
      // A file of the spool cannot be read. If it still exists, the error may be temporary, so its messages stay.
      if (fs::exists(os::path_of(path_of(part.number)), error)) break;
      drop_part(i--, fmt::format("{} was removed", path_of(part.number)));
    }
  }
  for (auto one = memory_.begin(); one != memory_.end() && found.size() < most; ++one) {
    if (one->id <= id) continue;
    places_[one->id] = {0, 0, one->readings, spool_bytes(*one)};
    found.push_back(*one);
  }
  update_counts();
  return found;
}

void Spool::collect_from(Part& part, std::int64_t id, std::size_t most, std::vector<Message>& found) {
  const SpoolFile& file = file_of(part);
  const bool continues = read_position_.part == part.number && read_position_.id <= id;
  std::size_t offset = continues ? read_position_.offset : 0;
  while (found.size() < most) {
    std::optional<SpoolFile::StoredMessage> one = file.next(offset, nullptr);
    if (!one) {
      if (offset < part.bytes && !part.damaged) recount(part);
      return;
    }
    read_position_ = {part.number, one->message.id, offset};
    if (one->arrived || one->message.id <= id || unmarked_.contains(one->message.id)) continue;
    places_[one->message.id] = {part.number, one->offset, one->message.readings, spool_bytes(one->message)};
    found.push_back(std::move(one->message));
  }
}

void Spool::remove(const std::vector<std::int64_t>& ids) {
  const std::lock_guard lock(mutex_);
  for (const std::int64_t id : ids) {
    const auto place = places_.find(id);
    if (place == places_.end()) continue;  // the message was dropped after it had been returned for sending
    remove_one(id, place->second);
    places_.erase(id);
  }
  tidy();
  update_counts();
}

void Spool::remove_one(std::int64_t id, const Place& place) {
  if (place.part == 0) {
    const auto found = std::find_if(memory_.begin(), memory_.end(), [&](const Message& one) { return one.id == id; });
    if (found == memory_.end()) return;
    memory_counts_ -= {1, place.readings};
    memory_bytes_ -= place.bytes;
    memory_.erase(found);
    return;
  }
  Part* part = find_part(place.part);
  if (part == nullptr) return;
  part->waiting -= {1, place.readings};
  part->waiting_bytes -= place.bytes;
  try {
    if (file_of(*part).mark_arrived(place.offset) == 0) return;
  } catch (const os::Failure&) {  // the file cannot be opened, so the acknowledgement is noted in memory only
  }
  unmarked_.insert(id);
}

void Spool::forget(const std::string& encoder) {
  const std::lock_guard lock(mutex_);
  facts_.next_numbers.erase(encoder);
  unwritten_numbers_.erase(encoder);
  if (newest_ == nullptr) return;
  // If this write fails, only the number of the encoder's next reading stays in the newest file, which does no harm.
  [[maybe_unused]] const int ignored = newest_->log().append(spool_record_without(encoder));
  parts_.back().bytes = newest_->log().size();
}

void Spool::fail(const std::string& why) {
  const std::lock_guard lock(shown_mutex_);
  if (std::exchange(condition_.trouble, "the spool: " + why).empty()) {
    notes_.push_back(
        fmt::format("the spool cannot be written: {}; new messages wait in memory, at most {} kB of them, and "
                    "are sent from there",
                    why, memory_bytes(most_bytes_) / 1000));
  }
}

void Spool::drop(const Counts& counts, const std::string& why) {
  const std::lock_guard lock(shown_mutex_);
  dropped_.counts += counts;
  dropped_.why = why;
}

void Spool::update_counts() {
  Counts stored = memory_counts_;
  std::int64_t bytes = memory_bytes_;
  for (const Part& part : parts_) {
    stored += part.waiting;
    bytes += part.waiting_bytes;
  }
  const std::lock_guard lock(shown_mutex_);
  stored_ = stored;
  stored_bytes_ = bytes;
  condition_.in_memory = !memory_.empty();
}

Spool::Counts Spool::stored() const {
  const std::lock_guard lock(shown_mutex_);
  return stored_;
}

std::int64_t Spool::stored_bytes() const {
  const std::lock_guard lock(shown_mutex_);
  return stored_bytes_;
}

Spool::Condition Spool::condition() const {
  const std::lock_guard lock(shown_mutex_);
  return condition_;
}

Spool::Dropped Spool::take_dropped() {
  const std::lock_guard lock(shown_mutex_);
  return std::exchange(dropped_, {});
}

std::vector<std::string> Spool::take_notes() {
  const std::lock_guard lock(shown_mutex_);
  return std::exchange(notes_, {});
}

}  // namespace absenc::serve
