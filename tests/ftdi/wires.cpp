// SPDX-License-Identifier: Apache-2.0
#include "tests/ftdi/wires.hpp"

#include <algorithm>
#include <ostream>
#include <stdexcept>
#include <utility>

#include "absenc/core/bit_view.hpp"

namespace absenc::ftdi {

using namespace std::chrono_literals;

EncoderWires::EncoderWires(LinkKind kind, const LineSettings& settings, Machine<std::uint8_t>& device)
    : kind_(kind), settings_(settings), device_(&device) {
  if (!carries_bits(kind)) throw std::invalid_argument("only clocked encoders are on these wires");
  run(Time{});
}

void EncoderWires::change(Time at, std::uint8_t levels, std::uint8_t outputs) {
  const bool is_output = (outputs & Mpsse::in) != 0;
  if (was_output_ && !is_output) {
    left_ = (left_ & Mpsse::in) != 0;
    left_at_ = at;
  }
  if (is_output) left_ = levels & Mpsse::in;
  was_output_ = is_output;

  const bool driving = (levels & outputs & direction) != 0;
  if (std::exchange(drives_, driving) != driving) {
    if (records_) recorded_direction_.push_back({at, driving});
    if (!driving) turn(at);
  }
  const bool out = (levels & Mpsse::out) != 0;
  if (std::exchange(out_, out) != out && records_) recorded_out_.push_back({at, out});
  // A pin that is no output is pulled up.
  const bool high = ((outputs & Mpsse::clock) == 0 || (levels & Mpsse::clock) != 0) != fault.clock_swapped;
  if (clock_ == high) return;
  pass(at);  // a rest of the clock up to this edge may have ended the transfer
  clock_ = high;
  if (records_) recorded_clock_.push_back({at, high});
  if (!fault.no_clock) high ? rises(at) : falls(at);
}

bool EncoderWires::data(Time at) {
  pass(at);
  // The chip's pull-up of 75 kOhm needs longer than this for the pin and its wire (DS_FT232H, DC characteristics).
  constexpr Time pull_up_time = 1500ns;
  if (fault.no_transceiver) return left_at_ != Time::min() && at - left_at_ < pull_up_time ? left_ != 0 : true;
  if (fault.stuck) return *fault.stuck;
  if (drives_) return true;  // the receiver is off while the driver is on
  const Time sent = at - fault.delay;
  const auto later = std::upper_bound(levels_.begin(), levels_.end(), sent,
                                      [](Time time, const Change& one) { return time < one.at; });
  const bool level = std::prev(later)->level;
  return fault.flip_every != 0 && ++sampled_ % fault.flip_every == 0 ? !level : level;
}

void EncoderWires::pass(Time now) {
  const Time rest = 8 * half_ + 2us;
  if (selected_ && clock_ && now - last_edge_ > rest) deselect(last_edge_);
  if (now >= timer_) {
    timer_ = never;
    feed({.kind = ByteEvent::Kind::timer, .at = now});
  }
}

void EncoderWires::falls(Time at) { fell_at_ = last_edge_ = at; }

void EncoderWires::rises(Time at) {
  const Time low = at - fell_at_;
  last_edge_ = at;
  // Much longer than a clock pulse: the host holds the clock low, which a BiSS encoder reads as a bit of a control
  // frame.
  const bool held = kind_ == LinkKind::clocked && half_ > Time{} && low > 3 * half_ + 2us;
  if (held) {
    if (selected_) deselect(fell_at_);
    held_low_ = true;
    return;
  }
  if (!selected_) select(fell_at_, 2 * low);
  half_ = low;
  if (drives_) {
    if (host_bits_.empty()) host_from_ = clocks_;
    host_bits_.push_back(out_);
  }
  ++clocks_;
  set_level(at);
}

void EncoderWires::select(Time at, Time period) {
  selected_ = true;
  clocks_ = 0;
  driven_from_ = 0;
  driven_.clear();
  behind_driven_ = true;
  width_ = {};
  if (!records_) levels_.erase(levels_.begin(), levels_.end() - 1);
  feed({.kind = ByteEvent::Kind::selected, .at = at, .held_low = std::exchange(held_low_, false), .width = period});
}

void EncoderWires::deselect(Time at) {
  selected_ = false;
  // Until then the device drives the line low; on a bidirectional line it sends its last bit for a whole period.
  const Time held = kind_ == LinkKind::clocked_bidirectional ? std::max(width_, 2 * half_) : width_;
  if (!levels_.back().level) levels_.push_back({at + held, true});
  feed({.kind = ByteEvent::Kind::sent, .at = at, .bits = clocks_});
}

// Passes the host's bits on; the bits of the device follow.
void EncoderWires::turn(Time at) {
  if (host_bits_.empty()) return;
  std::vector<std::uint8_t> items((host_bits_.size() + 7) / 8);
  for (std::size_t i = 0; i < host_bits_.size(); ++i) {
    if (host_bits_[i]) items[i / 8] |= static_cast<std::uint8_t>(0x80u >> i % 8);
  }
  const std::size_t bits = host_bits_.size();
  host_bits_.clear();
  driven_from_ = clocks_;
  driven_.clear();
  behind_driven_ = true;
  feed({.kind = ByteEvent::Kind::received, .at = at, .items = items, .bits = bits, .clocks_before = host_from_});
}

void EncoderWires::feed(const ByteEvent& event) {
  device_->feed(event);
  run(event.at);
}

void EncoderWires::run(Time now) {
  for (;;) {
    const ByteStep step = device_->next(now);
    switch (step.kind) {
      case ByteStep::Kind::transfer:
        driven_.assign(step.out.begin(), step.out.end());
        behind_driven_ = step.behind_out() != 0;
        width_ = step.width;
        break;
      case ByteStep::Kind::wait:
        timer_ = step.at > now ? step.at : never;
        return;
      case ByteStep::Kind::done:
        timer_ = never;
        return;
      default:
        break;
    }
  }
}

bool EncoderWires::level_after_edges() const {
  const std::size_t before = kind_ == LinkKind::clocked ? std::size_t{settings_.idle_clocks} : driven_from_ + 1;
  if (clocks_ < before) return true;
  const std::size_t bit = clocks_ - before;
  return bit < 8 * driven_.size() ? BitView{driven_, 8 * driven_.size()}[bit] : behind_driven_;
}

void EncoderWires::set_level(Time at) {
  while (levels_.back().at > at) levels_.pop_back();  // the planned release of the line
  levels_.push_back({at, level_after_edges()});
}

void EncoderWires::write_vcd(std::ostream& file) const {
  struct Line {
    Time at;
    char wire;
    bool level;
  };
  std::vector<Line> lines;
  for (const Change& one : recorded_clock_) lines.push_back({one.at, '!', one.level});
  for (const Change& one : recorded_direction_) lines.push_back({one.at, '#', one.level});
  for (const Change& one : recorded_out_) lines.push_back({one.at, '>', one.level});
  for (const Change& one : levels_) {
    if (one.at != Time::min()) lines.push_back({one.at + fault.delay, '<', one.level});
  }
  std::stable_sort(lines.begin(), lines.end(), [](const Line& one, const Line& other) { return one.at < other.at; });
  file << "$timescale 1 ns $end\n$scope module line $end\n$var wire 1 ! clock $end\n$var wire 1 \" data $end\n"
          "$var wire 1 # direction $end\n$upscope $end\n$enddefinitions $end\n#0\n1!\n1\"\n0#\n";
  if (recorded_clock_.empty()) return;
  const Time begin = recorded_clock_.front().at - 100us;  // the line rests before the first edge
  bool last = true, out = false, in = true, drives = false;
  for (const Line& one : lines) {
    if (one.wire == '>') out = one.level;
    if (one.wire == '<') in = one.level;
    if (one.wire == '#') drives = one.level;
    if (one.at < begin) continue;  // the levels at which the port left the pins when it opened
    const auto put = [&](char wire, bool level) {
      file << '#' << (one.at - begin).count() << '\n' << level << wire << '\n';
    };
    if (one.wire == '!' || one.wire == '#') put(one.wire, one.level);
    const bool data = drives ? out : in;
    if (std::exchange(last, data) != data) put('"', data);
  }
  file << '#' << (lines.back().at - begin + 100us).count() << '\n';
}

}  // namespace absenc::ftdi
