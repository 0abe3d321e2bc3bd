// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/annotate/drawing.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <ostream>
#include <span>
#include <stdexcept>
#include <vector>

#include "absenc/capture/files/zip_writer.hpp"

namespace absenc::capture {

namespace {

// Writes `number` in groups of 7 bits, lowest first; bit 7 is set in all bytes but the last.
void put_number(std::FILE* file, std::uint64_t number) {
  for (; number > 0x7F; number >>= 7) std::putc(static_cast<int>(number & 0x7F) | 0x80, file);
  std::putc(static_cast<int>(number), file);
}

bool get_number(std::FILE* file, std::uint64_t& number) {
  number = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const int byte = std::getc(file);
    if (byte == EOF) return false;
    number |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
    if (byte < 0x80) return true;
  }
  return false;
}

[[noreturn]] void fail_scratch(const char* why) {
  throw std::runtime_error(std::string("the waveform cannot be kept until it is written: ") + why);
}

void check(std::FILE* file) {
  if (std::ferror(file) != 0) fail_scratch(std::strerror(errno));
}

void begin_reading(std::FILE* file) {
  if (std::fflush(file) != 0 || std::fseek(file, 0, SEEK_SET) != 0) fail_scratch(std::strerror(errno));
}

/// The levels of all wires of a drawing at one time, which only moves forward.
class WireLevels {
 public:
  explicit WireLevels(Drawing& drawing) : drawing_(drawing) {
    for (const Drawing::Wire& wire : drawing.wires()) levels.push_back(wire.before);
    drawing.rewind_changes();
    take();
    advance(0);
  }

  /// Returns the time of the next change, or the end of the drawing.
  [[nodiscard]] Tick next_change() const { return std::min(next_, drawing_.end()); }
  /// Applies all level changes up to and including `time`.
  void advance(Tick time) {
    constexpr unsigned changes_per_report = 4096;
    for (; next_ <= time && next_ != none; take()) {
      levels[wire_] = !levels[wire_];
      if (++taken_ % changes_per_report == 0) drawing_.report_progress();
    }
  }

  std::vector<bool> levels;

 private:
  static constexpr Tick none = std::numeric_limits<Tick>::max();

  void take() {
    if (!drawing_.next_change(next_, wire_)) next_ = none;
  }

  Drawing& drawing_;
  Tick next_ = 0;
  std::size_t wire_ = 0;
  std::uint64_t taken_ = 0;
};

// Returns a wire's identifier for the value change dump: printable characters from '!' on.
std::string identifier(std::size_t trace) {
  constexpr std::size_t digits = 94;
  std::string text(1, static_cast<char>('!' + trace % digits));
  return trace < digits ? text : identifier(trace / digits - 1) + text;
}

constexpr std::uint64_t nanoseconds_a_second = 1'000'000'000;

std::string seconds(Tick time) {
  std::string fraction = std::to_string(time % nanoseconds_a_second);
  fraction.insert(0, 9 - fraction.size(), '0');
  return std::to_string(time / nanoseconds_a_second) + '.' + fraction;
}

/// The samples of a drawing in the order of time; each call of `fill` computes the next ones.
class Samples {
 public:
  Samples(Drawing& drawing, std::uint64_t rate)
      : size(std::bit_ceil((drawing.wires().size() + 7) / 8)),
        count(sample_at(drawing.end(), rate)),
        drawing_(drawing),
        levels_(drawing),
        rate_(rate) {}

  /// Writes as many whole samples as fit into `room` bytes. Returns the number of written bytes.
  std::size_t fill(std::uint8_t* bytes, std::size_t room) {
    drawing_.report_progress();
    const std::size_t wanted = room / size;
    for (std::size_t done = 0; done < wanted;) {
      if (sample_ >= changes_at_) take_change();
      const std::uint64_t same = changes_at_ > sample_ ? changes_at_ - sample_ : wanted;
      const auto run = static_cast<std::size_t>(std::min<std::uint64_t>(wanted - done, same));
      if (size == 1) {
        std::memset(bytes + done, packed_[0], run);
      } else {
        for (std::size_t i = 0; i < run; ++i) std::memcpy(bytes + (done + i) * size, packed_, size);
      }
      done += run;
      sample_ += run;
    }
    return wanted * size;
  }

  const std::size_t size;  // size of a sample in bytes
  const std::uint64_t count;

 private:
  // Returns the index of the first sample that is not before `time`.
  static std::uint64_t sample_at(Tick time, std::uint64_t rate) {
    const std::uint64_t whole = time / nanoseconds_a_second * rate;
    return whole + (time % nanoseconds_a_second * rate + nanoseconds_a_second - 1) / nanoseconds_a_second;
  }
  void take_change() {
    while (true) {
      const Tick next = levels_.next_change();
      changes_at_ = sample_at(next, rate_);
      if (changes_at_ > sample_ || changes_at_ >= count) break;
      levels_.advance(next);
    }
    std::memset(packed_, 0, sizeof(packed_));
    for (std::size_t i = 0; i < levels_.levels.size(); ++i) {
      if (levels_.levels[i]) packed_[i / 8] |= static_cast<std::uint8_t>(1u << i % 8);
    }
  }

