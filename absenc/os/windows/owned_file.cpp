// SPDX-License-Identifier: Apache-2.0
// A file is owned by a lock of a byte behind its end: Windows lets no other program write into locked bytes.
#include "absenc/os/owned_file.hpp"

#include <windows.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/files.hpp"
#include "absenc/os/windows/text.hpp"
#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

namespace {

constexpr DWORD share = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

// Locks the open file. Returns false if another process has locked it.
bool lock(int file) {
  OVERLAPPED behind{};
  behind.OffsetHigh = 0x7FFF'FFFF;
  return ::LockFileEx(handle_of_file(file), LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &behind) != 0;
}

FileIdentity identity_of_handle(HANDLE file) {
  BY_HANDLE_FILE_INFORMATION about{};
  if (::GetFileInformationByHandle(file, &about) == 0) return {};
  return {about.dwVolumeSerialNumber, std::uint64_t{about.nFileIndexHigh} << 32 | about.nFileIndexLow};
}

}  // namespace

FileIdentity identity_of(const std::string& path) {
  const Handle file(::CreateFileW(utf16(path).c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                  nullptr, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr));
  return file ? identity_of_handle(file.get()) : FileIdentity{};
}

OwnedFile::OwnedFile(const std::string& path) : path_(path) {
  std::error_code ignored;
  const std::filesystem::file_status there = std::filesystem::status(path_of(path), ignored);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) {
    throw Failure(Failure::Kind::unsupported, path + " is no regular file");
  }
  file_ = open_file(path, share, CREATE_NEW);
  made_ = static_cast<bool>(file_);
  if (!file_ && errno == EEXIST) file_ = open_file(path, share, OPEN_EXISTING);
  if (!file_ && errno != EBUSY) throw system_failure("opening " + path, errno);
  if (!file_ || !lock(file_.get())) throw Failure(Failure::Kind::in_use, "another program keeps " + path);
}

void OwnedFile::replace(std::string_view content, Durable durable) {
  NewFile file(path_);
  file.write(content);
  file_ = Descriptor();  // Windows replaces no file that is open
  try {
    file.take_place(durable);
  } catch (const Failure&) {
    file_ = open_file(path_, share, OPEN_EXISTING);
    static_cast<void>(lock(file_.get()));
    throw;
  }
  file_ = open_file(path_, share, OPEN_EXISTING);
  if (!file_) throw system_failure("opening " + path_, errno);
  if (!lock(file_.get())) throw Failure(Failure::Kind::in_use, "another program keeps " + path_);
}

bool OwnedFile::has_its_name() const { return identity_of(path_) == identity_of_handle(handle_of_file(file_.get())); }

OwnedFile::State OwnedFile::state() const {
  BY_HANDLE_FILE_INFORMATION about{};
  if (::GetFileInformationByHandle(handle_of_file(file_.get()), &about) == 0) {
    throw windows_failure("reading " + path_, ::GetLastError());
  }
  constexpr std::int64_t begin_1970 = 116'444'736'000'000'000;  // Windows counts 100 ns since 1601
  const auto written = static_cast<std::int64_t>(std::uint64_t{about.ftLastWriteTime.dwHighDateTime} << 32 |
                                                 about.ftLastWriteTime.dwLowDateTime);
  return {static_cast<std::int64_t>(std::uint64_t{about.nFileSizeHigh} << 32 | about.nFileSizeLow),
          (written - begin_1970) * 100};
}

std::string OwnedFile::beginning(std::size_t size) const { return read_at(file_.get(), 0, size, path_); }

}  // namespace absenc::os
