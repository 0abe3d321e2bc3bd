// SPDX-License-Identifier: Apache-2.0
// What a command asks the operating system about itself: its standard streams, its processor time, files it replaces.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// From here on a closed pipe and a file that reached its limit (`ulimit -f`) are errors of writing, no longer the end
/// of the process, and a standard stream that was
/// closed cannot become a port: that gets the lowest free number, and with standard output closed the readings would
/// go to the encoder. Writing to a standard output that was closed fails. Throws Failure.
void protect_standard_streams();

/// Hands `bytes` to the system; when they do not all fit into a file, none of them stays. Returns 0, or the error of
/// the system.
[[nodiscard]] int write_standard_output(std::string_view bytes);

[[nodiscard]] bool is_terminal(int descriptor);

/// User and system time of this process so far.
[[nodiscard]] Time processor_time();

/// How long the thread that makes it was ready to run and was not let run, because others ran: what it missed
/// meanwhile it could not have seen earlier.
class RunDelay {
 public:
  RunDelay();
  /// Since it was made, or the last call; 0 where the kernel does not tell (proc(5), schedstat).
  [[nodiscard]] Time take();

 private:
  Descriptor file_;
  Time before_{};
};

/// Whether `replace_file` may replace this existing file. A file that is itself protected is not to be replaced,
/// although its directory would allow it. Returns 0 or a value of errno.
[[nodiscard]] int replaceable(const std::string& path);

enum class Durable : std::uint8_t { no, yes };

/// A file that takes the place of `path` when it is whole; otherwise nobody sees it. Throws Failure.
class NewFile {
 public:
  explicit NewFile(const std::string& path);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  [[nodiscard]] int descriptor() const { return file_.get(); }
  /// By which it can be opened meanwhile.
  [[nodiscard]] const std::string& path() const { return meanwhile_; }
  void write(std::string_view content);
  /// `Durable::yes` waits for the disk. Returns the file, open.
  Descriptor take_place(Durable durable);

 private:
  std::string path_;
  std::string meanwhile_;
  std::string beside_;  // its name as long as it has one of its own
  Descriptor file_;
};

/// A file in this folder ("": the working directory) that nobody sees and that is gone when it is closed. Throws
/// Failure.
[[nodiscard]] Descriptor nameless_file(const std::string& folder);

/// Writes a new file and puts it in the place of the old one, so that there is always a whole one. Throws Failure.
void replace_file(const std::string& path, std::string_view content, Durable durable);

}  // namespace absenc::os
