// SPDX-License-Identifier: Apache-2.0
// Steps and events (link/step.hpp) on any port that carries a byte stream.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "absenc/core/bytes.hpp"
#include "absenc/link/port.hpp"
#include "absenc/os/descriptor.hpp"
#include "absenc/os/poller.hpp"
#include "absenc/os/waiting.hpp"

namespace absenc::os {

/// Base class of all ports that carry a byte stream. `begin` and `wait` throw Failure, Interrupted or Ended.
class StreamPort : public Port<std::uint8_t> {
 public:
  StreamPort(const StreamPort&) = delete;
  StreamPort& operator=(const StreamPort&) = delete;
  virtual ~StreamPort() = default;

  [[nodiscard]] Time now() final;
  void begin(const Step<std::uint8_t>& step) final;
  [[nodiscard]] Event<std::uint8_t> wait(const Step<std::uint8_t>& step) final;

  /// Returns the delay between the line and this program, which is added to the limits Step::answer and Step::gap.
  [[nodiscard]] Time latency() const { return latency_; }
  void set_latency(Time latency) { latency_ = latency; }
  /// Sets a delay that replaces `latency` for the limit Step::gap in steps whose `expect` is 0, if it is less than
  /// `latency`. Default `never`: no other delay.
  void set_idle_latency(Time latency) { idle_latency_ = latency; }

  /// Sets the send slack: a transfer whose time is at most `slack` ahead is sent at once. Default 0.
  void set_send_slack(Time slack) { send_slack_ = slack; }

  /// Sets the time at which a wait of the port ends with Ended. Default `never`.
  void set_end(Time end) { end_ = end; }

  /// Returns the duration of a character on the line; 0 if it is unknown or there is no line.
  [[nodiscard]] Time character_time() const { return character_time_; }

 protected:
  StreamPort();

  /// Sets the duration of a character, from which the time of `sent` is computed. Default 0.
  void set_character_time(Time time) { character_time_ = time; }
  /// When the characters of a transfer leave.
  enum class Leaving : std::uint8_t {
    after_write,  // from the end of `write_all` on
    from_write,   // from the beginning of `write_all` on
    in_write,     // before `write_all` returns
  };
  /// Sets from when on the time of a transfer is counted. Default `after_write`.
  void set_leaving(Leaving leaving) { leaving_ = leaving; }
  [[nodiscard]] Time end() const { return end_; }
  /// Returns the end of the last transfer or pulse, as computed from the duration of its characters.
  [[nodiscard]] Time sent_at() const { return sent_at_; }

  /// Returns the poller that waits for this port; a derived class adds its descriptors to it.
  [[nodiscard]] Poller& poller() { return poller_; }
  /// Reads bytes from those descriptors of this port that are in `ready`, and returns their number.
  virtual std::size_t read_some(MutableBytes into, std::span<const int> ready) = 0;
  /// Returns how long the bytes that were read last may have waited because this program did not run; 0 if unknown.
  virtual Time lateness() { return {}; }
  virtual void write_all(Bytes bytes) = 0;
  /// `drive` sets a wire, and `change_rate` the bit rate; both throw Failure `unsupported` unless a derived class
  /// overrides them.
  virtual void drive(ExtraWire wire, bool active);
  virtual void change_rate(std::uint32_t rate);
  /// Returns the duration of a pulse: `requested`, unless a derived class overrides this.
  [[nodiscard]] virtual Time pulse_width(ExtraWire wire, Time requested) const;

 private:
  void reach(Time time);
  void pulse(const Step<std::uint8_t>& step);
  void mark_sent(Time at, Time late);
  void transfer(const Step<std::uint8_t>& step);
  void write(std::span<const std::uint8_t> out);

  Poller poller_;
  Time latency_{};
  Time idle_latency_ = never;
  Time send_slack_{};
  Time end_ = never;
  Time character_time_{};
  Leaving leaving_ = Leaving::after_write;

  Waiting<std::uint8_t> waiting_;
  Time sent_at_{};  // time at which the last transfer or pulse ends
  Time sent_late_{};
  bool sent_pending_ = false;  // whether the event `sent` is still to be reported
  std::array<std::uint8_t, 4096> buffer_;
};

/// A stream port on one descriptor that is read and written. Its default latency is 0.
class DescriptorPort : public StreamPort {
 public:
  /// Makes the descriptor non-blocking. `name`, for example "the port /dev/ttyUSB0", is used in messages.
  DescriptorPort(Descriptor descriptor, std::string name);

  [[nodiscard]] const std::string& name() const { return name_; }

 protected:
  [[nodiscard]] int descriptor() const { return descriptor_.get(); }

  /// Writes as many bytes as possible, like write(2).
  virtual std::ptrdiff_t write_some(Bytes bytes);
  /// Reads what is there, like read(2).
  std::ptrdiff_t read_once(MutableBytes into);

  std::size_t read_some(MutableBytes into, std::span<const int> ready) override;
  void write_all(Bytes bytes) override;

  /// Throws the exception for `error`: a value of errno, or 0 for the end of the stream.
  [[noreturn]] void fail(int error) const;

 private:
  Descriptor descriptor_;
  std::string name_;
};

}  // namespace absenc::os
