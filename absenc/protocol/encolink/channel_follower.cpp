// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/encolink/channel_follower.hpp"

#include <algorithm>

#include "absenc/protocol/encolink/fields.hpp"

namespace absenc::encolink {

void ChannelFollower::follow(std::uint64_t number, Bytes request, Bytes reply) {
  cycle_.reset();
  has_answer_ = false;
  const bool is_identity = reply.size() == identity_bytes || reply.size() == padded_identity_bytes;
  if (!is_identity) {
    const Format format = assumed(format_, reply);
    const Result<Position> position = decode_position(format, reply);
    if (!position) return lose();
    if (format.has_ch2) take_byte(format, number, *position);
  }
  // A request has an effect on channels 2 and 3 only from the frame after its reply on.
  if (request.size() < request_bytes) return;
  const auto config = static_cast<Config>(request[0]);
  if (config == Config::position) {
    take_request(number, request[1]);
  } else {
    reset();
  }
}

void ChannelFollower::lose() {
  in_step_ = false;
  frames_.clear();
  partial_access_.clear();
  awaits_answer_ = false;
}

void ChannelFollower::reset() {
  lose();
  in_step_ = true;
}

void ChannelFollower::take_byte(const Format& format, std::uint64_t number, const Position& position) {
  const std::size_t size = format.cycle_bytes();
  if (frames_.size() >= size) {
    const auto newer = frames_;
    frames_.clear();
    for (std::size_t i = newer.size() - size + 1; i < newer.size(); ++i) frames_.push_back(newer[i]);
  }
  frames_.push_back(position);
  first_ = number + 1 - frames_.size();
  if (frames_.size() < size) return;
  ByteBuffer<longest_cycle> bytes;
  for (const Position& one : frames_.view()) bytes.push_back(one.channel2);
  const Result<ChannelCycle> cycle = decode_cycle(format, bytes);
  const bool same = cycle && same_place(cycle->position, frames_[0]);
  if (!same && !in_step_) return;
  cycle_bytes_ = bytes;
  cycle_ = Composed{.reply = cycle_bytes_, .first = first_};
  if (cycle && !same) cycle_->error = Error::cross_check_failed;
  in_step_ = same;
  frames_.clear();
  if (same) take_answer(cycle->channel3);
}

void ChannelFollower::take_answer(std::uint8_t byte) {
  if (!awaits_answer_) return;
  const bool writes = last_access_[access_keys.size()] == static_cast<std::uint8_t>(RegisterRequest::Operation::write);
  // Channel 3 bytes before the encoder's answer, such as idle or busy, are dropped.
  if (answer_.empty() && byte != (writes ? channel3::write_ready : channel3::read_ready)) return;
  answer_.push_back(byte);
  if (answer_.size() < 2) return;
  const Result<RegisterRequest> access = decode_access(last_access_);
  const bool brings_data = !writes && access && static_cast<AccessStatus>(answer_[1]) == AccessStatus::ok;
  has_answer_ = answer_.size() == 2u + (brings_data ? std::min<std::size_t>(access->length, access_capacity) : 0u);
  awaits_answer_ = !has_answer_;
}

void ChannelFollower::take_request(std::uint64_t number, std::uint8_t byte) {
  if (partial_access_.size() < access_keys.size() && byte != access_keys[partial_access_.size()])
    partial_access_.clear();
  if (partial_access_.empty() && byte != access_keys[0]) return;
  if (partial_access_.empty()) partial_access_from_ = number;
  partial_access_.push_back(byte);
  if (partial_access_.size() <= access_header) return;
  const auto length =
      static_cast<std::size_t>(load_big_endian(partial_access_.view().subspan(access_keys.size() + 1, 2)));
  const bool writes =
      partial_access_[access_keys.size()] == static_cast<std::uint8_t>(RegisterRequest::Operation::write);
  if (partial_access_.size() < access_header + (writes ? std::min(length, access_capacity) : 0) + 1) return;
  last_access_ = partial_access_;
  last_access_from_ = partial_access_from_;
  partial_access_.clear();
  answer_.clear();
  has_answer_ = false;
  awaits_answer_ = true;
}

bool ChannelFollower::take(Composed& one) {
  if (cycle_) {
    one = *cycle_;
    cycle_.reset();
    return true;
  }
  if (!has_answer_) return false;
  has_answer_ = false;
  one = Composed{.request = last_access_, .reply = answer_, .first = last_access_from_};
  return true;
}

}  // namespace absenc::encolink
