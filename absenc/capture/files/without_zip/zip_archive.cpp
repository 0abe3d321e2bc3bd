// SPDX-License-Identifier: Apache-2.0
// In place of files/zip_archive.cpp in programs that are built without minizip, zlib and libdeflate.
#include "absenc/capture/files/zip_archive.hpp"

namespace absenc::capture {

struct ZipArchive::State {};

bool has_zip() { return false; }

ZipArchive::ZipArchive(Source&) { throw OpenError("this program was built without minizip and libdeflate"); }

ZipArchive::~ZipArchive() = default;

bool ZipArchive::find(const std::string&, Entry&) const { return false; }
std::vector<std::string> ZipArchive::names() const { return {}; }
bool ZipArchive::expand(const Entry&, std::span<std::uint8_t>) { return false; }
bool ZipArchive::open(const Entry&) { return false; }
std::size_t ZipArchive::read(std::span<std::uint8_t>) { return 0; }
bool ZipArchive::ran_out() const { return false; }
bool ZipArchive::at_good_end() { return false; }
std::string ZipArchive::problem() const { return {}; }
std::uint64_t ZipArchive::offset() const { return 0; }

}  // namespace absenc::capture
