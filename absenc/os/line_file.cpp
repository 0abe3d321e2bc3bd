// SPDX-License-Identifier: Apache-2.0
// The parts of output files that are the same on all systems.
#include "absenc/os/line_file.hpp"

#include <cerrno>
#include <system_error>

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

void OutputFile::refuse(const std::string& path, int error) {
  throw Failure(kind_of(error),
                error == EEXIST ? "there is already a file " + path + ", which stays as it is: choose another name"
                                : "the file " + path + " cannot be made: " + std::generic_category().message(error));
}

void LineFile::append(std::string_view lines) {
  require_there();
  const int error = put(size(), lines);
  if (error == 0) return;
  [[maybe_unused]] const int ignored = resize(size());
  throw system_failure("writing " + path_, error);
}

void BlockFile::write(std::uint64_t at, Bytes bytes) {
  require_there();
  const int error = put(at, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (error != 0) throw system_failure("writing " + path_, error);
}

void BlockFile::grow(std::uint64_t size) {
  require_there();
  if (size <= size_) return;
  if (const int error = resize(size); error != 0) throw system_failure("writing " + path_, error);
  size_ = size;
}

}  // namespace absenc::os