  Drawing& drawing_;
  WireLevels levels_;
  std::uint64_t rate_;
  std::uint64_t sample_ = 0;
  std::uint64_t changes_at_ = 0;
  std::uint8_t packed_[8]{};
};

std::string metadata(Drawing& drawing, std::uint64_t rate, std::size_t unit_size) {
  std::string text = "[global]\nsigrok version=0.5.2\n\n[device 1]\ncapturefile=logic-1\ntotal probes=" +
                     std::to_string(drawing.wires().size()) + "\nsamplerate=" + std::to_string(rate) +
                     " Hz\ntotal analog=0\n";
  for (std::size_t i = 0; i < drawing.wires().size(); ++i) {
    text += "probe" + std::to_string(i + 1) + '=' + drawing.wires()[i].name + '\n';
  }
  return text + "unitsize=" + std::to_string(unit_size) + '\n';
}

}  // namespace

Drawing::Drawing(std::string title, ScratchFile changes, ScratchFile labels)
    : title_(std::move(title)), changes_(std::move(changes)), labels_(std::move(labels)) {
  if (changes_ == nullptr || labels_ == nullptr) fail_scratch("there is no place for temporary files");
}

void Drawing::change(Tick at, std::size_t wire) {
  put_number(changes_.get(), at - std::exchange(last_change_, at));
  put_number(changes_.get(), wire);
  check(changes_.get());
}

void Drawing::label(Tick at, std::string_view words) {
  put_number(labels_.get(), at - std::exchange(last_label_, at));
  put_number(labels_.get(), words.size());
  std::fwrite(words.data(), 1, words.size(), labels_.get());
  check(labels_.get());
}

void Drawing::rewind_changes() {
  begin_reading(changes_.get());
  last_change_ = 0;
}

bool Drawing::next_change(Tick& at, std::size_t& wire) {
  std::uint64_t later = 0;
  std::uint64_t index = 0;
  if (!get_number(changes_.get(), later) || !get_number(changes_.get(), index)) return check(changes_.get()), false;
  wire = static_cast<std::size_t>(index);
  at = last_change_ += later;
  return true;
}

void Drawing::rewind_labels() {
  begin_reading(labels_.get());
  last_label_ = 0;
}

bool Drawing::next_label(Tick& at, std::string& words) {
  std::uint64_t later = 0;
  std::uint64_t size = 0;
  if (!get_number(labels_.get(), later) || !get_number(labels_.get(), size)) return check(labels_.get()), false;
  words.resize(static_cast<std::size_t>(size));
  if (std::fread(words.data(), 1, words.size(), labels_.get()) != words.size()) return check(labels_.get()), false;
  at = last_label_ += later;
  return true;
}

void write_vcd(std::ostream& out, Drawing& drawing) {
  out << "$version absenc $end\n$timescale 1 ns $end\n";
  // All labels are written before the first change, because sigrok's reader stops at a comment among the changes.
  drawing.rewind_labels();
  Tick labelled = 0;
  for (std::string words; drawing.next_label(labelled, words);) {
    out << "$comment #" << labelled << ' ' << words << " $end\n";
  }
  out << "$scope module " << drawing.title() << " $end\n";
  for (std::size_t i = 0; i < drawing.wires().size(); ++i) {
    out << "$var wire 1 " << identifier(i) << ' ' << drawing.wires()[i].name << " $end\n";
  }
  out << "$upscope $end\n$enddefinitions $end\n#0\n";
  WireLevels levels(drawing);
  for (std::size_t i = 0; i < levels.levels.size(); ++i) out << levels.levels[i] << identifier(i) << '\n';
  for (Tick at = levels.next_change(); at < drawing.end(); at = levels.next_change()) {
    const std::vector<bool> before = levels.levels;
    levels.advance(at);
    out << '#' << at << '\n';
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (before[i] != levels.levels[i]) out << levels.levels[i] << identifier(i) << '\n';
    }
  }
  out << '#' << drawing.end() << '\n';
}

void write_saleae_csv(std::ostream& out, Drawing& drawing) {
  out << "Time [s]";
  for (const Drawing::Wire& wire : drawing.wires()) out << ',' << wire.name;
  out << '\n';
  WireLevels levels(drawing);
  for (Tick at = 0;; at = levels.next_change()) {
    levels.advance(at);
    out << seconds(at);
    for (const bool level : levels.levels) out << ',' << level;
    out << '\n';
    if (at == drawing.end()) break;
  }
}

void write_sigrok(const std::filesystem::path& path, Drawing& drawing, std::uint64_t rate) {
  ZipWriter archive(path);
  Samples samples(drawing, rate);
  archive.add("version", "2");
  archive.add("metadata", metadata(drawing, rate, samples.size));

  constexpr std::uint64_t samples_a_part = 4 << 20;
  std::vector<std::uint8_t> bytes(1 << 16);  // buffer; a sample has 1, 2, 4 ... bytes, so whole samples fill the buffer
  unsigned part = 0;
  for (std::uint64_t first = 0; first < samples.count; first += samples_a_part) {
    archive.begin("logic-1-" + std::to_string(++part));
    for (std::uint64_t left = std::min(samples_a_part, samples.count - first) * samples.size; left != 0;) {
      const std::size_t filled =
          samples.fill(bytes.data(), static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), left)));
      archive.write(std::span(bytes).first(filled));
      left -= filled;
    }
  }
  archive.finish();
}

}  // namespace absenc::capture
