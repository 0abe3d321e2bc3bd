// SPDX-License-Identifier: Apache-2.0
// CAN through an adapter on a serial port that speaks the ASCII protocol of Lawicel (link/slcan.hpp), and the other end
// of that: an adapter on a pseudo-terminal, behind which virtual nodes are.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absenc/link/slcan.hpp"
#include "absenc/os/frame_port.hpp"

namespace absenc::os {

/// Frames and answers as lines over a port of bytes.
class SlcanLine : public FramePort {
 protected:
  explicit SlcanLine(std::shared_ptr<Port<std::uint8_t>> bytes) : bytes_(std::move(bytes)) {}

  void write(Bytes text);
  void collect(Time deadline) final;
  /// Collects until something came, or the deadline; whether something did.
  bool hears_until(Time deadline);
  /// When something is to happen though nothing comes; `never`: no time.
  [[nodiscard]] virtual Time due() const { return never; }
  /// It may have come; whether something was pushed.
  virtual bool reach(Time) { return false; }
  /// A line without its CR, a refusal, or garbage came.
  virtual void take(slcan::LineReader::Found found, Bytes line, Time at) = 0;

 private:
  std::shared_ptr<Port<std::uint8_t>> bytes_;
  slcan::LineReader reader_;
  bool collected_ = false;
};

/// The adapter is opened at the bit rate of `settings`, and closed at the end.
class SlcanPort final : public SlcanLine {
 public:
  /// `name` as in "/dev/ttyACM0", for messages. Throws Failure: `bad_rate` when the adapter has no such bit rate or
  /// refuses it, `system` when it refuses to open.
  SlcanPort(std::shared_ptr<Port<std::uint8_t>> bytes, std::string name, const LineSettings& settings);
  ~SlcanPort() override;

  /// What could be better about the adapter, one sentence each.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  enum class Answer : std::uint8_t { none, accepted, refused };

  void send(const CanFrame& frame) override;
  void apply(const LineSettings& settings) override;
  void take(slcan::LineReader::Found found, Bytes line, Time at) override;
  Answer ask(std::string_view command);
  void settle();

  std::string name_;
  std::vector<std::string> notes_;
  bool asking_ = false;  // what comes answers a command, not a frame
  Answer answer_ = Answer::none;
  unsigned garbage_ = 0;
};

/// Plays the adapter: what a host sends reaches the device that is driven on this port, and the other way round, while
/// the host has opened it at the bit rate that the device has. Each frame takes its time on the bus: those that a host
/// sends at once wait for it, as many as an adapter keeps, and the others are refused (BEL).
class SlcanAdapter final : public SlcanLine {
 public:
  SlcanAdapter(std::shared_ptr<Port<std::uint8_t>> bytes, const LineSettings& settings)
      : SlcanLine(std::move(bytes)), device_rate_(settings.rate) {}

  /// Frames that were lost because the host had the adapter closed or at another bit rate.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  /// Frames that were refused because too many waited for the bus.
  [[nodiscard]] std::uint64_t overflowed() const { return overflowed_; }
  /// Lines that are no command.
  [[nodiscard]] std::uint64_t garbage() const { return garbage_; }

 private:
  void send(const CanFrame& frame) override;
  void apply(const LineSettings& settings) override { device_rate_ = settings.rate; }
  void take(slcan::LineReader::Found found, Bytes line, Time at) override;
  [[nodiscard]] Time due() const override { return waiting_.empty() ? never : bus_free_; }
  bool reach(Time now) override;
  void take_frame(Bytes line, Time at);
  [[nodiscard]] Time duration(const CanFrame& frame) const;
  bool execute(Bytes line);
  void answer(std::string_view text);
  [[nodiscard]] bool connected() const { return open_ && rate_ == device_rate_; }

  std::uint32_t device_rate_;
  std::uint32_t rate_ = 0;  // as the host has set it; 0: not yet
  bool open_ = false;
  bool listen_only_ = false;
  bool with_time_ = false;
  std::deque<CanFrame> waiting_;  // of the host; the first is on the bus
  Time bus_free_{};               // when that, or the last one, has ended
  std::uint64_t lost_ = 0;
  std::uint64_t overflowed_ = 0;
  std::uint64_t garbage_ = 0;
};

}  // namespace absenc::os
