// SPDX-License-Identifier: Apache-2.0
// A drive with a BiSS encoder on an SPI controller with DMA, as in docs/drive.md.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <new>

#include "absenc/host/carrier.hpp"
#include "absenc/host/cyclic_host.hpp"
#include "absenc/protocol/biss/host.hpp"
#include "absenc/protocol/biss/unit.hpp"

using namespace absenc;
using namespace std::chrono_literals;

Time now();  // you write this: returns the time since start, from a counter that never stops
// you write this: starts receiving the bytes over SPI by DMA, and returns at once
void spi_receive(MutableBytes bytes);
void set_clock(bool high);  // you write this: sets the level of the clock line while the SPI controller rests

struct Axis {
  // The encoder has 19 bits and a clock of 5 MHz. It needs 1 us for a position; its timeout adapts to the clock.
  static constexpr biss::Format format{.ma_khz = 5000, .timeout = biss::Timeout::adaptive(), .latency = 1us};
  static constexpr Time period = 31'250ns;  // period of the current loop

  struct Read {
    Conversation<std::uint8_t>& operator()() { return *new (memory) biss::ReadPosition(format); }
    alignas(biss::ReadPosition) std::byte memory[sizeof(biss::ReadPosition)];
  };
  Read read;
  host::CyclicHost<std::uint8_t, Read&> cycles{
      read, {.period = period, .line = biss::line_settings, .carried = biss::unit.services_carry_position}, period};
  host::Carrier<std::uint8_t, Axis> carrier{*this};
  std::array<std::uint8_t, 32> samples{};
  std::size_t bytes = 0;
  host::Cycle last{};

  // The carrier calls `hold_clock`, `begin` and `result`. The clock's level in the pause is a bit for the encoder.
  void hold_clock(bool low) { set_clock(!low); }
  void begin(const ByteStep& step) {
    // besides transfers, the only kind of step is a change of the clock rate, which is not needed here
    if (step.kind != ByteStep::Kind::transfer) return;
    bytes = std::min((step.bits + 7) / 8, samples.size());
    spi_receive(MutableBytes(samples).first(bytes));
  }
  void result(bool) { last = cycles.cycle(); }
} axis;

// A register access that runs while positions are read. The main program starts it, and waits until it is over.
struct RegisterAccess {
  alignas(std::max_align_t) std::array<std::byte, 4608> storage{};
  host::Service<std::uint8_t>* start(const Options& options, Arguments address_bank_count) {
    auto* const read =
        biss::unit.host(options, *find_command(biss::unit, "memory-read"), address_bank_count, storage).bytes;
    if (read == nullptr) return nullptr;
    auto* const service = new (&service_memory) host::Service<std::uint8_t>(*read);
    axis.cycles.add(*service);  // call this while the interrupts that use the carrier are disabled
    return service;
  }
  alignas(host::Service<std::uint8_t>) std::byte service_memory[sizeof(host::Service<std::uint8_t>)];
};

void start() { axis.carrier.start(axis.cycles, now()); }
void timer_tick() { axis.carrier.tick(now()); }  // call this when the time axis.carrier.due() is reached
void dma_complete() {
  set_clock(true);
  axis.carrier.sent(now());
  axis.carrier.received(Bytes(axis.samples).first(axis.bytes), now());
}
