// SPDX-License-Identifier: Apache-2.0
// Plays the encoder's side of one conversation.
#pragma once

#include <algorithm>
#include <functional>
#include <type_traits>
#include <vector>

#include "tests/kit/frames.hpp"

namespace absenc::kit {

struct Still final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {}; }
};

template <class Item>
class Player {
 public:
  using Pieces = std::vector<std::vector<Item>>;
  /// A function that returns the reply to the request under test, in pieces. `clocks`: number of bits that the host
  /// clocks for the reply; 0 if unknown.
  using Reply = std::function<Pieces(std::size_t clocks)>;

  /// Creates a player without a virtual encoder: only the request under test gets a reply.
  Player() = default;
  Player(const Unit& unit, const Options& options) : device_storage_(unit.device_storage) {
    device_ = unit.device(options, still_, device_storage_).template of<Item>();
    if (device_ != nullptr) device_->power_on(now_, Device<Item>::PowerOn::skip);
  }

  /// Runs the conversation. Returns whether it ended within `most_steps` steps.
  template <class OnEmit>
  bool run(Conversation<Item>& conversation, const std::vector<Item>& request, const Reply& reply, OnEmit&& on_emit,
           unsigned most_steps = 2000) {
    using Kind = typename Event<Item>::Kind;
    using Wanted = typename Step<Item>::Kind;
    bool unsolicited = request.empty();
    for (unsigned steps = 0; steps < most_steps; ++steps) {
      const Step<Item> step = conversation.next(now_);
      if (step.kind == Wanted::done) return true;
      if (step.kind == Wanted::emit && conversation.streams()) on_emit();
      if (step.kind == Wanted::emit || step.kind == Wanted::configure) continue;
      now_ += std::chrono::milliseconds(1);
      if (step.kind == Wanted::wait) {
        if (std::exchange(unsolicited, false)) {
          play(conversation, reply(step.expect));
        } else {
          conversation.feed({.kind = Kind::silence, .at = now_});
        }
        continue;
      }
      const std::vector<Item> sent(step.out.begin(), step.out.end());
      const std::size_t clocks = step.bits != 0 ? step.bits - step.out_bits : step.expect;
      now_ = std::max(now_, step.at);
      conversation.feed({.kind = Kind::sent, .at = now_});
      ++request_count_;
      const bool tested = sent == request;
      if (tested) ++tested_requests_;
      unsolicited = false;
      if (step.out_bits != 0) ask_bits(step);
      play(conversation, tested ? reply(clocks) : Pieces{step.bits == 0 ? ask_device(sent) : answered_bits(clocks)});
    }
    return false;
  }
  /// Returns the number of times that the host has sent the request under test.
  [[nodiscard]] unsigned tested_requests() const { return tested_requests_; }
  /// Returns the number of requests of any kind that the host has sent.
  [[nodiscard]] unsigned request_count() const { return request_count_; }

 private:
  void play(Conversation<Item>& conversation, const Pieces& pieces) {
    for (const std::vector<Item>& piece : pieces) {
      if (piece.empty()) continue;
      now_ += std::chrono::microseconds(1);
      if (conversation.next(now_).kind != Step<Item>::Kind::wait) return;
      conversation.feed({.kind = Event<Item>::Kind::received, .at = now_, .items = piece, .bits = 8 * piece.size()});
    }
  }

  std::vector<Item> ask_device(const std::vector<Item>& request) {
    if (device_ == nullptr || request.empty()) return {};
    device_->feed({.kind = Event<Item>::Kind::received, .at = now_, .items = request});
    const Step<Item> step = device_->next(now_);
    if (step.kind != Step<Item>::Kind::transfer) return {};
    std::vector<Item> reply(step.out.begin(), step.out.end());
    device_->feed({.kind = Event<Item>::Kind::sent, .at = now_});
    return reply;
  }

  // Gives the host's bits of an exchange on a bidirectional clocked link to the virtual encoder.
  void ask_bits(const Step<Item>& step) {
    answer_.clear();
    if (device_ == nullptr) return;
    device_->feed({.kind = Event<Item>::Kind::selected, .at = now_});
    device_->feed({.kind = Event<Item>::Kind::received, .at = now_, .items = step.out, .bits = step.out_bits});
    const Step<Item> answer = device_->next(now_);
    if (answer.kind == Step<Item>::Kind::transfer) answer_.assign(answer.out.begin(), answer.out.end());
    device_->feed({.kind = Event<Item>::Kind::sent, .at = now_, .bits = step.bits});
    now_ += std::chrono::milliseconds(1);
  }
  // Returns the bits of the virtual encoder that the host clocks; nobody drives the line behind them.
  std::vector<Item> answered_bits(std::size_t clocks) {
    std::vector<Item> bits((clocks + 7) / 8);
    for (std::size_t i = 0; i < bits.size(); ++i) {
      if constexpr (std::is_same_v<Item, std::uint8_t>) bits[i] = i < answer_.size() ? answer_[i] : Item{0xFF};
    }
    return bits;
  }

  Time now_{};
  std::vector<Item> answer_;  // bits of the virtual encoder's last answer on a bidirectional clocked link
  Still still_;
  std::vector<std::byte> device_storage_;
  Device<Item>* device_ = nullptr;
  unsigned tested_requests_ = 0;
  unsigned request_count_ = 0;
};

}  // namespace absenc::kit
