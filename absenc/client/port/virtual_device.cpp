// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/virtual_device.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/core/bits.hpp"

namespace absenc::client {

namespace {

std::uint64_t checked(std::string_view name, std::optional<std::int64_t> value, unsigned bits, bool has_sign) {
  if (!value) return 0;
  if (bits == 0) throw UsageError(fmt::format("{} cannot be set: this encoder has no such position", name));
  const std::uint64_t low = low_mask(bits) & static_cast<std::uint64_t>(*value);
  // Accepts negative turns either as a number with a sign, or as the bits that stand for them on the line.
  if (low == static_cast<std::uint64_t>(*value) || (has_sign && with_sign(low, bits) == *value)) return low;
  const std::int64_t minimum = has_sign ? with_sign(std::uint64_t{1} << (bits - 1), bits) : 0;
  throw UsageError(fmt::format("{} is {}, but must be from {} to {}: it has {} bits{}", name, *value, minimum,
                               low_mask(has_sign ? bits - 1 : bits), bits, has_sign ? ", the highest its sign" : ""));
}

std::int64_t start_position(const Unit& unit, const Options& options, const DeviceSettings& settings) {
  const Resolution resolution = unit.resolution(options);
  const std::uint64_t counts = checked("singleturn", settings.singleturn, resolution.singleturn_bits, false);
  const std::uint64_t turns =
      checked("multiturn", settings.multiturn, resolution.multiturn_bits, resolution.multiturn_signed);
  const unsigned bits = resolution.singleturn_bits;
  const std::uint64_t fraction = bits <= 32 ? counts << (32 - bits) : counts >> (bits - 32);
  return static_cast<std::int64_t>(turns << 32 | fraction);
}

sim::Motion motion_of(const Unit& unit, const Options& options, const DeviceSettings& settings) {
  const std::int64_t start = start_position(unit, options, settings);
  try {
    return sim::parse_motion(settings.motion, start);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

sim::FaultRates rates_of(const DeviceSettings& settings) {
  sim::FaultRates rates;
  rates.delay = settings.delay;
  for (const std::string& text : settings.faults) {
    const sim::FaultRate fault = require_fault(text);
    rates[fault.kind] = fault.rate;
  }
  return rates;
}

}  // namespace

sim::FaultRate require_fault(std::string_view text) {
  try {
    return sim::parse_fault(text);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

VirtualDevice::VirtualDevice(const Unit& unit, const Options& options, const DeviceSettings& settings)
    : options_(options),
      motion_(motion_of(unit, options, settings)),
      storage_(std::make_unique<std::byte[]>(unit.device_storage)),
      device_(unit.device(options, motion_, {storage_.get(), unit.device_storage})),
      rates_(rates_of(settings)),
      had_faults_(!settings.faults.empty()),
      real_power_on_(settings.real_power_on) {
  if (device_.bytes == nullptr && device_.frames == nullptr) {
    throw UsageError(fmt::format("{} has no virtual encoder with these options", unit.id));
  }
  if (!settings.alarms.empty()) alarms_ = require_alarms(unit, options, settings.alarms);
  for (const Condition& condition : unit.conditions) conditions_.push_back(condition.normal);
  for (const std::string& text : settings.conditions) {
    const OptionText written = split_setting(text);
    const Condition& condition = require_condition(unit, written.name);
    conditions_[static_cast<std::size_t>(&condition - unit.conditions.data())] =
        require_value(condition, written.value);
  }
  rates_.character_bytes = static_cast<std::uint8_t>(line_settings(unit, options).character_bytes());
  if (!had_faults_ && !settings.faults_may_come) return;
  if (device_.bytes != nullptr) faulty_ = std::make_unique<sim::FaultyDevice>(*device_.bytes, rates_, settings.seed);
  if (device_.frames != nullptr) {
    faulty_node_ = std::make_unique<sim::FaultyNode>(*device_.frames, rates_, settings.seed);
  }
}

Machine<std::uint8_t>* VirtualDevice::bytes() const {
  return faulty_ ? static_cast<Machine<std::uint8_t>*>(faulty_.get()) : device_.bytes;
}

Machine<CanFrame>* VirtualDevice::frames() const {
  return faulty_node_ ? static_cast<Machine<CanFrame>*>(faulty_node_.get()) : device_.frames;
}

const sim::FaultCounts* VirtualDevice::faults() const {
  if (!had_faults_) return nullptr;
  if (faulty_) return &faulty_->counts();
  return faulty_node_ ? &faulty_node_->counts() : nullptr;
}

std::optional<std::uint64_t> VirtualDevice::damaged_replies() const {
  if (!had_faults_ || !faulty_) return std::nullopt;
  return faulty_->damaged_replies();
}

// Calls `use` with the virtual encoder, whether its line carries bytes or CAN frames.
template <class Use>
void VirtualDevice::each(Use use) {
  if (device_.bytes != nullptr) use(*device_.bytes);
  if (device_.frames != nullptr) use(*device_.frames);
}

void VirtualDevice::power_on(Time now) {
  motion_.begin_at(now);
  for (std::size_t i = 0; i < conditions_.size(); ++i) {
    set_condition(i, conditions_[i], now);
  }
  switch_on(now, real_power_on_);
  raise_alarms(alarms_);
}

void VirtualDevice::switch_on(Time now, bool real) {
  if (std::exchange(is_on_, true)) return;
  each([&]<class Item>(Device<Item>& device) {
    device.power_on(now, real ? Device<Item>::PowerOn::real : Device<Item>::PowerOn::skip);
  });
}

void VirtualDevice::switch_off(Time now) {
  if (!std::exchange(is_on_, false)) return;
  each([&](auto& device) { device.power_off(now); });
}

void VirtualDevice::watch_rules(RuleWatch* watch) {
  each([&](auto& device) { device.watch_rules(watch); });
}

void VirtualDevice::raise_alarms(std::uint32_t bits) {
  each([&](auto& device) { device.raise_alarms(bits); });
}

void VirtualDevice::lower_alarms(std::uint32_t bits) {
  each([&](auto& device) { device.lower_alarms(bits); });
}

void VirtualDevice::set_condition(std::size_t index, std::int64_t value, Time now) {
  conditions_[index] = value;
  each([&](auto& device) { device.set_condition(index, value, now); });
}

void VirtualDevice::set_faults(const sim::FaultRates& rates) {
  rates_ = rates;
  had_faults_ = true;
  if (faulty_) faulty_->set_rates(rates);
  if (faulty_node_) faulty_node_->set_rates(rates);
}

}  // namespace absenc::client
