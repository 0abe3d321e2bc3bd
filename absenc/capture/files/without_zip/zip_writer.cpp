// SPDX-License-Identifier: Apache-2.0
// In place of files/zip_writer.cpp in programs that are built without minizip.
#include "absenc/capture/files/zip_writer.hpp"

#include <stdexcept>
#include <utility>

#include "absenc/capture/files/source.hpp"

namespace absenc::capture {

void ZipWriter::Close::operator()(void*) const {}

void ZipWriter::fail() const {
  throw std::runtime_error(name_of(path_) +
                           " would be a zip archive, which this program cannot write: it was built without "
                           "minizip");
}

ZipWriter::ZipWriter(std::filesystem::path path) : path_(std::move(path)) { fail(); }

ZipWriter::~ZipWriter() = default;

void ZipWriter::end_entry() { fail(); }
void ZipWriter::begin(const std::string&) { fail(); }
void ZipWriter::write(std::span<const std::uint8_t>) { fail(); }
void ZipWriter::add(const std::string&, std::string_view) { fail(); }
void ZipWriter::finish() { fail(); }

}  // namespace absenc::capture
