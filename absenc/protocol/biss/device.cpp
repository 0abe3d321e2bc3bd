// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/device.hpp"

#include <algorithm>

namespace absenc::biss {

void LineDelay::apply(const Behaviour& behaviour, Time period, Samples& samples) {
  if (behaviour.line_delay == Time{}) return;
  const auto late = static_cast<unsigned>(behaviour.line_delay / period);
  const Time rest = behaviour.line_delay % period;
  const bool just_late = late > 0 && rest < behaviour.edge_noise;
  const bool nearly_late = period - rest < behaviour.edge_noise;
  if (late == 0 && !nearly_late) return;
  const BitBuffer driven = samples;
  samples.clear();
  const auto bit = [&driven](std::size_t index, unsigned by) {
    if (index < by) return true;  // before the delay of the line has passed, the host samples an idle line
    return index - by < driven.size() && driven.view()[index - by];
  };
  for (std::size_t i = 0; i < driven.size() + late && i < Samples::capacity(); ++i) {
    noise_ = noise_ * 1'664'525 + 1'013'904'223;
    const bool other = (noise_ >> 31) != 0;
    unsigned by = late;
    if (just_late && other) --by;
    if (nearly_late && other) ++by;
    samples.append(bit(i, by) ? 1 : 0, 1);
  }
}

// ---- Registers

namespace {
// Index of the registers outside the banks in the memory of a slave.
constexpr std::size_t direct = VirtualRegisters::banks * registers::bank_size;

// Initial content of the registers device ID (6 bytes) and manufacturer (2 bytes).
constexpr std::array<std::uint8_t, 8> identity{'A', 'b', 's', 'e', 'n', 'c', 'v', 'e'};
}  // namespace

VirtualRegisters::VirtualRegisters(unsigned slaves, RegisterOrder order, StopBit stop_bit)
    : slaves_(slaves), stop_bit_(stop_bit) {
  const unsigned lowest = registers::serial_number + (order == RegisterOrder::big ? 3 : 0);
  for (unsigned slave = 0; slave < most_slaves; ++slave) {
    const MutableBytes own = MutableBytes(memory_).subspan(slave * slave_size + direct);
    own[registers::eds_bank - registers::bank_size] = 0;  // value 0: the virtual encoder has no electronic data sheet
    own[registers::profile - registers::bank_size] = 0;
    own[registers::profile + 1 - registers::bank_size] = 0;
    own[lowest - registers::bank_size] = static_cast<std::uint8_t>(slave + 1);
    std::copy(identity.begin(), identity.end(), own.begin() + (registers::device_id - registers::bank_size));
  }
}

void VirtualRegisters::power_on() {
  bank_ = {};
  data_off_ = 0;
  control_off_ = 0;
}

void VirtualRegisters::set_time(Time at, Time delay) {
  now_ = at;
  delay_ = delay;
}

std::size_t VirtualRegisters::place(unsigned slave, unsigned address) const {
  const std::size_t first = slave * slave_size;
  if (address < registers::bank_size) return first + bank_[slave] * registers::bank_size + address;
  return first + direct + (address - registers::bank_size);
}

// Outside the banks, only bank select and the maker's registers may be written.
bool VirtualRegisters::allows(unsigned slave, unsigned address, bool write) const {
  if (address < registers::bank_size) return bank_[slave] < banks;
  if (!write || address == registers::bank_select) return true;
  return address >= registers::device && address < registers::device_id;
}

std::uint8_t VirtualRegisters::read(unsigned slave, unsigned address) {
  requested_ = false;
  return address == registers::bank_select ? bank_[slave] : memory_[place(slave, address)];
}

void VirtualRegisters::write(unsigned slave, unsigned address, std::uint8_t value) {
  requested_ = false;
  if (address == registers::bank_select) {
    bank_[slave] = value;
  } else {
    memory_[place(slave, address)] = value;
    ++written_;
  }
}

bool VirtualRegisters::stop_bit(bool next_allowed) const {
  return stop_bit_ == StopBit::next ? !next_allowed : stop_bit_ == StopBit::one;
}

bool VirtualRegisters::is_ready() const {
  if (delay_ == Time{}) return true;
  if (!requested_) {
    requested_ = true;
    requested_at_ = now_;
  }
  return now_ - requested_at_ >= delay_;
}

// Accepts commands 0 and 1, which the standard defines; the maker defines 2 and 3.
bool VirtualRegisters::obeys(unsigned, unsigned command) const { return command < 2; }

void VirtualRegisters::execute(std::uint8_t slaves, unsigned command) {
  const auto process_data = [&](std::uint8_t whose, bool on) {
    data_off_ = static_cast<std::uint8_t>(on ? data_off_ & ~whose : data_off_ | whose);
  };
  const auto control = [&](std::uint8_t whose, bool on) {
    control_off_ = static_cast<std::uint8_t>(on ? control_off_ & ~whose : control_off_ | whose);
  };
  const bool broadcast = slaves == 0;
  const auto whose = static_cast<std::uint8_t>(broadcast ? 0xFF : slaves);
  if (command == 0) process_data(whose, !broadcast);
  if (command == 1) control(whose, broadcast);
}

}  // namespace absenc::biss
