// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/decode.hpp"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "absenc/client/captures/run.hpp"
#include "absenc/client/captures/sequence_watch.hpp"
#include "absenc/client/captures/words.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/core/angle.hpp"

namespace absenc::client {

namespace {

using capture::Annotation;

/// The places of the columns before those of the unit's fields.
enum At : std::size_t { at_begin, at_end, at_kind, at_request, at_reply, at_turnaround, at_position, first_field };

std::vector<Column> columns_of(const Unit& unit, const Options& options, bool has_time) {
  const bool is_linear = unit.resolution(options).unit_um > 0;
  const Type wire = unit.link == LinkKind::can || unit.link == LinkKind::clocked ? Type::text : Type::bytes;
  const Type time = has_time ? Type::real : Type::uint64;
  std::vector<Column> columns{
      {has_time ? "time_s" : "tick", has_time ? "s" : "", time, "when its first bit began"},
      {has_time ? "end_s" : "end_tick", has_time ? "s" : "", time, "when its last bit ended"},
      {"kind", "", Type::text, "exchange, request, reply or noise"},
      {"request", "", wire, "what was asked"},
      {"reply", "", wire, "what came back"},
      {"turnaround_us", "us", Type::real, "from the end of the request to the begin of its reply"},
      {is_linear ? "position_mm" : "angle_deg", is_linear ? "mm" : "deg", Type::real, "where the encoder stands"}};
  for (const FieldInfo& field : unit.fields) columns.push_back(column_of(field));
  columns.push_back({"error", "", Type::text, "why the exchange is not good"});
  columns.push_back({"message", "", Type::text, "the same in words, and what to try"});
  return columns;
}

}  // namespace

struct Decoded::Work {
  /// Some rows at a time: each goes from thread to thread.
  using Batch = std::vector<Row>;
  struct Stopped {};

  Work(const std::string& path, std::string_view protocol, const DecodeChoices& choices)
      : unit(require_unit(protocol)),
        run(unit, require_options(unit, choices.model, choices.options), {path, choices}),
        clock(run.ticks_per_second()),
        columns(columns_of(unit, run.options(), clock.has_time())) {}

  ~Work() { stop(); }

  void stop() {
    {
      const std::lock_guard lock(mutex);
      stopped = true;
    }
    changed.notify_all();
  }

  // ---- In the thread that decodes

  struct Sink final : capture::AnnotationSink {
    Sink(Work& for_work, const Options& of_capture) : work(for_work), options(of_capture) {}
    void put(const Annotation& annotation) override {
      work.fill(annotation, options, work.next_row());
      if (work.filled == batch_size) work.hand_over();
    }
    Work& work;
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
      const std::lock_guard lock(mutex);
      thrown = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    ended = true;
    changed.notify_all();
  }

  Row& next_row() {
    if (filled == batch.size()) batch.push_back({columns, {}});
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

  [[nodiscard]] Value wire(const Frame& frame) const {
    if (frame.empty()) return {};
    if (columns[at_request].type == Type::bytes) return ByteVector(frame.bytes.begin(), frame.bytes.end());
    return to_wire_text(unit.link, frame);
  }

  void fill(const Annotation& annotation, const Options& options, Row& row) const {
    row.columns = columns;
    row.values.assign(columns.size(), {});
    const bool has_time = clock.has_time();
    const auto time = [&](capture::Tick tick) { return has_time ? Value(clock.seconds(tick)) : Value(tick); };
    row.values[at_begin] = time(annotation.begin);
    row.values[at_end] = time(annotation.end);
    row.values[at_kind] = std::string(name_of(annotation.kind));
    row.values[at_request] = wire(annotation.request);
    row.values[at_reply] = wire(annotation.reply);
    if (annotation.turnaround && has_time) {
      row.values[at_turnaround] = static_cast<double>(clock.time(*annotation.turnaround).count()) / 1000;
    }
    const std::string message = message_of(unit, options, annotation);
    if (!message.empty()) row.values.back() = message;
    if (annotation.error != Error::none) row.values[columns.size() - 2] = std::string(text_of(annotation.error).name);
    if (!has_fields(annotation)) return;
    fill_fields(annotation.contents, row.values);
    if (annotation.contents.reading == nullptr || annotation.contents.reading->singleturn_bits == 0) return;
    const Reading& reading = *annotation.contents.reading;
    if (!reading.ready || !reading.singleturn_valid()) return;
    row.values[at_position] = reading.unit_um > 0 ? micrometres(reading.singleturn, reading.unit_um) / 1000
                                                  : degrees(reading.singleturn, reading.singleturn_bits);
  }

  // A unit's own field, or one of the same name.
  [[nodiscard]] std::size_t place_of(const FieldInfo& info) const {
    const std::span<const FieldInfo> fields = unit.fields;
    std::size_t place = 0;
    while (place < fields.size() && &fields[place] != &info) ++place;
    if (place < fields.size()) return place;
    place = 0;
    while (place < fields.size() && fields[place].name != info.name) ++place;
    return place;
  }

  void fill_fields(const capture::Contents& contents, std::vector<Value>& values) const {
    for (const FieldValue& field : contents.fields) {
      const std::size_t place = place_of(*field.info);
      if (place == unit.fields.size()) continue;
      const Validity validity =
          contents.reading == nullptr ? Validity::valid : validity_of(*field.info, *contents.reading);
      values[first_field + place] = validity == Validity::valid     ? value_of(field)
                                    : validity == Validity::unknown ? Value(Unknown{})
                                                                    : Value(Invalid{});
    }
    if (contents.reading != nullptr) fill_alarms(*contents.reading, values);
  }

  // Also those that this reply does not carry, as far as earlier ones have reported them.
  void fill_alarms(const Reading& reading, std::vector<Value>& values) const {
    for (const Flags& flags : alarms_of(unit, reading)) {
      const std::size_t place = place_of(*flags.field);
      if (place != unit.fields.size()) values[first_field + place] = value_of(flags);
    }
  }

  // ---- In the thread that takes the rows

  /// Null at the end. Throws what the other thread threw, behind the rows that came before.
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
  std::vector<Column> columns;
  std::vector<std::string> notes;  // when it has ended

  // Of the thread that decodes.
  Batch batch;
  std::size_t filled = 0;
  // Of the thread that takes.
  Batch taken;
  std::size_t at = 0;

  std::mutex mutex;  // guards what follows
  std::condition_variable changed;
  std::deque<Batch> ready;
  std::vector<Batch> used;  // to be filled again
  std::exception_ptr thrown;
  bool ended = false;
  bool stopped = false;

  std::jthread thread;  // last: it uses all of the others
};

Decoded::Decoded(const std::string& path, std::string_view protocol, const DecodeChoices& choices)
    : work_(std::make_unique<Work>(path, protocol, choices)) {}
Decoded::Decoded(Decoded&&) noexcept = default;
Decoded& Decoded::operator=(Decoded&&) noexcept = default;
Decoded::~Decoded() = default;

Decoded::Iterator Decoded::begin() {
  work_->thread = std::jthread([work = work_.get()] { work->decode_all(); });
  advance();
  return Iterator(*this);
}

void Decoded::cancel() { work_->stop(); }
void Decoded::advance() { row_ = work_->take(); }

std::span<const Column> Decoded::columns() const { return work_->columns; }
const std::vector<std::string>& Decoded::notes() const { return work_->notes; }

}  // namespace absenc::client
