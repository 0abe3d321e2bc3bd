// SPDX-License-Identifier: Apache-2.0
// Finds the frames of a protocol among the characters of a line, pairs requests with their replies and decodes them, by
// the functions of the unit that decode them live.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/capture/annotate/exchanges.hpp"
#include "absenc/capture/annotate/judge.hpp"
#include "absenc/capture/annotate/run.hpp"

namespace absenc::capture {

/// What a channel carries.
enum class Carries : std::uint8_t {
  both,
  requests,
  replies,
  one,  // of two channels, one carries requests and one replies: found by what is on them
};

/// The times of the unit's line in a capture. 0 ticks a bit: the characters have no lengths, and what is a tick apart
/// belongs to different frames. 0 ticks a second: the line has the unit's own rate.
[[nodiscard]] LineTicks line_ticks(const Unit& unit, double ticks_per_bit, std::uint64_t ticks_per_second);

/// Characters in, exchanges out. Memory is fixed.
///
/// Where the line pauses, a frame ends. The first characters of a capture, up to the first pause, may be the end of a
/// frame or not even characters: they are told as cut. On a line that never pauses, what is believed to be a frame has
/// a good one next to it: a weak checksum finds frames everywhere. On a line of both directions a frame is a request or
/// a reply by what was said before, never by its bytes alone: some replies equal their requests.
///
/// Where times are those of arrival (`by_arrival`), a pause may lie within a frame and none between two. Then frames
/// are told apart by length and content alone, and pauses only judge bytes that are no good frame: see
/// annotate_arrival.cpp.
class Annotator {
 public:
  struct Settings {
    std::array<Carries, 2> channels{Carries::both, Carries::replies};
    std::size_t channel_count = 1;
    LineTicks ticks{};
    Tick begin = 0;              // of the capture
    bool begins_silent = false;  // nothing was on the line before it
    bool by_arrival = false;     // characters have the time at which a program received them; of one channel only
    Tick gap = 1;                // by arrival: a pause that the way from line to program does not make by itself
  };

  /// `unit` and `sink` must outlive it.
  Annotator(const Unit& unit, const Options& options, const Settings& settings, AnnotationSink& sink);
  Annotator(const Annotator&) = delete;
  Annotator& operator=(const Annotator&) = delete;

  /// In the order of their beginnings.
  void put(const Character& character);
  /// The capture ends here.
  void finish(Tick end);
  /// By arrival: hands out what is whole and good so far, without waiting for what follows.
  void hand_out();
  /// By arrival: nothing has come for so long that no frame goes on, and no reply comes any more.
  void fall_silent();
  /// What each channel carries; `one` while it is not known.
  [[nodiscard]] Carries carries(std::size_t channel) const { return channels_[channel].carries; }

 private:
  struct Channel {
    Carries carries = Carries::both;
    Run run;
    bool synchronised = false;    // there was a pause
    bool in_step = false;         // a frame is known to begin where the run, or what is left of it, begins
    std::size_t last_size = 0;    // of the last good frame in this run that nobody asked for; 0: none
    std::size_t stream_size = 0;  // the same, in any run
  };

  // Who sends what, when nobody said.
  void hold(const Character& character);
  void find_roles();

  // Runs.
  void take(const Character& character);
  [[nodiscard]] Tick pause_of(const Channel& channel) const;
  void close(Channel& channel, bool cut);
  void parse(Channel& channel, bool whole, bool cut);

  // Frames of the run from `at_` on; each returns how many characters it took, 0: none.
  std::size_t next_frame();
  std::size_t whole_frame();
  std::size_t answer_here();
  [[nodiscard]] bool goes_on(std::size_t size);
  [[nodiscard]] std::optional<std::size_t> asked_before(Tick begin) const;
  [[nodiscard]] std::size_t echoed_answer_size(Bytes request, std::size_t from);
  std::size_t echoed_answer_here(std::size_t which, std::size_t size);
  std::size_t repeated_here();
  std::size_t request_here();
  [[nodiscard]] bool is_request(std::size_t size);
  std::size_t unsolicited_here();
  std::size_t bad_here();
  void tell_bad(std::size_t size);

  [[nodiscard]] Bytes rest(std::size_t from) const { return channel_->run.bytes().subspan(from); }
  [[nodiscard]] Piece piece(std::size_t size) const;
  [[nodiscard]] std::size_t reply_at(Bytes request, std::size_t from, std::size_t usual = 0);
  [[nodiscard]] std::size_t request_at(std::size_t from);
  [[nodiscard]] bool good_from(std::size_t from);
  [[nodiscard]] bool may_turn(std::size_t at) const;
  [[nodiscard]] bool has_gap(std::size_t before) const;
  [[nodiscard]] bool stands_alone(std::size_t size) const;
  [[nodiscard]] std::size_t bad_size();

  Judge judge_;
  Settings settings_;
  Exchanges exchanges_;
  Options options_;
  std::array<Channel, 2> channels_{};
  std::array<std::size_t, 256> reply_sizes_{};  // of the last good reply to a request with this first byte
  std::vector<Character> held_;                 // until it is known who sends what

  bool is_first_ = true;  // what belongs to the first frame may lie before the capture

  // While a run is parsed.
  Channel* channel_ = nullptr;
  std::size_t at_ = 0;
  bool whole_ = true;  // nothing will be added to the run
  bool cut_ = false;   // the capture ends with it
  std::size_t last_reply_at_ = 0;
  std::size_t last_reply_size_ = 0;  // of the reply that ended at `at_`; 0: none did
};

}  // namespace absenc::capture
