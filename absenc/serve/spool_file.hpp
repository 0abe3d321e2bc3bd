// SPDX-License-Identifier: Apache-2.0
// One file of the spool: a sequence of records. The fields of a record with their sizes in bytes, the numbers in the
// byte order of this computer:
//
//   checksum (4) | size of the body (4) | kind (1) | arrived (1) | body
//
// `arrived` shows whether the broker has acknowledged the message in the record. A file begins with a record that holds
// the format of the file; those of absenc 0.1.0 have none.
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
  std::int64_t id = 0;  // number of the message; ascends from message to message as long as the spool exists
  std::string topic{};
  std::string payload{};
  std::uint64_t readings = 0;  // number of readings in the message
};

/// Returns the approximate number of bytes that a message needs in the spool.
[[nodiscard]] inline std::int64_t spool_bytes(const Message& message) {
  return static_cast<std::int64_t>(message.topic.size() + message.payload.size()) + 32;
}

/// The identity of the spool and the numbers from which it continues. Each file of the spool begins with them, so that
/// older files can be deleted.
struct SpoolFacts {
  std::string source{};
  std::int64_t next_id = 1;
  std::map<std::string, std::uint64_t> next_numbers{};  // number of the next reading, by name of the encoder
};

[[nodiscard]] std::string spool_record(const Message& message);
[[nodiscard]] std::string spool_record(const SpoolFacts& facts);
/// Returns the records with which a file begins: its format, and `facts`.
[[nodiscard]] std::string spool_head(const SpoolFacts& facts);
/// Returns a record that deletes the number of the next reading of `encoder`.
[[nodiscard]] std::string spool_record_without(std::string_view encoder);

class SpoolFile {
 public:
  /// Creates a file that begins with `facts`. Throws os::Failure.
  SpoolFile(const std::string& path, const SpoolFacts& facts);
  /// Opens an existing file. Throws os::Failure, of kind `unsupported` if a newer absenc has written it.
  explicit SpoolFile(const std::string& path);

  [[nodiscard]] os::LogFile& log() { return log_; }
  [[nodiscard]] const os::LogFile& log() const { return log_; }

  struct StoredMessage {
    Message message{};
    std::size_t offset = 0;  // offset of the record of the message in the file
    bool arrived = false;
  };
  /// Returns the next message at or after `offset` and moves `offset` behind it; nothing at the end of the file or at
  /// a damaged record. Records that contain SpoolFacts instead of a message are skipped, and their content is stored in
  /// `facts` unless it is null. Throws os::Failure.
  [[nodiscard]] std::optional<StoredMessage> next(std::size_t& offset, SpoolFacts* facts) const;
  /// Marks the message at `offset` as acknowledged. Returns 0 or the errno of the write.
  [[nodiscard]] int mark_arrived(std::size_t offset) const;

 private:
  struct StoredRecord {
    char kind = 0;
    bool arrived = false;
    std::string body{};
    std::size_t end = 0;  // offset of the next record
  };
  [[nodiscard]] std::optional<StoredRecord> read_record(std::size_t offset) const;

  os::LogFile log_;
};

}  // namespace absenc::serve
