// SPDX-License-Identifier: Apache-2.0
// Implements the reader of Saleae's binary export, with layouts as in "Binary Export Format - Version 0" and "Binary
// and CSV Export Formats - 2025 Update" (version 1).
#include "absenc/capture/files/saleae.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "absenc/capture/files/parsed_reader.hpp"

namespace absenc::capture {

namespace {

constexpr std::string_view magic = "<SALEAE>";
constexpr double ticks_per_second = 1e12;
// Limit for the times in a file, 92 days: well within the range of signed 64-bit ticks.
constexpr double longest_seconds = 8e6;
constexpr std::size_t transitions_at_once = 1 << 13;

template <class Unsigned>
Unsigned load(const std::uint8_t* bytes) {
  Unsigned value = 0;
  for (std::size_t i = sizeof(Unsigned); i-- > 0;) value = static_cast<Unsigned>(value << 8 | bytes[i]);
  return value;
}

double load_double(const std::uint8_t* bytes) { return std::bit_cast<double>(load<std::uint64_t>(bytes)); }

bool is_time(double seconds) { return std::isfinite(seconds) && std::abs(seconds) < longest_seconds; }

std::int64_t to_picoseconds(double seconds) { return std::llround(seconds * ticks_per_second); }

/// The transitions in the file of one channel, of which some are read ahead.
class TransitionStream {
 public:
  TransitionStream(SaleaeChannel channel, Damages& damages)
      : name_(std::move(channel.name)), source_(std::move(channel.source)), damages_(&damages) {
    std::array<std::uint8_t, 16> header{};
    if (source_->read(0, header) != header.size() ||
        !std::equal(magic.begin(), magic.end(), header.begin(), [](char a, std::uint8_t b) { return a == char(b); })) {
      throw OpenError(name_ + " is no binary export of Saleae Logic 2: it does not begin with <SALEAE>");
    }
    version_ = load<std::uint32_t>(&header[8]);
    if (version_ > 1) {
      throw OpenError(name_ + " has version " + std::to_string(static_cast<std::int32_t>(version_)) +
                      " of Saleae's binary export; 0 and 1 are known: export it as CSV");
    }
    if (load<std::uint32_t>(&header[12]) != 0) {
      throw OpenError(name_ + " holds analog values; only digital channels are decoded");
    }
    position_ = header.size();
    chunks_ = 1;
    if (version_ == 1) {
      std::array<std::uint8_t, 8> count{};
      if (source_->read(position_, count) != count.size()) throw OpenError(name_ + " ends in its header");
      chunks_ = load<std::uint64_t>(count.data());
      position_ += count.size();
      if (chunks_ == 0) throw OpenError(name_ + " holds no data: its export has no chunk");
    }
    if (!begin_chunk()) throw OpenError(name_ + " " + damage_.what);
    before_ = state_;
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool before() const { return before_; }
  [[nodiscard]] std::int64_t begin() const { return begin_; }
  [[nodiscard]] std::int64_t end() const { return end_; }
  [[nodiscard]] bool exhausted() const { return remaining_ == 0 && chunks_ == 0; }
  [[nodiscard]] bool damaged() const { return !damage_.what.empty(); }
  /// Returns the time of the last good transition, or of the chunk's begin if it has none, in picoseconds.
  [[nodiscard]] std::int64_t last() const { return last_; }
  [[nodiscard]] Damage damage() const { return damage_; }
  /// Returns the time before which all transitions of this channel are known, in picoseconds.
  [[nodiscard]] std::int64_t known() const { return last_; }

  /// Reads ahead until a transition before `known()` is available, or the file ends or is damaged.
  void refill(std::int64_t origin) {
    times_.erase(times_.begin(), times_.begin() + static_cast<std::ptrdiff_t>(next_));
    next_ = 0;
    while (!exhausted() && !damaged() && (times_.empty() || times_.front() >= last_)) {
      if (remaining_ != 0) {
        read_times();
        continue;
      }
      const bool level = state_;
      const std::int64_t gap_begin = end_;
      if (!begin_chunk()) return;
      if (begin_ > gap_begin) gaps_.add(position_, static_cast<Tick>(gap_begin) - static_cast<Tick>(origin));
      if (state_ != level) toggle_at(begin_);
    }
  }

  /// Removes the transitions before `limit` and appends their times to `at`, in ticks from `origin`.
  void take(std::int64_t limit, std::int64_t origin, std::vector<Tick>& at) {
    for (; next_ < times_.size() && times_[next_] < limit; ++next_) {
      at.push_back(static_cast<Tick>(times_[next_]) - static_cast<Tick>(origin));
      before_ = !before_;
    }
  }

  void report_gaps() const {
    gaps_.report(*damages_, "gaps in " + name_ + ": its level is taken to stand still there");
  }

 private:
  bool fail(std::string what) {
    damage_ = {.offset = position_, .what = std::move(what)};
    return false;
  }

  bool begin_chunk() {
    std::array<std::uint8_t, 36> header{};
    const std::size_t rate = version_ == 1 ? 8 : 0;
    const std::span<std::uint8_t> used = std::span(header).first(28 + rate);
    if (source_->read(position_, used) != used.size()) return fail("ends in a header");
    const auto state = load<std::uint32_t>(&header[0]);
    const double begin = load_double(&header[4 + rate]);
    const double end = load_double(&header[12 + rate]);
    if (state > 1) return fail("has an initial state that is not 0 or 1");
    if (!is_time(begin) || !is_time(end) || end < begin) return fail("begins or ends at an impossible time");
    if (to_picoseconds(begin) < end_) return fail("has a chunk that begins before the end of the one before it");
    state_ = state == 1;
    begin_ = to_picoseconds(begin);
    end_ = to_picoseconds(end);
    last_ = begin_;
    remaining_ = load<std::uint64_t>(&header[20 + rate]);
    position_ += used.size();
    --chunks_;
    return true;
  }

  // Adds a level change at `time`. Two changes within a picosecond cancel each other.
  void toggle_at(std::int64_t time) {
    if (!times_.empty() && times_.back() == time) {
      times_.pop_back();
    } else {
      times_.push_back(time);
    }
  }

  void read_times() {
    std::array<std::uint8_t, 8 * transitions_at_once> bytes;
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(remaining_, transitions_at_once));
    const std::size_t got = source_->read(position_, std::span(bytes).first(8 * wanted)) / 8;
    for (std::size_t i = 0; i < got; ++i, position_ += 8) {
      const double seconds = load_double(&bytes[8 * i]);
      const std::int64_t time = is_time(seconds) ? to_picoseconds(seconds) : std::numeric_limits<std::int64_t>::min();
      if (time < last_) {
        fail("has a transition that is before the one above it, or at an impossible time");
        return;
      }
      last_ = time;
      state_ = !state_;
      toggle_at(time);
    }
    remaining_ -= got;
    if (got < wanted) fail("ends before the last of the transitions that its header announces: was it cut off?");
  }

