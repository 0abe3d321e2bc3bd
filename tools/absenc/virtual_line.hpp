// SPDX-License-Identifier: Apache-2.0
// The virtual encoders of `emulate` on one line.
#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/sim/bus.hpp"
#include "absenc/sim/frame_bus.hpp"
#include "tools/absenc/subcommand.hpp"

namespace absenc::tool {

using namespace client;

/// Returns the settings of virtual encoders that the options of the verb state. Throws UsageError.
[[nodiscard]] DeviceSettings device_settings(const Invocation& invocation);
/// Returns the sim: address of a further encoder, from a value of the option --also. Throws UsageError.
[[nodiscard]] EncoderAddress further_encoder(const Unit& unit, const Invocation& invocation, const std::string& further,
                                             const DeviceSettings& settings);
/// Prints about a virtual encoder: number of answers, time since `start`, injected faults, and rules that its host
/// broke.
void print_summary(const VirtualDevice& device, std::string_view name, Time start);

template <class Item>
class VirtualLine {
 public:
  VirtualLine(const Unit& unit, const Options& options, const Invocation& invocation)
      : unit_(unit), further_(invocation.texts("--also")) {
    const DeviceSettings settings = device_settings(invocation);
    Options first = options;
    if (!further_.empty()) tell_shared(unit, first);
    devices_.push_back(std::make_unique<VirtualDevice>(unit, first, settings));
    for (const std::string& further : further_) {
      EncoderAddress uri = further_encoder(unit, invocation, further, settings);
      tell_shared(unit, uri.options);
      devices_.push_back(std::make_unique<VirtualDevice>(unit, uri.options, uri.device));
    }
    std::vector<Machine<Item>*> machines;
    for (const auto& device : devices_) machines.push_back(machine_of(*device));
    if constexpr (is_can) {
      const LineSettings line = line_settings(unit, options);
      bus_ = std::make_unique<sim::FrameBus>(machines, line.rate);
    } else if (machines.size() > 1) {
      bus_ = std::make_unique<sim::Bus>(machines, unit.line.with_some_rate().byte_time());
    }
  }

  /// Returns the first encoder. The option --memory stores its memory in a file.
  [[nodiscard]] Device<Item>& first() {
    if constexpr (is_can) {
      return *devices_.front()->device().frames;
    } else {
      return *devices_.front()->device().bytes;
    }
  }
  [[nodiscard]] Machine<Item>& machine() { return bus_ != nullptr ? *bus_ : *machine_of(*devices_.front()); }

  void power_on(Time now) {
    for (const auto& device : devices_) device->power_on(now);
  }

  [[nodiscard]] const Unit& unit() const { return unit_; }
  [[nodiscard]] std::vector<VirtualDevice*> devices() {
    std::vector<VirtualDevice*> all;
    for (const auto& device : devices_) all.push_back(device.get());
    return all;
  }

  void summarize(Time start) const {
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      const std::string name = i > 0 ? further_[i - 1] + ": " : devices_.size() > 1 ? "the first: " : "";
      print_summary(*devices_[i], name, start);
    }
  }

 private:
  static constexpr bool is_can = std::is_same_v<Item, CanFrame>;

  static Machine<Item>* machine_of(const VirtualDevice& device) {
    if constexpr (is_can) {
      return device.frames();
    } else {
      return device.bytes();
    }
  }

  const Unit& unit_;
  std::span<const std::string> further_;
  std::vector<std::unique_ptr<VirtualDevice>> devices_;
  std::unique_ptr<std::conditional_t<is_can, sim::FrameBus, sim::Bus>> bus_;
};

}  // namespace absenc::tool
