// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/outstanding_requests.hpp"

#include <algorithm>

namespace absenc::host {

namespace {

Frame to_frame(Bytes bytes) { return {.bytes = bytes}; }
Frame to_frame(std::span<const CanFrame> frames) { return {.can = frames.data()}; }

}  // namespace

template <class Item>
bool OutstandingRequests<Item>::is_answered(Items request) const {
  return unit_->is_answered == nullptr || unit_->is_answered(*options_, to_frame(request));
}

template <class Item>
Time OutstandingRequests<Item>::pause_after(Items request) const {
  return unit_->pause == nullptr ? Time{} : unit_->pause(*options_, to_frame(request));
}

template <class Item>
Time OutstandingRequests<Item>::character() const {
  return is_can ? Time{} : line_settings(*unit_, *options_).with_some_rate().character();
}

template <class Item>
bool OutstandingRequests<Item>::is_reply(Items request, Items reply) const {
  return unit_->check(*options_, to_frame(request), to_frame(reply)) == Error::none;
}

template <class Item>
bool OutstandingRequests<Item>::may_answer(Items request, Items reply) const {
  return !is_can || unit_->check(*options_, to_frame(request), to_frame(reply)) != Error::unexpected_reply;
}

template <class Item>
auto OutstandingRequests<Item>::find(Items request) -> Entry* {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Items stored = entries_[i].request;
    if (std::equal(stored.begin(), stored.end(), request.begin(), request.end())) return &entries_[i];
  }
  return nullptr;
}

template <class Item>
auto OutstandingRequests<Item>::find_by_reply(Items reply) -> Entry* {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (is_reply(entries_[i].request, reply)) return &entries_[i];
  }
  return nullptr;
}

template <class Item>
void OutstandingRequests<Item>::add(Items request, std::size_t expect, Time sent_at) {
  longest_interval_ = entries_.empty() ? Time{} : std::max(longest_interval_, sent_at - newest_);
  newest_ = sent_at;
  Entry* entry = find(request);
  if (entry == nullptr) {
    Entry fresh;
    fresh.request.append(request);
    fresh.expect = expect;
    if (!entries_.push_back(fresh)) return;
    entry = &entries_[entries_.size() - 1];
  }
  if (entry->sent_at.push_back(sent_at)) return;
  entry->lost_first = entry->oldest();
  entry->lost_last = entry->sent_at[0];
  ++entry->lost;
  drop_first(entry->sent_at);
  entry->sent_at.push_back(sent_at);
}

template <class Item>
void OutstandingRequests<Item>::mark_lost(Items request, Time longest) {
  Entry* const entry = find(request);
  if (entry == nullptr) return;
  entry->lost_last = entry->newest();
  entry->lost_first = std::max(entry->oldest(), entry->lost_last - longest);
  entry->lost += static_cast<unsigned>(entry->sent_at.size());
  entry->sent_at.clear();
}

// Removes the oldest request of `entry`. If requests of the entry were lost, one of those is removed, because a late
// reply may belong to it.
template <class Item>
void OutstandingRequests<Item>::remove_oldest(Entry& entry) {
  if (entry.lost != 0) {
    --entry.lost;
  } else {
    drop_first(entry.sent_at);
  }
  if (entry.count() == 0) remove(entry);
}

template <class Item>
void OutstandingRequests<Item>::remove_older(Time before) {
  for (std::size_t i = entries_.size(); i-- > 0;) {
    if (entries_[i].newest() < before) remove(entries_[i]);
  }
}

template <class Item>
void OutstandingRequests<Item>::remove(const Entry& entry) {
  Buffer<Entry, most> left;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (&entries_[i] != &entry) left.push_back(entries_[i]);
  }
  entries_ = left;
}

template class OutstandingRequests<std::uint8_t>;
template class OutstandingRequests<CanFrame>;

}  // namespace absenc::host
