// SPDX-License-Identifier: Apache-2.0
// Messages on disk until a broker has taken them: kill -9 loses none that is there.
//
// A folder of files that are only appended to (spool_file.hpp). A file whose messages have all arrived is deleted, so
// that draining a full disk needs no room on it. While nothing can be written, new messages wait in memory, as far as
// there is room, and are sent from there.
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

/// Any thread may use it. Nothing but the constructor throws: trouble with the disk is in `condition`.
class Spool {
 public:
  struct Counts {
    std::uint64_t messages = 0;
    std::uint64_t readings = 0;

    Counts& operator+=(const Counts& other);
    Counts& operator-=(const Counts& other);
  };

  /// At most `bytes` of files. Throws Failure when another process has it or the folder around it is missing. A disk
  /// that is full or cannot be written is none: it goes on in memory.
  Spool(std::string path, std::int64_t bytes);

  /// Random, but the same for as long as the spool is kept: 16 characters.
  [[nodiscard]] const std::string& source() const { return facts_.source; }
  /// Random, and another each time that the spool is opened: 16 characters.
  [[nodiscard]] const std::string& run() const { return run_; }
  /// The number after the last one that an encoder's readings had; by its name.
  [[nodiscard]] std::map<std::string, std::uint64_t> next_numbers();
  /// The least that no message has had.
  [[nodiscard]] std::int64_t next_id();

  /// All of it, with the numbers that follow. What no longer has room, the oldest first, is dropped.
  void add(const std::vector<Message>& messages, const std::map<std::string, std::uint64_t>& next_numbers);
  /// Up to `most` behind `id`, in order.
  [[nodiscard]] std::vector<Message> after(std::int64_t id, std::size_t most);
  /// They have arrived.
  void remove(const std::vector<std::int64_t>& ids);
  /// Nothing more is known of this encoder.
  void forget(const std::string& encoder);

  [[nodiscard]] Counts held() const;
  [[nodiscard]] std::int64_t held_bytes() const;

  struct Condition {
    std::string trouble{};   // why messages cannot be written; "": they are
    bool in_memory = false;  // messages wait there, which kill -9 loses
  };
  [[nodiscard]] Condition condition() const;

  struct Dropped {
    Counts counts{};
    std::string why{};  // of the last ones
  };
  /// Since the last call.
  [[nodiscard]] Dropped take_dropped();
  /// Sentences about what happened to the files since the last call.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  struct Part {  // one file
    std::int64_t number = 0;
    std::int64_t first_id = 0, last_id = 0;
    Counts waiting{};
    std::int64_t waiting_bytes = 0;
    std::size_t bytes = 0;
    bool damaged = false;  // something in it cannot be read: it is set aside, not deleted
  };
  struct Place {            // of a message that `after` has returned
    std::int64_t part = 0;  // 0: in memory
    std::size_t offset = 0;
    std::uint64_t readings = 0;
    std::int64_t bytes = 0;
  };

  void open_folder();
  void load();
  void load_part(std::int64_t number);
  void look_at_folder();
  void rescue_newest();
  void write_waiting();
  bool write_some();
  void begin_part();
  void drop_for_room();
  void drop_part(std::size_t index, const std::string& why);
  void collect_of(Part& part, std::int64_t id, std::size_t most, std::vector<Message>& found);
  void count_again(Part& part);
  void settle_one(std::int64_t id, const Place& place);
  void tidy();
  SpoolFile& file_of(const Part& part);
  [[nodiscard]] Part* find_part(std::int64_t number);
  [[nodiscard]] std::string path_of(std::int64_t number) const;
  void set_aside(const std::string& path);
  void fail(const std::string& why);
  void drop(const Counts& counts, const std::string& why);
  void show();

  std::string path_;
  std::int64_t most_bytes_;
  std::string run_;

  std::mutex mutex_;  // guards what follows
  SpoolFacts facts_;
  std::map<std::string, std::uint64_t> unwritten_numbers_;
  std::optional<os::OwnedFolder> folder_;
  std::deque<Part> parts_;             // the oldest first
  std::unique_ptr<SpoolFile> newest_;  // of the last part, which is appended to; null while there is none
  std::int64_t next_part_ = 1;
  std::size_t part_limit_ = 0;
  std::unique_ptr<SpoolFile> older_;  // the one that was read last
  std::int64_t older_number_ = 0;
  struct {
    std::int64_t part = 0, id = 0;
    std::size_t offset = 0;
  } read_to_;                   // where `after` ended
  std::deque<Message> memory_;  // behind all parts
  Counts memory_counts_{};
  std::int64_t memory_bytes_ = 0;
  std::unordered_map<std::int64_t, Place> places_;
  std::set<std::int64_t> unmarked_;  // arrived, but the disk did not take the mark

  mutable std::mutex shown_mutex_;  // guards what follows, so that nobody waits for the disk who only asks
  Counts held_{};
  std::int64_t held_bytes_ = 0;
  Condition condition_{};
  Dropped dropped_{};
  std::vector<std::string> notes_;
};

}  // namespace absenc::serve
