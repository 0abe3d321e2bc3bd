// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/log_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "absenc/os/error.hpp"

namespace absenc::os {

OwnedFolder::OwnedFolder(const std::string& path) : path_(path) {
  if (::mkdir(path.c_str(), 0777) < 0 && errno != EEXIST) {
    if (errno != ENOENT) throw system_failure("making the folder " + path, errno);
    throw Failure(Failure::Kind::not_found, "the folder " + path + " cannot be made: the one that it is in is missing");
  }
  folder_ = Descriptor(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder_) throw system_failure("opening the folder " + path, errno);
  if (::flock(folder_.get(), LOCK_EX | LOCK_NB) == 0) return;
  if (errno != EWOULDBLOCK) throw system_failure("locking the folder " + path, errno);
  throw Failure(Failure::Kind::in_use, "the folder " + path + " is locked: another process keeps it");
}

bool OwnedFolder::is_there() const {
  struct stat ours {
  }, named{};
  return ::fstat(folder_.get(), &ours) == 0 && ::stat(path_.c_str(), &named) == 0 && ours.st_ino == named.st_ino &&
         ours.st_dev == named.st_dev;
}

LogFile::LogFile(const std::string& path, Open how)
    : path_(path), file_(::open(path.c_str(), O_RDWR | O_CLOEXEC | (how == Open::fresh ? O_CREAT | O_EXCL : 0), 0666)) {
  struct stat file {};
  if (!file_ || ::fstat(file_.get(), &file) < 0) throw system_failure("opening " + path, errno);
  if (!S_ISREG(file.st_mode)) throw Failure(Failure::Kind::unsupported, path + " is no file");
  size_ = static_cast<std::size_t>(file.st_size);
}

int LogFile::append(std::string_view bytes) {
  const std::size_t before = size_;
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(size_));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const int error = written < 0 ? errno : ENOSPC;
      [[maybe_unused]] const int ignored = ::ftruncate(file_.get(), static_cast<off_t>(before));
      size_ = before;
      return error;
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
    size_ += static_cast<std::size_t>(written);
  }
  return 0;
}

int LogFile::replace(std::size_t offset, char byte) const {
  return ::pwrite(file_.get(), &byte, 1, static_cast<off_t>(offset)) == 1 ? 0 : errno;
}

bool LogFile::shrink_to(std::string_view bytes) {
  if (bytes.size() > size_) return false;
  if (::pwrite(file_.get(), bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return false;
  if (::ftruncate(file_.get(), static_cast<off_t>(bytes.size())) < 0) return false;
  size_ = bytes.size();
  return true;
}

std::string LogFile::read(std::size_t offset, std::size_t size) const {
  std::string bytes(size, '\0');
  std::size_t done = 0;
  while (done < size) {
    const ssize_t part = ::pread(file_.get(), bytes.data() + done, size - done, static_cast<off_t>(offset + done));
    if (part < 0 && errno == EINTR) continue;
    if (part < 0) throw system_failure("reading " + path_, errno);
    if (part == 0) break;
    done += static_cast<std::size_t>(part);
  }
  bytes.resize(done);
  return bytes;
}

void LogFile::sync() const { ::fdatasync(file_.get()); }

bool LogFile::is_there() const {
  struct stat file {};
  return ::fstat(file_.get(), &file) == 0 && file.st_nlink != 0;
}

}  // namespace absenc::os
