// SPDX-License-Identifier: Apache-2.0
// A bad line as the host's port: one device behind it, whole frames in virtual time, damaged at random on the way.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absenc/link/port.hpp"
#include "absenc/link/silence.hpp"
#include "absenc/sim/random.hpp"

namespace absenc::sim {

/// How often what is sent to the host is damaged on the way, 0 to 1: `bit` each data bit by itself, all others each
/// frame. What a device itself does wrong is FaultRates, and stands between the device and this line.
struct RoughRates {
  double bit = 0;      // is flipped
  double burst = 0;    // 2 to 16 bits in a row: the first and last are flipped, those between by chance
  double doubled = 0;  // one byte comes twice; where the host is the clock a bit, and the last one is lost
  double talker = 0;   // somebody else sends random bytes over it, or beyond its end: what comes is the AND of both
  double late = 0;     // it comes 10 us to 10 s late, each decade as often, and what follows not before it
};

struct RoughCounts {
  std::uint64_t requests = 0;  // transfers and pulses of the host
  std::uint64_t replies = 0;   // frames sent to it
  std::uint64_t damaged = 0;   // of them, by any fault but `late`
  std::uint64_t late = 0;
};

/// Faster than a Line, which moves characters one by one: whoever needs collisions or single characters takes that. A
/// frame comes at its end, in one piece; between ends at different rates as a `line_error`. On CAN the controllers
/// check: a damaged frame is a `line_error`. Clocked and SPI links have no late frames, and one rate.
template <class Item>
class RoughLine final : public Port<Item> {
 public:
  /// `device` must outlive the line. The same seed gives the same faults.
  RoughLine(LinkKind kind, LineSettings settings, Machine<Item>& device, std::uint64_t seed);

  /// From the next frame on.
  void set_rates(const RoughRates& rates);

  [[nodiscard]] Time now() override;
  void begin(const Step<Item>& step) override;
  /// A wait for something that can never happen is a std::logic_error.
  [[nodiscard]] Event<Item> wait(const Step<Item>& step) override;
  /// Nobody listens until then.
  void rest(Time until);
  /// What has come and was not told is forgotten, as by a host that takes the newest only.
  void drop();

  /// What is sent before now is old from now on.
  void mark();
  /// Since when each old frame that the host was told since `mark` had been under way.
  [[nodiscard]] std::span<const Time> old_frames() const { return old_; }
  [[nodiscard]] const RoughCounts& counts() const { return counts_; }
  /// The last request and, of any length, what was sent for it before it was damaged.
  [[nodiscard]] std::span<const Item> request() const { return request_; }
  [[nodiscard]] std::span<const Item> reply() const { return out_; }
  /// Of the last transfer on a clocked link.
  [[nodiscard]] std::size_t bits() const { return bits_; }

 private:
  // On its way to the host. No items: characters that cannot be read.
  struct Held {
    Time sent;   // when it was begun
    Time first;  // when its first item is there
    Time at;     // when it is whole
    std::vector<Item> items;
  };
  // The device's side of the line.
  struct Side {
    Time answer{};
    Time gap{};
    Time timer = never;
    Silence silence;
    bool sending = false;
    Time end{};
  };

  [[nodiscard]] bool driven() const { return kind_ == LinkKind::spi || kind_ == LinkKind::clocked; }
  [[nodiscard]] Time due() const;
  void set_rate(std::uint32_t& end, std::uint32_t rate);
  void let_hear(std::span<const Item> request);
  void run_device();
  void run_until(Time limit);
  void feed(const Event<Item>& event);
  void serve_device();
  bool carry_out(const Step<Item>& step);
  void send(const Step<Item>& step);
  void transfer(const Step<Item>& step);
  void hold(Time start, Time first, Time end, std::span<const Item> items);
  Event<Item> deliver();
  Event<Item> tell(const Event<Item>& event);

  void damage(std::vector<Item>& items);
  void flip(std::vector<Item>& items, std::size_t bit);
  bool flip_bits(std::vector<Item>& items, std::size_t count);
  void double_one(std::vector<Item>& items, std::size_t count);
  void talk_over(std::vector<Item>& items);
  void draw_skip();
  [[nodiscard]] Time lateness();

  LinkKind kind_;
  LineSettings settings_;
  Machine<Item>& device_;
  Random random_;
  RoughRates rates_{};
  RoughCounts counts_{};
  std::uint64_t skip_ = ~std::uint64_t{0};  // good bits before the next that is flipped

  Time time_{};
  Time told_{};
  Time character_;
  std::uint32_t host_rate_;
  std::uint32_t device_rate_;
  Side side_;
  std::vector<Item> request_;
  std::vector<Item> out_;  // of the device
  std::uint8_t behind_out_ = 0xFF;
  std::size_t bits_ = 0;
  std::vector<Held> held_;  // from front_ to back_; what was told is used again
  std::size_t front_ = 0;
  std::size_t back_ = 0;
  std::vector<Item> told_items_;
  // The host's side.
  bool sent_due_ = false;
  Silence silence_;
  Time mark_{};
  std::vector<Time> old_;
};

extern template class RoughLine<std::uint8_t>;
extern template class RoughLine<CanFrame>;

}  // namespace absenc::sim
