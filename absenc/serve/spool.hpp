// SPDX-License-Identifier: Apache-2.0
// Stores MQTT messages on disk until the broker has acknowledged them.
//
// The spool is a folder of files (spool_file.hpp). Acknowledged messages are marked in place, so sending needs no
// free space on the disk. While the disk cannot be written, new messages wait in memory, up to a limit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absenc/os/log_file.hpp"
#include "absenc/serve/spool_file.hpp"

namespace absenc::serve {

/// A store of messages on disk. Thread-safe. `condition` reports disk errors.
class Spool {
 public:
  struct Counts {
    std::uint64_t messages = 0;
    std::uint64_t readings = 0;

    Counts& operator+=(const Counts& other);
    Counts& operator-=(const Counts& other);
  };

  /// Opens the spool in the folder `path`; `bytes` limits the size of its files. Throws Failure if the spool is in
  /// use, if a newer absenc has written it, or if the folder above it is missing; `condition` reports other disk
  /// errors.
  Spool(std::string path, std::int64_t bytes);

  /// Returns a random text of 16 characters that stays the same as long as the spool exists.
  [[nodiscard]] const std::string& source() const { return facts_.source; }
  /// Returns a random text of 16 characters that is different each time the spool is opened.
  [[nodiscard]] const std::string& run() const { return run_; }
  /// Returns for each encoder, by name, the number that its next reading gets.
  [[nodiscard]] std::map<std::string, std::uint64_t> next_numbers();
  /// Returns the smallest message id that is not used yet.
  [[nodiscard]] std::int64_t next_id();

  /// Stores messages, and the next reading numbers of encoders; may drop the oldest messages.
  void add(const std::vector<Message>& messages, const std::map<std::string, std::uint64_t>& next_numbers);
  /// Returns up to `most` messages with ids above `id`, in ascending order.
  [[nodiscard]] std::vector<Message> after(std::int64_t id, std::size_t most);
  /// Removes messages that the broker has acknowledged, by their ids.
  void remove(const std::vector<std::int64_t>& ids);
  /// Forgets the number of the next reading of `encoder`.
  void forget(const std::string& encoder);

  [[nodiscard]] Counts stored() const;
  [[nodiscard]] std::int64_t stored_bytes() const;

  struct Condition {
    std::string trouble{};   // why messages cannot be written to disk; "" without an error
    bool in_memory = false;  // whether messages wait in memory, where kill -9 loses them
  };
  [[nodiscard]] Condition condition() const;

  struct Dropped {
    Counts counts{};
    std::string why{};  // why messages were dropped most recently
  };
  /// Returns how many messages were dropped since the last call, and why.
  [[nodiscard]] Dropped take_dropped();
  /// Returns sentences about the spool's files and disk errors since the last call, for events.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  struct Part {  // one file of the spool
    std::int64_t number = 0;
    std::int64_t first_id = 0, last_id = 0;
    Counts waiting{};
    std::int64_t waiting_bytes = 0;
    std::size_t bytes = 0;
    bool damaged = false;  // whether a part of the file cannot be read; such a file is renamed instead of deleted
  };
  struct Place {            // place and size of a stored message that `after` has returned
    std::int64_t part = 0;  // number of the file with the message; 0: the message is in memory
    std::size_t offset = 0;
    std::uint64_t readings = 0;
    std::int64_t bytes = 0;
  };

  void open_folder();
  void load();
  void load_part(std::int64_t number);
  void check_folder();
  void rescue_newest();
  void write_waiting();
  bool write_some();
  void begin_part();
  void drop_for_room();
  void drop_part(std::size_t index, const std::string& why);
  void collect_from(Part& part, std::int64_t id, std::size_t most, std::vector<Message>& found);
  void recount(Part& part);
  void remove_one(std::int64_t id, const Place& place);
  void tidy();
  SpoolFile& file_of(const Part& part);
  [[nodiscard]] Part* find_part(std::int64_t number);
  [[nodiscard]] std::string path_of(std::int64_t number) const;
  void set_aside(const std::string& path);
  void fail(const std::string& why);
  void drop(const Counts& counts, const std::string& why);
  void update_counts();

  std::string path_;
  std::int64_t most_bytes_;
  std::string run_;

  std::mutex mutex_;  // mutex that guards the members from here to `shown_mutex_`
  SpoolFacts facts_;
  std::map<std::string, std::uint64_t> unwritten_numbers_;
  std::optional<os::OwnedFolder> folder_;
  std::deque<Part> parts_;             // files of the spool, oldest first
  std::unique_ptr<SpoolFile> newest_;  // the last file of `parts_`, which gets new messages; null if none is open
  std::int64_t next_part_ = 1;
  std::size_t part_limit_ = 0;
  std::unique_ptr<SpoolFile> older_;  // the file other than `newest_` from which messages were read last; kept open
  std::int64_t older_number_ = 0;
  struct {
    std::int64_t part = 0, id = 0;
    std::size_t offset = 0;
  } read_position_;             // place at which the last call of `after` stopped reading
  std::deque<Message> memory_;  // messages that wait for the disk; newer than all messages in files
  Counts memory_counts_{};
  std::int64_t memory_bytes_ = 0;
  std::unordered_map<std::int64_t, Place> places_;
  std::set<std::int64_t> unmarked_;  // ids of acknowledged messages whose mark the disk did not store

  // Mutex that guards all members below, so that reading them never waits for the disk.
  mutable std::mutex shown_mutex_;
  Counts stored_{};
  std::int64_t stored_bytes_ = 0;
  Condition condition_{};
  Dropped dropped_{};
  std::vector<std::string> notes_;
};

}  // namespace absenc::serve
