// SPDX-License-Identifier: Apache-2.0
// A host port on a bad line in virtual time: one device, whole frames, damaged at random.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/link/silence.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::sim {

/// Probabilities, 0 to 1, of damage to what the host receives: `bit` is per bit, the others are per frame.
struct RoughRates {
  double bit = 0;  ///< probability that a data bit is flipped
  /// Probability that some bits in a row of 2 to 16 bits are flipped.
  double burst = 0;
  /// Probability that a byte or CAN frame arrives twice; on SPI and clocked links one bit arrives twice and the last
  /// bit is lost.
  double doubled = 0;
  /// Probability that another sender sends random bytes during the frame, perhaps past its end.
  double talker = 0;
  double late = 0;  ///< probability of a delay of 10 us to 10 s, each decade equally likely; frames stay in order
};

/// Counts of the requests, the replies and the disturbances of a rough line.
struct RoughCounts {
  std::uint64_t requests = 0;  ///< number of transfers and pulses of the host
  std::uint64_t replies = 0;   ///< number of frames that the device sent to the host
  std::uint64_t damaged = 0;   ///< number of frames that were damaged by any fault except `late`
  std::uint64_t late = 0;      ///< number of frames that were delayed
};

/// A line that damages frames to the host at random. A frame arrives in one piece at its end; use Line for collisions
/// or single characters. On CAN, flipped bits make a frame a `line_error`. Clocked and SPI links have no late frames
/// and only one rate.
template <class Item>
class RoughLine final : public Port<Item> {
 public:
  /// Makes a line to `device`, which must outlive it. The same seed gives the same faults.
  RoughLine(LinkKind kind, LineSettings settings, Machine<Item>& device, std::uint64_t seed);

  /// Sets the probabilities of damage, from the next frame on.
  void set_rates(const RoughRates& rates);

  [[nodiscard]] Time now() override;
  void begin(const Step<Item>& step) override;
  /// Blocks until the next event. Throws std::logic_error if no event can ever end the wait.
  [[nodiscard]] Event<Item> wait(const Step<Item>& step) override;
  /// Advances the time to `until` while the host is not waiting.
  void rest(Time until);
  /// Discards frames that have arrived but were not yet reported to the host.
  void drop();

  /// Marks all frames that the device began to send before now as old.
  void mark();
  /// Returns the send time of each old frame that was reported to the host since `mark`.
  [[nodiscard]] std::span<const Time> old_frames() const { return old_; }
  /// Returns the counts of requests, replies and disturbances so far.
  [[nodiscard]] const RoughCounts& counts() const { return counts_; }
  /// Returns the last request of the host.
  [[nodiscard]] std::span<const Item> request() const { return request_; }
  /// Returns the last reply of the device, as it was before the line damaged it.
  [[nodiscard]] std::span<const Item> reply() const { return out_; }
  /// Returns the number of bits of the last transfer on an SPI or clocked link.
  [[nodiscard]] std::size_t bits() const { return bits_; }

 private:
  // A frame in transit to the host; without items it arrives as a `line_error`.
  struct InTransit {
    Time sent;   // time at which the transmission of the frame began
    Time first;  // arrival time of the first item
    Time at;     // arrival time of the whole frame
    std::vector<Item> items;
    std::size_t bits = 0;  // bidirectional clocked links: number of bits in `items`
  };
  // State of the device's end of the line.
  struct Side {
    Time answer{};
    Time gap{};
    Time timer = never;
    Silence silence;
    bool sending = false;
    Time end{};
  };

  [[nodiscard]] Time due() const;
  void set_rate(std::uint32_t& end, std::uint32_t rate);
  void deliver_request(std::span<const Item> request);
  void run_device();
  void run_until(Time limit);
  void feed(const Event<Item>& event);
  void serve_device();
  bool carry_out(const Step<Item>& step);
  void send(const Step<Item>& step);
  void transfer(const Step<Item>& step);
  void exchange_bits(const Step<Item>& step);
  void enqueue(Time start, Time first, Time end, std::span<const Item> items);
  Event<Item> deliver();
  Event<Item> report(const Event<Item>& event);

  void damage(std::vector<Item>& items);
  void flip(std::vector<Item>& items, std::size_t bit);
  bool flip_bits(std::vector<Item>& items, std::size_t count);
  void double_item(std::vector<Item>& items, std::size_t count);
  void add_other_sender(std::vector<Item>& items);
  void draw_skip();
  [[nodiscard]] Time lateness();

  LinkKind kind_;
  LineSettings settings_;
  Machine<Item>& device_;
  Random random_;
  RoughRates rates_{};
  RoughCounts counts_{};
  std::uint64_t skip_ = ~std::uint64_t{0};  // number of bits that still pass undamaged before the next flipped bit

  Time time_{};
  Time last_event_at_{};
  Time byte_time_;
  std::uint32_t host_rate_;
  std::uint32_t device_rate_;
  Side side_;
  std::vector<Item> request_;
  std::vector<Item> out_;  // items that the device sent in its last frame
  std::uint8_t behind_out_ = 0xFF;
  std::size_t bits_ = 0;
  // Bidirectional clocked links: clocks of the present exchange so far, and clocks of it before the first bit of
  // `out_`.
  std::size_t clocks_ = 0;
  std::size_t driven_from_ = 0;
  bool goes_on_ = false;  // bidirectional clocked links: the next transfer belongs to the same exchange
  // ring buffer: the entries front_ to back_ - 1 are in transit, the others are reused
  std::vector<InTransit> in_transit_;
  std::size_t front_ = 0;
  std::size_t back_ = 0;
  std::vector<Item> reported_items_;
  // State of the host's end of the line.
  bool sent_due_ = false;
  Silence silence_;
  Time mark_{};
  std::vector<Time> old_;
};

extern template class RoughLine<std::uint8_t>;
extern template class RoughLine<CanFrame>;

}  // namespace absenc::sim
