// SPDX-License-Identifier: Apache-2.0
// Messages on disk until a broker has taken them, in one SQLite file: kill -9 loses none that is in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "absenc/serve/sqlite.hpp"

namespace absenc::serve {

struct Message {
  std::int64_t id = 0;  // ascends for as long as the file is kept
  std::string topic{};
  std::string payload{};
  std::uint64_t readings = 0;  // in it
};

/// Any thread may use it.
class Spool {
 public:
  struct Counts {
    std::uint64_t messages = 0;
    std::uint64_t readings = 0;
  };

  /// At most `bytes` of messages. Throws Failure when the file cannot be opened, is something else, or is in use.
  Spool(const std::string& path, std::int64_t bytes);

  /// Random, but the same for as long as the file is kept: 16 characters.
  [[nodiscard]] const std::string& source() const { return source_; }
  /// Random, and another each time that the file is opened: 16 characters.
  [[nodiscard]] const std::string& run() const { return run_; }
  /// The number after the last one that an encoder's readings had; by its name.
  [[nodiscard]] std::map<std::string, std::uint64_t> next_numbers();
  /// The least that no message has had.
  [[nodiscard]] std::int64_t next_id();

  /// All of it, with the numbers that follow, or nothing. Then it is in the file. What no longer has room, the oldest
  /// first, is dropped: returns how much. Throws Failure: nothing was added.
  Counts add(const std::vector<Message>& messages, const std::map<std::string, std::uint64_t>& next_numbers);
  /// Up to `most` behind `id`, in order. Throws Failure.
  [[nodiscard]] std::vector<Message> after(std::int64_t id, std::size_t most);
  /// They have arrived. Throws Failure: then they are still there.
  void remove(const std::vector<std::int64_t>& ids);
  /// Nothing more is known of this encoder. Throws Failure.
  void forget(const std::string& encoder);

  [[nodiscard]] Counts held() const;
  [[nodiscard]] std::int64_t held_bytes() const;

 private:
  struct Held {
    Counts counts{};
    std::int64_t bytes = 0;
  };
  template <class Work>
  void commit(const Work& work);
  void hold(const Held& now);
  Held drop_oldest(std::int64_t bytes);

  Sqlite sqlite_;
  std::int64_t most_bytes_;
  std::string source_;
  std::string run_;
  std::mutex mutex_;               // guards the file
  Held held_;                      // written with both locked
  mutable std::mutex held_mutex_;  // so that nobody waits for the disk who only asks how much there is
};

}  // namespace absenc::serve
