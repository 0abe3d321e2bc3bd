// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/files/sigrok.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/files/mended_zip.hpp"
#include "absenc/capture/files/parsed_reader.hpp"
#include "absenc/capture/files/raw.hpp"
#include "absenc/capture/files/text_lines.hpp"
#include "absenc/capture/files/zip_archive.hpp"

namespace absenc::capture {

namespace {

// Size in bytes up to which a piece (an archive entry with samples) is expanded as a whole; each thread needs that much
// memory. sigrok-cli writes pieces of 4 MiB, PulseView of 10 MiB.
constexpr std::uint64_t largest_piece = 1 << 24;
constexpr std::uint64_t streamed_bytes = 1 << 22;
constexpr std::uint64_t longest_metadata = 1 << 20;
// limit for the number of bytes of a capture; only a damaged file can state more
constexpr std::uint64_t believable = std::uint64_t{1} << 60;
constexpr const char* copy_again = "copy the file again from where it came";

struct Metadata {
  std::string capture_file;
  unsigned unit_size = 1;
  unsigned channels = 0;
  unsigned analog = 0;
  std::uint64_t samples_per_second = 0;
  std::map<unsigned, std::string> names;  // channel names by number, from 1
};

unsigned to_number(std::string_view text) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : 0;
}

// Parses the metadata of a session: the first device that has samples.
Metadata parse_metadata(std::string_view text) {
  Metadata found;
  bool in_device = false;
  while (!text.empty()) {
    const std::string_view line = trim(text.substr(0, text.find('\n')));
    text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
    if (line.starts_with('[')) {
      if (!found.capture_file.empty()) break;
      in_device = line.starts_with("[device");
      continue;
    }
    const std::size_t equals = line.find('=');
    if (!in_device || equals == std::string_view::npos) continue;
    const std::string_view key = trim(line.substr(0, equals));
    const std::string_view value = trim(line.substr(equals + 1));
    if (key == "capturefile") found.capture_file = value;
    if (key == "unitsize") found.unit_size = to_number(value);
    if (key == "total probes") found.channels = to_number(value);
    if (key == "total analog") found.analog = to_number(value);
    if (key == "samplerate") found.samples_per_second = parse_rate(value).value_or(0);
    const unsigned number = key.starts_with("probe") ? to_number(key.substr(5)) : 0;
    if (number >= 1 && number <= 64) found.names[number] = value;
  }
  return found;
}

void widen(std::vector<std::uint8_t>& samples, std::size_t count, std::size_t from, std::size_t to) {
  for (std::size_t i = count; i-- > 0;) {
    std::memmove(&samples[i * to], &samples[i * from], from);
    std::fill_n(samples.begin() + static_cast<std::ptrdiff_t>(i * to + from), to - from, std::uint8_t{0});
  }
}

class SigrokReader final : public Reader {
 public:
  SigrokReader(std::unique_ptr<Source> source, std::string_view name, std::uint64_t samples_per_second)
      : source_(std::move(source)) {
    open_archive(name);
    ZipArchive& archive = *idle_.front();
    const std::string version = read_entry(archive, "version", name);
    if (trim(version) != "1" && trim(version) != "2") {
      throw OpenError(std::string(name) + " has version " + std::string(trim(version)).substr(0, 16) +
                      " of sigrok's sessions; 1 and 2 are known: write it as VCD with sigrok-cli -O vcd");
    }
    const Metadata metadata = parse_metadata(read_entry(archive, "metadata", name));
    describe(metadata, name, samples_per_second);
    list_pieces(archive, metadata.capture_file);
    if (pieces_.empty()) refuse(name, has_lost_entries(), "its first sample", " holds no logic samples");
    describe_end(archive);
  }

  [[nodiscard]] const Layout& layout() const override { return layout_; }
  [[nodiscard]] const std::vector<Damage>& damages() const override { return damages_.list(); }

  [[nodiscard]] bool claim(Block& block) override {
    while (stream_ == nullptr) {
      if (next_ == pieces_.size()) return false;
      const SamplePiece& piece = pieces_[next_++];
      if (piece.entry.size <= largest_piece) {
        start(block, piece.first, (piece.entry.size + piece.tail - piece.skip) / unit_size_);
        block.file_offset = next_ - 1;
        block.file_size = piece.entry.size;
        return true;
      }
      begin_stream(piece);
    }
    claim_streamed(block);
    return true;
  }

