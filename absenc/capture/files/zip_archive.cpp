// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/zip_archive.hpp"

#include <libdeflate.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

namespace absenc::capture {

namespace {

// The source in the form that libzip reads, with a buffer that saves system calls.
struct Window {
  Source* source = nullptr;
  std::uint64_t position = 0;
  std::uint64_t buffered_at = 0;
  std::size_t buffered = 0;
  std::array<std::uint8_t, 1 << 16> buffer{};
  bool mark = false;  // true: the next read of the source is the first one since an entry was opened
  std::uint64_t entry = 0;
  zip_error_t error{};

  std::size_t read(std::uint8_t* into, std::size_t size) {
    if (std::exchange(mark, false)) entry = position;
    std::size_t done = 0;
    while (done < size) {
      if (position < buffered_at || position >= buffered_at + buffered) {
        buffered_at = position;
        buffered = source->read(position, buffer);
        if (buffered == 0) break;
      }
      const auto from = static_cast<std::size_t>(position - buffered_at);
      const std::size_t count = std::min(size - done, buffered - from);
      std::memcpy(into + done, buffer.data() + from, count);
      done += count;
      position += count;
    }
    return done;
  }

  zip_int64_t seek(void* data, zip_uint64_t length) {
    const zip_int64_t to = zip_source_seek_compute_offset(position, source->size(), data, length, &error);
    if (to < 0) return -1;
    position = static_cast<std::uint64_t>(to);
    return 0;
  }

  zip_int64_t status(void* data, zip_uint64_t length) {
    if (length < sizeof(zip_stat_t)) return -1;
    auto* stat = static_cast<zip_stat_t*>(data);
    zip_stat_init(stat);
    stat->size = source->size();
    stat->valid |= ZIP_STAT_SIZE;
    return sizeof(zip_stat_t);
  }
};

zip_int64_t answer(void* user, void* data, zip_uint64_t length, zip_source_cmd_t command) {
  auto& window = *static_cast<Window*>(user);
  switch (command) {
    case ZIP_SOURCE_OPEN:
      window.position = 0;
      return 0;
    case ZIP_SOURCE_READ:
      return static_cast<zip_int64_t>(window.read(static_cast<std::uint8_t*>(data), static_cast<std::size_t>(length)));
    case ZIP_SOURCE_CLOSE:
    case ZIP_SOURCE_FREE:
      return 0;
    case ZIP_SOURCE_STAT:
      return window.status(data, length);
    case ZIP_SOURCE_ERROR:
      return zip_error_to_data(&window.error, data, length);
    case ZIP_SOURCE_SEEK:
      return window.seek(data, length);
    case ZIP_SOURCE_TELL:
      return static_cast<zip_int64_t>(window.position);
    case ZIP_SOURCE_SUPPORTS:
      return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT,
                                            ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE, ZIP_SOURCE_SEEK, ZIP_SOURCE_TELL,
                                            ZIP_SOURCE_SUPPORTS, -1);
    default:
      zip_error_set(&window.error, ZIP_ER_OPNOTSUPP, 0);
      return -1;
  }
}

struct Close {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
  void operator()(libdeflate_decompressor* inflater) const { libdeflate_free_decompressor(inflater); }
};

// Returns a limit for the compressed size of `size` bytes: deflate adds only few bytes to data that cannot be
// compressed.
constexpr std::size_t most_packed(std::size_t size) { return size + size / 64 + 1024; }

}  // namespace

struct ZipArchive::State {
  Window window;
  std::unique_ptr<zip_t, Close> archive;
  std::unique_ptr<zip_file_t, Close> file;  // handle of the entry that is read; must be closed before its archive
  std::unique_ptr<libdeflate_decompressor, Close> inflater;
  std::vector<std::uint8_t> packed;
  std::string problem;
  bool ran_out = false;

  std::span<std::uint8_t> room(std::size_t size) {
    if (packed.size() < size) packed.resize(size);
    return std::span(packed).first(size);
  }
  // Expands a deflated entry. Returns true if the data fills `into` exactly.
  bool inflate(std::span<const std::uint8_t> from, std::span<std::uint8_t> into) {
    if (inflater == nullptr) inflater.reset(libdeflate_alloc_decompressor());
    return inflater != nullptr && libdeflate_deflate_decompress(inflater.get(), from.data(), from.size(), into.data(),
                                                                into.size(), nullptr) == LIBDEFLATE_SUCCESS;
  }
};

