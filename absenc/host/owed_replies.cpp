// SPDX-License-Identifier: Apache-2.0
#include "absenc/host/owed_replies.hpp"

#include <algorithm>

namespace absenc::host {

namespace {

Frame to_frame(Bytes bytes) { return {.bytes = bytes}; }
Frame to_frame(std::span<const CanFrame> frames) { return {.can = frames.data()}; }

}  // namespace

template <class Item>
bool OwedReplies<Item>::is_answered(Items request) const {
  return unit_->is_answered == nullptr || unit_->is_answered(*options_, to_frame(request));
}

template <class Item>
Time OwedReplies<Item>::pause_after(Items request) const {
  return unit_->pause == nullptr ? Time{} : unit_->pause(*options_, to_frame(request));
}

template <class Item>
bool OwedReplies<Item>::is_reply(Items request, Items reply) const {
  return unit_->check(*options_, to_frame(request), to_frame(reply)) == Error::none;
}

template <class Item>
bool OwedReplies<Item>::concerns(Items request, Items reply) const {
  return !is_can || unit_->check(*options_, to_frame(request), to_frame(reply)) != Error::unexpected_reply;
}

template <class Item>
auto OwedReplies<Item>::find(Items request) -> Owed* {
  for (std::size_t i = 0; i < owed_.size(); ++i) {
    const Items one = owed_[i].request;
    if (std::equal(one.begin(), one.end(), request.begin(), request.end())) return &owed_[i];
  }
  return nullptr;
}

template <class Item>
auto OwedReplies<Item>::owed_to(Items reply) -> Owed* {
  for (std::size_t i = 0; i < owed_.size(); ++i) {
    if (is_reply(owed_[i].request, reply)) return &owed_[i];
  }
  return nullptr;
}

template <class Item>
void OwedReplies<Item>::add(Items request, std::size_t expect, Time sent_at) {
  widest_ = owed_.empty() ? Time{} : std::max(widest_, sent_at - newest_);
  newest_ = sent_at;
  Owed* owed = find(request);
  if (owed == nullptr) {
    Owed fresh;
    fresh.request.append(request);
    fresh.expect = expect;
    if (!owed_.push_back(fresh)) return;
    owed = &owed_[owed_.size() - 1];
  }
  if (owed->sent_at.push_back(sent_at)) return;
  owed->lost_first = owed->oldest();
  owed->lost_last = owed->sent_at[0];
  ++owed->lost;
  drop_first(owed->sent_at);
  owed->sent_at.push_back(sent_at);
}

template <class Item>
void OwedReplies<Item>::sent_again(Items request, Time longest) {
  Owed* const owed = find(request);
  if (owed == nullptr) return;
  owed->lost_last = owed->newest();
  owed->lost_first = std::max(owed->oldest(), owed->lost_last - longest);
  owed->lost += static_cast<unsigned>(owed->sent_at.size());
  owed->sent_at.clear();
}

// It may be one that was taken for lost: then the one of the next is still to come.
template <class Item>
void OwedReplies<Item>::came(Owed& owed) {
  if (owed.lost != 0) {
    --owed.lost;
  } else {
    drop_first(owed.sent_at);
  }
  if (owed.count() == 0) remove(owed);
}

template <class Item>
void OwedReplies<Item>::forget(Time before) {
  for (std::size_t i = owed_.size(); i-- > 0;) {
    if (owed_[i].newest() < before) remove(owed_[i]);
  }
}

template <class Item>
void OwedReplies<Item>::remove(const Owed& owed) {
  Buffer<Owed, most> left;
  for (std::size_t i = 0; i < owed_.size(); ++i) {
    if (&owed_[i] != &owed) left.push_back(owed_[i]);
  }
  owed_ = left;
}

template class OwedReplies<std::uint8_t>;
template class OwedReplies<CanFrame>;

}  // namespace absenc::host
