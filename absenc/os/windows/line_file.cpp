// SPDX-License-Identifier: Apache-2.0
// Other programs may read the file while it is written, but not change, rename or remove it.
#include "absenc/os/line_file.hpp"

#include <windows.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/file_name.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/files.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

OutputFile::OutputFile(const std::string& path, Appears appears) : path_(path), appeared_(appears == Appears::at_once) {
  std::error_code ignored;
  if (std::filesystem::exists(path_of(path), ignored)) refuse(path, EEXIST);
  if (!appeared_) temporary_name_ = temporary_path(path);
  // A file that is still to get its name must allow to be renamed.
  const DWORD share = appeared_ ? FILE_SHARE_READ : FILE_SHARE_READ | FILE_SHARE_DELETE;
  file_ = open_file(appeared_ ? path : temporary_name_, share, CREATE_NEW);
  if (!file_) {
    temporary_name_.clear();
    refuse(path, errno);
  }
}

OutputFile::~OutputFile() {
  file_ = Descriptor();
  if (!temporary_name_.empty()) ::DeleteFileW(utf16(temporary_name_).c_str());
}

void BlockFile::appear() {
  if (const int error = rename_file(temporary_name_, path_, false); error != 0) refuse(path_, error);
  temporary_name_.clear();
  appeared_ = true;
}

void OutputFile::require_there() const {
  BY_HANDLE_FILE_INFORMATION about{};
  if (!appeared_ || ::GetFileInformationByHandle(handle_of_file(file_.get()), &about) != 0) return;
  throw Failure(Failure::Kind::lost, "the file " + path_ + " is gone: was its disk removed?");
}

void OutputFile::sync() {
  require_there();
  if (::FlushFileBuffers(handle_of_file(file_.get())) == 0) throw windows_failure("writing " + path_, ::GetLastError());
}

int OutputFile::put(std::uint64_t at, std::string_view bytes) {
  const int error = write_at(file_.get(), at, bytes);
  if (error == 0) size_ = std::max(size_, at + bytes.size());
  return error;
}

int OutputFile::resize(std::uint64_t size) { return set_size(file_.get(), size); }

void BlockFile::read(std::uint64_t at, MutableBytes bytes) const {
  const std::string content = read_at(file_.get(), at, bytes.size(), path_);
  std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
  std::memcpy(bytes.data(), content.data(), content.size());
}

}  // namespace absenc::os
