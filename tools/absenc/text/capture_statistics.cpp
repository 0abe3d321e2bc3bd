// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/capture_statistics.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

using namespace client;

namespace {

using capture::Annotation;
using capture::Remark;
using capture::Tick;

constexpr std::size_t bar_width = 40;

Time bound(std::size_t bucket) {
  const std::uint64_t four = std::uint64_t{4 + bucket % 4} << bucket / 4;
  return Time(static_cast<std::int64_t>(four / 4));
}

double microseconds(Time time) { return static_cast<double>(time.count()) / 1000; }

}  // namespace

std::vector<TimeHistogram::Bar> TimeHistogram::bars(std::size_t most) const {
  std::size_t first = 0;
  std::size_t end = counts_.size();
  while (first < end && counts_[first] == 0) ++first;
  while (end > first && counts_[end - 1] == 0) --end;
  const std::size_t joined = (end - first + most - 1) / most;
  std::vector<Bar> bars;
  for (std::size_t i = first; i < end; i += joined) {
    Bar bar{bound(i), bound(i + joined), 0};
    for (std::size_t k = i; k < std::min(i + joined, end); ++k) bar.count += counts_[k];
    bars.push_back(bar);
  }
  return bars;
}

CaptureStatistics::CaptureStatistics(const Unit& unit, const Options& options, const TickClock& clock)
    : unit_(unit), options_(options), clock_(clock) {}

void CaptureStatistics::put(const Annotation& annotation) {
  if (count_++ == 0) begin_ = annotation.begin;
  end_ = std::max(end_, annotation.end);
  if (annotation.composed) {
    ++composed_;
  } else {
    ++kinds_[static_cast<std::size_t>(annotation.kind)];
  }
  if (annotation.turnaround && clock_.has_time()) {
    const Time turnaround = clock_.time(*annotation.turnaround);
    turnarounds_.add(turnaround);
    histogram_.add(turnaround);
    shortest_ = std::min(shortest_, turnaround);
  }
  if (annotation.remark != Remark::none) {
    cut_ += annotation.remark == Remark::cut ? 1 : 0;
    echoes_ += annotation.remark == Remark::echo ? 1 : 0;
    repeated_ += annotation.remark == Remark::repeated ? 1 : 0;
  }
  if (annotation.error != Error::none) return put_error(annotation);
  error_run_.count = 0;
  // Leaves out frames that are composed of several exchanges, because their position was already added to the trace
  // with one of the exchanges.
  if (annotation.contents.reading != nullptr && !annotation.composed)
    trace_.add(annotation.begin, *annotation.contents.reading);
}

void CaptureStatistics::put_error(const Annotation& annotation) {
  ++errors_;
  if (error_run_.count++ == 0) error_run_.begin = annotation.begin;
  error_run_.end = annotation.end;
  if (error_run_.count > longest_error_run_.count) longest_error_run_ = error_run_;
  const auto kind = static_cast<std::size_t>(annotation.error);
  if (by_error_[kind]++ == 0) keep(annotation, first_of_kind_[kind]);
  if (first_count_ < most_kept) keep(annotation, first_[first_count_++]);
}

void CaptureStatistics::keep(const Annotation& annotation, StoredError& kept) const {
  const auto cut = [](Bytes bytes, std::size_t size) { return bytes.first(std::min(bytes.size(), size)); };
  kept.annotation = annotation;
  kept.annotation.contents = {};
  kept.request.clear();
  kept.reply.clear();
  kept.request.append(cut(annotation.request.bytes, kept.request.capacity()));
  kept.reply.append(cut(annotation.reply.bytes, kept.reply.capacity()));
  if (annotation.request.can != nullptr) kept.request_can = *annotation.request.can;
  if (annotation.reply.can != nullptr) kept.reply_can = *annotation.reply.can;
}

Annotation CaptureStatistics::restored(const StoredError& kept) const {
  Annotation annotation = kept.annotation;
  annotation.request.bytes = kept.request;
  annotation.reply.bytes = kept.reply;
  annotation.reply.bits = std::min(annotation.reply.bits, 8 * kept.reply.size());
  if (annotation.request.can != nullptr) annotation.request.can = &kept.request_can;
  if (annotation.reply.can != nullptr) annotation.reply.can = &kept.reply_can;
  return annotation;
}

