// SPDX-License-Identifier: Apache-2.0
// An MPSSE as FTDI's application note AN 108, version 1.5, describes it (paragraphs in brackets), with things on its
// pins: for tests.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "absenc/core/bytes.hpp"
#include "absenc/core/time.hpp"

namespace absenc::ftdi {

/// The circuit at the pins ADBUS0 to ADBUS7.
struct Wires {
  virtual ~Wires() = default;
  /// Processes new levels of the pins; those that are no `outputs` are not driven by the chip.
  virtual void change(Time at, std::uint8_t levels, std::uint8_t outputs) = 0;
  /// Returns the level on the data pin ADBUS2 at a time that is not before the last change.
  [[nodiscard]] virtual bool data(Time at) = 0;
};

/// The command processor of an FT232H (`base` 60 MHz) or FT2232D (12 MHz).
class Mpsse {
 public:
  static constexpr std::uint8_t clock = 0x01, out = 0x02, in = 0x04, tms = 0x08;
  /// The chip takes a byte of a command at this interval; AN 108 states no time, so this is the least.
  static constexpr Time byte_time = Time(17);

  explicit Mpsse(Wires& wires, std::uint32_t base = 60'000'000) : wires_(&wires), fast_(base) {}

  /// Switches the engine off and on: all pins are inputs, all settings as after reset, nothing waits. Not before `now`.
  void reset(Time now);
  /// Drops incomplete commands if `commands`, and replies that were not taken if `replies`.
  void purge(bool commands, bool replies);
  /// Executes `commands` from the host, of which a command may continue in the next call; not before `now`.
  void take(Bytes commands, Time now);

  /// Returns the replies that are ready at `now` because they are to be sent at once [5.1], or which are older than
  /// `latency`, at most `most` bytes, and removes them.
  [[nodiscard]] std::vector<std::uint8_t> replies(Time now, Time latency, std::size_t most);
  /// Returns the time at which the next reply is ready; `never` if there is none.
  [[nodiscard]] Time ready_at(Time latency) const;

  /// Returns the number of shift commands whose edges do not suit the level at which the clock rests, as the notes
  /// "use if CLK starts at" in [3.3] demand: on a real chip their clock has other edges.
  [[nodiscard]] unsigned misused() const { return misused_; }
  /// Returns the number of commands that no MPSSE has [3.1].
  [[nodiscard]] unsigned unknown() const { return unknown_; }
  /// Returns the clock rate of the last shift command in Hz.
  [[nodiscard]] double rate() const { return rate_; }
  [[nodiscard]] std::uint8_t levels() const { return levels_; }

  /// The level of the input GPIOL1, for which the commands 0x88, 0x89 and 0x94, 0x95 wait.
  bool gpio_l1 = true;

 private:
  [[nodiscard]] std::size_t length(std::size_t from) const;
  bool execute(std::size_t at, std::size_t size);
  void shift(std::uint8_t code, std::size_t count, Bytes out);
  void bit(std::uint8_t code, bool level, bool* sampled);
  void clocks(std::size_t count);
  void set(std::uint8_t levels, std::uint8_t outputs);
  void toggle(bool high);
  void reply(std::uint8_t byte) { replies_.push_back({byte, now(), never}); }
  [[nodiscard]] std::uint8_t pins();
  [[nodiscard]] double half_ns() const { return (divisor_ + 1.0) * 1e9 / (by_five_ ? 12e6 : fast_); }
  [[nodiscard]] Time now() const { return base_time_ + Time(static_cast<Time::rep>(since_ns_)); }
  void pass(double ns) { since_ns_ += ns; }
  void pass_until(Time time) {
    if (time <= now()) return;
    base_time_ = time;
    since_ns_ = 0;
  }

  struct Reply {
    std::uint8_t byte;
    Time made;
    Time due;  // time at which it must be sent; `never`: with the latency timer
  };

  Wires* wires_;
  double fast_;
  std::vector<std::uint8_t> commands_;
  std::deque<Reply> replies_;
  Time base_time_{};
  double since_ns_ = 0;
  std::uint8_t levels_ = 0xFF, outputs_ = 0, high_levels_ = 0xFF, high_outputs_ = 0;
  std::uint32_t divisor_ = 0;
  bool by_five_ = true;  // after reset the H chips count like the FT2232D [3.8.2]
  bool loopback_ = false;
  bool three_phases_ = false;
  double rate_ = 0;
  unsigned misused_ = 0, unknown_ = 0;
};

}  // namespace absenc::ftdi
