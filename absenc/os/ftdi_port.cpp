// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/ftdi_port.hpp"

#include <algorithm>
#include <array>
#include <chrono>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

using Kind = Failure::Kind;

namespace {

// An MPSSE reads its commands byte by byte at 60 MHz at most, so a command of three bytes takes at least this long.
constexpr Time least_command_time = 50ns;

// Longest time for which a pause is made of commands; nothing on a clocked line needs a longer one inside of a
// transfer.
constexpr Time longest_pause = 1us;

std::string hertz(std::uint32_t rate) { return std::to_string(rate) + " Hz"; }

}  // namespace

FtdiPort::FtdiPort(const std::string& place, LinkKind kind, const LineSettings& settings, const SpiChoice& choice,
                   FtdiUsb& usb)
    : TransferPort(kind), choice_(choice) {
  const FtdiPlace where = ftdi_place(place);
  const FtdiAdapter adapter = find_ftdi(usb, where);
  name_ = adapter.words();
  if (adapter.channels > 1) name_ += std::string(", channel ") + where.channel;
  base_ = adapter.base;
  channel_ = usb.open(adapter, where.channel);
  synchronise();
  apply(settings);
  commands_.clear();
  commands_.set_pins(rest());
  send(0);
}

// Sends a command that no MPSSE has until the chip answers to it: what it answered before belongs to an earlier
// program (AN 135, "Synchronization & Bad Command Detection").
void FtdiPort::synchronise() {
  commands_.clear();
  commands_.unknown();
  commands_.send_immediate();
  channel_->write(commands_.bytes());
  const Time limit = os::now() + 1s;
  std::array<std::uint8_t, 2> last{};
  std::array<std::uint8_t, 64> read{};
  while (last != std::array<std::uint8_t, 2>{0xFA, 0xAA}) {
    const std::size_t size = channel_->read(read);
    for (std::size_t i = 0; i < size; ++i) last = {last[1], read[i]};
    if (os::now() > limit) {
      throw Failure(Kind::unsupported,
                    "the MPSSE of the " + name_ + " does not answer: unplug the adapter and plug it in");
    }
  }
  commands_.clear();
  if (base_ > 12'000'000) commands_.use_fast_base();
  commands_.end_loopback();
  send(0);
}

void FtdiPort::apply(LineSettings settings) {
  settings.rate = choice_.speed.value_or(settings.rate);
  settings.spi_mode = choice_.mode.value_or(settings.spi_mode);
  const bool bytes = kind() == LinkKind::spi;
  const bool turns = kind() == LinkKind::clocked_bidirectional;
  if (bytes && settings.spi_mode % 2 != 0) {
    throw Failure(Kind::unsupported,
                  "an MPSSE shifts in SPI modes 0 and 2 (FTDI's AN 114), but this encoder needs mode " +
                      std::to_string(settings.spi_mode) + ": use an SPI controller of Linux, spi:/dev/spidevB.C");
  }
  if (turns && !idles_high(settings.spi_mode)) {
    throw Failure(Kind::unsupported,
                  "the clock of a line that turns rests high: leave spi_mode out, and swap no wires");
  }
  if (turns && settings.rate > highest_turning_rate) {
    throw Failure(Kind::bad_rate, "an MPSSE reads a line that turns at up to " + hertz(highest_turning_rate) +
                                      ", not " + hertz(settings.rate) +
                                      ": set speed=" + std::to_string(highest_turning_rate));
  }
  const std::optional<MpsseClock> clock = MpsseClock::nearest(settings.rate, base_, settings.highest_rate);
  if (!clock) {
    throw Failure(Kind::bad_rate, "the clock divider of the " + name_ + " makes " + hertz(MpsseClock::lowest(base_)) +
                                      " to " + hertz(MpsseClock::highest(base_)) + ", not " + hertz(settings.rate) +
                                      ": set another speed=HZ");
  }
  settings_ = settings;
  settings_.rate = clock->rate();
  divisor_ = clock->divisor;
}