  std::string name_;
  std::unique_ptr<Source> source_;
  Damages* damages_;
  std::uint32_t version_ = 0;
  std::uint64_t position_ = 0;
  std::uint64_t chunks_ = 0;     // number of chunks of the file that are not read yet
  std::uint64_t remaining_ = 0;  // number of transitions in the present chunk that are not read yet
  std::int64_t begin_ = 0;
  std::int64_t end_ = std::numeric_limits<std::int64_t>::min();
  std::int64_t last_ = 0;
  bool state_ = false;   // level after all transitions read so far
  bool before_ = false;  // level after all transitions that `take` has returned so far
  std::vector<std::int64_t> times_;
  std::size_t next_ = 0;
  Damage damage_;
  Occurrences gaps_;
};

class SaleaeReader final : public ParsedReader {
 public:
  explicit SaleaeReader(std::vector<SaleaeChannel> channels) {
    layout_.content = Content::changes;
    layout_.ticks_per_second = static_cast<std::uint64_t>(ticks_per_second);
    streams_.reserve(channels.size());
    for (SaleaeChannel& channel : channels) {
      streams_.emplace_back(std::move(channel), damages_);
      layout_.channels.push_back(streams_.back().name());
    }
    if (streams_.empty()) throw OpenError("there is no file digital_0.bin, digital_1.bin ...");
    origin_ =
        std::min_element(streams_.begin(), streams_.end(), [](const TransitionStream& a, const TransitionStream& b) {
          return a.begin() < b.begin();
        })->begin();
  }

  [[nodiscard]] bool claim(Block& block) override {
    if (done_) return false;
    begin_block(block, index_++, first_);
    block.changes.resize(streams_.size());
    // Before the end of the block, all transitions of every channel are known.
    std::optional<std::int64_t> limit;
    std::optional<std::int64_t> damaged;
    for (TransitionStream& stream : streams_) {
      stream.refill(origin_);
      if (stream.damaged()) {
        damaged = std::min(damaged.value_or(stream.last() + 1), stream.last() + 1);
      } else if (!stream.exhausted()) {
        limit = std::min(limit.value_or(stream.known()), stream.known());
      }
    }
    done_ = !limit || (damaged && *limit >= *damaged);
    const std::int64_t end = !done_ ? *limit : damaged.value_or(last_of_all());
    if (done_) report();
    for (std::size_t i = 0; i < streams_.size(); ++i) {
      block.changes[i].before = streams_[i].before();
      streams_[i].take(end, origin_, block.changes[i].at);
    }
    first_ = std::max(first_, static_cast<Tick>(end) - static_cast<Tick>(origin_));
    block.end = first_;
    return true;
  }

 private:
  [[nodiscard]] std::int64_t last_of_all() const {
    std::int64_t last = origin_;
    for (const TransitionStream& stream : streams_) last = std::max({last, stream.end(), stream.last() + 1});
    return last;
  }

  void report() {
    for (const TransitionStream& stream : streams_) {
      stream.report_gaps();
      if (!stream.damaged()) continue;
      Damage damage = stream.damage();
      damage.tick = static_cast<Tick>(stream.last()) - static_cast<Tick>(origin_);
      damage.what = stream.name() + " " + damage.what;
      damages_.add(std::move(damage));
    }
  }

  std::vector<TransitionStream> streams_;
  std::int64_t origin_ = 0;
  std::uint64_t index_ = 0;
  Tick first_ = 0;
  bool done_ = false;
};

}  // namespace

bool is_saleae(std::string_view head) { return head.starts_with(magic); }

std::string saleae_channel_name(std::string_view stem) {
  constexpr std::string_view prefix = "digital_";
  return stem.starts_with(prefix) ? "Channel " + std::string(stem.substr(prefix.size())) : std::string(stem);
}

std::unique_ptr<Reader> read_saleae(std::vector<SaleaeChannel> channels) {
  return std::make_unique<SaleaeReader>(std::move(channels));
}

}  // namespace absenc::capture
