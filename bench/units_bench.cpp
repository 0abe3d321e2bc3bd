// SPDX-License-Identifier: Apache-2.0
// The decoder that everybody uses, Unit::decode, over the good replies of every unit's vectors with the options of
// each.
#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "tests/kit/frames.hpp"

namespace {

using namespace absenc;

struct Reply {
  Options options;
  kit::Held request;
  kit::Held reply;
};

// Nothing is kept: what a sink does with it is not the decoder's time.
struct Sink final : FieldSink {
  void put(const FieldValue& value) override { benchmark::DoNotOptimize(value.number); }
  void put_reading(const Reading& reading) override { benchmark::DoNotOptimize(reading.singleturn); }
};

std::vector<Reply> replies_of(const Unit& unit) {
  std::vector<Reply> replies;
  for (const Vector& vector : unit.vectors) {
    const std::optional<Options> options = kit::options_of(unit, vector.options);
    if (!options || vector.reply.empty() || vector.error != Error::none) continue;
    replies.push_back({*options, kit::held(unit, vector.request), kit::held(unit, vector.reply)});
  }
  return replies;
}

void decode(benchmark::State& state, const Unit& unit) {
  const std::vector<Reply> replies = replies_of(unit);
  Sink sink;
  std::size_t next = 0;
  for (auto _ : state) {
    const Reply& one = replies[next];
    next = next + 1 == replies.size() ? 0 : next + 1;
    benchmark::DoNotOptimize(unit.decode(one.options, one.request.frame(), one.reply.frame(), sink));
  }
}

}  // namespace

int main(int argc, char** argv) {
  for (const Unit* unit : all_units()) {
    benchmark::RegisterBenchmark(std::string(unit->id).c_str(),
                                 [unit](benchmark::State& state) { decode(state, *unit); });
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
