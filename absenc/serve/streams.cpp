// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/streams.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace absenc::serve {

namespace {

Stream::Text event_text(std::string_view event, const client::Json& data) {
  return std::make_shared<const std::string>(fmt::format("event: {}\ndata: {}\n\n", event, data.line()));
}

}  // namespace

std::shared_ptr<Stream> Streams::open(const std::string& trace) {
  auto stream = std::make_shared<Stream>("text/event-stream");
  // A browser that has lost it comes back after a second.
  stream->push(std::make_shared<const std::string>("retry: 1000\n\n"));
  const std::lock_guard lock(mutex_);
  if (open_.size() >= most) return nullptr;
  open_.push_back({stream, trace});
  return stream;
}

void Streams::tell(std::string_view event, const client::Json& data) {
  const Stream::Text text = event_text(event, data);
  const std::lock_guard lock(mutex_);
  for (const Open& one : open_) one.stream->push(text);
}

void Streams::tell_traced(const std::string& encoder, std::string_view event, const client::Json& data) {
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
