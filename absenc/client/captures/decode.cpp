// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/decode.hpp"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "absenc/client/captures/annotation_rows.hpp"
#include "absenc/client/captures/run.hpp"
#include "absenc/client/captures/sequence_watch.hpp"
#include "absenc/client/captures/words.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::client {

struct Decoded::Parts {
  /// A batch of rows, which the decoding thread passes to the thread of the caller.
  using Batch = std::vector<Row>;
  struct Stopped {};

  Parts(const std::string& path, std::string_view protocol, const DecodeChoices& choices)
      : unit(require_unit(protocol)),
        run(unit, require_options(unit, choices.model, choices.options), {path, choices}),
        clock(run.ticks_per_second()),
        rows(unit, run.options(), clock) {}

  ~Parts() { stop(); }

  void stop() {
    {
      const std::lock_guard lock(mutex);
      stopped = true;
    }
    changed.notify_all();
  }

  // ---- Functions of the decoding thread

  struct Sink final : capture::AnnotationSink {
    Sink(Parts& decoded, const Options& of_capture) : parts(decoded), options(of_capture) {}
    void put(const capture::Annotation& annotation) override {
      parts.rows.fill(annotation, options, parts.next_row());
      if (parts.filled == batch_size) parts.hand_over();
    }
    Parts& parts;
    const Options& options;
  };

  void decode_all() {
    try {
      const Options& options = run.settle_options();
      Sink sink(*this, options);
      SequenceWatch watched(sink);
      const CaptureOutcome outcome = run.run(watched, [this](capture::Tick) {
        const std::lock_guard lock(mutex);
        if (stopped) throw Stopped{};
      });
      notes = outcome.notes;
      for (const capture::Damage& damage : outcome.damages) notes.push_back(to_text(damage, clock));
      hand_over();
    } catch (const Stopped&) {
    } catch (...) {
      const std::exception_ptr failure = std::current_exception();
      try {
        if (filled > 0) hand_over();  // passes the rows that were decoded before the failure on to the caller
      } catch (const Stopped&) {
      }
      const std::lock_guard lock(mutex);
      thrown = failure;
    }
    const std::lock_guard lock(mutex);
    ended = true;
    changed.notify_all();
  }

  Row& next_row() {
    if (filled == batch.size()) batch.push_back({rows.columns(), {}});
    return batch[filled++];
  }

  void hand_over() {
    batch.resize(filled);
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return stopped || ready.size() < most_ready; });
    if (stopped) throw Stopped{};
    ready.push_back(std::move(batch));
    batch.clear();
    if (!used.empty()) batch = std::move(used.back());
    if (!used.empty()) used.pop_back();
    filled = 0;
    changed.notify_all();
  }

  // ---- Functions of the caller's thread

  /// Returns the next row; null at the end. Throws exceptions of the decoding, and Cancelled.
  const Row* take() {
    if (++at < taken.size()) return &taken[at];
    std::unique_lock lock(mutex);
    if (!taken.empty()) used.push_back(std::move(taken));
    taken.clear();
    changed.wait(lock, [&] { return ended || stopped || !ready.empty(); });
    if (stopped) throw Cancelled{};
    if (ready.empty()) {
      if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
      return nullptr;
    }
    taken = std::move(ready.front());
    ready.pop_front();
    at = 0;
    changed.notify_all();
    return taken.empty() ? nullptr : &taken[0];
  }

  static constexpr std::size_t batch_size = 256;
  static constexpr std::size_t most_ready = 8;

  const Unit& unit;
  CaptureRun run;
  TickClock clock;
  AnnotationRows rows;
  // sentences about damage and properties of the capture; complete when decoding has ended
  std::vector<std::string> notes;

  // Members used by the decoding thread only:
  Batch batch;
  std::size_t filled = 0;
  // Members used by the caller's thread only:
  Batch taken;
  std::size_t at = 0;

  std::mutex mutex;  // the mutex guards the following members except `changed` and `thread`
  std::condition_variable changed;
  std::deque<Batch> ready;
  std::vector<Batch> used;  // batches of rows that the caller has read, whose memory is used again for new rows
  std::exception_ptr thrown;
  bool ended = false;
  bool stopped = false;

  std::jthread thread;  // declared last, because the thread uses all other members of this object
};

Decoded::Decoded(const std::string& path, std::string_view protocol, const DecodeChoices& choices)
    : parts_(std::make_unique<Parts>(path, protocol, choices)) {}
Decoded::Decoded(Decoded&&) noexcept = default;
Decoded& Decoded::operator=(Decoded&&) noexcept = default;
Decoded::~Decoded() = default;

Decoded::Iterator Decoded::begin() {
  parts_->thread = std::jthread([parts = parts_.get()] { parts->decode_all(); });
  advance();
  return Iterator(*this);
}

void Decoded::cancel() { parts_->stop(); }
void Decoded::advance() { row_ = parts_->take(); }

std::span<const Column> Decoded::columns() const { return parts_->rows.columns(); }
const std::vector<std::string>& Decoded::notes() const { return parts_->notes; }

}  // namespace absenc::client