Time CaptureStatistics::span() const { return clock_.time(end_ - std::min(begin_, end_)); }

double CaptureStatistics::per_second() const {
  return span().count() > 0 ? static_cast<double>(count_ - composed_) * 1e9 / static_cast<double>(span().count()) : 0;
}

// ---- Statistics as text, for people

std::string CaptureStatistics::text(const CaptureOutcome& outcome) const {
  std::string text = counts_text(outcome) + turnaround_text();
  if (const std::string plot = trace_.plot(); !plot.empty()) {
    text += fmt::format("\nposition, {} valid", trace_.count());
    if (clock_.has_time()) {
      text += fmt::format(", from {} s to {} s", clock_.text(trace_.first()), clock_.text(trace_.last()));
    }
    text += fmt::format("\n{}", plot);
  }
  return text + errors_text();
}

std::string CaptureStatistics::counts_text(const CaptureOutcome& outcome) const {
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](std::string_view name, std::uint64_t count, std::string more = {}) {
    rows.push_back({std::string(name), fmt::format("{}", count), std::move(more)});
  };
  row("exchanges", kinds_[0]);
  if (kinds_[1] != 0) row("requests", kinds_[1], "without a reply");
  if (kinds_[2] != 0) row("replies", kinds_[2], "without a request");
  if (kinds_[3] != 0) row("noise", kinds_[3], "neither request nor reply");
  if (composed_ != 0) row("in parts", composed_, "frames of which each exchange carried a byte");
  if (cut_ != 0) row("of them cut", cut_, "by the beginning or the end of the capture");
  if (echoes_ != 0) row("echoes", echoes_, "the request came back before its reply");
  if (repeated_ != 0) row("repeated", repeated_, "replies that came once more");
  row("errors", errors_,
      count_ == 0 ? "" : fmt::format("{:.3g} %", 100.0 * static_cast<double>(errors_) / static_cast<double>(count_)));
  for (std::size_t i = 1; i < by_error_.size(); ++i) {
    if (by_error_[i] == 0) continue;
    row(fmt::format("  {}", error_texts[i].name), by_error_[i], std::string(error_texts[i].description));
  }
  std::string text = table(rows);
  if (clock_.has_time()) text += fmt::format("in {}, {:.1f} a second\n", tool::to_text(span()), per_second());
  for (std::size_t i = 0; i < outcome.baud.size(); ++i) {
    if (outcome.baud[i] > 0) text += fmt::format("baud rate measured: {:.0f}\n", outcome.baud[i]);
  }
  for (const std::string& line : outcome.carries) text += line + '\n';
  return text;
}

std::string CaptureStatistics::turnaround_text() const {
  if (turnarounds_.count() == 0) return {};
  const Time document = unit_.timing.turnaround;
  std::string text = fmt::format("\nturn-around: least {}, median {}, 99 % {}, longest {}{}\n",
                                 tool::to_text(shortest_), tool::to_text(turnarounds_.percentile(0.5)),
                                 tool::to_text(turnarounds_.percentile(0.99)), tool::to_text(turnarounds_.longest()),
                                 document.count() == 0 ? "; the document does not tell"
                                                       : fmt::format("; the document: {}", tool::to_text(document)));
  const auto bars = histogram_.bars(16);
  std::uint64_t highest = 1;
  for (const auto& bar : bars) highest = std::max(highest, bar.count);
  for (const auto& bar : bars) {
    const auto width = static_cast<std::size_t>(static_cast<double>(bar.count) / static_cast<double>(highest) *
                                                static_cast<double>(bar_width));
    const bool here = document >= bar.least && document < bar.most;
    text += fmt::format("  {:>8} to {:<8}{} {:<{}} {}\n", tool::to_text(bar.least), tool::to_text(bar.most),
                        here ? " <" : "  ", std::string(bar.count != 0 ? std::max<std::size_t>(width, 1) : 0, '#'),
                        bar_width, bar.count);
  }
  return text;
}

