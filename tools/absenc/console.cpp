// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/console.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

constexpr std::string_view spaces = " \t\r";

// Removes the first word from `line` and returns it; "" if `line` has no word.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(spaces), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(spaces));
  line.remove_prefix(word.size());
  return word;
}

bool is_blank(std::string_view text) { return text.find_first_not_of(spaces) == std::string_view::npos; }

}  // namespace

void Console::look(Time now) {
  for (const std::string& line : lines_.take()) {
    if (is_blank(line)) continue;
    try {
      std::string answer;
      try {
        answer = fmt::format("ok: {}", carry_out(line, now));
      } catch (const UsageError& error) {
        answer = fmt::format("error: {}", error.what());
      }
      print_line(answer);
    } catch (const OutputClosed&) {
      unheard_ = true;
    }
  }
}

std::string Console::carry_out(std::string_view line, Time now) {
  const std::size_t colon = std::min(line.find(':'), line.size());
  if (colon == line.size()) {
    std::vector<std::string> answers;
    for (VirtualDevice* device : devices_) answers.push_back(carry_out_one(*device, line, now));
    if (answers.size() == 1) return answers[0];
    const bool same = std::count(answers.begin(), answers.end(), answers[0]) == std::ssize(answers);
    if (same) return fmt::format("all {}: {}", answers.size(), answers[0]);
    for (std::size_t i = 0; i < answers.size(); ++i) answers[i] = fmt::format("{}: {}", i + 1, answers[i]);
    return fmt::format("{}", fmt::join(answers, "; "));
  }
  std::string_view before = line.substr(0, colon);
  const Result<std::int64_t> number = parse_number(take_word(before));
  if (!number || !is_blank(before) || *number < 1 || static_cast<std::size_t>(*number) > devices_.size()) {
    throw UsageError(
        fmt::format("\"{}\" is no encoder of this line: they are 1 to {}", line.substr(0, colon), devices_.size()));
  }
  VirtualDevice& device = *devices_[static_cast<std::size_t>(*number) - 1];
  return fmt::format("{}: {}", *number, carry_out_one(device, line.substr(colon + 1), now));
}

std::string Console::carry_out_one(VirtualDevice& device, std::string_view line, Time now) const {
  std::string_view rest = line;
  const std::string_view word = take_word(rest);
  if (word == "alarm" || word == "clear") return alarms(device, rest, word == "alarm");
  if (word == "fault") return faults(device, rest);
  if (word == "help" && is_blank(rest)) return help();
  if (word != "power") return condition(device, line, now);
  const std::string_view state = take_word(rest);
  if ((state != "on" && state != "off") || !is_blank(rest)) {
    throw UsageError("power can be on or off: write \"power on\" or \"power off\"");
  }
  const bool was_on = device.is_on();
  if (state == "off") {
    device.switch_off(now);
    return was_on ? "power is off" : "power is off already";
  }
  if (was_on) return "power is on already";
  device.switch_on(now, true);
  return "power is on; it takes its time to start";
}

std::string Console::condition(VirtualDevice& device, std::string_view line, Time now) const {
  const std::size_t equals = std::min(line.find('='), line.size());
  std::string_view before = line.substr(0, equals);
  const std::string_view name = take_word(before);
  std::vector<std::string_view> known;
  for (const Condition& one : unit_.conditions) known.push_back(one.name);
  known.insert(known.end(), {"power", "alarm", "clear", "fault", "help"});
  const Condition* found = is_blank(before) ? find_condition(unit_, name) : nullptr;
  if (found == nullptr) {
    const std::string_view near = nearest(name, known);
    throw UsageError(fmt::format("there is no \"{}\" here{}; possible are {}", line.substr(0, equals),
                                 near.empty() ? "" : fmt::format("; did you mean {}?", near), fmt::join(known, ", ")));
  }
  const auto index = static_cast<std::size_t>(found - unit_.conditions.data());
  if (equals < line.size()) {
    std::string_view rest = line.substr(equals + 1);
    const std::string_view value = take_word(rest);
    device.set_condition(index, require_value(*found, is_blank(rest) ? value : line.substr(equals + 1)), now);
  }
  return fmt::format("{} is {}", name, to_text(*found, device.condition(index)));
}

std::string Console::alarms(VirtualDevice& device, std::string_view names, bool raise) const {
  std::vector<std::string> all;
  while (!is_blank(names)) all.emplace_back(take_word(names));
  // With some options an encoder cannot report an alarm. Such an alarm can be lowered here, but not raised.
  const std::uint32_t bits = raise ? require_alarms(unit_, device.options(), all) : require_alarms(unit_, all);
  if (bits == 0) {
    throw UsageError(fmt::format("which alarm? There are {}", fmt::join(flag_names(*unit_.alarms, ~0ull), ", ")));
  }
  raise ? device.raise_alarms(bits) : device.lower_alarms(bits);
  return fmt::format("{} {}", raise ? "raised" : "lowered", fmt::join(all, ", "));
}

// Sets the rates of the faults that `wanted` names, such as "drop=0.1". Returns all faults with a rate above 0 as text.
std::string Console::faults(VirtualDevice& device, std::string_view wanted) {
  sim::FaultRates rates = device.fault_rates();
  for (std::string_view rest = wanted; !is_blank(rest);) {
    const std::string_view word = take_word(rest);
    if (word == "none") {
      rates.rates = {};
    } else {
      const sim::FaultRate fault = require_fault(word);
      rates[fault.kind] = fault.rate;
    }
  }
  if (!is_blank(wanted)) device.set_faults(rates);
  std::vector<std::string> set;
  for (std::size_t i = 0; i < rates.rates.size(); ++i) {
    if (rates.rates[i] > 0) set.push_back(fmt::format("{}={}", sim::fault_names[i], rates.rates[i]));
  }
  return set.empty() ? "no faults" : fmt::format("faults: {}", fmt::join(set, ", "));
}

std::string Console::help() const {
  std::vector<std::string> all;
  for (const Condition& one : unit_.conditions) all.push_back(fmt::format("{}={}", one.name, range_of(one)));
  all.insert(all.end(), {"power on", "power off"});
  if (unit_.alarms != nullptr) {
    const std::string names = fmt::format("{}", fmt::join(flag_names(*unit_.alarms, ~0ull), " "));
    all.insert(all.end(), {"alarm NAME", fmt::format("clear NAME, of {}", names)});
  }
  all.push_back(fmt::format("fault KIND=RATE, of {}", fmt::join(sim::fault_names, " ")));
  all.insert(all.end(), {"fault none", "help"});
  if (devices_.size() > 1)
    all.push_back(fmt::format("in front the number of one encoder, as 1: to {}:", devices_.size()));
  return fmt::format("{}", fmt::join(all, "; "));
}

}  // namespace absenc::tool