ZipArchive::ZipArchive(Source& source) : state_(std::make_unique<State>()) {
  state_->window.source = &source;
  zip_error_t error;
  zip_error_init(&error);
  zip_error_init(&state_->window.error);
  zip_source_t* from = zip_source_function_create(&answer, &state_->window, &error);
  if (from != nullptr) state_->archive.reset(zip_open_from_source(from, ZIP_RDONLY, &error));
  if (state_->archive == nullptr) {
    const std::string why = zip_error_strerror(&error);
    zip_source_free(from);
    zip_error_fini(&error);
    throw OpenError(why);
  }
  zip_error_fini(&error);
}

ZipArchive::~ZipArchive() {
  state_->file.reset();
  state_->archive.reset();
  zip_error_fini(&state_->window.error);
}

bool ZipArchive::find(const std::string& name, Entry& entry) const {
  const zip_int64_t index = zip_name_locate(state_->archive.get(), name.c_str(), ZIP_FL_ENC_GUESS);
  zip_stat_t stat;
  zip_stat_init(&stat);
  if (index < 0 || zip_stat_index(state_->archive.get(), static_cast<zip_uint64_t>(index), 0, &stat) != 0) return false;
  entry = {static_cast<std::uint64_t>(index), (stat.valid & ZIP_STAT_SIZE) != 0 ? stat.size : 0};
  return true;
}

std::vector<std::string> ZipArchive::names() const {
  std::vector<std::string> names;
  const zip_int64_t count = zip_get_num_entries(state_->archive.get(), 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* name = zip_get_name(state_->archive.get(), static_cast<zip_uint64_t>(i), ZIP_FL_ENC_GUESS);
    if (name != nullptr) names.emplace_back(name);
  }
  return names;
}

bool ZipArchive::expand(const Entry& entry, std::span<std::uint8_t> into) {
  zip_stat_t stat;
  zip_stat_init(&stat);
  constexpr zip_uint64_t needed =
      ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_CRC | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
  const bool known =
      zip_stat_index(state_->archive.get(), entry.index, 0, &stat) == 0 && (stat.valid & needed) == needed;
  if (!known || stat.comp_method != ZIP_CM_DEFLATE || stat.encryption_method != ZIP_EM_NONE) return false;
  if (stat.size != into.size() || stat.comp_size > most_packed(into.size())) return false;
  const std::span<std::uint8_t> packed = state_->room(static_cast<std::size_t>(stat.comp_size));
  state_->file.reset(zip_fopen_index(state_->archive.get(), entry.index, ZIP_FL_COMPRESSED));
  if (state_->file == nullptr || read(packed) != packed.size() || !state_->inflate(packed, into)) return false;
  return libdeflate_crc32(0, into.data(), into.size()) == stat.crc;
}

bool ZipArchive::open(const Entry& entry) {
  state_->file.reset();
  state_->ran_out = false;
  state_->window.mark = true;
  state_->file.reset(zip_fopen_index(state_->archive.get(), entry.index, 0));
  if (state_->file != nullptr) return true;
  state_->problem = zip_error_strerror(zip_get_error(state_->archive.get()));
  return false;
}

std::size_t ZipArchive::read(std::span<std::uint8_t> into) {
  std::size_t done = 0;
  state_->ran_out = false;
  while (done < into.size()) {
    const zip_int64_t got = zip_fread(state_->file.get(), into.data() + done, into.size() - done);
    if (got <= 0) {
      // At the end of an entry libzip checks the entry's checksum and size.
      const int code = zip_error_code_zip(zip_file_get_error(state_->file.get()));
      state_->ran_out = got == 0 || code == ZIP_ER_CRC || code == ZIP_ER_INCONS;
      state_->problem = got == 0 ? "it ends early" : zip_error_strerror(zip_file_get_error(state_->file.get()));
      break;
    }
    done += static_cast<std::size_t>(got);
  }
  return done;
}

bool ZipArchive::ran_out() const { return state_->ran_out; }

bool ZipArchive::at_good_end() {
  std::uint8_t more = 0;
  const zip_int64_t got = zip_fread(state_->file.get(), &more, 1);
  if (got == 0) return true;
  state_->problem =
      got > 0 ? "it is longer than the archive says" : zip_error_strerror(zip_file_get_error(state_->file.get()));
  return false;
}

std::string ZipArchive::problem() const { return state_->problem; }

std::uint64_t ZipArchive::offset() const { return state_->window.entry; }

}  // namespace absenc::capture
