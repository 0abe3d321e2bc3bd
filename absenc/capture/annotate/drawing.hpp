// SPDX-License-Identifier: Apache-2.0
// Writes level changes to files that waveform viewers and logic analyser programs open.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/capture/signal.hpp"
#include "absenc/core/time.hpp"

namespace absenc::capture {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
/// A file handle that closes its file.
using ScratchFile = std::unique_ptr<std::FILE, CloseFile>;

/// Creates a temporary file, which disappears when it is closed; returns null on failure.
[[nodiscard]] inline ScratchFile temporary_file() { return ScratchFile(std::tmpfile()); }

/// Level changes of wires, and labels, stored in temporary files. Ticks are nanoseconds.
class Drawing {
 public:
  struct Wire {
    std::string name;
    bool before;  // level of the wire before its first change
  };

  /// Makes an empty drawing. `title` must be one word without blanks. Throws std::runtime_error if a file is null.
  explicit Drawing(std::string title, ScratchFile changes = temporary_file(), ScratchFile labels = temporary_file());

  void add_wire(std::string name, bool before) { wires_.push_back({std::move(name), before}); }
  /// Inverts the level of the wire with index `wire` at `at`; the wire may be added later. Times must not decrease.
  /// Throws std::runtime_error, perhaps only in `rewind_changes`.
  void change(Tick at, std::size_t wire);
  /// Adds the label `words` at `at`. Times must not decrease. Throws std::runtime_error, perhaps only in
  /// `rewind_labels`.
  void label(Tick at, std::string_view words);
  void set_end(Tick end) { end_ = end; }
  /// Sets a function that is called repeatedly while the drawing is written; its exceptions end the writing.
  void watch(std::function<void()> report_progress) { on_progress_ = std::move(report_progress); }

  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] const std::vector<Wire>& wires() const { return wires_; }
  [[nodiscard]] Tick end() const { return end_; }
  void report_progress() const {
    if (on_progress_) on_progress_();
  }

  /// Makes `next_change` begin with the first level change. Throws std::runtime_error.
  void rewind_changes();
  /// Reads the next level change; returns false if there is none. Throws std::runtime_error.
  [[nodiscard]] bool next_change(Tick& at, std::size_t& wire);
  void rewind_labels();
  [[nodiscard]] bool next_label(Tick& at, std::string& words);

 private:
  std::string title_;
  std::vector<Wire> wires_;
  ScratchFile changes_;
  ScratchFile labels_;
  Tick last_change_ = 0;
  Tick last_label_ = 0;
  Tick end_ = 0;
  std::function<void()> on_progress_;
};

/// Stores the changes and comments of a waveform in a drawing, with `lead` added to all times.
template <class Waveform>
class WaveformSink final : public Waveform::Sink {
 public:
  explicit WaveformSink(Drawing& drawing, Time lead = {}) : drawing_(&drawing), lead_(lead) {}

  void change(Time at, std::size_t wire) override { drawing_->change(tick(at), wire); }
  void comment(Time at, std::string_view words) override { drawing_->label(tick(at), words); }

  /// Adds the wires to the drawing and sets its end: `margin` after the end of the waveform, but at least `least`.
  void finish(Waveform& waveform, Time margin, Time least = {}) {
    waveform.finish();
    for (const auto& wire : waveform.wires()) drawing_->add_wire(std::string(wire.name), wire.idle);
    drawing_->set_end(tick(std::max(waveform.end() + margin, least)));
  }

 private:
  [[nodiscard]] Tick tick(Time at) const { return static_cast<Tick>((at + lead_).count()); }

  Drawing* drawing_;
  Time lead_;
};

/// Writes `drawing` as a value change dump (IEEE 1364, clause 18); labels become comments.
void write_vcd(std::ostream& out, Drawing& drawing);

/// Writes `drawing` as CSV in the form of Saleae Logic 2's export.
void write_saleae_csv(std::ostream& out, Drawing& drawing);

/// Writes `drawing` as a sigrok session with `rate` samples per second, at most 1 GHz. Replaces the file at `path`.
/// Throws std::runtime_error, and exceptions of the function set by `Drawing::watch`.
void write_sigrok(const std::filesystem::path& path, Drawing& drawing, std::uint64_t rate);

}  // namespace absenc::capture
