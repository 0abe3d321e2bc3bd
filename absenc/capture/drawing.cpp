// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/drawing.hpp"

#include <zip.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <ostream>
#include <stdexcept>

namespace absenc::capture {

namespace {

/// The levels of all traces from one change to the next.
class Levels {
 public:
  explicit Levels(const Drawing& drawing) : drawing_(drawing), next_(drawing.traces.size()) {
    for (const Trace& trace : drawing.traces) levels.push_back(trace.changes.before);
  }

  /// The time of the next change, or the end of the drawing.
  [[nodiscard]] Tick next_change() const {
    Tick next = drawing_.end;
    for (std::size_t i = 0; i < next_.size(); ++i) {
      const std::vector<Tick>& at = drawing_.traces[i].changes.at;
      if (next_[i] < at.size()) next = std::min(next, at[next_[i]]);
    }
    return next;
  }
  /// Everything that changes up to and including `time`.
  void advance(Tick time) {
    for (std::size_t i = 0; i < next_.size(); ++i) {
      const std::vector<Tick>& at = drawing_.traces[i].changes.at;
      for (; next_[i] < at.size() && at[next_[i]] <= time; ++next_[i]) levels[i] = !levels[i];
    }
  }

  std::vector<bool> levels;

 private:
  const Drawing& drawing_;
  std::vector<std::size_t> next_;
};

// Printable characters from '!' on, more than one where there are many traces.
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

/// The samples of a drawing, made while the archive asks for them: a part at a time, as sigrok itself writes them.
class Samples {
 public:
  Samples(const Drawing& drawing, std::uint64_t rate)
      : size(std::bit_ceil((drawing.traces.size() + 7) / 8)),
        count(sample_at(drawing.end, rate)),
        levels_(drawing),
        rate_(rate) {}

  /// As many whole samples as fit. Returns the number of bytes.
  std::size_t fill(std::uint8_t* bytes, std::size_t room) {
    const std::size_t wanted = room / size;
    for (std::size_t i = 0; i < wanted; ++i, ++sample_) {
      if (sample_ >= changes_at_) take_change();
      std::memcpy(bytes + i * size, packed_, size);
    }
    return wanted * size;
  }

  const std::size_t size;  // bytes of one sample
  const std::uint64_t count;

 private:
  // The first sample that is not before the time.
  static std::uint64_t sample_at(Tick time, std::uint64_t rate) {
    const std::uint64_t whole = time / nanoseconds_a_second * rate;
    return whole + (time % nanoseconds_a_second * rate + nanoseconds_a_second - 1) / nanoseconds_a_second;
  }
  // What is past at this sample, and when the next change shows.
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

  Levels levels_;
  std::uint64_t rate_;
  std::uint64_t sample_ = 0;
  std::uint64_t changes_at_ = 0;
  std::uint8_t packed_[8]{};
};

/// One part of the samples as a file of the archive.
struct Part {
  Samples* samples;
  std::uint64_t size;  // bytes
  std::uint64_t given = 0;
};

// What libzip asks of whoever provides a file while it compresses.
zip_int64_t provide(void* state, void* data, zip_uint64_t size, zip_source_cmd_t command) {
  Part& part = *static_cast<Part*>(state);
  switch (command) {
    case ZIP_SOURCE_OPEN:
    case ZIP_SOURCE_CLOSE:
    case ZIP_SOURCE_FREE:
      return 0;
    case ZIP_SOURCE_READ: {
      const std::uint64_t room = std::min<std::uint64_t>(size, part.size - part.given);
      const std::size_t filled = part.samples->fill(static_cast<std::uint8_t*>(data), room);
      part.given += filled;
      return static_cast<zip_int64_t>(filled);
    }
    case ZIP_SOURCE_STAT: {
      auto* const stat = static_cast<zip_stat_t*>(data);
      zip_stat_init(stat);
      stat->size = part.size;
      stat->valid = ZIP_STAT_SIZE;
      return sizeof(*stat);
    }
    case ZIP_SOURCE_SUPPORTS:
      return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT,
                                            ZIP_SOURCE_FREE, -1);
    default:
      return -1;
  }
}

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
using Archive = std::unique_ptr<zip_t, Discard>;

[[noreturn]] void fail(const std::string& path, const char* why) {
  throw std::runtime_error(path + " cannot be written: " + why);
}

void add(zip_t* archive, const std::string& path, const char* name, zip_source_t* source) {
  if (source != nullptr && zip_file_add(archive, name, source, ZIP_FL_OVERWRITE) >= 0) return;
  if (source != nullptr) zip_source_free(source);
  fail(path, zip_strerror(archive));
}

std::string metadata(const Drawing& drawing, std::uint64_t rate, std::size_t unit_size) {
  std::string text = "[global]\nsigrok version=0.5.2\n\n[device 1]\ncapturefile=logic-1\ntotal probes=" +
                     std::to_string(drawing.traces.size()) + "\nsamplerate=" + std::to_string(rate) +
                     " Hz\ntotal analog=0\n";
  for (std::size_t i = 0; i < drawing.traces.size(); ++i) {
    text += "probe" + std::to_string(i + 1) + '=' + drawing.traces[i].name + '\n';
  }
  return text + "unitsize=" + std::to_string(unit_size) + '\n';
}

}  // namespace