  void fill(Block& block) override {
    if (block.file_size == 0) return;  // a block of a large archive entry: `claim` has already read its samples
    const auto index = static_cast<std::size_t>(block.file_offset);
    const SamplePiece& piece = pieces_[index];
    const auto size = static_cast<std::size_t>(piece.entry.size);
    block.samples.resize(
        std::max(static_cast<std::size_t>(block.end - block.first) * bytes_per_sample_, size + piece.tail));
    const std::span<std::uint8_t> into(block.samples);
    std::unique_ptr<ZipArchive> archive = take_handle();
    bool whole = archive != nullptr && archive->expand(piece.entry, into.first(size));
    std::size_t count = size;
    if (!whole) {
      const bool opened = archive != nullptr && archive->open(piece.entry);
      count = opened ? archive->read(into.first(size)) : 0;
      whole = opened && count == size && archive->at_good_end();
    }
    if (whole) {
      count += read_tail(*archive, index, into.subspan(size, piece.tail));
    } else if (!ends_at_cut(piece, archive.get())) {
      // a wrong checksum does not show which samples are wrong, so all samples of the archive entry are dropped
      count = 0;
      report(piece, block.first, archive.get());
    }
    count -= std::min<std::size_t>(count, piece.skip);
    if (piece.skip != 0) std::memmove(into.data(), into.data() + piece.skip, count);
    finish(block, count / unit_size_);
    if (is_cut(piece)) report_cut(piece, block.end, whole);
    return_handle(std::move(archive));
  }

 private:
  struct SamplePiece {
    std::string name;
    ZipArchive::Entry entry{};
    Tick first = 0;
    // Number of bytes at the beginning of this piece (an archive entry) that belong to the last sample of the previous
    // piece, because sigrok may split a sample between two pieces.
    unsigned skip = 0;
    unsigned tail = 0;  // number of bytes of this piece's last sample that are in the next piece (archive entry)
  };

  // Opens the session as a zip archive; a file that lost the directory at its end gets a new one.
  void open_archive(std::string_view name) {
    if (!has_zip()) {
      throw OpenError(std::string(name) +
                      " is a zip archive, as the sessions of sigrok are, and this program was built without the "
                      "libraries that read it: export VCD or CSV instead");
    }
    std::unique_ptr<ZipArchive> archive = take_handle();
    if (archive == nullptr) {
      cut_ = mend_zip(std::move(source_));
      source_ = std::move(cut_->archive);
      archive = take_handle();
    }
    if (archive == nullptr) {
      throw OpenError(std::string(name) + " is a zip archive that is too damaged to be read: " + copy_again);
    }
    return_handle(std::move(archive));
  }

  [[nodiscard]] bool has_lost_entries() const { return cut_ && !cut_->complete; }

  [[noreturn]] void refuse(std::string_view name, bool cut, const std::string& before, const std::string& else_) const {
    throw OpenError(std::string(name) + (cut ? " is a zip archive that is cut off at byte " +
                                                   std::to_string(cut_->end) + ", before " + before + ": " + copy_again
                                             : else_));
  }

  std::string read_entry(ZipArchive& archive, const std::string& entry_name, std::string_view name) const {
    const std::string end = "the end of its " + entry_name;
    ZipArchive::Entry entry;
    if (!archive.find(entry_name, entry)) {
      refuse(name, has_lost_entries(), end, " is a zip archive, but no session of sigrok: it holds no " + entry_name);
    }
    std::vector<std::uint8_t> text(static_cast<std::size_t>(std::min(entry.size, longest_metadata)));
    if (entry.size > longest_metadata || !archive.open(entry) || archive.read(text) != text.size() ||
        !archive.at_good_end()) {
      refuse(name, cut_ && cut_->cut_entry == entry.index, end, ": " + entry_name + " in it is damaged");
    }
    return {text.begin(), text.end()};
  }

  void describe(const Metadata& metadata, std::string_view name, std::uint64_t samples_per_second) {
    if (metadata.capture_file.empty()) throw OpenError(std::string(name) + " holds no logic samples, only other ones");
    if (metadata.channels > 64 || metadata.unit_size < 1 || metadata.unit_size > 8) {
      throw OpenError(std::string(name) + " has " + std::to_string(metadata.channels) + " channels in samples of " +
                      std::to_string(metadata.unit_size) + " bytes; 64 in 8 bytes are the most");
    }
    unit_size_ = metadata.unit_size;
    bytes_per_sample_ = bytes_per_sample(8 * unit_size_);
    const unsigned channels = metadata.channels != 0 ? std::min(metadata.channels, 8 * unit_size_) : 8 * unit_size_;
    for (unsigned i = 1; i <= channels; ++i) {
      const auto found = metadata.names.find(i);
      layout_.channels.push_back(found != metadata.names.end() ? found->second : "probe" + std::to_string(i));
    }
    layout_.content = Content::samples;
    layout_.ticks_per_second = metadata.samples_per_second != 0 ? metadata.samples_per_second : samples_per_second;
    if (metadata.analog != 0) {
      damages_.add({.what = std::to_string(metadata.analog) + " analog channels are left out", .note = true});
    }
  }

