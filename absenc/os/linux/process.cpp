// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/process.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "absenc/os/error.hpp"

namespace absenc::os {

void protect_standard_streams() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // open(2) returns the lowest free number, which is that of the closed standard stream.
    if (::open("/dev/null", stream == STDOUT_FILENO ? O_RDONLY : O_RDWR) < 0) throw system_failure("/dev/null", errno);
  }
}

int write_standard_output(std::string_view bytes) {
  off_t done = 0;
  while (!bytes.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int error = errno;
      struct stat file {};
      const bool is_file = ::fstat(STDOUT_FILENO, &file) == 0 && S_ISREG(file.st_mode);
      // If standard output is a regular file, a partly written text is removed, unless another program has written
      // behind it.
      if (done > 0 && is_file && file.st_size == ::lseek(STDOUT_FILENO, 0, SEEK_CUR)) {
        [[maybe_unused]] const int ignored = ::ftruncate(STDOUT_FILENO, file.st_size - done);
        ::lseek(STDOUT_FILENO, -done, SEEK_CUR);
      }
      return error;
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
    done += written;
  }
  return 0;
}

void write_standard_error(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(STDERR_FILENO, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::vector<std::string> command_words(int count, char** words) { return {words, words + count}; }

TerminalKind terminal_kind() { return {}; }

void limit_thread_stacks() {
  pthread_attr_t attributes;
  ::pthread_attr_init(&attributes);
  ::pthread_attr_setstacksize(&attributes, 1 << 20);
  ::pthread_setattr_default_np(&attributes);
  ::pthread_attr_destroy(&attributes);
}

bool is_terminal(int descriptor) { return ::isatty(descriptor) == 1; }

Time processor_time() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto of = [](const timeval& time) {
    return Time(std::chrono::seconds(time.tv_sec)) + std::chrono::microseconds(time.tv_usec);
  };
  return of(usage.ru_utime) + of(usage.ru_stime);
}

RunDelay::RunDelay() : file_(::open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC)) { (void)take(); }

Time RunDelay::take() {
  // Fields of /proc/thread-self/schedstat: ns that the thread ran, ns that it was ready to run but waited, number of
  // time slices.
  std::array<char, 64> text{};
  if (!file_ || ::pread(file_.get(), text.data(), text.size() - 1, 0) <= 0) return {};
  char* end = text.data();
  std::strtoull(end, &end, 10);
  const Time total(static_cast<std::int64_t>(std::strtoull(end, &end, 10)));
  return total - std::exchange(last_total_, total);
}

int replaceable(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path();
  const bool may = ::access(path.c_str(), W_OK) == 0 && ::access(folder.empty() ? "." : folder.c_str(), W_OK) == 0;
  return may ? 0 : errno;
}

namespace {

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path();
  return folder.empty() ? "." : folder;
}

// A file without a name disappears when the process ends, however it ends.
Descriptor open_nameless(const std::string& folder, mode_t mode) {
  return Descriptor(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, mode));
}

}  // namespace

NewFile::NewFile(const std::string& path) : path_(path), file_(open_nameless(folder_of(path), 0666)) {
  if (file_) {
    temporary_path_ = "/proc/self/fd/" + std::to_string(file_.get());
    return;
  }
  temporary_name_ = path_ + ".XXXXXX";
  file_ = Descriptor(::mkostemp(temporary_name_.data(), O_CLOEXEC));
  if (!file_) throw system_failure("writing " + path_, errno);
  temporary_path_ = temporary_name_;
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::fchmod(file_.get(), 0666 & ~mask);
}

NewFile::~NewFile() {
  if (!temporary_name_.empty()) ::unlink(temporary_name_.c_str());
}

void NewFile::write(std::string_view content) {
  while (!content.empty()) {
    const ssize_t size = ::write(file_.get(), content.data(), content.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) throw system_failure("writing " + path_, errno);
    content.remove_prefix(static_cast<std::size_t>(size));
  }
}

Descriptor NewFile::take_place(Durable durable) {
  if (durable == Durable::yes && ::fsync(file_.get()) < 0) throw system_failure("writing " + path_, errno);
  if (temporary_name_.empty()) {  // linkat(2) cannot replace an existing name, so the file gets a temporary one first
    temporary_name_ = path_ + "." + std::to_string(::getpid());
    ::unlink(temporary_name_.c_str());
    if (::linkat(AT_FDCWD, temporary_path_.c_str(), AT_FDCWD, temporary_name_.c_str(), AT_SYMLINK_FOLLOW) < 0) {
      throw system_failure("writing " + path_, errno);
    }
  }
  if (::rename(temporary_name_.c_str(), path_.c_str()) < 0) throw system_failure("writing " + path_, errno);
  temporary_name_.clear();
  return std::move(file_);
}

Descriptor nameless_file(const std::string& folder) {
  const std::string where = folder.empty() ? "." : folder;
  Descriptor file = open_nameless(where, 0600);
  if (file) return file;
  std::string name = where + "/absenc.XXXXXX";
  file = Descriptor(::mkostemp(name.data(), O_CLOEXEC));
  if (!file) throw system_failure("writing to " + where, errno);
  ::unlink(name.c_str());
  return file;
}

}  // namespace absenc::os
