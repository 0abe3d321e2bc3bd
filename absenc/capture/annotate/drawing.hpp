// SPDX-License-Identifier: Apache-2.0
// Levels written as the files that waveform viewers and logic analysers' programs open.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
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
/// Open for writing and reading, and empty.
using ScratchFile = std::unique_ptr<std::FILE, CloseFile>;

/// Where the system has such files; it is gone with the process. Null when there can be none.
[[nodiscard]] inline ScratchFile temporary_file() { return ScratchFile(std::tmpfile()); }

/// Levels of wires and what they mean, of any length: on the disk, a few bytes a change, until it is known which wires
/// there are and when it ends. The memory it takes does not depend on its length. Ticks are nanoseconds.
class Drawing {
 public:
  struct Wire {
    std::string name;
    bool before;  // the level before the first change
  };

  /// `title` is one word. Throws std::runtime_error when a file is null.
  explicit Drawing(std::string title, ScratchFile changes = temporary_file(), ScratchFile labels = temporary_file());

  void add_wire(std::string name, bool before) { wires_.push_back({std::move(name), before}); }
  /// Inverts the level of a wire, which may be added later. In the order of time. Throws std::runtime_error when the
  /// disk is full.
  void change(Tick at, std::size_t wire);
  /// What the levels mean. In the order of time. Throws as `change` does.
  void label(Tick at, std::string_view words);
  void set_end(Tick end) { end_ = end; }
  /// Called now and then while it is written; what it throws ends that.
  void watch(std::function<void()> look) { look_ = std::move(look); }

  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] const std::vector<Wire>& wires() const { return wires_; }
  [[nodiscard]] Tick end() const { return end_; }
  void look() const {
    if (look_) look_();
  }

  /// From the first on; one at a time.
  void rewind_changes();
  /// False: there are no more.
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
  std::function<void()> look_;
};

/// Takes what sim::Waveform, or whatever else has wires, changes and comments like it, hands over, `lead` later: a line
/// that is idle before its first item.
template <class Waveform>
class WaveformSink final : public Waveform::Sink {
 public:
  explicit WaveformSink(Drawing& drawing, Time lead = {}) : drawing_(&drawing), lead_(lead) {}

  void change(Time at, std::size_t wire) override { drawing_->change(tick(at), wire); }
  void comment(Time at, std::string_view words) override { drawing_->label(tick(at), words); }

  /// Behind the last item there is `margin`, for decoders that wait for the line to be idle; the end is not before
  /// `least`, until when a host waited in vain.
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

/// A value change dump (IEEE 1364, clause 18), exact to the nanosecond; the labels are comments before the changes.
void write_vcd(std::ostream& out, Drawing& drawing);

/// As Saleae Logic 2 exports digital channels: a line for each time at which one changes, exact to the nanosecond.
void write_saleae_csv(std::ostream& out, Drawing& drawing);

/// A sigrok session of samples at `rate` a second (at most 1 GHz). Replaces the file. Throws std::runtime_error with a
/// sentence when it cannot be written.
void write_sigrok(const std::string& path, Drawing& drawing, std::uint64_t rate);

}  // namespace absenc::capture
