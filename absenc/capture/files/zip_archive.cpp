// SPDX-License-Identifier: Apache-2.0
// Reads zip archives as far as they are intact: minizip refuses an entry whose local header and directory differ, as
// they do in an archive that was cut off, and libzip loads GnuTLS. The numbers are from PKWARE's APPNOTE 6.3.10, 4.3.
#include "absenc/capture/files/zip_archive.hpp"

#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absenc/capture/files/zip_format.hpp"

namespace absenc::capture {

using namespace zip;

namespace {

constexpr std::size_t directory_bytes = 46;
constexpr std::size_t zip64_end_bytes = 56;
constexpr std::size_t zip64_locator_bytes = 20;
constexpr std::size_t end_bytes = 22;
constexpr std::size_t longest_comment = 0xFFFF;
constexpr std::uint64_t stored = 0;
constexpr std::uint64_t deflated = 8;
constexpr std::uint64_t is_encrypted = 1;  // flag of an entry: its data is encrypted
// greatest number of bytes that are read from the file at once, for example the directory
constexpr std::size_t longest_piece = 1 << 28;

struct DirectoryEntry {
  std::string name;
  std::uint64_t flags = 0;
  std::uint64_t method = 0;
  std::uint64_t crc = 0;
  std::uint64_t packed = 0;
  std::uint64_t size = 0;
  std::uint64_t at = 0;  // offset in the file of the entry's local header
};

// Replaces fields of the entry that are in the zip64 extra field, in their order.
void take_zip64(DirectoryEntry& entry, Bytes extra) {
  while (extra.size() >= 4) {
    const std::size_t length = std::min(4 + length_at(extra, 2), extra.size());
    if (number(extra, 0, 2) == 1) {
      Bytes values = extra.subspan(4, length - 4);
      for (std::uint64_t* field : {&entry.size, &entry.packed, &entry.at}) {
        if (*field != in_zip64 || values.size() < 8) continue;
        *field = number(values, 0, 8);
        values = values.subspan(8);
      }
      return;
    }
    extra = extra.subspan(length);
  }
}

// Returns `size` bytes of the source from `at` on. Returns nothing if the source has fewer bytes, reading fails, or
// `size` is above `longest_piece`.
std::optional<std::vector<std::uint8_t>> bytes_at(Source& source, std::uint64_t at, std::uint64_t size) {
  if (at > source.size() || size > source.size() - at || size > longest_piece) return std::nullopt;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  if (source.read(at, bytes) != bytes.size()) return std::nullopt;
  return bytes;
}

struct Place {
  std::uint64_t at = 0;
  std::uint64_t size = 0;
};

// Finds the directory by the record at the end of the file, behind which only a comment may be.
std::optional<Place> find_directory(Source& source) {
  const std::uint64_t tail_size = std::min<std::uint64_t>(source.size(), end_bytes + longest_comment);
  const std::uint64_t tail_at = source.size() - tail_size;
  const auto tail = bytes_at(source, tail_at, tail_size);
  if (!tail || tail->size() < end_bytes) return std::nullopt;
  for (std::size_t i = tail->size() - end_bytes + 1; i-- > 0;) {
    if (number(*tail, i, 4) != end_signature || i + end_bytes + number(*tail, i + 20, 2) > tail->size()) continue;
    const Place place{number(*tail, i + 16, 4), number(*tail, i + 12, 4)};
    const std::uint64_t end_at = tail_at + i;
    if (place.at != in_zip64 && place.size != in_zip64 && place.at + place.size <= end_at) return place;
    if (end_at < zip64_locator_bytes) continue;
    const auto locator = bytes_at(source, end_at - zip64_locator_bytes, zip64_locator_bytes);
    if (!locator || number(*locator, 0, 4) != zip64_locator_signature) continue;
    const auto end = bytes_at(source, number(*locator, 8, 8), zip64_end_bytes);
    if (end && number(*end, 0, 4) == zip64_end_signature) return Place{number(*end, 48, 8), number(*end, 40, 8)};
  }
  return std::nullopt;
}

std::optional<std::vector<DirectoryEntry>> read_directory(Source& source) {
  const std::optional<Place> place = find_directory(source);
  const auto bytes = place ? bytes_at(source, place->at, place->size) : std::nullopt;
  if (!bytes) return std::nullopt;
  std::vector<DirectoryEntry> entries;
  for (Bytes left = *bytes; left.size() >= directory_bytes;) {
    const std::size_t name = length_at(left, 28);
    const std::size_t extra = length_at(left, 30);
    const std::size_t length = directory_bytes + name + extra + length_at(left, 32);
    if (number(left, 0, 4) != directory_signature || length > left.size()) return std::nullopt;
    DirectoryEntry entry{.name = {},
                         .flags = number(left, 8, 2),
                         .method = number(left, 10, 2),
                         .crc = number(left, 16, 4),
                         .packed = number(left, 20, 4),
                         .size = number(left, 24, 4),
                         .at = number(left, 42, 4)};
    const Bytes text = left.subspan(directory_bytes, name);
    entry.name.assign(text.begin(), text.end());
    take_zip64(entry, left.subspan(directory_bytes + name, extra));
    entries.push_back(std::move(entry));
    left = left.subspan(length);
  }
  return entries;
}

struct Free {
  void operator()(libdeflate_decompressor* inflater) const { libdeflate_free_decompressor(inflater); }
  void operator()(z_stream* stream) const {
    inflateEnd(stream);
    delete stream;
  }
};

// Returns a limit for the compressed size: deflate adds only few bytes to data that cannot be compressed.
constexpr std::size_t most_packed(std::size_t size) { return size + size / 64 + 1024; }

}  // namespace

struct ZipArchive::State {
  Source* source = nullptr;
  std::vector<DirectoryEntry> entries;
  std::unique_ptr<libdeflate_decompressor, Free> inflater;
  std::vector<std::uint8_t> packed;
  std::string problem;
  bool ran_out = false;