// The chip is told with the next transfer: a conversation may set its rate before each reading, and the rate before it
// again afterwards.
void FtdiPort::change_rate(std::uint32_t rate) {
  if (choice_.speed) return;
  const std::optional<MpsseClock> clock = MpsseClock::nearest(rate, base_, settings_.highest_rate);
  if (clock && clock->rate() == settings_.rate) return;
  LineSettings settings = settings_;
  settings.rate = rate;
  apply(settings);
}

// The levels of the pins between two transfers.
std::uint8_t FtdiPort::rest() const {
  const bool high = kind() != LinkKind::spi || idles_high(settings_.spi_mode);
  const bool swapped = carries_bits(kind()) && !idles_high(settings_.spi_mode);
  return static_cast<std::uint8_t>(MpssePin::select | (high && !swapped ? MpssePin::clock : 0));
}

void FtdiPort::exchange(const ByteStep& step, TransferResult& received) {
  commands_.clear();
  if (step.hold_low) {
    hold_low(step.at);
  } else {
    reach(step.at);
  }
  if (divisor_ != sent_divisor_) commands_.set_divisor(divisor_);
  sent_divisor_ = divisor_;
  switch (kind()) {
    case LinkKind::clocked:
      return clock_in(step, received);
    case LinkKind::clocked_bidirectional:
      return turn(step, received);
    default:
      return exchange_bytes(step, received);
  }
}

// A pause on the clock line is made by time, between two USB transfers: an MPSSE has clocks without data (0x8E and
// 0x8F), but they move the clock pin, and it has no command that only waits. The encoder measures its timeout from the
// falling edge, which comes late if this thread does. So the chip replies when the clock is low, and the clock stays
// low for as long as the host wanted from then on.
void FtdiPort::hold_low(Time until) {
  const Time wanted = until - end_;
  commands_.set_pins(rest() ^ MpssePin::clock);
  commands_.read_pins();
  send(0);
  reach(os::now() + wanted);
  commands_.clear();
  commands_.set_pins(rest());
  pause(settings_.bits(1) / 2, rest());
}

// Between two commands the clock rests for a time that AN 108 does not state. A BiSS encoder with an adaptive timeout
// may end its frame after one and a half periods, so a line without idle clocks gets one command of whole bytes, with
// up to seven more clocks than needed. SSI has idle clocks; its encoders wait for more than 10 us, and some send the
// word again if there are more clocks.
void FtdiPort::clock_in(const ByteStep& step, TransferResult& received) {
  const std::size_t needed = settings_.idle_clocks + step.bits;
  const std::size_t clocks = needed <= 8 || settings_.idle_clocks > 0 ? needed : (needed + 7) / 8 * 8;
  if (step.bits > 0) commands_.shift_in(clocks, idles_high(settings_.spi_mode));
  send(clocks, &received);
  if (step.bits == 0) return;
  MpsseBits bits(replies_);
  bits.take_shifted(clocks);
  extract(bits.bytes(), settings_.idle_clocks, step.bits, received);
}

