// SPDX-License-Identifier: Apache-2.0
// Measures the decoding of every unit that has a valid reply vector, compared with a bitwise CRC of the same bytes.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "absenc/core/crc.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/protocol/vector_check.hpp"
#include "bench/ratio.hpp"

namespace {

using namespace absenc;

[[noreturn]] void fail(const Unit& unit, const Vector& vector) {
  std::fprintf(stderr, "%s: vector %s does not decode\n", std::string(unit.id).c_str(), std::string(vector.id).c_str());
  std::exit(1);
}

Options options_of(const Unit& unit, const Vector& vector) {
  std::vector<OptionText> settings;
  for (std::string_view text = vector.options; !text.empty();) {
    const std::string_view one = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), one.size() + 1));
    settings.push_back({one.substr(0, one.find('=')), one.substr(one.find('=') + 1)});
  }
  Options options;
  if (resolve_options(unit, {}, settings, options).kind != OptionError::Kind::none) fail(unit, vector);
  return options;
}

/// A frame of a reference vector in the form of its link; it owns the data to which `frame()` refers.
struct OwnedFrame {
  OwnedFrame(const Unit& unit, Bytes text) : bytes(text.begin(), text.end()) {
    if (carries_bits(unit.link)) {
      const auto packed = bits_of_text(text);
      bits = packed.size();
      bytes.assign(packed.bytes().begin(), packed.bytes().end());
    } else if (unit.link == LinkKind::can && !text.empty()) {
      can = can_frame_of_text(text);
      has_can = true;
      bytes.assign(can.bytes().begin(), can.bytes().end());
    }
  }
  [[nodiscard]] Frame frame() const { return {.bytes = bytes, .bits = bits, .can = has_can ? &can : nullptr}; }

  std::vector<std::uint8_t> bytes;
  std::size_t bits = 0;
  CanFrame can{};
  bool has_can = false;
};

struct Sample {
  Options options;
  OwnedFrame request;
  OwnedFrame reply;
};

std::vector<Sample> samples_of(const Unit& unit) {
  std::vector<Sample> samples;
  for (const Vector& vector : unit.vectors) {
    if (vector.error != Error::none || vector.reply.empty()) continue;
    samples.push_back({options_of(unit, vector), {unit, vector.request}, {unit, vector.reply}});
  }
  return samples;
}

struct Sink final : FieldSink {
  void put(const FieldValue& value) override { benchmark::DoNotOptimize(value.number); }
};

void decode(benchmark::State& state, const Unit& unit) {
  const std::vector<Sample> samples = samples_of(unit);
  Sink sink;
  std::size_t i = 0;
  for (auto _ : state) {
    const Sample& sample = samples[i++ % samples.size()];
    if (unit.decode(sample.options, sample.request.frame(), sample.reply.frame(), sink) != Error::none) {
      state.SkipWithError("a good frame is refused");
      break;
    }
  }
}

void decode_many(benchmark::State& state, const Unit& unit) {
  const std::vector<Sample> samples = samples_of(unit);
  std::vector<std::unique_ptr<std::byte[]>> storage;
  std::vector<FrameDecoder*> decoders;
  for (const Sample& sample : samples) {
    storage.push_back(std::make_unique<std::byte[]>(unit.decoder_storage));
    decoders.push_back(unit.decoder(sample.options, {storage.back().get(), unit.decoder_storage}));
  }
  Sink sink;
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t at = i++ % samples.size();
    if (decoders[at]->decode(samples[at].request.frame(), samples[at].reply.frame(), sink) != Error::none) {
      state.SkipWithError("a good frame is refused");
      break;
    }
  }
}

void reference(benchmark::State& state, const Unit& unit) {
  constexpr CrcParameters crc{16, 0x8005, 0xFFFF, true, true, 0};
  const std::vector<Sample> samples = samples_of(unit);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(crc_bitwise(crc, samples[i++ % samples.size()].reply.bytes));
}

}  // namespace

int main(int argc, char** argv) {
  for (const Unit* unit : all_units()) {
    const std::string name(unit->id);
    if (samples_of(*unit).empty()) continue;
    benchmark::RegisterBenchmark(name.c_str(), [unit](benchmark::State& state) { decode(state, *unit); });
    benchmark::RegisterBenchmark((name + "_reference").c_str(),
                                 [unit](benchmark::State& state) { reference(state, *unit); });
    if (unit->decoder == nullptr) continue;
    benchmark::RegisterBenchmark((name + "_many").c_str(),
                                 [unit](benchmark::State& state) { decode_many(state, *unit); });
    benchmark::RegisterBenchmark((name + "_many_reference").c_str(),
                                 [unit](benchmark::State& state) { reference(state, *unit); });
  }
  return absenc::bench::run_with_ratios(argc, argv);
}
