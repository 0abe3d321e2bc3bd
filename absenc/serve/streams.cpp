// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "absenc/os/signals.hpp"

namespace absenc::serve {

namespace {

Stream::Text event_text(std::string_view event, const client::Json& data) {
  return std::make_shared<const std::string>(fmt::format("event: {}\ndata: {}\n\n", event, data.line()));
}

}  // namespace

std::shared_ptr<Stream> Streams::open(const std::string& trace, const std::string& peer) {
  auto stream = std::make_shared<Stream>("text/event-stream");
  // With this text, the EventSource of a browser connects again one second after it has lost the stream.
  stream->push(std::make_shared<const std::string>("retry: 1000\n\n"));
  const std::lock_guard lock(mutex_);
  if (!make_room(peer)) return nullptr;
  open_.push_back({stream, trace, peer});
  return stream;
}

bool Streams::make_room(const std::string& peer) {
  std::map<std::string, std::size_t> counts;
  for (const Open& one : open_) ++counts[one.peer];
  if (counts[peer] >= most_of_address) return abort_slowest(peer, os::now() - stall_time);
  if (open_.size() < most) return true;
  const auto busiest =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (busiest->second > counts[peer] + 1) return abort_slowest(busiest->first, never);
  return abort_slowest(peer, os::now() - stall_time);
}

// Closes the stream of the IP address `peer` that has waited longest for its client to take data, if it has waited
// since before the time `taken_before`. Returns whether a stream was closed.
bool Streams::abort_slowest(const std::string& peer, Time taken_before) {
  auto slowest = open_.end();
  for (auto one = open_.begin(); one != open_.end(); ++one) {
    const Time at = one->stream->taken_at();
    if (one->peer == peer && at < taken_before) {
      slowest = one;
      taken_before = at;
    }
  }
  if (slowest == open_.end()) return false;
  slowest->stream->abort();
  dropped_before_ += slowest->stream->dropped();
  open_.erase(slowest);
  return true;
}

void Streams::send(std::string_view event, const client::Json& data) {
  const Stream::Text text = event_text(event, data);
  const std::lock_guard lock(mutex_);
  for (const Open& one : open_) one.stream->push(text);
}

void Streams::send_traced(const std::string& encoder, std::string_view event, const client::Json& data) {
  const Stream::Text text = event_text(event, data);
  const std::lock_guard lock(mutex_);
  for (const Open& one : open_) {
    if (one.trace == encoder) one.stream->push(text);
  }
}

void Streams::tidy() {
  const std::lock_guard lock(mutex_);
  std::erase_if(open_, [&](const Open& one) {
    const bool over = one.stream->over();
    if (over) dropped_before_ += one.stream->dropped();
    return over;
  });
}

std::set<std::string> Streams::traced() const {
  std::set<std::string> names;
  const std::lock_guard lock(mutex_);
  for (const Open& one : open_) {
    if (!one.trace.empty()) names.insert(one.trace);
  }
  return names;
}

std::size_t Streams::count() const {
  const std::lock_guard lock(mutex_);
  return open_.size();
}

std::uint64_t Streams::dropped() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t all = dropped_before_;
  for (const Open& one : open_) all += one.stream->dropped();
  return all;
}

}  // namespace absenc::serve
