// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/transfer_port.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "absenc/core/bit_view.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

TransferPort::TransferPort(LinkKind kind) : kind_(kind) {
  if (!host_clocks(kind)) throw std::invalid_argument("this port exchanges bytes or clocks bits");
}

Time TransferPort::now() { return waiting_.now(); }

void TransferPort::begin(const ByteStep& step) {
  switch (step.kind) {
    case ByteStep::Kind::transfer:
      // SIGINT and SIGTERM are checked here, because a caller that reads without pauses never waits.
      if (interrupted() && take_interrupt()) throw Interrupted{};
      received_.items.clear();
      received_.bits = 0;
      received_.idle_low = false;
      if (kind_ == LinkKind::clocked_bidirectional && step.rate != 0) change_rate(step.rate);
      exchange(step, received_);
      used_rate_ = set_rate();
      sent_pending_ = true;
      received_pending_ = !received_.items.empty();
      waiting_.silence.sent(received_.at);
      if (received_pending_) waiting_.silence.received(received_.at);
      break;
    case ByteStep::Kind::pulse:
      throw Failure(Failure::Kind::unsupported, "a clock has no trigger and clear wires beside it: use a serial port");
    case ByteStep::Kind::configure:
      change_rate(step.rate);
      break;
    case ByteStep::Kind::wait:
    case ByteStep::Kind::emit:
    case ByteStep::Kind::done:
      break;
  }
}

ByteEvent TransferPort::wait(const ByteStep& step) {
  waiting_.begin(step);
  if (std::exchange(sent_pending_, false)) {
    return waiting_.report({.kind = ByteEvent::Kind::sent, .at = received_.at, .late = received_.late});
  }
  if (std::exchange(received_pending_, false)) {
    return waiting_.report({.kind = ByteEvent::Kind::received,
                            .at = received_.at,
                            .items = received_.items,
                            .bits = kind_ == LinkKind::clocked_bidirectional ? received_.bits : 0,
                            .idle_low = received_.idle_low,
                            .width = received_.sampled_after});
  }
  sleep_until(waiting_.due());
  return waiting_.take_due(std::max(os::now(), waiting_.due())).value();
}

void TransferPort::extract(Bytes samples, std::size_t idle, std::size_t bits, TransferResult& received) {
  const BitView clocked{samples, samples.size() * 8};
  received.idle_low = idle > 0 && clocked.load(0, static_cast<unsigned>(idle)) == 0;
  received.bits = bits;
  received.items.resize((bits + 7) / 8);
  for (std::size_t i = 0; i < received.items.size(); ++i) {
    const auto count = static_cast<unsigned>(std::min<std::size_t>(8, bits - 8 * i));
    received.items[i] = static_cast<std::uint8_t>(clocked.load(idle + 8 * i, count) << (8 - count));
  }
}

}  // namespace absenc::os
