// SPDX-License-Identifier: Apache-2.0
// In place of files/zip_writer.cpp in programs that are built without minizip.
#include "absenc/capture/files/zip_writer.hpp"

#include <stdexcept>

namespace absenc::capture {

void ZipWriter::Close::operator()(void*) const {}

void ZipWriter::fail() const {
  throw std::runtime_error(path_ +
                           " would be a zip archive, which this program cannot write: it was built without "
                           "minizip");
}

ZipWriter::ZipWriter(const std::string& path) : path_(path) { fail(); }

ZipWriter::~ZipWriter() = default;

void ZipWriter::end_entry() { fail(); }
void ZipWriter::begin(const std::string&) { fail(); }
void ZipWriter::write(std::span<const std::uint8_t>) { fail(); }
void ZipWriter::add(const std::string&, std::string_view) { fail(); }
void ZipWriter::finish() { fail(); }

}  // namespace absenc::capture
