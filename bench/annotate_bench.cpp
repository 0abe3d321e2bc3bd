// SPDX-License-Identifier: Apache-2.0
// Measures the time per character of a loaded T-format line, from characters to exchanges.
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/protocol/tformat/frame.hpp"
#include "absenc/protocol/tformat/unit.hpp"

namespace absenc::capture {
namespace {

constexpr Tick character = 80;  // duration of a character in samples, at 20 million samples per second
constexpr Tick turnaround = 60;
constexpr Tick pause = 64;

struct Count final : AnnotationSink {
  void put(const Annotation& annotation) override {
    if (annotation.error == Error::none && annotation.contents.reading != nullptr)
      positions += annotation.contents.reading->singleturn;
    ++count;
  }
  std::uint64_t count = 0;
  std::uint64_t positions = 0;
};

std::vector<Character> line(std::size_t exchanges) {
  std::vector<Character> characters;
  Tick at = 1000;
  const auto send = [&](Bytes bytes) {
    for (const std::uint8_t byte : bytes) {
      characters.push_back({.begin = at, .end = at + character, .value = byte});
      at += character;
    }
  };
  for (std::size_t i = 0; i < exchanges; ++i) {
    send(tformat::encode_request({}));
    at += turnaround;
    send(tformat::encode_reply({.singleturn = static_cast<std::uint32_t>(i * 37 % 131072),
                                .multiturn = static_cast<std::uint32_t>(i % 65536),
                                .encoder_id = 0x11}));
    at += pause;
  }
  return characters;
}

void annotate(benchmark::State& state) {
  const std::vector<Character> characters = line(10'000);
  Options options;
  static_cast<void>(resolve_options(tformat::unit, {}, {}, options));
  Annotator::Settings settings;
  settings.ticks = line_ticks(tformat::unit, 8, 20'000'000);
  for (auto _ : state) {
    Count count;
    const auto annotator = std::make_unique<Annotator>(tformat::unit, options, settings, count);
    for (const Character& one : characters) annotator->put(one);
    annotator->finish(characters.back().end + pause);
    if (count.count != 10'000) state.SkipWithError("exchanges are missing");
    benchmark::DoNotOptimize(count.positions);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(characters.size()));
}
BENCHMARK(annotate);

}  // namespace
}  // namespace absenc::capture

BENCHMARK_MAIN();
