// SPDX-License-Identifier: Apache-2.0
// Helpers shared by the tests and fuzzers of the readers.
#pragma once

#include <zip.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "absenc/capture/files/open.hpp"

namespace absenc::capture {

using FileBytes = std::vector<std::uint8_t>;

inline FileBytes to_bytes(std::string_view text) { return {text.begin(), text.end()}; }

inline std::unique_ptr<Reader> open_bytes(FileBytes bytes, const OpenChoices& choices = {},
                                          std::string_view name = "capture") {
  return open_capture(memory_source(std::move(bytes)), name, choices);
}

inline std::unique_ptr<Reader> open_text(std::string_view text, const OpenChoices& choices = {}) {
  return open_bytes(to_bytes(text), choices);
}

/// The joined content of all blocks of a capture.
struct CaptureContents {
  std::vector<std::uint8_t> samples;
  std::vector<Changes> changes;
  std::vector<Character> bytes;
  std::vector<CanRecord> frames;
  std::uint64_t blocks = 0;
  Tick first = 0;
  Tick end = 0;
};

inline void require_that(bool condition) {
  if (!condition) std::abort();
}

/// Reads a capture to its end and returns its contents. Aborts if the reader breaks a rule of Reader, for example if
/// the times of a block are not in order.
inline CaptureContents read_all(Reader& reader) {
  CaptureContents all;
  Block block;
  const Layout layout = reader.layout();
  while (reader.claim(block)) {
    reader.fill(block);
    require_that(block.index == all.blocks && block.first <= block.end);
    if (all.blocks == 0) all.first = block.first;
    require_that(block.first >= all.end || all.blocks == 0);
    ++all.blocks;
    all.end = block.end;
    if (layout.content == Content::samples) {
      require_that(block.samples.size() == (block.end - block.first) * block.bytes_per_sample);
      all.samples.insert(all.samples.end(), block.samples.begin(), block.samples.end());
    }
    if (layout.content == Content::changes) {
      require_that(block.changes.size() == layout.channels.size());
      if (all.changes.empty()) all.changes.assign(block.changes.size(), {});
      for (std::size_t i = 0; i < block.changes.size(); ++i) {
        Changes& whole = all.changes[i];
        if (all.blocks == 1) whole.before = block.changes[i].before;
        require_that(block.changes[i].before == (whole.before != (whole.at.size() % 2 != 0)));
        Tick last = block.first;
        for (const Tick at : block.changes[i].at) {
          require_that(at >= last && at < block.end && (whole.at.empty() || at > whole.at.back()));
          whole.at.push_back(last = at);
        }
      }
    }
    for (const Character& one : block.bytes) require_that(one.begin >= block.first && one.begin <= block.end);
    for (const CanRecord& one : block.frames)
      require_that(one.frame.size <= 8 && one.at >= block.first && one.at <= block.end);
    all.bytes.insert(all.bytes.end(), block.bytes.begin(), block.bytes.end());
    all.frames.insert(all.frames.end(), block.frames.begin(), block.frames.end());
  }
  require_that(!reader.claim(block));
  for (const Damage& damage : reader.damages()) require_that(!damage.what.empty());
  return all;
}

/// Returns the samples of a capture whose blocks are filled by four threads at once.
inline FileBytes read_in_threads(Reader& reader) {
  std::mutex mutex;
  std::vector<FileBytes> parts;
  const auto work = [&] {
    Block block;
    for (;;) {
      {
        const std::lock_guard lock(mutex);
        if (!reader.claim(block)) return;
        parts.resize(static_cast<std::size_t>(block.index) + 1);
      }
      reader.fill(block);
      const std::lock_guard lock(mutex);
      parts[static_cast<std::size_t>(block.index)] = block.samples;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  FileBytes all;
  for (const FileBytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// Returns a zip archive with the given entries, compressed by `method` of libzip.
inline FileBytes make_zip(const std::vector<std::pair<std::string, FileBytes>>& entries, zip_int32_t method) {
  zip_source_t* target = zip_source_buffer_create(nullptr, 0, 0, nullptr);
  zip_source_keep(target);
  zip_t* archive = zip_open_from_source(target, ZIP_TRUNCATE, nullptr);
  require_that(archive != nullptr);
  for (const auto& [name, bytes] : entries) {
    zip_source_t* from = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    const zip_int64_t index = zip_file_add(archive, name.c_str(), from, 0);
    require_that(index >= 0);
    zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), method, 1);
  }
  require_that(zip_close(archive) == 0);
  zip_stat_t stat;
  require_that(zip_source_stat(target, &stat) == 0 && zip_source_open(target) == 0);
  FileBytes made(static_cast<std::size_t>(stat.size));
  require_that(zip_source_read(target, made.data(), made.size()) == static_cast<zip_int64_t>(made.size()));
  zip_source_close(target);
  zip_source_free(target);
  return made;
}

/// Returns a zip archive with the given entries, all deflated or all stored.
inline FileBytes make_zip(const std::vector<std::pair<std::string, FileBytes>>& entries, bool deflate = true) {
  return make_zip(entries, deflate ? zip_int32_t{ZIP_CM_DEFLATE} : zip_int32_t{ZIP_CM_STORE});
}

inline std::string sigrok_metadata(std::string_view rate, unsigned channels, unsigned unit_size) {
  std::string text = "[global]\nsigrok version=0.5.2\n\n[device 1]\ncapturefile=logic-1\n";
  text += "total probes=" + std::to_string(channels) + "\nsamplerate=" + std::string(rate) + "\ntotal analog=0\n";
  for (unsigned i = 1; i <= channels; ++i) text += "probe" + std::to_string(i) + "=D" + std::to_string(i - 1) + "\n";
  return text + "unitsize=" + std::to_string(unit_size) + "\n";
}

/// Writes text, and numbers with their least significant byte first, for tests of binary files.
struct BinaryWriter {
  FileBytes bytes;

  template <class Number>
  BinaryWriter& put(Number number) {
    auto part = std::bit_cast<std::array<std::uint8_t, sizeof(Number)>>(number);
    if constexpr (std::endian::native == std::endian::big) std::reverse(part.begin(), part.end());
    bytes.insert(bytes.end(), part.begin(), part.end());
    return *this;
  }
  BinaryWriter& text(std::string_view text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
    return *this;
  }
};

inline BinaryWriter saleae_header(std::int32_t version, std::int32_t type = 0) {
  BinaryWriter writer;
  writer.text("<SALEAE>").put(version).put(type);
  return writer;
}

inline FileBytes saleae_file(bool level, double begin, double end, const std::vector<double>& times) {
  BinaryWriter writer = saleae_header(0);
  writer.put(std::uint32_t{level}).put(begin).put(end).put(std::uint64_t{times.size()});
  for (const double time : times) writer.put(time);
  return writer.bytes;
}

/// Calls `read` with the fuzzer's input, and with a good file that is changed by the input.
template <class Read>
void fuzz_file(const std::uint8_t* data, std::size_t size, const FileBytes& good, Read read) {
  read(FileBytes(data, data + size));
  FileBytes changed = good;
  std::size_t i = 0;
  for (; i + 3 <= size; i += 3) {
    changed[(static_cast<std::size_t>(data[i]) << 8 | data[i + 1]) % changed.size()] = data[i + 2];
  }
  if (i < size) changed.resize(changed.size() * data[i] / 256);
  read(std::move(changed));
}

/// Requires that opening a file either states why it fails or gives a capture that can be read to its end.
inline void read_or_refuse(FileBytes bytes, const OpenChoices& choices = {}) {
  std::unique_ptr<Reader> reader;
  try {
    reader = open_bytes(std::move(bytes), choices);
  } catch (const OpenError& error) {
    require_that(error.what()[0] != '\0');
    return;
  }
  static_cast<void>(read_all(*reader));
}

}  // namespace absenc::capture