  // the entry that is being read
  const DirectoryEntry* entry = nullptr;
  std::unique_ptr<z_stream, Free> stream;  // null: the data of the entry is not compressed
  std::array<std::uint8_t, 1 << 16> buffer{};
  std::uint64_t next = 0;  // offset in the file of the entry's bytes that were not taken into `buffer` yet
  std::uint64_t left = 0;  // number of the entry's bytes that were not taken into `buffer` yet
  std::uint64_t given = 0;
  std::uint32_t crc = 0;
  bool ended = false;  // whether all data of the entry was expanded

  // Returns the offset of the entry's data; nothing if its local header is damaged.
  [[nodiscard]] std::optional<std::uint64_t> data_of(const DirectoryEntry& one) const {
    const auto header = bytes_at(*source, one.at, local_bytes);
    if (!header || number(*header, 0, 4) != local_signature) return std::nullopt;
    return one.at + local_bytes + number(*header, 26, 2) + number(*header, 28, 2);
  }

  // Expands a deflated entry. Returns true if the data fills `into` exactly.
  bool inflate_whole(std::span<const std::uint8_t> from, std::span<std::uint8_t> into) {
    if (inflater == nullptr) inflater.reset(libdeflate_alloc_decompressor());
    return inflater != nullptr && libdeflate_deflate_decompress(inflater.get(), from.data(), from.size(), into.data(),
                                                                into.size(), nullptr) == LIBDEFLATE_SUCCESS;
  }

  // Reads the next packed bytes into `into`; returns their number, 0 at the end of the entry or of the file.
  std::size_t take(std::span<std::uint8_t> into) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(into.size(), left));
    const std::size_t got = source->read(next, into.first(wanted));
    next += got;
    left -= got;
    return got;
  }

  // Expands the next bytes of the entry; returns their number, 0 at its end or on error, which sets `problem`.
  std::size_t expand_some(std::span<std::uint8_t> into) {
    if (stream == nullptr) {
      const std::size_t got = take(into);
      ended = left == 0;
      if (got == 0 && !ended) problem = "it ends early";
      return got;
    }
    stream->next_out = into.data();
    stream->avail_out = static_cast<unsigned>(std::min<std::size_t>(into.size(), 1 << 30));
    const unsigned room = stream->avail_out;
    while (!ended && stream->avail_out == room) {
      if (stream->avail_in == 0) {
        stream->next_in = buffer.data();
        stream->avail_in = static_cast<unsigned>(take(buffer));
      }
      if (stream->avail_in == 0) {
        problem = "it ends early";
        ran_out = true;
        break;
      }
      const int status = ::inflate(stream.get(), Z_NO_FLUSH);
      ended = status == Z_STREAM_END;
      if (status != Z_OK && !ended) {
        problem = stream->msg != nullptr ? stream->msg : "its compressed data is damaged";
        break;
      }
    }
    return room - stream->avail_out;
  }
};

