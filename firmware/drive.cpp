// SPDX-License-Identifier: Apache-2.0
// A drive with a T-format encoder: a timer requests positions, the UART's interrupts run the conversations.
//
//   drive POSITIONS SINGLETURN MULTITURN LATENCY_MS: number of confirmed readings, the position that each
//   must report, and the latency of the line
#include <array>
#include <new>

#include "absenc/host/carrier.hpp"
#include "absenc/host/first_reading.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/unit.hpp"
#include "firmware/machine/machine.hpp"

namespace absenc::firmware {
namespace {

using machine::print;
using namespace std::chrono_literals;

constexpr Time tick_period = 500us;  // one position per tick while the line is free
constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};
// Highest speed of the axis; low, so that undetected errors of the XOR checksum are implausible.
constexpr std::uint32_t axis_rpm = 1;

struct Result {
  Error error;
  Reading reading;
};

// Runs one conversation at a time, from the interrupts.
class Axis {
 public:
  explicit Axis(Time latency) : carrier_(*this, latency) {}

  // ---- Called by interrupts

  void tick(Time now) {
    carrier_.tick(now);
    if (carrier_.is_busy()) return;
    if (ordered_ != nullptr) {
      running_ = ordered_;
      ordered_ = nullptr;
      carrier_.start(*running_, now);
    } else if (positions_requested_ && count_ < results_.size()) {
      running_ = position_ = new (position_memory_) tformat::ReadPosition(format);
      carrier_.start(*position_, now);
    }
  }
  void received(std::uint8_t byte, Time now) {
    if (!carrier_.is_busy()) ++unsolicited_;
    carrier_.received({&byte, 1}, now);
  }
  void sent(Time now) { carrier_.sent(now); }

  // ---- Called by the carrier

  void begin(const ByteStep& step) {
    ++requests_;
    machine::send(step.out);
  }
  void result(bool over) {
    if (!over) return;
    if (running_ == position_) {
      const Reading* const reading = position_->reading();
      results_[(first_ + count_++) % results_.size()] = {position_->error(), reading != nullptr ? *reading : Reading{}};
    }
    running_ = nullptr;
  }

  // ---- Called by the main program

  void request_positions(bool wanted) {
    const machine::InterruptLock lock;
    positions_requested_ = wanted;
  }
  bool take(Result& result) {
    const machine::InterruptLock lock;
    if (count_ == 0) return false;
    result = results_[first_];
    first_ = (first_ + 1) % results_.size();
    --count_;
    return true;
  }
  // Runs a conversation to its end; the conversation then has an error or a result.
  void run(Conversation<std::uint8_t>& conversation) {
    {
      const machine::InterruptLock lock;
      ordered_ = &conversation;
    }
    for (bool over = false; !over;) {
      asm volatile("wfi");
      const machine::InterruptLock lock;
      over = ordered_ == nullptr && running_ != &conversation;
    }
  }
  [[nodiscard]] std::uint32_t requests() const { return requests_; }
  [[nodiscard]] std::uint32_t silences() const { return carrier_.silences(); }
  [[nodiscard]] std::uint32_t unsolicited() const { return unsolicited_; }

 private:
  host::Carrier<std::uint8_t, Axis> carrier_;
  alignas(tformat::ReadPosition) std::byte position_memory_[sizeof(tformat::ReadPosition)];
  tformat::ReadPosition* position_ = nullptr;
  Conversation<std::uint8_t>* running_ = nullptr;
  Conversation<std::uint8_t>* ordered_ = nullptr;
  std::array<Result, 8> results_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint32_t requests_ = 0;
  std::uint32_t unsolicited_ = 0;
  bool positions_requested_ = false;
};

alignas(Axis) std::byte axis_memory[sizeof(Axis)];
Axis* axis = nullptr;

class ReadingCheck {
 public:
  ReadingCheck(std::uint32_t singleturn, std::uint32_t multiturn) : singleturn_(singleturn), multiturn_(multiturn) {}

