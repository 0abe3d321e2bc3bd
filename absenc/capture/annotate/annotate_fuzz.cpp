// SPDX-License-Identifier: Apache-2.0
// Fuzzes the annotation of characters, for every half-duplex and full-duplex unit.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/protocol/all.hpp"

namespace {

using namespace absenc;
using namespace absenc::capture;

constexpr Tick length = 10;

void require(bool condition) {
  if (!condition) std::abort();
}

struct Check final : AnnotationSink {
  Check(const Unit& one, const Options& its) : unit(one), options(its) {}

  void put(const Annotation& annotation) override {
    require(annotation.begin <= annotation.end);
    require(annotation.contents.reading == nullptr || annotation.error == Error::none);
    const bool is_echo = annotation.remark == Remark::echo;
    bytes += annotation.request.bytes.size() * (is_echo ? 2 : 1) + annotation.reply.bytes.size();
    // A late reply may follow an echo of its request, but an annotation has only one remark, so the echo is not
    // counted.
    if (annotation.remark == Remark::late) hidden += annotation.request.bytes.size();
    if (annotation.error != Error::none || annotation.remark == Remark::cut) return;
    if (annotation.remark == Remark::undocumented) return;
    NoFields nowhere;
    require(unit.decode(options, annotation.request, annotation.reply, nowhere) == Error::none);
  }
  const Unit& unit;
  const Options& options;
  std::size_t bytes = 0;
  std::size_t hidden = 0;  // upper limit of the number of input bytes that no annotation contains
};

void annotate(const Unit& unit, const Options& options, Annotator::Settings settings, Bytes data, bool pauses,
              std::size_t times) {
  Check check(unit, options);
  const auto annotator = std::make_unique<Annotator>(unit, options, settings, check);
  Tick at = length;
  for (std::size_t i = 0; i < times * data.size(); ++i) {
    const std::uint8_t byte = data[i % data.size()];
    const auto channel = static_cast<std::uint8_t>(settings.channel_count == 2 ? byte >> 3 & 1 : 0);
    annotator->put({.begin = at, .end = at + length, .value = byte, .channel = channel, .bad_stop = i % 61 == 60});
    at += length + (pauses && byte % 5 == 0 ? byte % 32 : 0);
  }
  annotator->finish(at);
  const std::size_t all = times * data.size();
  const bool is_complete = check.bytes <= all && check.bytes + check.hidden >= all;
  require(is_complete || all > Exchanges::PendingRequest::capacity);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes bytes(data, size);
  // number that selects whether the line carries requests, replies or both; from the size and the first byte of the
  // input, and another one for each unit
  std::size_t turn = size + data[0];
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::half_duplex && unit->link != LinkKind::full_duplex) continue;
    Options options;
    static_cast<void>(resolve_options(*unit, {}, {}, options));
    Annotator::Settings settings;
    settings.ticks = {.pause = length / 2, .character = length, .turnaround = 3, .limit = 20};
    constexpr std::array lines{Carries::both, Carries::requests, Carries::replies, Carries::detect};
    const Carries carries = lines[turn++ % lines.size()];
    settings.channels[0] = carries;
    settings.begins_silent = carries == Carries::both;
    if (carries == Carries::detect) {
      settings.channels = {Carries::detect, Carries::detect};
      settings.channel_count = 2;
    }
    annotate(*unit, options, settings, bytes, true, 1);
    // Input without pauses takes long, so only one input size in sixteen is tested.
    if (carries == Carries::both && size % 16 == 5) {
      annotate(*unit, options, settings, bytes, false, 1 + 2 * Run::capacity / size);
    }
  }
  return 0;
}
