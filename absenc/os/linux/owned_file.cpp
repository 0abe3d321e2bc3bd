// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/owned_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "absenc/os/error.hpp"

namespace absenc::os {

namespace {

bool is_regular(const struct stat& status) { return S_ISREG(status.st_mode); }

FileIdentity identity_of(const struct stat& status) { return {status.st_dev, status.st_ino}; }

void require_regular(bool regular, const std::string& path) {
  if (!regular) throw Failure(Failure::Kind::unsupported, path + " is no regular file");
}

}  // namespace

FileIdentity identity_of(const std::string& path) {
  struct stat named {};
  return ::stat(path.c_str(), &named) == 0 ? identity_of(named) : FileIdentity{};
}

OwnedFile::OwnedFile(const std::string& path) : path_(path) {
  constexpr int most_tries = 100;
  for (int tries = 0; tries < most_tries; ++tries) {
    // The type of the file is checked before opening, because opening a device may already have an effect.
    struct stat named {};
    const bool there = ::stat(path.c_str(), &named) == 0;
    if (there) require_regular(is_regular(named), path);
    const int make = there ? 0 : O_CREAT | O_EXCL;
    file_ = Descriptor(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_NOCTTY | O_CLOEXEC | make, 0666));
    // Another process may have created or removed the file between stat(2) and open(2).
    if (!file_ && (errno == EEXIST || (there && errno == ENOENT))) continue;
    if (!file_) throw system_failure("opening " + path, errno);
    made_ = made_ || !there;
    struct stat opened {};
    if (::fstat(file_.get(), &opened) < 0) throw system_failure("opening " + path, errno);
    require_regular(is_regular(opened), path);
    if (::flock(file_.get(), LOCK_EX | LOCK_NB) < 0) {
      if (errno != EWOULDBLOCK) throw system_failure("locking " + path, errno);
      throw Failure(Failure::Kind::in_use, "another program keeps " + path);
    }
    // Another process may have replaced the file before it was locked.
    if (identity_of(path) == identity_of(opened)) return;
  }
  // The path is a link to itself or to a missing file, or another process replaces the file again and again.
  struct stat named {};
  throw system_failure("opening " + path, ::stat(path.c_str(), &named) < 0 ? errno : ELOOP);
}

void OwnedFile::replace(std::string_view content, Durable durable) {
  NewFile file(path_);
  if (::flock(file.descriptor(), LOCK_EX | LOCK_NB) < 0) throw system_failure("locking " + path_, errno);
  file.write(content);
  file_ = file.take_place(durable);
}

bool OwnedFile::has_its_name() const {
  struct stat opened {};
  return ::fstat(file_.get(), &opened) == 0 && identity_of(path_) == identity_of(opened);
}

OwnedFile::State OwnedFile::state() const {
  struct stat opened {};
  if (::fstat(file_.get(), &opened) < 0) throw system_failure("reading " + path_, errno);
  return {opened.st_size, opened.st_mtim.tv_sec * std::int64_t{1'000'000'000} + opened.st_mtim.tv_nsec};
}

std::string OwnedFile::beginning(std::size_t size) const {
  std::string bytes(size, '\0');
  const ssize_t count = ::pread(file_.get(), bytes.data(), bytes.size(), 0);
  if (count < 0) throw system_failure("reading " + path_, errno);
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

}  // namespace absenc::os
