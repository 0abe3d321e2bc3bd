// SPDX-License-Identifier: Apache-2.0
// A drive with a T-format encoder: a timer begins the cycles, the UART's interrupts run the conversations, and the main
// program evaluates the readings. Meanwhile an alarm is cleared and the encoder's memory written.
//
//   drive POSITIONS SINGLETURN MULTITURN LATENCY_MS: number of confirmed readings, the position that each
//   must report, and the latency of the line
#include <array>
#include <new>

#include "absenc/host/carrier.hpp"
#include "absenc/host/cyclic_host.hpp"
#include "absenc/host/first_reading.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/unit.hpp"
#include "firmware/machine/machine.hpp"

namespace absenc::firmware {
namespace {

using machine::print;
using namespace std::chrono_literals;

constexpr Time period = 500us;  // period of the cycles, and of the timer that begins them
constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};
// Highest speed of the axis. It is low, so that a position with an error that the XOR checksum misses is implausible.
constexpr std::uint32_t axis_rpm = 1;

struct Result {
  Error error;
  Reading reading;
};

// Makes the conversation that reads one position.
struct Read {
  Conversation<std::uint8_t>& operator()() { return *new (memory) tformat::ReadPosition(format); }
  alignas(tformat::ReadPosition) std::byte memory[sizeof(tformat::ReadPosition)];
};

// The axis of the drive, used by the interrupts: a position in each cycle, and commands of the main program beside
// them.
class Axis {
 public:
  explicit Axis(Time latency)
      : cycles_(read_, {.period = period, .line = tformat::line_settings, .latency = latency}, period),
        carrier_(*this, latency) {}

  // ---- Called by interrupts

  void start(Time now) { carrier_.start(cycles_, now); }
  void tick(Time now) { carrier_.tick(now); }
  void received(std::uint8_t byte, Time now) { carrier_.received({&byte, 1}, now); }
  void sent(Time now) { carrier_.sent(now); }

  // ---- Called by the carrier

  void begin(const ByteStep& step) {
    ++requests_;
    machine::send(step.out);
  }
  // On a slow line a reading takes several cycles: all of them but the last report Error::busy.
  void result(bool) {
    const host::Cycle& cycle = cycles_.cycle();
    const bool is_over = cycle.kind != host::Cycle::Kind::repeated && cycle.error != Error::busy;
    if (!is_over || count_ == results_.size()) return;
    results_[(first_ + count_++) % results_.size()] = {cycle.error, cycle.reading};
  }

  // ---- Called by the main program

  bool take(Result& result) {
    const machine::InterruptLock lock;
    if (count_ == 0) return false;
    result = results_[first_];
    first_ = (first_ + 1) % results_.size();
    --count_;
    return true;
  }
  void add(host::Service<std::uint8_t>& service) {
    const machine::InterruptLock lock;
    cycles_.add(service);
  }
  [[nodiscard]] static bool is_over(const host::Service<std::uint8_t>& service) {
    const machine::InterruptLock lock;
    return service.is_over();
  }
  [[nodiscard]] std::uint32_t requests() const { return requests_; }
  [[nodiscard]] std::uint32_t silences() const { return carrier_.silences(); }
  [[nodiscard]] std::uint32_t unasked() const { return cycles_.unasked(); }

 private:
  Read read_{};
  host::CyclicHost<std::uint8_t, Read&> cycles_;
  host::Carrier<std::uint8_t, Axis> carrier_;
  std::array<Result, 8> results_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint32_t requests_ = 0;
};

alignas(Axis) std::byte axis_memory[sizeof(Axis)];
Axis* axis = nullptr;

class ReadingCheck {
 public:
  ReadingCheck(std::uint32_t singleturn, std::uint32_t multiturn) : singleturn_(singleturn), multiturn_(multiturn) {}

  // Sets which alarms the encoder may report without failing the check.
  void allow(std::uint32_t alarms) { alarms_ = alarms; }
  void take(const Result& result) {
    if (result.error != Error::none) {
      ++failed_;
      known_ = false;
      return first_.start_again();
    }
    const bool near = first_.confirms(result.reading);
    if ((result.reading.alarms & ~alarms_) != 0 || (known_ && !near)) {
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
  bool known_ = false;  // whether the last reading was plausible; then the position of the next reading must be near it
  std::uint32_t good_ = 0;
  std::uint32_t failed_ = 0;
  std::uint32_t implausible_ = 0;
  std::uint32_t wrong_ = 0;
};

// Checks the result of the next cycle if there is one; otherwise waits for an interrupt.
void take_one(ReadingCheck& check) {
  Result result;
  if (axis->take(result)) {
    check.take(result);
  } else {
    asm volatile("wfi");
  }
}

// Runs a command of the unit beside the positions, up to ten times. Returns whether one of the runs succeeded.
bool command(ReadingCheck& check, std::string_view name, Arguments arguments) {
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
    host::Service<std::uint8_t> service(*conversation, true);
    axis->add(service);
    while (!Axis::is_over(service)) take_one(check);
    if (conversation->error() == Error::none) return true;
    ReadingCheck::print_count(text_of(conversation->error()).name, attempt);
  }
  return false;
}

bool run() {
  const std::uint32_t positions = machine::argument(0, 1000);
  ReadingCheck check(machine::argument(1, 0), machine::argument(2, 0));
  check.allow(tformat::alarms::over_heat);
  while (check.good() < positions / 2) take_one(check);
  const bool cleared = command(check, "clear-alarms", {});
  constexpr std::array<std::int64_t, 3> written{5, 0x42, 2};  // arguments of the command: address, value, page
  const bool stored = command(check, "memory-write", written);
  check.allow(0);
  while (check.good() < positions) take_one(check);
  check.print_count();
  ReadingCheck::print_count("requests", axis->requests());
  ReadingCheck::print_count("silences", axis->silences());
  ReadingCheck::print_count("unasked", axis->unasked());
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
  machine::start_clock(period);
  machine::start_uart();
  {
    const machine::InterruptLock lock;
    axis->start(machine::now());
  }
  machine::end(firmware::run());
}
