// SPDX-License-Identifier: Apache-2.0
// The stream decoder of the RAA38S6 against a state machine that looks at one byte after the other, on a clean stream
// and on one with a disturbance every 100 frames. Both hand out every position.
#include <array>
#include <cstdint>
#include <vector>

#include "absenc/protocol/raa38/serial/stream.hpp"
#include "absenc/sim/random.hpp"
#include "bench/ratio.hpp"

namespace {

using namespace absenc;
using namespace absenc::raa38::serial;

constexpr Format format{.bits = 14};
constexpr std::size_t piece = 4096;  // what a port reads at once

// The same rules, written as one writes them first: a state for each byte, and when a frame turns out to be none, its
// bytes but the first once more.
class ByteAtATime {
 public:
  explicit ByteAtATime(const Format& of_stream, std::uint8_t second_byte = fixed_second_byte)
      : format_(of_stream), second_byte_(second_byte) {}

  template <class OnFrame>
  void feed(Bytes bytes, Time at, OnFrame&& on_frame) {
    for (const std::uint8_t byte : bytes) take(byte, at, on_frame);
  }

 private:
  enum class State : std::uint8_t { first, second, data, sum, next_first, next_second };

  template <class OnFrame>
  void take(std::uint8_t byte, Time at, OnFrame& on_frame) {
    bytes_[count_++] = byte;
    switch (state_) {
      case State::first:
        sum_ = byte;
        value_ = 0;
        has_header_ = false;
        state_ = State::second;
        if (byte != header) refuse(at, on_frame);
        return;
      case State::second:
        sum_ = static_cast<std::uint8_t>(sum_ + byte);
        state_ = State::data;
        if (byte != second_byte_) refuse(at, on_frame);
        return;
      case State::data:
        sum_ = static_cast<std::uint8_t>(sum_ + byte);
        value_ = value_ << 8 | byte;
        has_header_ = has_header_ || byte == header;
        if (count_ == format_.frame_bytes() - 1) state_ = State::sum;
        return;
      case State::sum:
        has_header_ = has_header_ || byte == header;
        at_ = at;
        if (byte != sum_ || value_ > low_mask(format_.bits)) return refuse(at, on_frame);
        if (!in_step_ && !has_candidate_) return keep_candidate();
        if (in_step_ && has_header_) {
          state_ = State::next_first;
          return;
        }
        return accept(on_frame);
      case State::next_first:
        state_ = State::next_second;
        if (byte != header) refuse(at, on_frame);
        return;
      case State::next_second:
        if (byte != second_byte_) return refuse(at, on_frame);
        accept(on_frame);
        bytes_[0] = header;
        bytes_[1] = second_byte_;
        count_ = 2;
        sum_ = static_cast<std::uint8_t>(header + second_byte_);
        value_ = 0;
        has_header_ = false;
        state_ = State::data;
        return;
    }
  }

  void keep_candidate() {
    has_candidate_ = true;
    candidate_ = {Error::none, value_, at_};
    candidate_bytes_ = bytes_;
    count_ = 0;
    state_ = State::first;
  }

  template <class OnFrame>
  void accept(OnFrame& on_frame) {
    if (has_candidate_) on_frame(candidate_);
    on_frame(Found{Error::none, value_, at_});
    has_candidate_ = false;
    in_step_ = true;
    count_ = 0;
    state_ = State::first;
  }

  // The candidate's bytes but the first, and then these.
  template <class OnFrame>
  void refuse(Time at, OnFrame& on_frame) {
    if (in_step_) on_frame(Found{.error = Error::bad_checksum});
    std::array<std::uint8_t, 2 * frame_capacity + 2> again{};
    std::size_t size = 0;
    if (has_candidate_) {
      for (std::size_t i = 0; i < format_.frame_bytes(); ++i) again[size++] = candidate_bytes_[i];
    }
    for (std::size_t i = 0; i < count_; ++i) again[size++] = bytes_[i];
    in_step_ = has_candidate_ = false;
    count_ = 0;
    state_ = State::first;
    ++skipped_;
    for (std::size_t i = 1; i < size; ++i) take(again[i], at, on_frame);
  }

  Format format_;
  std::uint8_t second_byte_;
  State state_ = State::first;
  bool in_step_ = false;
  bool has_candidate_ = false;
  bool has_header_ = false;
  std::uint8_t sum_ = 0;
  std::uint32_t value_ = 0;
  std::size_t count_ = 0;
  std::uint64_t skipped_ = 0;
  Time at_{};
  Found candidate_;
  std::array<std::uint8_t, frame_capacity + 2> bytes_{};
  std::array<std::uint8_t, frame_capacity + 2> candidate_bytes_{};
};

std::vector<std::uint8_t> make_stream(bool noisy) {
  sim::Random random(7);
  std::vector<std::uint8_t> wire;
  for (std::uint32_t i = 0; i < 200'000; ++i) {
    const FrameBytes frame = encode_position(format, {i * 7 & 0x3FFF});
    wire.insert(wire.end(), frame.view().begin(), frame.view().end());
    if (noisy && i % 100 == 99) wire.resize(wire.size() - 1 - random.below(4));
  }
  return wire;
}

template <class Decoder>
std::vector<std::uint32_t> positions(const std::vector<std::uint8_t>& wire) {
  std::vector<std::uint32_t> all;
  Decoder decoder(format);
  decoder.feed(wire, Time{}, [&](const Found& found) {
    if (found.error == Error::none) all.push_back(found.singleturn);
  });
  return all;
}

template <class Decoder>
void run(benchmark::State& state, bool noisy) {
  const std::vector<std::uint8_t> wire = make_stream(noisy);
  if (positions<Decoder>(wire) != positions<StreamDecoder>(wire)) return state.SkipWithError("they find other frames");
  for (auto _ : state) {
    Decoder decoder(format);
    std::uint32_t sum = 0;
    for (std::size_t at = 0; at < wire.size(); at += piece) {
      decoder.feed(Bytes(wire).subspan(at, std::min(piece, wire.size() - at)), Time{}, [&](const Found& found) {
        if (found.error == Error::none) sum += found.singleturn;
      });
    }
    benchmark::DoNotOptimize(sum);
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(static_cast<std::size_t>(state.iterations()) * wire.size()));
}

void raa38_clean(benchmark::State& state) { run<StreamDecoder>(state, false); }
void raa38_clean_reference(benchmark::State& state) { run<ByteAtATime>(state, false); }
void raa38_noisy(benchmark::State& state) { run<StreamDecoder>(state, true); }
void raa38_noisy_reference(benchmark::State& state) { run<ByteAtATime>(state, true); }
BENCHMARK(raa38_clean);
BENCHMARK(raa38_clean_reference);
BENCHMARK(raa38_noisy);
BENCHMARK(raa38_noisy_reference);

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