  // Returns the numbers N of all entries of the archive that are named NAME-N, in rising order.
  static std::vector<unsigned> numbers_of_pieces(const ZipArchive& archive, const std::string& name) {
    std::vector<unsigned> numbers;
    for (const std::string& entry : archive.names()) {
      if (!entry.starts_with(name + "-")) continue;
      const unsigned number = to_number(std::string_view(entry).substr(name.size() + 1));
      if (number != 0 && entry == name + "-" + std::to_string(number)) numbers.push_back(number);
    }
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
  }

  // Leaves a gap for missing pieces (archive entries with samples). Returns the number of sample bytes before the piece
  // `next`, if each missing piece was as long as one beside them.
  std::uint64_t leave_gap(ZipArchive& archive, const std::string& name, const std::string& next,
                          std::pair<unsigned, unsigned> missing_numbers, std::uint64_t before) {
    ZipArchive::Entry neighbour;
    static_cast<void>(archive.find(next, neighbour));
    if (!pieces_.empty()) {
      neighbour.size = pieces_.back().entry.size;
      pieces_.back().tail = 0;
    }
    const std::uint64_t count = missing_numbers.second - missing_numbers.first;
    const std::uint64_t longest = neighbour.size == 0 ? 0 : believable / neighbour.size;
    const std::uint64_t after = before + std::min(count, longest) * neighbour.size;
    const std::string first = name + "-" + std::to_string(missing_numbers.first);
    const std::string last = name + "-" + std::to_string(missing_numbers.second - 1);
    static_cast<void>(archive.open(neighbour));
    damages_.add({.offset = archive.offset(),
                  .tick = before / unit_size_,
                  .what = (count == 1 ? first + " is missing" : first + " to " + last + " are missing") + ", about " +
                          std::to_string((after - before) / unit_size_) + " samples; " + copy_again});
    return after;
  }

  void list_pieces(ZipArchive& archive, const std::string& name) {
    std::uint64_t bytes = 0;
    const auto add = [&](const std::string& entry_name) {
      SamplePiece piece{.name = entry_name};
      if (!archive.find(entry_name, piece.entry)) return false;
      if (piece.entry.size == 0) return true;
      piece.skip = missing(bytes);
      piece.first = (bytes + piece.skip) / unit_size_;
      bytes = std::min(bytes + std::min(piece.entry.size, believable), believable);
      piece.tail = missing(bytes);
      pieces_.push_back(std::move(piece));
      return true;
    };
    if (!add(name)) {
      unsigned expected = 1;
      for (const unsigned number : numbers_of_pieces(archive, name)) {
        const std::string piece = name + "-" + std::to_string(number);
        if (number != expected) bytes = leave_gap(archive, name, piece, {expected, number}, bytes);
        add(piece);
        bytes = std::min(bytes, believable);
        expected = number + 1;
      }
    }
    layout_.ticks = bytes / unit_size_;
  }

  void describe_end(ZipArchive& archive) {
    SamplePiece& last = pieces_.back();
    if (has_lost_entries()) {
      last.tail = 0;
      if (std::any_of(pieces_.begin(), pieces_.end(), [&](const SamplePiece& piece) { return is_cut(piece); })) {
        layout_.ticks = 0;  // the file is cut off within samples: the length of the capture is known only after reading
      } else {
        damages_.add({.offset = cut_->end,
                      .tick = layout_.ticks,
                      .what = std::string("the file is cut off: whatever came next is missing; ") + copy_again});
      }
      return;
    }
    if (cut_) {
      damages_.add({.offset = cut_->end,
                    .tick = layout_.ticks,
                    .what = "the directory of the archive is cut off or damaged; no piece is missing",
                    .note = true});
    }
    if (last.tail == 0) return;
    last.tail = 0;
    static_cast<void>(archive.open(last.entry));
    damages_.add({.offset = archive.offset(), .tick = layout_.ticks, .what = last.name + " ends within a sample"});
  }

  [[nodiscard]] bool is_cut(const SamplePiece& piece) const { return cut_ && cut_->cut_entry == piece.entry.index; }

  // Returns whether the samples of an archive entry ended because the file is cut off within this entry.
  [[nodiscard]] bool ends_at_cut(const SamplePiece& piece, const ZipArchive* archive) const {
    return is_cut(piece) && archive != nullptr && archive->ran_out();
  }

  // Returns how many bytes follow the offset `bytes` in the sample that lies at this offset; 0 if a sample begins
  // there.
  [[nodiscard]] unsigned missing(std::uint64_t bytes) const {
    return static_cast<unsigned>((unit_size_ - bytes % unit_size_) % unit_size_);
  }

  // Reads the bytes of a piece's last sample that are in the next piece (archive entry). Returns their number, which
  // may be lower than the size of `into`.
  [[nodiscard]] std::size_t read_tail(ZipArchive& archive, std::size_t index, std::span<std::uint8_t> into) const {
    return into.empty() || !archive.open(pieces_[index + 1].entry) ? 0 : archive.read(into);
  }

