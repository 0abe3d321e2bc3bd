// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/log_file.hpp"

#include <windows.h>

#include <cerrno>

#include "absenc/os/error.hpp"
#include "absenc/os/owned_file.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/files.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

// A folder is owned by a file in it that no second process can open. Nobody can rename the folder while it is open.
OwnedFolder::OwnedFolder(const std::string& path) : path_(path) {
  if (::CreateDirectoryW(utf16(path).c_str(), nullptr) == 0 && ::GetLastError() != ERROR_ALREADY_EXISTS) {
    const DWORD error = ::GetLastError();
    if (error != ERROR_PATH_NOT_FOUND) throw windows_failure("making the folder " + path, error);
    throw Failure(Failure::Kind::not_found, "the folder " + path + " cannot be made: the one that it is in is missing");
  }
  folder_ = open_file(path + "\\lock", 0, OPEN_ALWAYS, FILE_ATTRIBUTE_NORMAL | FILE_FLAG_DELETE_ON_CLOSE);
  if (folder_) return;
  if (errno != EBUSY) throw system_failure("opening the folder " + path, errno);
  throw Failure(Failure::Kind::in_use, "the folder " + path + " is locked: another process keeps it");
}

bool OwnedFolder::is_there() const { return identity_of(path_).number != 0; }

LogFile::LogFile(const std::string& path, Open how)
    : path_(path),
      file_(open_file(path, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                      how == Open::fresh ? CREATE_NEW : OPEN_EXISTING)) {
  LARGE_INTEGER size{};
  if (!file_) throw system_failure("opening " + path, errno);
  if (::GetFileSizeEx(handle_of_file(file_.get()), &size) == 0) {
    throw windows_failure("opening " + path, ::GetLastError());
  }
  size_ = static_cast<std::size_t>(size.QuadPart);
}

int LogFile::append(std::string_view bytes) {
  const int error = write_at(file_.get(), size_, bytes);
  if (error == 0) {
    size_ += bytes.size();
  } else {
    static_cast<void>(set_size(file_.get(), size_));
  }
  return error;
}

int LogFile::replace(std::size_t offset, char byte) const { return write_at(file_.get(), offset, {&byte, 1}); }

bool LogFile::shrink_to(std::string_view bytes) {
  if (bytes.size() > size_) return false;
  if (write_at(file_.get(), 0, bytes) != 0 || set_size(file_.get(), bytes.size()) != 0) return false;
  size_ = bytes.size();
  return true;
}

std::string LogFile::read(std::size_t offset, std::size_t size) const {
  return read_at(file_.get(), offset, size, path_);
}

void LogFile::sync() const { ::FlushFileBuffers(handle_of_file(file_.get())); }

bool LogFile::is_there() const {
  FILE_STANDARD_INFO about{};
  return ::GetFileInformationByHandleEx(handle_of_file(file_.get()), FileStandardInfo, &about, sizeof about) != 0 &&
         about.DeletePending == 0 && about.NumberOfLinks != 0;
}

}  // namespace absenc::os
