// SPDX-License-Identifier: Apache-2.0
// Decodes asynchronous characters from level changes.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "absenc/capture/signal.hpp"
#include "absenc/link/line.hpp"

namespace absenc::capture {

/// Settings of an asynchronous line, whose characters have their data bits LSB first.
struct AsyncFormat {
  double bit = 0;  // duration of a bit in ticks, at least 2.5; need not be a whole number
  bool idle_high = true;
  Parity parity = Parity::none;
  unsigned stop_bits = 1;  // number of stop bits, 1 or 2; only the first is checked, as in a receiver
  Tick glitch = 0;         // level changes closer together than this, in ticks, are removed as noise; 0: no filter
  unsigned data_bits = 8;  // number of data bits of a character, 5 to 16
};

/// A decoder of asynchronous characters, which decodes a capture part by part. A bit is the level at its middle,
/// counted from the falling edge of the start bit.
class AsyncDecoder {
 public:
  /// Counts of characters and faults; `ticks` / `bits` of all good characters is the bit time.
  struct Statistics {
    std::uint64_t ticks = 0;
    std::uint64_t bits = 0;
    std::uint64_t characters = 0;
    // number of characters with a wrong stop or parity bit, and of falling edges that were no start bit
    std::uint64_t faults = 0;

    Statistics& operator+=(const Statistics& other);
    Statistics& operator-=(const Statistics& other);
  };
  /// How decoding begins: with a search for the first start bit, or with the first falling edge.
  enum class Start : std::uint8_t { search, trust };

  /// Makes a decoder. `channel` is stored as the channel of each character.
  explicit AsyncDecoder(const AsyncFormat& format, std::uint8_t channel = 0, Start start = Start::search);

  /// Begins anew because the next part of the capture does not follow the previous one; keeps the statistics.
  void restart(Start start = Start::search);
  /// Decodes the next part of the capture, from tick `first` to `end`, and appends complete characters.
  void decode(const Changes& part, Tick first, Tick end, std::vector<Character>& characters);
  /// Works like `decode`, but takes over characters from `guessed`: `other` decoded them from this part after a restart
  /// with `trust`.
  void join(const Changes& part, Tick first, Tick end, AsyncDecoder& other, std::vector<Character>& guessed,
            std::vector<Character>& characters);
  /// Ends the capture; appends the remaining characters.
  void finish(std::vector<Character>& characters);

  /// Returns a time at or before the begin of all characters that are still to be returned.
  [[nodiscard]] Tick settled() const;
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  [[nodiscard]] const AsyncFormat& format() const { return format_; }

 private:
  struct Candidate;
  template <class Visit>
  std::size_t walk(std::size_t start, Tick limit, Tick needed, Visit&& visit) const;
  [[nodiscard]] Character character(const Candidate& candidate, Tick limit) const;
  [[nodiscard]] bool wrong_parity(unsigned levels) const;
  [[nodiscard]] std::optional<std::size_t> find_start(Tick limit, bool final) const;
  [[nodiscard]] std::uint64_t faults_from(std::size_t start, Tick limit) const;

  // Decodes until a character begins at the same time as one of the characters `targets`, which another decoder found;
  // returns the index of that target.
  std::optional<std::size_t> meet(const Changes& part, Tick first, Tick end, std::span<const Character> targets,
                                  std::vector<Character>& characters);
  void begin_part(const Changes& part, Tick first);
  void feed(std::span<const Tick> edges, Tick end);
  std::optional<std::size_t> run(bool final, std::span<const Character> targets, std::vector<Character>& characters);
  void drop(std::size_t edges);

  AsyncFormat format_;
  std::uint8_t channel_;
  unsigned stop_;                  // index of the stop bit, counted from the start bit
  std::array<Tick, 19> middle_{};  // time from the falling edge of the start bit to the middle of each bit, in ticks
  Tick length_;                    // duration of a character in ticks
  double per_tick_;                // number of bits per tick, at most 0.4

  Start start_;
  bool begun_ = false;
  Tick origin_ = 0;  // tick at which decoding began
  Tick end_ = 0;     // tick at which the last decoded part of the capture ends
  // level after all changes given so far; idle is high, also for an inverted line
  bool line_ = true;
  bool level_ = true;           // level before the first change in `edges_`
  std::vector<Tick> edges_;     // level changes from the first incomplete character on, in ticks
  std::optional<Tick> unsure_;  // tick of a level change that is held back, because it may begin a noise pulse
  Statistics statistics_;
};

}  // namespace absenc::capture
