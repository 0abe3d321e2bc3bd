// SPDX-License-Identifier: Apache-2.0
#include "tests/ftdi/mpsse.hpp"

#include <algorithm>

namespace absenc::ftdi {

namespace {

// Bits of the shift commands [3.2].
constexpr std::uint8_t write_falling = 0x01, bitwise = 0x02, read_falling = 0x04, lsb_first = 0x08, writes = 0x10,
                       reads = 0x20, writes_tms = 0x40;

constexpr bool is_shift(std::uint8_t code) { return code < 0x80; }

}  // namespace

void Mpsse::reset(Time now) {
  pass_until(now);
  commands_.clear();
  replies_.clear();
  set(0xFF, 0);
  high_levels_ = 0xFF;
  high_outputs_ = 0;
  divisor_ = 0;
  by_five_ = true;
  loopback_ = three_phases_ = false;
}

void Mpsse::purge(bool commands, bool replies) {
  if (commands) commands_.clear();
  if (replies) replies_.clear();
}

void Mpsse::take(Bytes commands, Time now) {
  pass_until(now);
  commands_.insert(commands_.end(), commands.begin(), commands.end());
  std::size_t at = 0;
  while (at < commands_.size()) {
    const std::size_t size = length(at);
    if (size == 0 || at + size > commands_.size() || !execute(at, size)) break;
    at += size;
  }
  commands_.erase(commands_.begin(), commands_.begin() + static_cast<std::ptrdiff_t>(at));
}

// Returns the length of the command that begins at `from`; 0 if its length is not received yet.
std::size_t Mpsse::length(std::size_t from) const {
  const std::uint8_t code = commands_[from];
  if (is_shift(code)) {
    if ((code & bitwise) != 0) return (code & (writes | writes_tms)) != 0 ? 3 : 2;
    if ((code & writes) == 0) return 3;
    if (from + 3 > commands_.size()) return 0;
    return 4 + commands_[from + 1] + std::size_t{256} * commands_[from + 2];
  }
  switch (code) {
    case 0x80:
    case 0x82:
    case 0x86:
    case 0x8F:
    case 0x9C:
    case 0x9D:
    case 0x9E:
      return 3;
    case 0x8E:
      return 2;
    default:
      return 1;
  }
}

// Executes the command; returns false if it waits for an input.
bool Mpsse::execute(std::size_t at, std::size_t size) {
  const std::uint8_t code = commands_[at];
  const auto byte = [&](std::size_t i) { return commands_[at + i]; };
  const std::size_t word = size == 3 ? byte(1) + std::size_t{256} * byte(2) : 0;
  pass(static_cast<double>(byte_time.count() * static_cast<Time::rep>(std::min<std::size_t>(size, 3))));
  if (is_shift(code)) {
    if ((code & (writes | reads | writes_tms)) == 0) {
      ++unknown_;
      reply(0xFA);
      reply(code);
      return true;
    }
    if ((code & bitwise) != 0) {
      shift(code, byte(1) % 8 + 1u, Bytes(commands_).subspan(at + 2, size - 2));
    } else {
      shift(code, 8 * (byte(1) + std::size_t{256} * byte(2) + 1), Bytes(commands_).subspan(at + 3, size - 3));
    }
    return true;
  }
  switch (code) {
    case 0x80:
      set(byte(1), byte(2));
      return true;
    case 0x82:
      high_levels_ = byte(1);
      high_outputs_ = byte(2);
      return true;
    case 0x81:
      reply(pins());
      return true;
    case 0x83:
      reply(static_cast<std::uint8_t>((high_levels_ & high_outputs_) | static_cast<std::uint8_t>(~high_outputs_)));
      return true;
    case 0x84:
    case 0x85:
      loopback_ = code == 0x84;
      return true;
    case 0x86:
      divisor_ = static_cast<std::uint32_t>(word);
      return true;
    case 0x87:
      for (Reply& one : replies_) one.due = std::min(one.due, now());
      return true;
    case 0x88:
    case 0x89:
      return gpio_l1 == (code == 0x88);
    case 0x8A:
    case 0x8B:
      by_five_ = code == 0x8B;
      return true;
    case 0x8C:
    case 0x8D:
      three_phases_ = code == 0x8C;
      return true;
    case 0x8E:
      clocks(byte(1) % 8 + 1u);
      return true;
    case 0x8F:
      clocks(8 * (word + 1));
      return true;
    case 0x94:
    case 0x95:
      if (gpio_l1 == (code == 0x94)) return true;
      clocks(8);
      return false;
    case 0x96:
    case 0x97:
    case 0x9E:
      return true;
    case 0x9C:
    case 0x9D:
      if (gpio_l1 != (code == 0x9C)) clocks(8 * (word + 1));
      return true;
    default:
      ++unknown_;
      reply(0xFA);
      reply(code);
      return true;
  }
}

void Mpsse::shift(std::uint8_t code, std::size_t count, Bytes data) {
  const bool starts_high = (levels_ & clock) != 0;
  rate_ = 1e9 / (2 * half_ns());
  const bool writes_any = (code & (writes | writes_tms)) != 0;
  // Data change at the second edge of a pulse and are sampled at the first one.
  if (writes_any && ((code & write_falling) != 0) == starts_high) ++misused_;
  if ((code & reads) != 0 && ((code & read_falling) != 0) != starts_high) ++misused_;
  for (std::size_t done = 0; done < count; done += 8) {
    const std::size_t bits = std::min<std::size_t>(8, count - done);
    unsigned sampled = 0;
    for (std::size_t i = 0; i < bits; ++i) {
      const bool tms_too = (code & writes_tms) != 0;
      // A TMS command shifts its bits out LSB first on TMS, while TDI has bit 7 of the byte [3.5.1].
      const std::size_t place = (code & lsb_first) != 0 || tms_too ? i : 7 - i;
      const bool level = !data.empty() && (data[done / 8] >> place & 1) != 0;
      if (tms_too) {
        set(static_cast<std::uint8_t>((levels_ & ~out) | ((data[0] & 0x80) != 0 ? out : 0)), outputs_);
      }
      bool read = false;
      bit(code, level, (code & reads) != 0 ? &read : nullptr);
      // A shift register: bits that do not fill a byte are its lowest ones, or with LSB first its highest ones.
      sampled = (code & lsb_first) != 0 ? sampled >> 1 | (read ? 0x80u : 0u) : sampled << 1 | (read ? 1u : 0u);
    }
    if ((code & reads) != 0) reply(static_cast<std::uint8_t>(sampled));
  }
}

void Mpsse::bit(std::uint8_t code, bool level, bool* sampled) {
  const bool starts_high = (levels_ & clock) != 0;
  const std::uint8_t pin = (code & writes_tms) != 0 ? tms : out;
  if ((code & (writes | writes_tms)) != 0) {
    set(static_cast<std::uint8_t>(level ? levels_ | pin : levels_ & ~pin), outputs_);
  }
  for (const bool first : {true, false}) {
    pass(half_ns());
    const bool falls = first == starts_high;
    if (sampled != nullptr && ((code & read_falling) != 0) == falls) {
      *sampled = loopback_ ? (levels_ & out) != 0 : wires_->data(now());
    }
    toggle(!falls);
  }
  if (three_phases_) pass(half_ns());
}

void Mpsse::clocks(std::size_t count) {
  const bool starts_high = (levels_ & clock) != 0;
  for (std::size_t i = 0; i < count; ++i) {
    pass(half_ns());
    toggle(!starts_high);
    pass(half_ns());
    toggle(starts_high);
  }
}

void Mpsse::toggle(bool high) { set(static_cast<std::uint8_t>(high ? levels_ | clock : levels_ & ~clock), outputs_); }

void Mpsse::set(std::uint8_t levels, std::uint8_t outputs) {
  levels_ = levels;
  outputs_ = outputs;
  wires_->change(now(), levels, outputs);
}

std::uint8_t Mpsse::pins() {
  const bool level = (outputs_ & in) != 0 ? (levels_ & in) != 0 : wires_->data(now());
  const auto others = static_cast<std::uint8_t>((levels_ & outputs_) | static_cast<std::uint8_t>(~outputs_));
  return static_cast<std::uint8_t>(level ? others | in : others & ~in);
}

Time Mpsse::ready_at(Time latency) const {
  if (replies_.empty()) return never;
  return std::min(replies_.front().due, replies_.front().made + latency);
}

std::vector<std::uint8_t> Mpsse::replies(Time now, Time latency, std::size_t most) {
  std::vector<std::uint8_t> ready;
  while (!replies_.empty() && ready.size() < most && ready_at(latency) <= now && replies_.front().made <= now) {
    ready.push_back(replies_.front().byte);
    replies_.pop_front();
  }
  return ready;
}

}  // namespace absenc::ftdi
