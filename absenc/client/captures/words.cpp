// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/captures/words.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "absenc/capture/lines/can_line.hpp"
#include "absenc/client/port/diagnosis.hpp"

namespace absenc::client {

using capture::Annotation;
using capture::Remark;
using Kind = Annotation::Kind;

TickClock::TickClock(std::uint64_t ticks_per_second) : ticks_per_second_(ticks_per_second) {
  for (std::uint64_t rate = 1; rate < ticks_per_second && digits_ < 12; rate *= 10) ++digits_;
}

double TickClock::seconds(capture::Tick tick) const {
  return static_cast<double>(tick) / static_cast<double>(ticks_per_second_);
}

Time TickClock::time(capture::Tick ticks) const {
  return has_time() ? Time(std::llround(seconds(ticks) * 1e9)) : Time{};
}

std::string TickClock::text(capture::Tick tick) const {
  return has_time() ? fmt::format("{:.{}f}", seconds(tick), digits_) : fmt::format("{}", tick);
}

std::string TickClock::format() const { return fmt::format("{{:.{}f}}", digits_); }

std::string to_text(const capture::Damage& damage, const TickClock& clock) {
  return fmt::format("{}byte {}, {} {}: {}", damage.note ? "note: " : "the capture is damaged at ", damage.offset,
                     clock.has_time() ? "second" : "tick", clock.text(damage.tick), damage.what);
}

std::string_view name_of(Kind kind) {
  static constexpr std::array<std::string_view, 4> names{"exchange", "request", "reply", "noise"};
  return names[static_cast<std::size_t>(kind)];
}

bool has_fields(const Annotation& annotation) {
  return annotation.error == Error::none && annotation.kind != Kind::noise && annotation.remark != Remark::cut &&
         annotation.remark != Remark::undocumented;
}

std::string message_of(const Unit& unit, const Options& options, const Annotation& annotation) {
  const bool is_bus_error = annotation.remark == Remark::damaged && annotation.reply.can != nullptr;
  const std::string_view remark =
      is_bus_error ? capture::text_of_error(*annotation.reply.can) : text_of(annotation.remark);
  if (annotation.error == Error::none && annotation.composed) return "each of the last exchanges carried a part of it";
  if (annotation.error == Error::none || !remark.empty()) return std::string(remark);
  if (annotation.reply.empty()) return describe(unit.link, Subject::request, annotation.error);
  return sentence_for(unit, options, annotation.error, annotation.request, annotation.reply);
}

}  // namespace absenc::client