void write_vcd(std::ostream& out, const Drawing& drawing) {
  out << "$version absenc $end\n$timescale 1 ns $end\n";
  // Not among the changes, where the standard allows them too: sigrok's reader stops at the first.
  for (const Label& label : drawing.labels) out << "$comment #" << label.at << ' ' << label.words << " $end\n";
  out << "$scope module " << drawing.title << " $end\n";
  for (std::size_t i = 0; i < drawing.traces.size(); ++i) {
    out << "$var wire 1 " << identifier(i) << ' ' << drawing.traces[i].name << " $end\n";
  }
  out << "$upscope $end\n$enddefinitions $end\n#0\n";
  Levels levels(drawing);
  for (std::size_t i = 0; i < levels.levels.size(); ++i) out << levels.levels[i] << identifier(i) << '\n';
  for (Tick at = levels.next_change(); at < drawing.end; at = levels.next_change()) {
    const std::vector<bool> before = levels.levels;
    levels.advance(at);
    out << '#' << at << '\n';
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (before[i] != levels.levels[i]) out << levels.levels[i] << identifier(i) << '\n';
    }
  }
  out << '#' << drawing.end << '\n';
}

void write_saleae_csv(std::ostream& out, const Drawing& drawing) {
  out << "Time [s]";
  for (const Trace& trace : drawing.traces) out << ',' << trace.name;
  out << '\n';
  Levels levels(drawing);
  for (Tick at = 0;; at = levels.next_change()) {
    levels.advance(at);
    out << seconds(at);
    for (const bool level : levels.levels) out << ',' << level;
    out << '\n';
    if (at == drawing.end) break;
  }
}

void write_sigrok(const std::string& path, const Drawing& drawing, std::uint64_t rate) {
  int code = 0;
  Archive archive(zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code));
  if (archive == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    fail(path, why.c_str());
  }
  Samples samples(drawing, rate);
  const std::string about = metadata(drawing, rate, samples.size);
  add(archive.get(), path, "version", zip_source_buffer(archive.get(), "2", 1, 0));
  add(archive.get(), path, "metadata", zip_source_buffer(archive.get(), about.data(), about.size(), 0));

  constexpr std::uint64_t samples_a_part = 4 << 20;
  std::vector<std::unique_ptr<Part>> parts;
  for (std::uint64_t first = 0; first < samples.count; first += samples_a_part) {
    const std::uint64_t size = std::min(samples_a_part, samples.count - first) * samples.size;
    parts.push_back(std::make_unique<Part>(Part{&samples, size}));
    add(archive.get(), path, ("logic-1-" + std::to_string(parts.size())).c_str(),
        zip_source_function(archive.get(), provide, parts.back().get()));
  }
  // Compresses everything, in the order of the files.
  if (zip_close(archive.get()) != 0) fail(path, zip_strerror(archive.get()));
  static_cast<void>(archive.release());
}

}  // namespace absenc::capture