  void alarms_are(std::uint32_t alarms) { alarms_ = alarms; }
  void take(const Result& result) {
    if (result.error != Error::none) {
      ++failed_;
      known_ = false;
      return first_.start_again();
    }
    const bool near = first_.confirms(result.reading);
    if (result.reading.alarms != alarms_ || (known_ && !near)) {
      ++implausible_;
      known_ = false;
      return first_.start_again();
    }
    known_ = true;
    if (!near) return;
    ++good_;
    if (result.reading.singleturn != singleturn_ || result.reading.multiturn != multiturn_ ||
        !result.reading.multiturn_valid) {
      ++wrong_;
    }
  }
  [[nodiscard]] std::uint32_t good() const { return good_; }
  [[nodiscard]] bool is_right() const { return wrong_ == 0; }
  void print_count() const {
    print_count("good", good_);
    print_count("failed", failed_);
    print_count("implausible", implausible_);
    print_count("wrong", wrong_);
  }
  static void print_count(std::string_view name, std::uint64_t number) {
    print(name);
    print(" ");
    print(number);
    print("\n");
  }

 private:
  host::FirstReading first_{axis_rpm};
  std::uint32_t singleturn_;
  std::uint32_t multiturn_;
  std::uint32_t alarms_ = 0;
  bool known_ = false;  // the last reading was plausible; the next one must be near it
  std::uint32_t good_ = 0;
  std::uint32_t failed_ = 0;
  std::uint32_t implausible_ = 0;
  std::uint32_t wrong_ = 0;
};

void read(ReadingCheck& check, std::uint32_t until) {
  axis->request_positions(true);
  Result result;
  while (check.good() < until) {
    if (axis->take(result)) {
      check.take(result);
    } else {
      asm volatile("wfi");
    }
  }
  axis->request_positions(false);
  while (axis->take(result)) check.take(result);
}

// Tries up to ten times. Returns whether it succeeded.
bool command(std::string_view name, Arguments arguments) {
  alignas(std::max_align_t) static std::array<std::byte, 4096> storage;
  const Unit& unit = tformat::unit;
  Options options;
  if (unit.host_storage > storage.size() ||
      resolve_options(unit, "TS5700N8500", {}, options).kind != OptionError::Kind::none) {
    return false;
  }
  for (unsigned attempt = 0; attempt < 10; ++attempt) {
    auto* const conversation = unit.host(options, *find_command(unit, name), arguments, storage).bytes;
    if (conversation == nullptr) return false;
    axis->run(*conversation);
    if (conversation->error() == Error::none) return true;
    ReadingCheck::print_count(text_of(conversation->error()).name, attempt);
  }
  return false;
}

bool run() {
  const std::uint32_t positions = machine::argument(0, 1000);
  ReadingCheck check(machine::argument(1, 0), machine::argument(2, 0));
  check.alarms_are(tformat::alarms::over_heat);
  read(check, positions / 2);
  const bool cleared = command("clear-alarms", {});
  constexpr std::array<std::int64_t, 3> written{5, 0x42, 2};  // arguments of the command: address, value, page
  const bool stored = command("memory-write", written);
  check.alarms_are(0);
  read(check, positions);
  check.print_count();
  ReadingCheck::print_count("requests", axis->requests());
  ReadingCheck::print_count("silences", axis->silences());
  ReadingCheck::print_count("unasked", axis->unsolicited());
  ReadingCheck::print_count("cleared", cleared ? 1 : 0);
  ReadingCheck::print_count("stored", stored ? 1 : 0);
  ReadingCheck::print_count("stack", machine::stack_used());
  return check.is_right() && cleared && stored;
}

}  // namespace
}  // namespace absenc::firmware

// All interrupts have one priority, so the functions that they call never interrupt each other.
namespace absenc::machine {
void on_tick() { firmware::axis->tick(now()); }
void on_received(std::uint8_t byte) { firmware::axis->received(byte, now()); }
void on_sent() { firmware::axis->sent(now()); }
}  // namespace absenc::machine

int main() {
  using namespace absenc;
  using namespace absenc::firmware;
  axis = new (axis_memory) Axis(std::chrono::milliseconds(machine::argument(3, 20)));
  machine::start_clock(tick_period);
  machine::start_uart();
  machine::end(firmware::run());
}