std::string CaptureStatistics::error_line(const StoredError& kept) const {
  const Annotation annotation = restored(kept);
  std::string line = fmt::format("  {:>14}  {}", clock_.text(annotation.begin), text_of(annotation.error).name);
  if (!annotation.request.empty()) line += "  " + to_wire_text(unit_.link, annotation.request) + " >";
  if (!annotation.reply.empty()) line += "  " + to_wire_text(unit_.link, annotation.reply);
  return line + fmt::format("\n  {:>14}  {}\n", "", message_of(unit_, options_, annotation));
}

std::string CaptureStatistics::errors_text() const {
  if (errors_ == 0) return {};
  std::string text = fmt::format("\nfirst error{}:\n", first_count_ == 1 ? "" : "s");
  for (std::size_t i = 0; i < first_count_; ++i) text += error_line(first_[i]);
  const Tick last = first_[first_count_ - 1].annotation.begin;
  for (std::size_t i = 1; i < by_error_.size(); ++i) {
    if (by_error_[i] == 0 || first_of_kind_[i].annotation.begin <= last) continue;
    text += fmt::format("first {}:\n{}", error_texts[i].name, error_line(first_of_kind_[i]));
  }
  if (longest_error_run_.count > 1) {
    text += fmt::format("worst: {} in a row, from {} to {}\n", longest_error_run_.count,
                        clock_.text(longest_error_run_.begin), clock_.text(longest_error_run_.end));
  }
  return text;
}

// ---- Statistics as JSON, for programs

Json CaptureStatistics::json(const CaptureOutcome& outcome) const {
  Json errors = Json::object();
  for (std::size_t i = 1; i < by_error_.size(); ++i) {
    if (by_error_[i] != 0) errors.set(error_texts[i].name, by_error_[i]);
  }
  Json json = Json::object();
  json.set("protocol", unit_.id).set("exchanges", kinds_[0]).set("requests", kinds_[1]).set("replies", kinds_[2]);
  json.set("noise", kinds_[3])
      .set("in_parts", composed_)
      .set("cut", cut_)
      .set("echoes", echoes_)
      .set("repeated", repeated_);
  json.set("good", good()).set("bad", errors_).set("errors", errors).set("positions", trace_.count());
  if (clock_.has_time()) {
    json.set("begin_s", clock_.seconds(begin_)).set("end_s", clock_.seconds(end_)).set("per_second", per_second());
  }
  if (turnarounds_.count() != 0) {
    json.set("turnaround_us",
             Json::object()
                 .set("least", microseconds(shortest_))
                 .set("median", microseconds(turnarounds_.percentile(0.5)))
                 .set("p99", microseconds(turnarounds_.percentile(0.99)))
                 .set("longest", microseconds(turnarounds_.longest()))
                 .set("document",
                      unit_.timing.turnaround.count() == 0 ? Json() : Json(microseconds(unit_.timing.turnaround))));
  }
  if (!outcome.baud.empty()) json.set("baud", Json::list(outcome.baud));
  const Json first_errors = Json::list(std::span(first_).first(first_count_), [&](const StoredError& kept) {
    const Annotation annotation = restored(kept);
    Json one = Json::object();
    if (clock_.has_time()) {
      one.set("time_s", clock_.seconds(annotation.begin));
    } else {
      one.set("tick", annotation.begin);
    }
    one.set("error", text_of(annotation.error).name).set("kind", name_of(annotation.kind));
    if (!annotation.request.empty()) one.set("request", to_compact_wire_text(unit_.link, annotation.request));
    if (!annotation.reply.empty()) one.set("reply", to_compact_wire_text(unit_.link, annotation.reply));
    return one.set("message", message_of(unit_, options_, annotation));
  });
  json.set("first_errors", first_errors);
  if (longest_error_run_.count > 1) json.set("most_errors_in_a_row", longest_error_run_.count);
  return json;
}

}  // namespace absenc::tool
