// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/zip_writer.hpp"

#include <minizip/zip.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "absenc/capture/files/source.hpp"

namespace absenc::capture {

namespace {

std::ios::seekdir seek_direction(int origin) {
  if (origin == ZLIB_FILEFUNC_SEEK_SET) return std::ios::beg;
  return origin == ZLIB_FILEFUNC_SEEK_CUR ? std::ios::cur : std::ios::end;
}

// Returns functions by which minizip writes: its own open a file by a name that Windows does not take as UTF-8.
zlib_filefunc64_def file_functions() {
  zlib_filefunc64_def all{};
  all.zopen64_file = [](void*, const void* path, int) -> void* {
    auto file = std::make_unique<std::filebuf>();
    constexpr auto mode = std::ios::in | std::ios::out | std::ios::trunc | std::ios::binary;
    return file->open(*static_cast<const std::filesystem::path*>(path), mode) == nullptr ? nullptr : file.release();
  };
  all.zread_file = [](void*, void* file, void* into, uLong size) {
    return static_cast<uLong>(
        static_cast<std::filebuf*>(file)->sgetn(static_cast<char*>(into), static_cast<std::streamsize>(size)));
  };
  all.zwrite_file = [](void*, void* file, const void* bytes, uLong size) {
    return static_cast<uLong>(
        static_cast<std::filebuf*>(file)->sputn(static_cast<const char*>(bytes), static_cast<std::streamsize>(size)));
  };
  all.ztell64_file = [](void*, void* file) {
    return static_cast<ZPOS64_T>(
        std::streamoff{static_cast<std::filebuf*>(file)->pubseekoff(0, std::ios::cur, std::ios::out)});
  };
  all.zseek64_file = [](void*, void* file, ZPOS64_T offset, int origin) {
    const std::streamoff place =
        static_cast<std::filebuf*>(file)->pubseekoff(static_cast<std::streamoff>(offset), seek_direction(origin));
    return place < 0 ? -1L : 0L;
  };
  all.zclose_file = [](void*, void* file) {
    const std::unique_ptr<std::filebuf> one(static_cast<std::filebuf*>(file));
    return one->close() == nullptr ? -1 : 0;
  };
  all.zerror_file = [](void*, void*) { return 0; };  // each function reports its own errors
  return all;
}

}  // namespace

void ZipWriter::Close::operator()(void* archive) const { zipClose(archive, nullptr); }

void ZipWriter::fail() const {
  const int error = errno;
  throw std::runtime_error(name_of(path_) +
                           " cannot be written: " + (error == 0 ? "unknown error" : std::strerror(error)));
}

ZipWriter::ZipWriter(std::filesystem::path path) : path_(std::move(path)), temporary_path_(path_) {
  temporary_path_ += ".part";
  errno = 0;
  zlib_filefunc64_def functions = file_functions();
  archive_.reset(zipOpen2_64(&temporary_path_, APPEND_STATUS_CREATE, nullptr, &functions));
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
