// SPDX-License-Identifier: Apache-2.0
// Splits the characters of a capture at the pauses of the line, and finds which channel carries the requests.
#include "absenc/capture/annotate/annotate.hpp"

#include <algorithm>
#include <memory>

namespace absenc::capture {

namespace {

// greatest number of characters that are stored while it is not known which channel carries the requests
constexpr std::size_t enough_characters = 2000;

struct Score final : AnnotationSink {
  void put(const Annotation& annotation) override {
    if (annotation.remark == Remark::cut) return;
    if (annotation.error != Error::none) {
      --points;
    } else {
      points += annotation.kind == Annotation::Kind::exchange ? 2 : 1;
    }
  }
  long points = 0;
};

}  // namespace

LineTicks line_ticks(const Unit& unit, double ticks_per_bit, std::uint64_t ticks_per_second) {
  if (ticks_per_bit <= 0) return {};
  const double rate =
      ticks_per_second != 0 ? static_cast<double>(ticks_per_second) : ticks_per_bit * unit.line.with_some_rate().rate;
  const auto ticks = [](double count) { return std::max<Tick>(1, static_cast<Tick>(count)); };
  const auto ticks_of = [rate](Time time) { return static_cast<Tick>(static_cast<double>(time.count()) * rate / 1e9); };
  return {.pause = ticks(ticks_per_bit * unit.timing.pause_bits),
          .frame_pause = ticks_of(unit.timing.frame_pause),
          .character = ticks(ticks_per_bit * unit.line.character_bits()),
          .turnaround = ticks_of(unit.timing.turnaround),
          .limit = ticks_of(unit.timing.turnaround_limit)};
}

Annotator::Annotator(const Unit& unit, const Options& options, const Settings& settings, AnnotationSink& sink)
    : judge_(unit, options),
      settings_(settings),
      exchanges_(Judge(unit, options), settings.ticks, sink),
      options_(options) {
  is_first_ = !settings_.begins_silent;
  for (std::size_t i = 0; i < settings_.channel_count; ++i) channels_[i].carries = settings_.channels[i];
  if (settings_.by_arrival) channels_[0].synchronised = channels_[0].at_frame_start = settings_.begins_silent;
}

void Annotator::put(const Character& character) {
  if (character.channel >= settings_.channel_count) return;
  if (channels_[0].carries == Carries::detect) {
    store_undecided(character);
  } else {
    take(character);
  }
}

void Annotator::finish(Tick end) {
  if (channels_[0].carries == Carries::detect) find_roles();
  Channel* first = channels_.data();
  Channel* second = channels_.data() + 1;
  if (!second->run.empty() && (first->run.empty() || second->run.end() < first->run.end())) std::swap(first, second);
  for (Channel* channel : {first, second}) {
    if (!channel->run.empty()) close(*channel, end < channel->run.end() + pause_of(*channel));
  }
  exchanges_.finish(end);
}

void Annotator::store_undecided(const Character& character) {
  undecided_.push_back(character);
  if (undecided_.size() == enough_characters) find_roles();
}

void Annotator::find_roles() {
  constexpr std::array<std::array<Carries, 2>, 2> assignments{
      {{Carries::requests, Carries::replies}, {Carries::replies, Carries::requests}}};
  std::array<long, 2> points{};
  for (std::size_t i = 0; i < assignments.size(); ++i) {
    Score score;
    Settings settings = settings_;
    settings.channels = assignments[i];
    const auto trial = std::make_unique<Annotator>(judge_.unit(), options_, settings, score);
    for (const Character& character : undecided_) trial->put(character);
    trial->finish(undecided_.empty() ? 0 : undecided_.back().end);
    points[i] = score.points;
  }
  const auto& assignment = assignments[points[1] > points[0] ? 1 : 0];
  for (std::size_t i = 0; i < assignment.size(); ++i) channels_[i].carries = assignment[i];
  for (const Character& character : undecided_) take(character);
  undecided_ = {};
}

Tick Annotator::pause_of(const Channel& channel) const {
  return channel.synchronised ? settings_.ticks.pause : std::max(settings_.ticks.pause, settings_.ticks.character);
}

bool Annotator::ends_with_request(const Channel& channel) {
  const Bytes bytes = channel.run.bytes();
  for (std::size_t size = 1; size <= bytes.size(); ++size) {
    if (judge_.request_size(bytes.last(size)) == size) return true;
  }
  return false;
}

// Returns whether the silence between the last character of `channel` and a next one at `begin` is a pause, which
// separates frames.
bool Annotator::is_over(const Channel& channel, Tick begin) {
  if (channel.run.empty()) return false;
  const Tick end = channel.run.end();
  if (begin < end + pause_of(channel)) return false;
  return begin >= end + settings_.ticks.frame_pause || ends_with_request(channel);
}

void Annotator::take(const Character& character) {
  Channel& channel = channels_[character.channel];
  if (settings_.by_arrival) {
    if (channel.run.full()) parse(channel, false, false);
    return channel.run.push(character);
  }
  const auto paused = [&](const Channel& one) { return is_over(one, character.begin); };
  if (settings_.channel_count == 2) {
    Channel& other = channels_[character.channel ^ 1u];
    const bool other_first = paused(other) && (!paused(channel) || other.run.end() <= channel.run.end());
    if (other_first) close(other, false);
    if (paused(channel)) close(channel, false);
    if (paused(other)) close(other, false);
  } else if (paused(channel)) {
    close(channel, false);
  }
  if (channel.run.empty() && !channel.synchronised) {
    channel.synchronised = channel.at_frame_start =
        settings_.begins_silent || character.begin >= settings_.begin + settings_.ticks.character;
  }
  if (channel.run.full()) parse(channel, false, false);
  channel.run.push(character);
}

void Annotator::close(Channel& channel, bool cut) {
  parse(channel, true, cut);
  channel.run.clear();
  channel.synchronised = channel.at_frame_start = true;
  channel.last_size = 0;
}

void Annotator::parse(Channel& channel, bool whole, bool cut) {
  channel_ = &channel;
  at_ = last_reply_size_ = 0;
  whole_ = whole;
  cut_ = cut;
  // No pause was seen before these characters, so the borders of their frames are unknown: all are reported as noise.
  if (whole && !channel.synchronised && !settings_.by_arrival) {
    const Run& run = channel.run;
    const Piece all{run.bytes(), run.begin(0), run.end()};
    return exchanges_.report_unpaired(Annotation::Kind::noise, all, Error::none, Remark::cut);
  }
  while (at_ < channel.run.size()) {
    const std::size_t taken = next_frame();
    if (taken == 0) break;
    at_ += taken;
    is_first_ = false;
  }
  channel.run.drop(at_);
  if (!whole) channel.synchronised = true;
}

}  // namespace absenc::capture
