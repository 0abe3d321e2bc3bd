// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/zip_writer.hpp"

#include <minizip/zip.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace absenc::capture {

void ZipWriter::Close::operator()(void* archive) const { zipClose(archive, nullptr); }

void ZipWriter::fail() const {
  const int error = errno;
  throw std::runtime_error(path_ + " cannot be written: " + (error == 0 ? "unknown error" : std::strerror(error)));
}

ZipWriter::ZipWriter(const std::string& path) : path_(path), temporary_path_(path + ".part") {
  errno = 0;
  archive_.reset(zipOpen64(temporary_path_.c_str(), APPEND_STATUS_CREATE));
  if (archive_ == nullptr) fail();
}

ZipWriter::~ZipWriter() {
  if (archive_ == nullptr) return;
  archive_.reset();
  std::error_code ignored;
  std::filesystem::remove(temporary_path_, ignored);
}

void ZipWriter::end_entry() {
  errno = 0;
  if (in_entry_ && zipCloseFileInZip(archive_.get()) != ZIP_OK) fail();
  in_entry_ = false;
}

void ZipWriter::begin(const std::string& name) {
  end_entry();
  zip_fileinfo info{};
  info.dosDate = 0x0021'0000;  // 1980-01-01: a fixed date, so that the same content always gives the same archive
  constexpr int fast = 1;
  if (zipOpenNewFileInZip64(archive_.get(), name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, fast,
                            0) != ZIP_OK) {
    fail();
  }
  in_entry_ = true;
}

void ZipWriter::write(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t most = 1 << 30;  // zlib counts bytes in an unsigned int, so long data is written in parts
  errno = 0;
  while (!bytes.empty()) {
    const std::size_t size = std::min(bytes.size(), most);
    if (zipWriteInFileInZip(archive_.get(), bytes.data(), static_cast<unsigned>(size)) != ZIP_OK) fail();
    bytes = bytes.subspan(size);
  }
}

void ZipWriter::add(const std::string& name, std::string_view content) {
  begin(name);
  write({reinterpret_cast<const std::uint8_t*>(content.data()), content.size()});
}

void ZipWriter::finish() {
  end_entry();
  errno = 0;
  const int error = zipClose(archive_.release(), nullptr);
  std::error_code renamed;
  if (error == ZIP_OK) std::filesystem::rename(temporary_path_, path_, renamed);
  if (error == ZIP_OK && !renamed) return;
  if (renamed) errno = renamed.value();
  const int why = errno;
  std::filesystem::remove(temporary_path_, renamed);
  errno = why;
  fail();
}

}  // namespace absenc::capture
