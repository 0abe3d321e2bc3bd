// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/virtual_device.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>

#include "absenc/core/bits.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/unit_text.hpp"

namespace absenc::tool {

namespace {

std::uint64_t checked(std::string_view name, std::optional<std::int64_t> value, unsigned bits) {
  if (!value) return 0;
  if (bits == 0) throw UsageError(fmt::format("{} cannot be set: this encoder has no such position", name));
  const std::uint64_t maximum = low_mask(bits);
  if (*value >= 0 && static_cast<std::uint64_t>(*value) <= maximum) return static_cast<std::uint64_t>(*value);
  throw UsageError(fmt::format("{} is {}, but must be from 0 to {}: it has {} bits", name, *value, maximum, bits));
}

// The shaft's position (core/shaft.hpp) at which the encoder shows what the user wants.
std::int64_t start_position(const Unit& unit, const Options& options, const DeviceSettings& settings) {
  const Resolution resolution = unit.resolution(options);
  const std::uint64_t counts = checked("singleturn", settings.singleturn, resolution.singleturn_bits);
  const std::uint64_t turns = checked("multiturn", settings.multiturn, resolution.multiturn_bits);
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

sim::FaultRates fault_rates(const DeviceSettings& settings) {
  sim::FaultRates rates;
  rates.delay = settings.delay;
  try {
    for (const std::string& text : settings.faults) {
      const sim::FaultRate fault = sim::parse_fault(text);
      rates[fault.kind] = fault.rate;
    }
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  return rates;
}

}  // namespace

VirtualDevice::VirtualDevice(const Unit& unit, const Options& options, const DeviceSettings& settings)
    : motion_(motion_of(unit, options, settings)),
      storage_(std::make_unique<std::byte[]>(unit.device_storage)),
      device_(unit.device(options, motion_, {storage_.get(), unit.device_storage})),
      real_power_on_(settings.real_power_on) {
  if (device_.bytes == nullptr && device_.frames == nullptr) {
    throw UsageError(fmt::format("{} has no virtual encoder with these options", unit.id));
  }
  if (!settings.alarms.empty() && unit.alarms == nullptr) {
    throw UsageError(fmt::format("the encoders of {} have no alarms", unit.id));
  }
  if (unit.alarms != nullptr) alarms_ = require_flags(*unit.alarms, settings.alarms);
  if (settings.faults.empty()) return;
  const sim::FaultRates rates = fault_rates(settings);
  if (device_.bytes != nullptr) faulty_ = std::make_unique<sim::FaultyDevice>(*device_.bytes, rates, settings.seed);
  if (device_.frames != nullptr)
    faulty_node_ = std::make_unique<sim::FaultyNode>(*device_.frames, rates, settings.seed);
}

Machine<std::uint8_t>* VirtualDevice::bytes() const {
  return faulty_ ? static_cast<Machine<std::uint8_t>*>(faulty_.get()) : device_.bytes;
}

Machine<CanFrame>* VirtualDevice::frames() const {
  return faulty_node_ ? static_cast<Machine<CanFrame>*>(faulty_node_.get()) : device_.frames;
}

const sim::FaultCounts* VirtualDevice::faults() const {
  if (faulty_) return &faulty_->counts();
  return faulty_node_ ? &faulty_node_->counts() : nullptr;
}

void VirtualDevice::power_on(Time now) {
  motion_.begin_at(now);
  const auto switch_on = [&](auto* device) {
    if (device == nullptr) return;
    using Kind = typename std::remove_pointer_t<decltype(device)>::PowerOn;
    device->power_on(now, real_power_on_ ? Kind::real : Kind::skip);
    device->raise_alarms(alarms_);
  };
  switch_on(device_.bytes);
  switch_on(device_.frames);
}

}  // namespace absenc::tool
