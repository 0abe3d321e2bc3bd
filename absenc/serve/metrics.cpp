// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <iterator>

#include "absenc/client/reading.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/serve/view.hpp"

namespace absenc::serve {

using namespace client;

namespace {

/// Escapes `text` for a label value, as the Prometheus format requires.
std::string label(std::string_view text) {
  std::string written;
  for (const char c : text) {
    if (c == '\\' || c == '"') written += '\\';
    if (c == '\n') {
      written += "\\n";
    } else {
      written += c;
    }
  }
  return written;
}

class Page {
 public:
  /// Writes the header of a metric. The caller must write the value lines of this metric next, because the Prometheus
  /// format requires them directly behind the header.
  void metric(std::string_view name, std::string_view kind, std::string_view help) {
    fmt::format_to(std::back_inserter(text), "# HELP {} {}\n# TYPE {} {}\n", name, help, name, kind);
  }
  template <class Number>
  void line(std::string_view name, const std::string& labels, Number value) {
    fmt::format_to(std::back_inserter(text), "{}{{{}}} {}\n", name, labels, value);
  }

  std::string text;
};

struct EncoderState {
  std::string label;
  const Unit* unit;
  Snapshot snapshot;
};

// Cleared alarms are written, too, with the value 0: without a line, an alarm would look unknown.
void add_alarms(Page& page, const EncoderState& encoder_state) {
  if (encoder_state.snapshot.state != State::live) return;
  for (const Flags& flags : alarms_of(*encoder_state.unit, encoder_state.snapshot.last.reading)) {
    for (std::size_t bit = 0; bit < flags.field->flags.size(); ++bit) {
      const std::string_view name = flags.field->flags[bit].name;
      if (name.empty() || (flags.reported >> bit & 1) == 0) continue;
      page.line("absenc_alarm",
                fmt::format("{},channel=\"{}\",alarm=\"{}\"", encoder_state.label, flags.field->name, name),
                flags.bits >> bit & 1);
    }
  }
}

void add_latencies(Page& page, const EncoderState& encoder_state) {
  const LatencyFigures& latency = encoder_state.snapshot.latency;
  for (std::size_t i = 0; i < latency_limits.size(); ++i) {
    page.line("absenc_latency_seconds_bucket",
              fmt::format("{},le=\"{}\"", encoder_state.label, seconds_of(latency_limits[i])), latency.within[i]);
  }
  page.line("absenc_latency_seconds_bucket", encoder_state.label + ",le=\"+Inf\"", latency.count);
  page.line("absenc_latency_seconds_sum", encoder_state.label, seconds_of(latency.sum));
  page.line("absenc_latency_seconds_count", encoder_state.label, latency.count);
}

}  // namespace

std::string metrics(const Fleet::Watches& watches, const ServerFigures& figures) {
  std::vector<EncoderState> all;
  for (const auto& watch : watches) {
    all.push_back({fmt::format("encoder=\"{}\",protocol=\"{}\"", label(watch->name()), watch->address().unit->id),
                   watch->address().unit, watch->snapshot()});
  }
  Page page;
  const auto each = [&](std::string_view name, std::string_view kind, std::string_view help, auto value) {
    page.metric(name, kind, help);
    for (const EncoderState& encoder_state : all) page.line(name, encoder_state.label, value(encoder_state.snapshot));
  };
  each("absenc_up", "gauge", "1 while readings arrive",
       [](const Snapshot& s) { return s.state == State::live ? 1 : 0; });
  each("absenc_readings_total", "counter", "good readings", [](const Snapshot& s) { return s.readings; });
  each("absenc_losses_total", "counter", "number of port losses", [](const Snapshot& s) { return s.losses; });
  each("absenc_repeated_total", "counter", "repeated requests", [](const Snapshot& s) { return s.counters.repeated; });
  each("absenc_age_seconds", "gauge", "time since the last reading; before the first one, since the start",
       [](const Snapshot& s) { return seconds_of(s.age); });
  each("absenc_rate_hertz", "gauge", "good readings per second", [](const Snapshot& s) { return s.rate; });
  page.metric("absenc_errors_total", "counter", "failed attempts by kind, including repetitions");
  for (const EncoderState& encoder_state : all) {
    for (std::size_t i = 1; i < error_texts.size(); ++i) {
      page.line("absenc_errors_total", fmt::format("{},error=\"{}\"", encoder_state.label, error_texts[i].name),
                encoder_state.snapshot.counters.errors[i]);
    }
  }
  page.metric("absenc_latency_seconds", "histogram", "time from the end of a request to the end of its reply");
  for (const EncoderState& encoder_state : all) add_latencies(page, encoder_state);
  each("absenc_latency_longest_seconds", "gauge", "longest latency",
       [](const Snapshot& s) { return seconds_of(s.latency.longest); });
  page.metric(
      "absenc_alarm", "gauge",
      "1 while the encoder reports this alarm, 0 while it reports it clear; absent while it reports neither, or "
      "is not live");
  for (const EncoderState& encoder_state : all) add_alarms(page, encoder_state);
  page.metric("absenc_streams", "gauge", "open event streams");
  page.line("absenc_streams", "", figures.streams);
  page.metric("absenc_stream_dropped_total", "counter", "messages lost by slow clients");
  page.line("absenc_stream_dropped_total", "", figures.stream_drops);
  page.metric("absenc_history_lost_total", "counter", "rows of history that could not be written");
  page.line("absenc_history_lost_total", "", figures.history_lost);
  page.metric("absenc_wrong_tokens_total", "counter", "requests with a wrong token");
  page.line("absenc_wrong_tokens_total", "", figures.wrong_tokens);
  return page.text;
}

}  // namespace absenc::serve
