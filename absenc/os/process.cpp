// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/process.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>

#include "absenc/os/descriptor.hpp"
#include "absenc/os/error.hpp"

namespace absenc::os {

void protect_standard_streams() {
  std::signal(SIGPIPE, SIG_IGN);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number is this one.
    if (::open("/dev/null", stream == STDOUT_FILENO ? O_RDONLY : O_RDWR) < 0) throw system_failure("/dev/null", errno);
  }
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

int replaceable(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path();
  const bool may = ::access(path.c_str(), W_OK) == 0 && ::access(folder.empty() ? "." : folder.c_str(), W_OK) == 0;
  return may ? 0 : errno;
}

void replace_file(const std::string& path, std::string_view content, Durable durable) {
  const std::string beside = path + ".new";
  const std::string what = "writing " + path;
  const Descriptor file(::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666));
  if (!file) throw system_failure(what, errno);
  try {
    while (!content.empty()) {
      const ssize_t size = ::write(file.get(), content.data(), content.size());
      if (size < 0 && errno == EINTR) continue;
      if (size < 0) throw system_failure(what, errno);
      content.remove_prefix(static_cast<std::size_t>(size));
    }
    if (durable == Durable::yes && ::fsync(file.get()) < 0) throw system_failure(what, errno);
    if (::rename(beside.c_str(), path.c_str()) < 0) throw system_failure(what, errno);
  } catch (const Failure&) {
    ::unlink(beside.c_str());
    throw;
  }
}

}  // namespace absenc::os
