// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/source.hpp"

#include <algorithm>
#include <exception>
#include <fstream>
#include <ios>
#include <mutex>
#include <system_error>
#include <utility>

namespace absenc::capture {

namespace {

using Handle = std::unique_ptr<std::filebuf>;

Handle open_handle(const std::filesystem::path& path) {
  auto handle = std::make_unique<std::filebuf>();
  handle->pubsetbuf(nullptr, 0);
  if (handle->open(path, std::ios::in | std::ios::binary) == nullptr) return nullptr;
  return handle;
}

// A capture file on a disk. A handle has one position, so each reading thread takes its own.
class FileSource final : public Source {
 public:
  FileSource(std::filesystem::path path, std::uint64_t size, Handle first) : path_(std::move(path)), size_(size) {
    idle_.push_back(std::move(first));
  }

  [[nodiscard]] std::uint64_t size() const override { return size_; }

  [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) override {
    if (offset >= size_) return 0;
    Handle handle = take();
    if (handle == nullptr) return 0;
    std::size_t count = 0;
    try {
      const auto position = static_cast<std::streamoff>(offset);
      if (handle->pubseekoff(position, std::ios::beg, std::ios::in) != std::streampos(position)) return 0;
      const auto wanted = static_cast<std::streamsize>(std::min<std::uint64_t>(into.size(), size_ - offset));
      const std::streamsize got = handle->sgetn(reinterpret_cast<char*>(into.data()), wanted);
      count = got > 0 ? static_cast<std::size_t>(got) : 0;
    } catch (const std::exception&) {  // libstdc++ throws if the disk fails; `read` then returns 0
      return 0;
    }
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(handle));
    return count;
  }

 private:
  Handle take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        Handle handle = std::move(idle_.back());
        idle_.pop_back();
        return handle;
      }
    }
    return open_handle(path_);
  }

  std::filesystem::path path_;
  std::uint64_t size_;
  std::mutex mutex_;
  std::vector<Handle> idle_;
};

class MemorySource final : public Source {
 public:
  explicit MemorySource(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {}

  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }

  [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) override {
    if (offset >= bytes_.size()) return 0;
    const auto from = std::span<const std::uint8_t>(bytes_).subspan(static_cast<std::size_t>(offset));
    const std::size_t count = std::min(into.size(), from.size());
    std::copy_n(from.begin(), count, into.begin());
    return count;
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<Source> file_source(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw OpenError(name_of(path) + " does not exist");
  if (std::filesystem::is_directory(status)) throw OpenError(name_of(path) + " is a folder");
  if (!std::filesystem::is_regular_file(status)) {
    throw OpenError(name_of(path) + " is no file that can be read at any place: copy it into one");
  }
  const std::uint64_t size = std::filesystem::file_size(path, error);
  Handle handle = error ? nullptr : open_handle(path);
  if (handle == nullptr) throw OpenError(name_of(path) + " cannot be read: check its permissions");
  return std::make_unique<FileSource>(path, size, std::move(handle));
}

std::unique_ptr<Source> memory_source(std::vector<std::uint8_t> bytes) {
  return std::make_unique<MemorySource>(std::move(bytes));
}

}  // namespace absenc::capture