// Clock i falls, then rises. The host puts out bit i at the falling edge; the encoder changes the line at the rising
// one, and sees that of the host. The host's bits go out while the clock rests low (mode 0): the first falling edge is
// set by hand, then each pulse is a rising and a falling edge. The encoder's bits come in by the same pulses, sampled
// at the rising edge, which is a period after the edge that changed them; the last two are read by hand, so that the
// clock ends high without another edge.
void FtdiPort::turn(const ByteStep& step, TransferResult& received) {
  constexpr std::uint8_t low = MpssePin::select;
  constexpr std::uint8_t high = MpssePin::select | MpssePin::clock;
  constexpr std::uint8_t driving = MpssePin::direction;
  const std::size_t out = step.out_bits;
  const std::size_t in = step.bits - out;
  const auto level = [&](std::size_t bit) {
    return static_cast<std::uint8_t>((step.out[bit / 8] >> (7 - bit % 8) & 1) != 0 ? MpssePin::out : 0);
  };
  const Time half = settings_.bits(1) / 2;
  if (out > 0) {
    commands_.set_pins(low | driving | level(0));
    const bool ends_high = in == 0 && !step.goes_on;
    const std::size_t shifted = ends_high ? out - 1 : out;
    commands_.shift_out(step.out, shifted);
    if (ends_high) {
      commands_.set_pins(low | driving | level(out - 1));
      pause(half, low | driving | level(out - 1));
      commands_.set_pins(high | driving | level(out - 1));
      pause(half, high | driving | level(out - 1));
      commands_.set_pins(high);
    } else {
      commands_.set_pins(low);
    }
  } else if (in > 0 && !rests_low_) {
    commands_.set_pins(low);
    pause(half, low);
  }
  const std::size_t pulses = in > 0 ? in - 1 : 0;
  if (in > 0) {
    commands_.shift_in(pulses, false);
    if (in > 1) {
      pause(longest_pause, low);
      commands_.read_pins();
    }
    commands_.set_pins(high);
    pause(longest_pause, high);
    commands_.read_pins();
    if (step.goes_on) commands_.set_pins(low);
  } else {
    commands_.read_pins();  // a reply, because a USB write ends before the chip has sent the bits
  }
  rests_low_ = step.goes_on;
  send(step.bits, &received);
  if (in == 0) return;
  MpsseBits bits(replies_);
  bits.take_shifted(pulses);
  if (in > 1) bits.take_pin();
  bits.take_pin();
  extract(bits.bytes(), in > 1 ? 1 : 0, in, received);  // the first pulse samples before the encoder's first bit
  received.idle_low = false;
  received.sampled_after = settings_.bits(1);
}

void FtdiPort::exchange_bytes(const ByteStep& step, TransferResult& received) {
  std::vector<std::uint8_t> out(step.out.begin(), step.out.end());
  out.resize(std::max(step.out.size(), step.expect), 0);
  const auto selected = static_cast<std::uint8_t>(rest() ^ MpssePin::select);
  commands_.set_pins(selected);
  if (settings_.select_lead > longest_pause) {
    send(0);
    reach(os::now() + settings_.select_lead);
    commands_.clear();
  } else {
    pause(settings_.select_lead, selected);
  }
  if (!out.empty()) commands_.exchange(out, idles_high(settings_.spi_mode));
  commands_.set_pins(rest());
  send(8 * out.size(), &received);
  received.items = replies_;
}

// Sets the same levels again until at least `least`, at most `longest_pause`, has passed.
void FtdiPort::pause(Time least, std::uint8_t levels) {
  for (Time made{}; made < std::min(least, longest_pause); made += least_command_time) commands_.set_pins(levels);
}

void FtdiPort::send(std::size_t clocks, TransferResult* received) {
  if (commands_.replies() > 0) commands_.send_immediate();
  const Time duration = clocks > 0 ? settings_.bits(clocks) : Time{};
  const Time before = os::now();
  channel_->write(commands_.bytes());
  replies_.resize(commands_.replies());
  const Time limit = before + duration + 1s;
  for (std::size_t have = 0; have < replies_.size();) {
    have += channel_->read(MutableBytes(replies_).subspan(have));
    if (have == replies_.size() || os::now() < limit) continue;
    throw Failure(Kind::lost, "the " + name_ + " answered with " + std::to_string(have) + " of " +
                                  std::to_string(replies_.size()) + " bytes within a second: unplug it and plug it in");
  }
  if (received == nullptr) return;
  received->at = end_ = os::now();
  received->late = std::max(received->at - before - duration, Time{});
}

FtdiPort::DataPin FtdiPort::look_at_data() {
  const DataPin first = look_once();
  if (first.driven) return first;
  // An encoder that ends its timeout changes the level by itself. If it did so between the two reads of the pin, the
  // second look finds the pin driven.
  const DataPin second = look_once();
  return second.driven ? second : first;
}

FtdiPort::DataPin FtdiPort::look_once() {
  commands_.clear();
  commands_.read_pins();
  send(0);
  const bool high = (replies_[0] & MpssePin::in) != 0;
  commands_.clear();
  commands_.set_pins(static_cast<std::uint8_t>(rest() | (high ? 0 : MpssePin::in)), MpssePin::outputs | MpssePin::in);
  commands_.set_pins(rest());
  commands_.read_pins();
  send(0);
  return {.high = high, .driven = ((replies_[0] & MpssePin::in) != 0) == high};
}

}  // namespace absenc::os
