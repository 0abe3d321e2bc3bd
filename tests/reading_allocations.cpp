// SPDX-License-Identifier: Apache-2.0
// Counts the memory allocations of loops that read. After the first readings there must be none, so that a loop in a
// real-time thread never waits for the allocator.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>

#include "absenc/client/emulate.hpp"
#include "absenc/client/encoder.hpp"

namespace {

// Number of memory allocations of this thread.
thread_local std::uint64_t allocations = 0;  // NOLINT: operator new must reach it

}  // namespace

#ifndef ABSENC_COUNTS_MALLOC

// Sanitizers replace malloc, so in builds with them only operator new is counted.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc{};
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

#else

// malloc and its relatives are replaced to count their calls, also those by operator new. The functions __libc_* of
// the GNU C library allocate the memory.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
}

#endif

namespace absenc::client {
namespace {

const std::string slow = "?max_rpm=100";
const std::string patient = slow + "&latency=20000";  // a latency of 20 s: a busy computer answers late
// The buffers of a simulated line grow with its second transfer; a port allocates nothing after the first reading.
int readings_before(const std::string& address) { return address.starts_with("sim:") ? 2 : 1; }
constexpr int last = 1000;

void expect_no_allocation_of_reads(const std::string& address) {
  Encoder encoder = open(address);
  std::uint64_t before = 0;
  for (int number = 1; number <= last; ++number) {
    ASSERT_TRUE(encoder.read().singleturn_valid()) << address;
    if (number == readings_before(address)) before = allocations;
  }
  EXPECT_EQ(allocations - before, 0u) << address;
}

void expect_no_allocation_of_samples(const std::string& address) {
  Encoder encoder = open(address);
  std::uint64_t before = 0;
  int number = 0;
  int gaps = 0;  // number of samples without a reading, which a busy computer may cause
  for (const Sample& sample : encoder.samples({.rate_hz = 2000, .count = last})) {
    if (sample.kind != Sample::Kind::reading) ++gaps;
    if (++number == readings_before(address)) before = allocations;
  }
  EXPECT_EQ(number, last);
  EXPECT_LT(gaps, last / 10);
  EXPECT_EQ(allocations - before, 0u) << address;
}

TEST(ReadingAllocations, AreCounted) {
  const std::uint64_t before = allocations;
  const std::string text(1000, 'x');
  EXPECT_GT(allocations, before) << text.size();
}

TEST(ReadingAllocations, ReadsThroughTerminal) {
  const Emulation encoder = emulate("tformat");
  expect_no_allocation_of_reads(encoder.address() + patient);
}

TEST(ReadingAllocations, SamplesThroughTerminal) {
  const Emulation encoder = emulate("tformat");
  expect_no_allocation_of_samples(encoder.address() + patient);
}

class OfVirtualEncoder : public testing::TestWithParam<const char*> {};

TEST_P(OfVirtualEncoder, Reads) {
  expect_no_allocation_of_reads(std::string("sim:") + GetParam() + slow + "&motion=rpm=60");
}

TEST_P(OfVirtualEncoder, Samples) {
  expect_no_allocation_of_samples(std::string("sim:") + GetParam() + slow + "&motion=rpm=60");
}

INSTANTIATE_TEST_SUITE_P(ReadingAllocations, OfVirtualEncoder, testing::Values("tformat", "biss", "raa38-can"));

}  // namespace
}  // namespace absenc::client
