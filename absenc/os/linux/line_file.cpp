// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/line_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "absenc/os/error.hpp"

namespace absenc::os {

namespace {

// Renames `from` to `to` and returns 0, or a value of errno: EEXIST if `to` exists.
int rename_to_new(const std::string& from, const std::string& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  if (::link(from.c_str(), to.c_str()) < 0) return errno;
  ::unlink(from.c_str());
  return 0;
}

}  // namespace

OutputFile::OutputFile(const std::string& path, Appears appears) : path_(path), appeared_(appears == Appears::at_once) {
  if (appeared_) {
    file_ = Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!file_) refuse(path, errno);
    return;
  }
  struct stat there {};
  if (::lstat(path.c_str(), &there) == 0) refuse(path, EEXIST);
  const std::string folder = std::filesystem::path(path).parent_path();
  file_ = Descriptor(::open(folder.empty() ? "." : folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666));
  if (file_) return;
  if (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL) refuse(path, errno);
  temporary_name_ = path + "." + std::to_string(::getpid());
  file_ = Descriptor(::open(temporary_name_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file_) refuse(std::exchange(temporary_name_, {}), errno);
}

OutputFile::~OutputFile() {
  if (!temporary_name_.empty()) ::unlink(temporary_name_.c_str());
}

void BlockFile::appear() {
  int error = 0;
  if (!temporary_name_.empty()) {
    error = rename_to_new(temporary_name_, path_);
  } else if (::linkat(AT_FDCWD, ("/proc/self/fd/" + std::to_string(file_.get())).c_str(), AT_FDCWD, path_.c_str(),
                      AT_SYMLINK_FOLLOW) < 0) {
    error = errno;
  }
  if (error != 0) refuse(path_, error);
  temporary_name_.clear();
  appeared_ = true;
}

void OutputFile::require_there() const {
  if (!appeared_) return;
  struct stat ours {};
  struct stat there {};
  if (::fstat(file_.get(), &ours) < 0) throw system_failure("looking at " + path_, errno);
  const bool found = ::stat(path_.c_str(), &there) == 0;
  if (!found && errno != ENOENT && errno != ENOTDIR) throw system_failure("looking at " + path_, errno);
  const bool same = found && there.st_dev == ours.st_dev && there.st_ino == ours.st_ino;
  const auto lose = [this](const std::string& what) {
    throw Failure(Failure::Kind::lost, "the file " + path_ + " was " + what);
  };
  if (ours.st_nlink == 0) {
    lose(std::string(found ? "replaced by another" : "removed") + " while it was written: what was in it is gone");
  }
  if (!same) lose("moved away while it was written: it goes no further than that");
  if (static_cast<std::uint64_t>(ours.st_size) < size_) lose("cut by another program while it was written");
}

void OutputFile::sync() {
  require_there();
  // Some file systems cannot synchronise a file.
  if (::fsync(file_.get()) < 0 && errno != EINVAL && errno != EROFS) throw system_failure("writing " + path_, errno);
}

int OutputFile::put(std::uint64_t at, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
    at += static_cast<std::uint64_t>(written);
  }
  size_ = std::max(size_, at);
  return 0;
}

int OutputFile::resize(std::uint64_t size) {
  return ::ftruncate(file_.get(), static_cast<off_t>(size)) == 0 ? 0 : errno;
}

void BlockFile::read(std::uint64_t at, MutableBytes bytes) const {
  std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
  while (!bytes.empty()) {
    const ssize_t got = ::pread(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw system_failure("reading " + path_, errno);
    if (got == 0) return;
    bytes = bytes.subspan(static_cast<std::size_t>(got));
    at += static_cast<std::uint64_t>(got);
  }
}

}  // namespace absenc::os
