// SPDX-License-Identifier: Apache-2.0
// Steps and events (link/step.hpp) over anything that carries a stream of bytes: the timing all such ports share,
// and the port over one file descriptor.
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

/// Every function throws Failure, Interrupted (os/signals.hpp) or Ended.
///
/// A transfer begins at `at`, never earlier; `begin` blocks until then. `timer` is reported when the `at` of a wait
/// lay ahead of the last event, or of the last call of `now`.
class StreamPort : public Port<std::uint8_t> {
 public:
  StreamPort(const StreamPort&) = delete;
  StreamPort& operator=(const StreamPort&) = delete;
  virtual ~StreamPort() = default;

  [[nodiscard]] Time now() final;
  void begin(const Step<std::uint8_t>& step) final;
  [[nodiscard]] Event<std::uint8_t> wait(const Step<std::uint8_t>& step) final;

  /// What the way between the line and this program adds to the answer and gap limits of a step.
  [[nodiscard]] Time latency() const { return latency_; }
  void set_latency(Time latency) { latency_ = latency; }
  /// The same to the gap limit where nothing more is due (`expect` 0), when that is less. `never` at first.
  void set_idle_latency(Time latency) { idle_latency_ = latency; }

  /// A transfer due within `slack` is sent at once: for a virtual encoder, whose line takes no time. 0 at first.
  void set_send_slack(Time slack) { send_slack_ = slack; }

  /// From `end` on the port throws Ended. `never` at first.
  void set_end(Time end) { end_ = end; }

  /// The time of a character on the line; 0: not known, or there is no line, as behind a pseudo-terminal.
  [[nodiscard]] Time character_time() const { return character_time_; }

 protected:
  StreamPort();

  /// Line time of a character: `sent` is computed from it, because tcdrain blocks for milliseconds. 0 at first: a
  /// transfer has left when it is written.
  void set_character_time(Time time) { character_time_ = time; }
  /// Whoever is at the other end may read what is written, and answer it, before the call that writes it has returned:
  /// `sent` is told with the time before that call, not after it. false at first.
  void set_read_at_once(bool yes) { read_at_once_ = yes; }
  [[nodiscard]] Time end() const { return end_; }
  /// End of the last transfer.
  [[nodiscard]] Time sent_at() const { return sent_at_; }

  /// Where bytes come from: to be filled by the derived port.
  [[nodiscard]] Poller& poller() { return poller_; }
  /// What has come on these descriptors, as far as it fits; 0 when that was not bytes.
  virtual std::size_t read_some(MutableBytes into, std::span<const int> ready) = 0;
  /// How long this program may have been kept from looking at what `read_some` brought; 0: not known.
  virtual Time lateness() { return {}; }
  virtual void write_all(Bytes bytes) = 0;
  /// Both throw `unsupported` unless overridden.
  virtual void drive(ExtraWire wire, bool active);
  virtual void change_rate(std::uint32_t rate);
  /// How long a pulse lasts: as asked, unless overridden.
  [[nodiscard]] virtual Time pulse_width(ExtraWire wire, Time asked) const;

 private:
  void reach(Time time);
  void pulse(const Step<std::uint8_t>& step);
  void mark_sent(Time at, Time late);
  void transfer(const Step<std::uint8_t>& step);

  Poller poller_;
  Time latency_{};
  Time idle_latency_ = never;
  Time send_slack_{};
  Time end_ = never;
  Time character_time_{};
  bool read_at_once_ = false;

  Waiting<std::uint8_t> waiting_;
  Time sent_at_{};             // end of the last transfer
  Time sent_late_{};           // it may have ended so much earlier
  bool sent_pending_ = false;  // `sent` is to be reported
  std::array<std::uint8_t, 4096> buffer_;
};

/// A stream port over one descriptor that reads and writes. Its latency is 0 at first.
class DescriptorPort : public StreamPort {
 public:
  /// `name` as in "the port /dev/ttyUSB0", for messages. Makes the descriptor non-blocking.
  DescriptorPort(Descriptor descriptor, std::string name);

  [[nodiscard]] const std::string& name() const { return name_; }

 protected:
  [[nodiscard]] int descriptor() const { return descriptor_.get(); }

  /// As write(2).
  virtual ssize_t write_some(Bytes bytes);

  std::size_t read_some(MutableBytes into, std::span<const int> ready) override;
  void write_all(Bytes bytes) override;

  /// Throws what `error`, a value of errno, or 0 at the end of the file, means of this port.
  [[noreturn]] void fail(int error) const;

 private:
  Descriptor descriptor_;
  std::string name_;
};

}  // namespace absenc::os
