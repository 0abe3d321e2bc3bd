// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/line_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "absenc/os/error.hpp"

namespace absenc::os {

namespace {

Failure::Kind kind_of(int error) {
  switch (error) {
    case EEXIST:
      return Failure::Kind::in_use;
    case EACCES:
    case EPERM:
    case EROFS:
      return Failure::Kind::no_permission;
    case ENOENT:
    case ENOTDIR:
      return Failure::Kind::not_found;
    default:
      return Failure::Kind::system;
  }
}

}  // namespace

LineFile::LineFile(const std::string& path)
    : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666)) {
  if (file_) return;
  const int error = errno;
  if (error == EEXIST)
    throw Failure(Failure::Kind::in_use,
                  "there is already a file " + path + ", which stays as it is: choose another name");
  throw Failure(kind_of(error), "the file " + path + " cannot be made: " + std::generic_category().message(error));
}

void LineFile::append(std::string_view lines) {
  std::string_view rest = lines;
  while (!rest.empty()) {
    const ssize_t written = ::write(file_.get(), rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int error = errno;
      [[maybe_unused]] const int ignored = ::ftruncate(file_.get(), static_cast<off_t>(size_));
      throw system_failure("writing " + path_, error);
    }
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  size_ += lines.size();
}

void LineFile::sync() {
  // What cannot be synchronised, a pipe or /dev/null, needs not be.
  if (::fsync(file_.get()) < 0 && errno != EINVAL && errno != EROFS) throw system_failure("writing " + path_, errno);
}

}  // namespace absenc::os