bool has_zip() { return true; }

ZipArchive::ZipArchive(Source& source) : state_(std::make_unique<State>()) {
  state_->source = &source;
  std::optional<std::vector<DirectoryEntry>> entries = read_directory(source);
  if (!entries) throw OpenError("it has no intact directory");
  state_->entries = *std::move(entries);
}

ZipArchive::~ZipArchive() = default;

bool ZipArchive::find(const std::string& name, Entry& entry) const {
  const auto found = std::find_if(state_->entries.begin(), state_->entries.end(),
                                  [&](const DirectoryEntry& one) { return one.name == name; });
  if (found == state_->entries.end()) return false;
  entry = {static_cast<std::uint64_t>(found - state_->entries.begin()), found->size};
  return true;
}

std::vector<std::string> ZipArchive::names() const {
  std::vector<std::string> names;
  for (const DirectoryEntry& one : state_->entries) names.push_back(one.name);
  return names;
}

bool ZipArchive::expand(const Entry& entry, std::span<std::uint8_t> into) {
  const DirectoryEntry& one = state_->entries[static_cast<std::size_t>(entry.index)];
  if (one.method != deflated || (one.flags & is_encrypted) != 0) return false;
  if (one.size != into.size() || one.packed > most_packed(into.size())) return false;
  const std::optional<std::uint64_t> data = state_->data_of(one);
  if (!data) return false;
  const auto size = static_cast<std::size_t>(one.packed);
  if (state_->packed.size() < size) state_->packed.resize(size);
  const std::span<std::uint8_t> packed = std::span(state_->packed).first(size);
  if (state_->source->read(*data, packed) != size || !state_->inflate_whole(packed, into)) return false;
  return libdeflate_crc32(0, into.data(), into.size()) == one.crc;
}

bool ZipArchive::open(const Entry& entry) {
  State& state = *state_;
  state.ran_out = false;
  const DirectoryEntry& one = state.entries[static_cast<std::size_t>(entry.index)];
  state.entry = &one;
  const std::optional<std::uint64_t> data = state.data_of(one);
  if (!data) {
    state.problem = "its header is damaged";
    return false;
  }
  if ((one.method != stored && one.method != deflated) || (one.flags & is_encrypted) != 0) {
    state.problem = "it is encrypted or compressed by another method than deflate";
    return false;
  }
  state.next = *data;
  state.left = one.packed;
  state.given = 0;
  state.crc = 0;
  state.ended = one.method == stored && one.packed == 0;
  state.stream.reset();
  if (one.method == deflated) {
    state.stream.reset(new z_stream{});
    constexpr int no_header = -MAX_WBITS;
    if (inflateInit2(state.stream.get(), no_header) != Z_OK) {
      state.problem = "there is too little memory";
      return false;
    }
  }
  return true;
}

std::size_t ZipArchive::read(std::span<std::uint8_t> into) {
  State& state = *state_;
  std::size_t done = 0;
  state.ran_out = false;
  while (done < into.size() && !state.ended) {
    const std::size_t got = state.expand_some(into.subspan(done));
    state.crc = libdeflate_crc32(state.crc, into.data() + done, got);
    done += got;
    if (got == 0 && !state.ended) return done;
  }
  state.given += done;
  if (done < into.size()) {
    state.ran_out = true;
    state.problem = "it ends early";
  }
  return done;
}

bool ZipArchive::ran_out() const { return state_->ran_out; }

bool ZipArchive::at_good_end() {
  State& state = *state_;
  std::array<std::uint8_t, 1> more{};
  while (!state.ended) {
    const std::size_t got = state.expand_some(more);
    if (got == 0 && !state.ended && !state.ran_out) return false;
    // if the mark at the end of the compressed data is cut off, size and checksum decide whether the data is good
    if (got == 0) break;
    state.problem = "it is longer than the archive says";
    return false;
  }
  if (state.given != state.entry->size) {
    state.problem = "its size is not the one that the archive says";
    return false;
  }
  if (state.crc == state.entry->crc) return true;
  state.problem = "its checksum is wrong";
  return false;
}

std::string ZipArchive::problem() const { return state_->problem; }

std::uint64_t ZipArchive::offset() const { return state_->entry == nullptr ? 0 : state_->entry->at; }

}  // namespace absenc::capture
