// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/tap.hpp"

#include <atomic>
#include <cstddef>
#include <utility>

#include "absenc/client/captures/annotation_rows.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/tap/tap_run.hpp"

namespace absenc::client {

struct Tap::Parts final : capture::AnnotationSink {
  Parts(const std::string& place, const TapChoices& choices)
      : run(place, choices), rows(settled(run), run.options(), clock) {}

  static const Unit& settled(TapRun& run) {
    if (run.settle([](const std::string&) {})) return run.unit();
    if (run.outcome().end == Receiver::ReceiveEnd::interrupted) throw os::Interrupted{};
    if (!run.outcome().problem.empty()) throw Failure(run.outcome().problem);
    throw Failure(run.received_bytes() == 0
                      ? "nothing came: does the drive ask the encoder?"
                      : "bytes came, but no protocol explains them: say which it is, or the baud rate");
  }

  void put(const capture::Annotation& annotation) override {
    if (filled == ready.size()) ready.push_back({rows.columns(), {}});
    rows.fill(annotation, run.options(), ready[filled++]);
  }

  const Row* take() {
    while (++at >= filled) {
      if (is_over) return end();
      filled = at = 0;
      is_over = !run.advance();
      --at;  // `at` is then one before the first new row, because the loop condition increments it
    }
    return &ready[at];
  }

  const Row* end() {
    if (is_cancelled) throw Cancelled{};
    const TapOutcome outcome = run.outcome();
    if (outcome.end == Receiver::ReceiveEnd::interrupted) throw os::Interrupted{};
    if (!outcome.problem.empty()) throw Failure(outcome.problem);
    return nullptr;
  }

  TapRun run;
  TickClock clock{arrival_ticks_per_second};
  AnnotationRows rows;
  std::vector<Row> ready;  // rows that wait for the caller; each call of `advance` fills the list anew
  std::size_t filled = 0;
  std::size_t at = 0;
  bool is_over = false;
  std::atomic<bool> is_cancelled = false;
};

Tap::Tap(const std::string& place, const TapChoices& choices) : parts_(std::make_unique<Parts>(place, choices)) {}
Tap::Tap(Tap&&) noexcept = default;
Tap& Tap::operator=(Tap&&) noexcept = default;
Tap::~Tap() = default;

Tap::Iterator Tap::begin() {
  parts_->run.begin(*parts_);
  --parts_->at;
  advance();
  return Iterator(*this);
}

void Tap::advance() { row_ = parts_->take(); }

void Tap::cancel() {
  parts_->is_cancelled = true;
  parts_->run.cancel();
}

std::string_view Tap::protocol() const { return parts_->run.unit().id; }
std::vector<std::string> Tap::options() const { return settings_for(parts_->run.unit(), parts_->run.options()); }
std::span<const Column> Tap::columns() const { return parts_->rows.columns(); }

}  // namespace absenc::client
