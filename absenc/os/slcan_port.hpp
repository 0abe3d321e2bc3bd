// SPDX-License-Identifier: Apache-2.0
// CAN over an adapter with the ASCII protocol of Lawicel (link/slcan.hpp), real or simulated.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absenc/link/slcan.hpp"
#include "absenc/os/frame_port.hpp"

namespace absenc::os {

/// Base class of both ends of a CAN adapter's text lines over a byte port: it reads frames and replies.
class SlcanLine : public FramePort {
 protected:
  explicit SlcanLine(std::shared_ptr<Port<std::uint8_t>> bytes) : bytes_(std::move(bytes)) {}

  void write(Bytes text);
  void collect(Time deadline) final;
  /// Calls `collect`. Returns whether a line, a refusal or garbage was received.
  bool receives_until(Time deadline);
  /// Returns the time of the next event that needs no received bytes; `never` if there is none.
  [[nodiscard]] virtual Time due() const { return never; }
  /// Pushes the event of `due()` if its time is reached. Returns whether an event was pushed.
  virtual bool reach(Time) { return false; }
  /// Handles a received line without its CR, a refusal by the adapter, or garbage.
  virtual void handle_line(slcan::LineReader::LineEvent line_event, Bytes line, Time at) = 0;

 private:
  std::shared_ptr<Port<std::uint8_t>> bytes_;
  slcan::LineReader reader_;
  bool received_any_ = false;
};

/// A port on a CAN adapter, which is opened at the bit rate of `settings` and closed at the end.
class SlcanPort final : public SlcanLine {
 public:
  /// `name`, for example "/dev/ttyACM0", is used in messages. Throws Failure, and as `bytes` does.
  SlcanPort(std::shared_ptr<Port<std::uint8_t>> bytes, std::string name, const LineSettings& settings);
  ~SlcanPort() override;

  /// Returns hints to the user about the adapter, one sentence each.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  enum class Reply : std::uint8_t { none, accepted, refused };

  void send(const CanFrame& frame) override;
  void apply(const LineSettings& settings) override;
  void handle_line(slcan::LineReader::LineEvent line_event, Bytes line, Time at) override;
  Reply request(std::string_view command);
  void settle();

  std::string name_;
  std::vector<std::string> notes_;
  // Whether a command is outstanding: the next empty line or refusal is the adapter's reply to that command.
  bool awaiting_reply_ = false;
  Reply reply_ = Reply::none;
  unsigned garbage_ = 0;
};

/// A simulated CAN adapter: the host sends it text lines, and the virtual encoder uses it as its CAN port.
class SlcanAdapter final : public SlcanLine {
 public:
  SlcanAdapter(std::shared_ptr<Port<std::uint8_t>> bytes, const LineSettings& settings)
      : SlcanLine(std::move(bytes)), device_rate_(settings.rate) {}

  /// Returns the number of frames of the device that were lost because the host had closed the adapter or set another
  /// bit rate.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  /// Returns the number of frames of the host that were refused because the queue was full.
  [[nodiscard]] std::uint64_t overflowed() const { return overflowed_; }
  /// Returns how often the host sent something other than a known command or a valid frame.
  [[nodiscard]] std::uint64_t garbage() const { return garbage_; }

 private:
  void send(const CanFrame& frame) override;
  void apply(const LineSettings& settings) override { device_rate_ = settings.rate; }
  void handle_line(slcan::LineReader::LineEvent line_event, Bytes line, Time at) override;
  [[nodiscard]] Time due() const override { return waiting_.empty() ? never : bus_free_; }
  bool reach(Time now) override;
  void queue_frame(Bytes line, Time at);
  [[nodiscard]] Time duration(const CanFrame& frame) const;
  bool execute(Bytes line);
  void send_reply(std::string_view text);
  [[nodiscard]] bool connected() const { return open_ && rate_ == device_rate_; }

  std::uint32_t device_rate_;
  std::uint32_t rate_ = 0;  // bit rate set by the host; 0: the host has set none
  bool open_ = false;
  bool listen_only_ = false;
  bool with_time_ = false;
  std::deque<CanFrame> waiting_;  // queued frames of the host; the first frame is being sent on the bus
  Time bus_free_{};               // time at which the frame on the bus, or the last one, ends
  std::uint64_t lost_ = 0;
  std::uint64_t overflowed_ = 0;
  std::uint64_t garbage_ = 0;
};

}  // namespace absenc::os