  void start(Block& block, Tick first, std::uint64_t count) {
    begin_block(block, index_++, first);
    block.bytes_per_sample = bytes_per_sample_;
    block.end = first + count;
  }

  // Completes a block of `count` samples, which still have the sample size of the file.
  void finish(Block& block, std::size_t count) const {
    if (unit_size_ != bytes_per_sample_) {
      block.samples.resize(std::max(block.samples.size(), count * bytes_per_sample_));
      widen(block.samples, count, unit_size_, bytes_per_sample_);
    }
    block.samples.resize(count * bytes_per_sample_);
    block.end = block.first + count;
  }

  void begin_stream(const SamplePiece& piece) {
    stream_ = take_handle();
    stream_tick_ = piece.first;
    stream_left_ = piece.entry.size - piece.skip;
    std::array<std::uint8_t, 8> skipped{};
    const auto skip = std::span(skipped).first(piece.skip);
    if (stream_ != nullptr && stream_->open(piece.entry) && stream_->read(skip) == skip.size()) return;
    if (!ends_at_cut(piece, stream_.get())) report(piece, piece.first, stream_.get());
    if (is_cut(piece)) report_cut(piece, piece.first, false);
    return_handle(std::move(stream_));
  }

  // Reads the next samples of a large archive entry into `block`.
  void claim_streamed(Block& block) {
    const SamplePiece& piece = pieces_[next_ - 1];
    const auto wanted = static_cast<std::size_t>(std::min(stream_left_, streamed_bytes / unit_size_ * unit_size_));
    const bool last = wanted == stream_left_;
    start(block, stream_tick_, 0);
    block.samples.resize(wanted + (last ? piece.tail : 0));
    const std::span<std::uint8_t> into(block.samples);
    std::size_t got = stream_->read(into.first(wanted));
    const bool whole = got == wanted;
    const bool good = whole && (!last || stream_->at_good_end());
    if (!good && !ends_at_cut(piece, stream_.get())) {
      report(piece, whole ? piece.first : stream_tick_ + got / unit_size_, stream_.get());
    }
    if (whole && last) got += read_tail(*stream_, next_ - 1, into.subspan(wanted));
    finish(block, got / unit_size_);
    stream_tick_ = block.end;
    stream_left_ -= wanted;
    if (whole && !last) return;
    if (is_cut(piece)) report_cut(piece, block.end, good);
    return_handle(std::move(stream_));
  }

  void report(const SamplePiece& piece, Tick at, const ZipArchive* archive) {
    const std::string why = archive == nullptr ? "the file cannot be opened again" : archive->problem();
    damages_.add({.offset = archive == nullptr ? 0 : archive->offset(),
                  .tick = at,
                  .what = piece.name + ", which ends at sample " +
                          std::to_string(piece.first + (piece.entry.size + piece.tail - piece.skip) / unit_size_) +
                          ", is damaged: " + why});
  }

  void report_cut(const SamplePiece& piece, Tick at, bool checked) {
    damages_.add({.offset = cut_->end,
                  .tick = at,
                  .what = "the file is cut off within " + piece.name +
                          (checked ? "; " : ", and the checksum of what is left of that cannot be verified; ") +
                          copy_again});
  }

  // Returns an open ZipArchive of the file that no other thread uses; null if the file cannot be opened again.
  std::unique_ptr<ZipArchive> take_handle() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<ZipArchive> archive = std::move(idle_.back());
        idle_.pop_back();
        return archive;
      }
    }
    try {
      return std::make_unique<ZipArchive>(*source_);
    } catch (const OpenError&) {
      return nullptr;
    }
  }

  void return_handle(std::unique_ptr<ZipArchive> archive) {
    if (archive == nullptr) return;
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(archive));
  }

  std::unique_ptr<Source> source_;
  std::optional<MendedZip> cut_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<ZipArchive>> idle_;
  std::vector<SamplePiece> pieces_;
  unsigned unit_size_ = 1;
  unsigned bytes_per_sample_ = 1;
  std::size_t next_ = 0;
  std::uint64_t index_ = 0;
  // open archive from which a large entry is being read in parts; null: none is read so
  std::unique_ptr<ZipArchive> stream_;
  Tick stream_tick_ = 0;
  std::uint64_t stream_left_ = 0;
  Layout layout_;
  Damages damages_;
};

}  // namespace

bool is_zip(std::string_view head) { return head.starts_with("PK\x03\x04"); }

std::unique_ptr<Reader> read_sigrok(std::unique_ptr<Source> source, std::string_view name,
                                    std::uint64_t samples_per_second) {
  return std::make_unique<SigrokReader>(std::move(source), name, samples_per_second);
}

}  // namespace absenc::capture
