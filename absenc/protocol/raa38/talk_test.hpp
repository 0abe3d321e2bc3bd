// SPDX-License-Identifier: Apache-2.0
// For tests: a conversation as the unit makes it, by the name of its command.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/protocol/unit.hpp"

namespace absenc::raa38::testing {

template <class Item>
class Talk : public Conversation<Item> {
 public:
  /// Arguments that are not given have their defaults.
  Talk(const Unit& unit, const Options& options, std::string_view name, std::vector<std::int64_t> arguments)
      : storage_(unit.host_storage), arguments_(std::move(arguments)) {
    const Command& command = *find_command(unit, name);
    for (std::size_t i = arguments_.size(); i < command.arguments.size(); ++i) {
      arguments_.push_back(command.arguments[i].default_value);
    }
    const Any<Conversation> made = unit.host(options, command, arguments_, storage_);
    if constexpr (std::is_same_v<Item, CanFrame>) {
      made_ = made.frames;
    } else {
      made_ = made.bytes;
    }
  }
  Talk(Talk&&) noexcept = default;  // the storage stays where it is

  void feed(const Event<Item>& event) override { made_->feed(event); }
  Step<Item> next(Time now) override { return made_->next(now); }
  [[nodiscard]] Error error() const override { return made_->error(); }
  [[nodiscard]] std::string_view detail() const override { return made_->detail(); }
  [[nodiscard]] std::string_view advice() const override { return made_->advice(); }
  [[nodiscard]] const Reading* reading() const override { return made_->reading(); }
  [[nodiscard]] bool streams() const override { return made_->streams(); }
  void report(FieldSink& sink) const override { made_->report(sink); }
  [[nodiscard]] Exchange<Item> exchange() const override { return made_->exchange(); }
  void report_left(FieldSink& sink) const override { made_->report_left(sink); }

 private:
  std::vector<std::byte> storage_;
  std::vector<std::int64_t> arguments_;
  Conversation<Item>* made_ = nullptr;
};

/// How long a conversation takes with a line on which something sends without a pause from its first request on.
inline Time time_with_noise(Conversation<std::uint8_t>& conversation) {
  using Kind = Step<std::uint8_t>::Kind;
  constexpr std::uint8_t noise = 0x55;
  Time now{};
  Time began = never;
  for (unsigned steps = 0; steps < 1'000'000; ++steps) {
    const Step<std::uint8_t> step = conversation.next(now);
    if (step.kind == Kind::done) return now - began;
    now += std::chrono::microseconds(100);
    if (step.kind == Kind::transfer) {
      began = std::min(began, now);
      conversation.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
    } else if (step.kind == Kind::wait && began != never) {
      conversation.feed({.kind = Event<std::uint8_t>::Kind::received, .at = now, .items = {&noise, 1}});
    }
  }
  return never;
}

}  // namespace absenc::raa38::testing
