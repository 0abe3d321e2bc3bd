// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/emulation/answer.hpp"

#include "absenc/client/port/virtual_device.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::client {

namespace {

template <class Item>
Attempted answer_on(const EncoderAddress& address, Machine<Item>& device, const Command& command, Arguments arguments) {
  sim::SimPort<Item> port(address.unit->link, address.line, device);
  Runner<Item> runner(address);
  runner.attach(port);
  return runner.once(command, arguments);
}

}  // namespace

Attempted answer_of(const EncoderAddress& address, const Command& command, Arguments arguments) {
  VirtualDevice device(*address.unit, address.options, address.device);
  device.power_on(Time{});
  return device.bytes() != nullptr ? answer_on(address, *device.bytes(), command, arguments)
                                   : answer_on(address, *device.frames(), command, arguments);
}

}  // namespace absenc::client
