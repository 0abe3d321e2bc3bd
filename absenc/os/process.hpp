// SPDX-License-Identifier: Apache-2.0
// Standard streams and processor time of this process, and files that it replaces.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/descriptor.hpp"

namespace absenc::os {

/// Protects this process from the state of its standard streams: writing to a closed pipe, or to a file at its size
/// limit, fails instead of ending the process, and closed streams are opened on /dev/null. Windows: line feeds stay as
/// they are. Throws Failure.
void protect_standard_streams();

/// Writes `bytes` to standard output. Returns 0 or a value of errno.
[[nodiscard]] int write_standard_output(std::string_view bytes);

/// Writes `bytes` to standard error, and ignores errors.
void write_standard_error(std::string_view bytes);

/// Returns whether the descriptor of a standard stream, 0 to 2, is a terminal.
[[nodiscard]] bool is_terminal(int descriptor);

/// The terminal of this process, as a library that draws on it must know it.
struct TerminalKind {
  const char* name = nullptr;  // null: the library finds it in the environment variable TERM
  bool has_faint_text = true;
};
[[nodiscard]] TerminalKind terminal_kind();

/// Returns the words of the command line in UTF-8, from the parameters of `main`.
[[nodiscard]] std::vector<std::string> command_words(int count, char** words);

/// Gives each thread that is started from now on a stack of 1 MiB, as Windows does anyway. Linux reserves 8 MiB, of
/// which a machine of 32 bits has addresses for less than 400.
void limit_thread_stacks();

/// Returns the processor time (user and system) that this process has used so far.
[[nodiscard]] Time processor_time();

/// A measurement of how long the thread that creates it waited for a processor.
class RunDelay {
 public:
  RunDelay();
  /// Returns how long the thread was ready to run but waited, since the last call or the constructor; 0 if the kernel
  /// does not report it.
  [[nodiscard]] Time take();

 private:
  Descriptor file_;
  Time last_total_{};
};

/// Checks whether `replace_file` may replace an existing file. Returns 0 or a value of errno.
[[nodiscard]] int replaceable(const std::string& path);

enum class Durable : std::uint8_t { no, yes };

/// A new file that `take_place` puts at `path`. Throws Failure.
class NewFile {
 public:
  explicit NewFile(const std::string& path);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  [[nodiscard]] int descriptor() const { return file_.get(); }
  /// Returns a path by which the new file can be opened before `take_place` gives it its name.
  [[nodiscard]] const std::string& path() const { return temporary_path_; }
  void write(std::string_view content);
  /// Gives the new file its name and returns its descriptor; with `Durable::yes`, waits first until its content is on
  /// the disk.
  Descriptor take_place(Durable durable);

 private:
  std::string path_;
  std::string temporary_path_;
  std::string temporary_name_;  // temporary name of the new file; "" if it has none
  Descriptor file_;
};

/// Creates a file without a name in `folder` ("": the working directory). Throws Failure.
[[nodiscard]] Descriptor nameless_file(const std::string& folder);

/// Replaces the file at `path` by a new one with `content`. Throws Failure.
void replace_file(const std::string& path, std::string_view content, Durable durable);

}  // namespace absenc::os
