// SPDX-License-Identifier: Apache-2.0
// Asynchronous characters from level changes. The samples are not looked at again: a character is computed from the few
// changes inside it.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "absenc/capture/signal.hpp"
#include "absenc/link/line.hpp"

namespace absenc::capture {

/// What is on a line: 8 data bits, LSB first.
struct AsyncFormat {
  double bit = 0;  // ticks, 2.5 at least; need not be a whole number
  bool idle_high = true;
  Parity parity = Parity::none;
  unsigned stop_bits = 1;  // 1 or 2. Only the first is looked at, as a receiver does
  Tick glitch = 0;         // a level that lasts for less is taken for noise; 0: none is
};

/// Decodes part after part. A bit is the level at its middle, counted from the falling edge of the start bit; what is
/// not low at the middle of its start bit is no character. After a wrong stop bit, the next falling edge begins a
/// character.
///
/// Between parts it keeps the changes from the first character on that is not complete; there is no state in the middle
/// of one.
///
/// A capture may begin inside a character: of the falling edges within the first, that is taken which leads to the
/// fewest errors in the next twelve characters.
class AsyncDecoder {
 public:
  /// Over all characters without an error, from the start bit to the last change: so that nothing adds up.
  struct Statistics {
    std::uint64_t ticks = 0;
    std::uint64_t bits = 0;
    std::uint64_t characters = 0;
    std::uint64_t faults = 0;  // wrong stop and parity bits, and falling edges that were no start bit

    Statistics& operator+=(const Statistics& other);
    Statistics& operator-=(const Statistics& other);
  };
  /// Whether the first falling edge is looked for, or known to be a start bit.
  enum class Start : std::uint8_t { look, trust };

  /// `channel` is what the characters bear.
  explicit AsyncDecoder(const AsyncFormat& format, std::uint8_t channel = 0, Start start = Start::look);

  /// Forgets everything but the statistics: what comes next does not follow what was.
  void restart(Start start = Start::look);
  /// The next part, from `first` to `end`. Where `part.before` does not fit, the line changed at `first`.
  void decode(const Changes& part, Tick first, Tick end, std::vector<Character>& characters);
  /// As decode, where `other`, just restarted with `Start::trust`, has decoded the same part into `guessed`: what is
  /// right of it is taken over together with its state. The outcome is that of decode, to the bit.
  void join(const Changes& part, Tick first, Tick end, AsyncDecoder& other, std::vector<Character>& guessed,
            std::vector<Character>& characters);
  /// Nothing follows: also characters of which the stop bit has begun.
  void finish(std::vector<Character>& characters);

  /// No character that is yet to come begins before.
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

  // The first of `targets` at which a character begins too; before that one it stops.
  std::optional<std::size_t> meet(const Changes& part, Tick first, Tick end, std::span<const Character> targets,
                                  std::vector<Character>& characters);
  void begin_part(const Changes& part, Tick first);
  void feed(std::span<const Tick> edges, Tick end);
  std::optional<std::size_t> run(bool final, std::span<const Character> targets, std::vector<Character>& characters);
  void drop(std::size_t edges);

  AsyncFormat format_;
  std::uint8_t channel_;
  unsigned stop_;                  // index of the bit
  std::array<Tick, 11> middle_{};  // of each bit, from the falling edge
  Tick length_;                    // of a character
  double per_tick_;                // bits

  Start start_;
  bool begun_ = false;
  Tick origin_ = 0;             // where the first part began
  Tick end_ = 0;                // where the last one ended
  bool line_ = true;            // behind all that was fed; high is idle from here on
  bool level_ = true;           // before edges_
  std::vector<Tick> edges_;     // from the character on that is not complete
  std::optional<Tick> unsure_;  // a change that may be a glitch
  Statistics statistics_;
};

}  // namespace absenc::capture
