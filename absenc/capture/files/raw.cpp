// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/raw.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "absenc/capture/files/parsed_reader.hpp"

namespace absenc::capture {

namespace {

// number of bytes in a block: small enough to stay in the cache until the block is decoded
constexpr std::uint64_t block_bytes = 1 << 20;

class RawReader final : public Reader {
 public:
  RawReader(std::unique_ptr<Source> source, unsigned channels, std::uint64_t samples_per_second)
      : source_(std::move(source)), size_of_sample_(bytes_per_sample(channels)) {
    whole_ = source_->size() / size_of_sample_ * size_of_sample_;
    layout_.content = Content::samples;
    layout_.ticks_per_second = samples_per_second;
    layout_.ticks = whole_ / size_of_sample_;
    for (unsigned i = 0; i < channels; ++i) layout_.channels.push_back(std::to_string(i));
    if (const std::uint64_t rest = source_->size() - whole_; rest != 0) {
      damages_.add({.offset = whole_,
                    .tick = layout_.ticks,
                    .what = "the last " + std::to_string(rest) + " bytes are no whole sample of " +
                            std::to_string(size_of_sample_) + " bytes: is the number of channels right?"});
    }
  }

  [[nodiscard]] const Layout& layout() const override { return layout_; }

  [[nodiscard]] bool claim(Block& block) override {
    if (next_ == whole_) return false;
    block.index = next_ / block_bytes;
    block.bytes_per_sample = size_of_sample_;
    block.file_offset = next_;
    block.file_size = std::min(block_bytes, whole_ - next_);
    block.first = next_ / size_of_sample_;
    next_ += block.file_size;
    block.end = next_ / size_of_sample_;
    return true;
  }

  // The size of `block.samples` mostly stays the same, so `resize` rarely has bytes to clear.
  void fill(Block& block) override {
    block.samples.resize(static_cast<std::size_t>(block.file_size));
    const std::size_t got = source_->read(block.file_offset, block.samples);
    if (got == block.samples.size()) return;
    block.samples.resize(got / size_of_sample_ * size_of_sample_);
    block.end = block.first + block.samples.size() / size_of_sample_;
    damages_.add({.offset = block.file_offset + got,
                  .tick = block.end,
                  .what = "the file cannot be read here: was it made shorter, or does the disk fail?"});
  }

  [[nodiscard]] const std::vector<Damage>& damages() const override { return damages_.list(); }

 private:
  std::unique_ptr<Source> source_;
  unsigned size_of_sample_;
  std::uint64_t whole_ = 0;
  std::uint64_t next_ = 0;
  Layout layout_;
  Damages damages_;
};

}  // namespace

std::unique_ptr<Reader> read_raw(std::unique_ptr<Source> source, std::string_view name, unsigned channels,
                                 std::uint64_t samples_per_second) {
  if (channels < 1 || channels > 64) {
    throw OpenError(std::string(name) + ": raw samples have 1 to 64 channels, not " + std::to_string(channels));
  }
  if (samples_per_second == 0) {
    throw OpenError(std::string(name) + ": raw samples do not tell how fast they were taken: give the sample rate");
  }
  return std::make_unique<RawReader>(std::move(source), channels, samples_per_second);
}

}  // namespace absenc::capture
