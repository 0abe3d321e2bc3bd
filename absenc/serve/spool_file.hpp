// SPDX-License-Identifier: Apache-2.0
// One file of the spool: records that are appended and never moved. A message that has arrived is marked in its place,
// which needs no room on the disk.
//
//   checksum (4) | size of the body (4) | kind (1) | arrived (1) | body       numbers in the order of this computer
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "absenc/os/log_file.hpp"

namespace absenc::serve {

struct Message {
  std::int64_t id = 0;  // ascends for as long as the spool is kept
  std::string topic{};
  std::string payload{};
  std::uint64_t readings = 0;  // in it
};

/// The bytes that a message takes in the spool: its texts, and its record around them.
[[nodiscard]] inline std::int64_t spool_bytes(const Message& message) {
  return static_cast<std::int64_t>(message.topic.size() + message.payload.size()) + 32;
}

/// Each file begins with these, so that the others may be deleted.
struct SpoolFacts {
  std::string source{};
  std::int64_t next_id = 1;
  std::map<std::string, std::uint64_t> next_numbers{};  // of readings, by encoder
};

[[nodiscard]] std::string spool_record(const Message& message);
[[nodiscard]] std::string spool_record(const SpoolFacts& facts);
/// A record that forgets an encoder's number.
[[nodiscard]] std::string spool_record_without(std::string_view encoder);

class SpoolFile {
 public:
  /// A new one, with `facts`. Throws os::Failure.
  SpoolFile(const std::string& path, const SpoolFacts& facts);
  /// One that is there. Throws os::Failure.
  explicit SpoolFile(const std::string& path);

  [[nodiscard]] os::LogFile& log() { return log_; }
  [[nodiscard]] const os::LogFile& log() const { return log_; }

  struct Found {
    Message message{};
    std::size_t offset = 0;  // of its record
    bool arrived = false;
  };
  /// The next message from `offset` on, which is then behind it; facts before it go into `facts`, unless that is null.
  /// Nothing at the end, and where a record is broken: then `offset` is not that of the end. Throws os::Failure.
  [[nodiscard]] std::optional<Found> next(std::size_t& offset, SpoolFacts* facts) const;
  /// Returns 0 or the error of the system.
  [[nodiscard]] int mark_arrived(std::size_t offset) const;

 private:
  os::LogFile log_;
};

}  // namespace absenc::serve
