// SPDX-License-Identifier: Apache-2.0
// Levels written as the files that waveform viewers and logic analysers' programs open.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/signal.hpp"
#include "absenc/core/time.hpp"

namespace absenc::capture {

struct Trace {
  std::string name;
  Changes changes;
};

struct Label {
  Tick at;
  std::string words;
};

/// Ticks are nanoseconds.
struct Drawing {
  std::string title;  // one word
  std::vector<Trace> traces;
  std::vector<Label> labels;  // what the levels mean, in the order of time
  Tick end = 0;
};

/// What sim::Waveform, or whatever else has wires and comments like it, has seen. Behind the last item there is room
/// for decoders that wait for the line to be idle.
template <class Waveform>
[[nodiscard]] Drawing drawing_of(std::string title, const Waveform& waveform) {
  constexpr Tick margin = 10'000;
  Drawing drawing{.title = std::move(title), .traces = {}, .labels = {}, .end = 0};
  for (const auto& wire : waveform.wires()) {
    Trace& trace = drawing.traces.emplace_back(Trace{std::string(wire.name), {wire.before, {}}});
    for (const Time change : wire.changes) trace.changes.at.push_back(static_cast<Tick>(change.count()));
  }
  for (const auto& comment : waveform.comments()) {
    drawing.labels.push_back({static_cast<Tick>(comment.at.count()), comment.words});
  }
  drawing.end = static_cast<Tick>(waveform.end().count()) + margin;
  return drawing;
}

/// A value change dump (IEEE 1364, clause 18), exact to the nanosecond; the labels are comments before the changes.
void write_vcd(std::ostream& out, const Drawing& drawing);

/// As Saleae Logic 2 exports digital channels: a line for each time at which one changes, exact to the nanosecond.
void write_saleae_csv(std::ostream& out, const Drawing& drawing);

/// A sigrok session of samples at `rate` a second (at most 1 GHz). Replaces the file. Throws std::runtime_error with a
/// sentence when it cannot be written.
void write_sigrok(const std::string& path, const Drawing& drawing, std::uint64_t rate);

}  // namespace absenc::capture
