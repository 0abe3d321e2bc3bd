// SPDX-License-Identifier: Apache-2.0
#include "absenc/sim/faults.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <string>
#include <utility>

namespace absenc::sim {

FaultRate parse_fault(std::string_view text) {
  const auto equals = text.find('=');
  const std::string_view name = text.substr(0, equals);
  const std::string quoted = "fault `" + std::string(text) + "`: ";
  const auto found = std::find(fault_names.begin(), fault_names.end(), name);
  if (found == fault_names.end()) {
    std::string known;
    for (const std::string_view kind : fault_names) known += (known.empty() ? "" : ", ") + std::string(kind);
    throw std::invalid_argument(quoted + "unknown kind; known are " + known + "; for example `drop=0.01`");
  }
  const std::string_view value = equals == std::string_view::npos ? std::string_view{} : text.substr(equals + 1);
  double rate = -1;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), rate);
  if (error != std::errc{} || end != value.data() + value.size() || !(rate >= 0 && rate <= 1)) {
    throw std::invalid_argument(quoted + "the rate must be a number from 0 to 1, for example `" + std::string(name) +
                                "=0.01`");
  }
  return {static_cast<FaultKind>(found - fault_names.begin()), rate};
}

FaultyDevice::FaultyDevice(Machine<std::uint8_t>& device, const FaultRates& rates, std::uint64_t seed)
    : device_(device), rates_(rates), random_(seed) {}

void FaultyDevice::feed(const Event<std::uint8_t>& event) {
  using Kind = Event<std::uint8_t>::Kind;
  switch (event.kind) {
    case Kind::received:
      // Bytes that arrive shortly after ignored ones are the end of the same request, and are ignored too.
      if (ignores_line_ || event.at - last_ignored_at_ <= 2 * device_gap_) {
        last_ignored_at_ = event.at;
      } else {
        receive(event);
      }
      return;
    case Kind::line_error:
      if (ignores_line_) return;
      break;
    case Kind::silence:
      if (silent_until_ != never) return;  // the device waits for the `sent` event of a suppressed reply
      break;
    case Kind::sent:
      ignores_line_ = false;
      break;
    case Kind::timer:
      if (silent_until_ <= event.at) {
        silent_until_ = never;
        device_.feed({.kind = Kind::sent, .at = event.at});
        return;
      }
      if (device_timer_ > event.at) return;
      break;
    case Kind::selected:
    case Kind::triggered:
      break;
  }
  device_.feed(event);
}

void FaultyDevice::receive(const Event<std::uint8_t>& event) {
  constexpr std::size_t longest_request = 256;
  received_.assign(event.items.begin(), event.items.end());
  for (std::uint8_t& byte : received_) {
    if (request_.size() < longest_request) request_.push_back(byte);
    if (strikes(FaultKind::request_corrupt)) {
      flip_bits({&byte, 1}, random_);
      request_damaged_ = true;
    }
  }
  Event<std::uint8_t> changed = event;
  changed.items = received_;
  device_.feed(changed);
}

Step<std::uint8_t> FaultyDevice::next(Time now) {
  using Kind = Step<std::uint8_t>::Kind;
  for (;;) {
    Step<std::uint8_t> step = device_.next(now);
    if (step.kind == Kind::transfer) {
      const Time begin = std::max(step.at, now);
      if (damage(step, now)) return step;
      if (begin > now) {
        silent_until_ = begin;
      } else {
        device_.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
      }
      continue;
    }
    if (step.kind == Kind::wait) {
      device_gap_ = std::max(device_gap_, step.gap);
      device_timer_ = step.at > now ? step.at : never;
      const Time due = std::min(device_timer_, silent_until_);
      step.at = due == never ? Time{} : due;
    }
    return step;
  }
}

bool FaultyDevice::strikes(FaultKind kind) {
  if (!random_.chance(rates_[kind])) return false;
  ++counts_[static_cast<std::size_t>(kind)];
  return true;
}

// Applies random faults to `reply`. Returns false if no reply is to be sent.
bool FaultyDevice::damage(Step<std::uint8_t>& reply, Time now) {
  const std::vector<std::uint8_t> request = std::exchange(request_, {});
  const auto faults_before = counts_;
  reply_.assign(reply.out.begin(), reply.out.end());
  if (strikes(FaultKind::silence)) reply_.clear();
  if (!reply_.empty()) {
    if (strikes(FaultKind::repeat)) reply_.insert(reply_.end(), reply.out.begin(), reply.out.end());
    // On a clocked link the faults corrupt, truncate and drop hit only bytes that the host clocks out.
    const auto taken = [&] { return reply.bits == 0 ? reply_.size() : std::min(reply_.size(), (reply.bits + 7) / 8); };
    if (strikes(FaultKind::corrupt)) flip_bits(std::span(reply_).first(taken()), random_);
    const std::size_t each = rates_.character_bytes;
    const auto characters = [&] { return (taken() + each - 1) / each; };
    if (characters() > 1 && strikes(FaultKind::truncate)) reply_.resize(each * (1 + random_.below(characters() - 1)));
    if (strikes(FaultKind::drop)) {
      const auto first = reply_.begin() + static_cast<std::ptrdiff_t>(each * random_.below(characters()));
      reply_.erase(first, std::min(first + static_cast<std::ptrdiff_t>(each), reply_.end()));
    }
    if (strikes(FaultKind::garbage)) {
      for (std::size_t more = each * (1 + random_.below(4u)); more > 0; --more) {
        reply_.insert(reply_.begin(), static_cast<std::uint8_t>(random_.below(256)));
      }
    }
    if (!request.empty() && strikes(FaultKind::echo)) reply_.insert(reply_.begin(), request.begin(), request.end());
    if (!reply_.empty() && strikes(FaultKind::delay)) {
      reply.at = std::max(reply.at, now) + rates_.delay;
      ignores_line_ = true;
    }
  }
  if (counts_ != faults_before) ++damaged_replies_;
  const bool damaged = std::exchange(request_damaged_, false);
  if (reply_.size() > reply.out.size() || (damaged && !reply_.empty())) ignores_line_ = true;
  reply.out = reply_;
  return !reply_.empty();
}

void flip_bits(std::span<std::uint8_t> bytes, Random& random) {
  std::array<std::size_t, 3> flipped{};
  const std::size_t count = 1 + random.below(flipped.size());
  for (std::size_t i = 0; i < count;) {
    const std::size_t bit = random.below(bytes.size() * 8);
    if (std::find(flipped.begin(), flipped.begin() + static_cast<std::ptrdiff_t>(i), bit) !=
        flipped.begin() + static_cast<std::ptrdiff_t>(i)) {
      continue;
    }
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << (bit % 8)));
    flipped[i++] = bit;
  }
}

}  // namespace absenc::sim
