// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/mended_zip.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "absenc/capture/files/zip_format.hpp"
#include "absenc/core/bits.hpp"

namespace absenc::capture {

using namespace zip;

namespace {

constexpr std::uint64_t size_behind = 1 << 3;  // flag of an entry whose sizes are stored after its data
constexpr std::uint64_t zip64_version = 45;
constexpr std::size_t largest_directory = 1 << 26;

struct Directory {
  std::vector<std::uint8_t> bytes;

  Directory& put(std::uint64_t value, std::size_t size) {
    bytes.resize(bytes.size() + size);
    store_little_endian(std::span(bytes).last(size), value);
    return *this;
  }
  Directory& put(Bytes more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return *this;
  }
};

// The local header of an entry, which is stored before the data of the entry.
struct Header {
  std::vector<std::uint8_t> bytes;
  std::uint64_t size = 0;
  std::uint64_t packed = 0;

  [[nodiscard]] Bytes name() const { return Bytes(bytes).subspan(local_bytes, length_at(bytes, 26)); }
  [[nodiscard]] Bytes extra() const { return Bytes(bytes).last(length_at(bytes, 28)); }

  // Reads the local header at offset `at`; returns false if there is none that can be used.
  [[nodiscard]] bool read(Source& source, std::uint64_t at) {
    bytes.resize(local_bytes);
    if (source.read(at, bytes) != local_bytes || number(bytes, 0, 4) != local_signature) return false;
    if ((number(bytes, 6, 2) & size_behind) != 0) return false;
    bytes.resize(local_bytes + length_at(bytes, 26) + length_at(bytes, 28));
    const auto rest = std::span(bytes).subspan(local_bytes);
    if (source.read(at + local_bytes, rest) != rest.size()) return false;
    packed = number(bytes, 18, 4);
    size = number(bytes, 22, 4);
    if (packed == in_zip64 || size == in_zip64) read_zip64();
    return true;
  }

  void read_zip64() {
    for (Bytes left = extra(); left.size() >= 4;) {
      const std::size_t length = 4 + length_at(left, 2);
      if (number(left, 0, 2) == 1 && length >= 20 && left.size() >= 20) {
        size = number(left, 4, 8);
        packed = number(left, 12, 8);
      }
      left = left.subspan(std::min(length, left.size()));
    }
  }
};

void add_entry(Directory& directory, const Header& header, std::uint64_t at, std::uint64_t packed) {
  directory.put(directory_signature, 4).put(zip64_version, 2);
  directory.put(Bytes(header.bytes).subspan(4, 14)).put(in_zip64, 4).put(in_zip64, 4);
  directory.put(header.name().size(), 2).put(28, 2);  // lengths of the name and of the zip64 extra field
  // Comment, disk and attributes are 0; the entry's offset is in the extra field.
  directory.put(0, 10).put(in_zip64, 4);
  directory.put(header.name()).put(1, 2).put(24, 2).put(header.size, 8).put(packed, 8).put(at, 8);
}

void add_end(Directory& directory, std::uint64_t at, std::uint64_t entries) {
  const std::uint64_t size = directory.bytes.size();
  directory.put(zip64_end_signature, 4).put(44, 8).put(zip64_version, 2).put(zip64_version, 2).put(0, 8);
  directory.put(entries, 8).put(entries, 8).put(size, 8).put(at, 8);
  directory.put(zip64_locator_signature, 4).put(0, 4).put(at + size, 8).put(1, 4);
  directory.put(end_signature, 4).put(0, 4).put(0xFFFF, 2).put(0xFFFF, 2).put(in_zip64, 4).put(in_zip64, 4).put(0, 2);
}

// A source that consists of the first `end` bytes of one source, followed by another source.
class TwoSources final : public Source {
 public:
  TwoSources(std::unique_ptr<Source> front, std::uint64_t end, std::unique_ptr<Source> behind)
      : front_(std::move(front)), end_(end), behind_(std::move(behind)) {}

  [[nodiscard]] std::uint64_t size() const override { return end_ + behind_->size(); }

  [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) override {
    if (offset >= end_) return behind_->read(offset - end_, into);
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(into.size(), end_ - offset));
    const std::size_t got = front_->read(offset, into.first(wanted));
    return got < wanted ? got : got + behind_->read(0, into.subspan(got));
  }

 private:
  std::unique_ptr<Source> front_;
  std::uint64_t end_;
  std::unique_ptr<Source> behind_;
};

}  // namespace

MendedZip mend_zip(std::unique_ptr<Source> source) {
  MendedZip mended;
  Directory directory;
  Header header;
  std::uint64_t entries = 0;
  while (!mended.cut_entry && directory.bytes.size() < largest_directory && header.read(*source, mended.end)) {
    const std::uint64_t begin = mended.end + header.bytes.size();
    const std::uint64_t packed = std::min(header.packed, source->size() - begin);
    add_entry(directory, header, mended.end, packed);
    if (packed < header.packed) mended.cut_entry = entries;
    mended.end = begin + packed;
    ++entries;
  }
  std::array<std::uint8_t, 4> behind{};
  mended.complete =
      source->read(mended.end, behind) == behind.size() && load_little_endian(behind) == directory_signature;
  add_end(directory, mended.end, entries);
  mended.archive =
      std::make_unique<TwoSources>(std::move(source), mended.end, memory_source(std::move(directory.bytes)));
  return mended;
}

}  // namespace absenc::capture
