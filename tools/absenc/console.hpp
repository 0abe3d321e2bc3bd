// SPDX-License-Identifier: Apache-2.0
// What is written on standard input while virtual encoders run: their conditions, power and alarms.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/emulation/virtual_device.hpp"
#include "absenc/link/step.hpp"
#include "absenc/os/input_lines.hpp"

namespace absenc::tool {

using namespace client;

class Console {
 public:
  /// All must outlive it. The encoders are of one unit, and are told apart by their number, from 1 on.
  Console(const Unit& unit, std::vector<VirtualDevice*> devices) : unit_(unit), devices_(std::move(devices)) {}

  /// Carries out the lines that are there, and answers each by one line on standard output.
  void look(Time now);
  /// Nothing comes any more.
  [[nodiscard]] bool ended() const { return lines_.ended() || unheard_; }

  /// What is so afterwards. Throws UsageError, which says what is possible.
  [[nodiscard]] std::string carry_out(std::string_view line, Time now);

 private:
  [[nodiscard]] std::string carry_out_one(VirtualDevice& device, std::string_view line, Time now) const;
  [[nodiscard]] std::string condition(VirtualDevice& device, std::string_view line, Time now) const;
  [[nodiscard]] std::string alarms(VirtualDevice& device, std::string_view names, bool raise) const;
  [[nodiscard]] std::string help() const;

  const Unit& unit_;
  std::vector<VirtualDevice*> devices_;
  os::InputLines lines_;
  bool unheard_ = false;  // nobody reads the answers
};

/// Stands in front of the encoders and looks at the console between their steps: nothing else runs meanwhile.
template <class Item>
class Consoled final : public Machine<Item> {
 public:
  Consoled(Machine<Item>& line, Console& console) : line_(line), console_(console) {}

  void feed(const Event<Item>& event) override {
    if (event.kind == Event<Item>::Kind::timer) {
      if (event.at < timer_) return;  // only to look
      timer_ = never;
    }
    line_.feed(event);
  }

  Step<Item> next(Time now) override {
    using namespace std::chrono_literals;
    constexpr Time between_looks = 20ms;
    if (now >= look_at_ && !console_.ended()) {
      console_.look(now);
      look_at_ = now + between_looks;
    }
    Step<Item> step = line_.next(now);
    if (step.kind != Step<Item>::Kind::wait) return step;
    // As ports have it: a timer that was due in the moment of another event stays due.
    timer_ = step.at > now || step.at == timer_ ? step.at : never;
    if (!console_.ended() && look_at_ < timer_) step.at = look_at_;
    return step;
  }

 private:
  Machine<Item>& line_;
  Console& console_;
  Time timer_ = never;  // of the line's last wait
  Time look_at_{};
};

}  // namespace absenc::tool
