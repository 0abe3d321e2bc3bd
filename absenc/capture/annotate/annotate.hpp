// SPDX-License-Identifier: Apache-2.0
// Finds frames among the characters of a line, and pairs requests with their replies.
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

/// Kind of frames that a channel carries.
enum class Carries : std::uint8_t {
  both,
  requests,
  replies,
  detect,  // not known yet: to be detected from the characters of both channels
};

/// Returns the time limits for the line of `unit` in ticks of a capture. If `ticks_per_bit` is 0 (not known), these are
/// the defaults of LineTicks; if `ticks_per_second` is 0 (not known), the unit's usual bit rate is assumed.
[[nodiscard]] LineTicks line_ticks(const Unit& unit, double ticks_per_bit, std::uint64_t ticks_per_second);

/// Converts characters to annotated exchanges. Memory does not grow with the length of the capture. Some replies equal
/// their requests, so that bytes alone do not always show the sender.
class Annotator {
 public:
  struct Settings {
    std::array<Carries, 2> channels{Carries::both, Carries::replies};
    std::size_t channel_count = 1;
    LineTicks ticks{};
    Tick begin = 0;              // first tick of the capture
    bool begins_silent = false;  // true: the line was silent before the capture began
    // true: characters have the times of their arrival at a program, not those on the line; only for one channel
    bool by_arrival = false;
    // with `by_arrival`: shortest pause between characters that the transport to the program cannot have caused
    Tick gap = 1;
  };

  /// Makes an annotator for captures of `unit`. `unit` and `sink` must outlive the annotator.
  Annotator(const Unit& unit, const Options& options, const Settings& settings, AnnotationSink& sink);
  Annotator(const Annotator&) = delete;
  Annotator& operator=(const Annotator&) = delete;

  /// Adds a character; characters must be added in the order of their begin times.
  void put(const Character& character);
  /// Ends the capture at `end`.
  void finish(Tick end);
  /// With `by_arrival`: reports the frames that are complete. Some can be recognised only after further characters.
  void report_complete();
  /// With `by_arrival`: reports everything received so far. Call it when the line was silent so long that no frame or
  /// reply can continue.
  void report_after_silence();
  /// Returns which kind of frames `channel` carries; `detect` while this is not known.
  [[nodiscard]] Carries carries(std::size_t channel) const { return channels_[channel].carries; }

 private:
  struct Channel {
    Carries carries = Carries::both;
    Run run;
    // false: no pause was seen on this channel yet, so the characters before the first pause may begin within a frame,
    // and are reported as noise with Remark::cut (unused with arrival times)
    bool synchronised = false;
    bool at_frame_start = false;  // true: the next character to parse is taken as the begin of a frame
    // size in bytes of the last good unsolicited frame since the last pause, 0 if there was none; with arrival times a
    // reply to a request sets it to 0
    std::size_t last_size = 0;
    // size in bytes of the last good unsolicited frame of this channel, even before the last pause; 0: none
    std::size_t stream_size = 0;
  };

  // The functions `store_undecided` and `find_roles` find which channel carries requests and which carries replies.
  void store_undecided(const Character& character);
  void find_roles();

  // The functions from `take` to `parse` split the characters of each channel at the pauses of the line.
  void take(const Character& character);
  [[nodiscard]] Tick pause_of(const Channel& channel) const;
  [[nodiscard]] bool ends_with_request(const Channel& channel);
  [[nodiscard]] bool is_over(const Channel& channel, Tick begin);
  void close(Channel& channel, bool cut);
  void parse(Channel& channel, bool whole, bool cut);

  // The functions from `next_frame` to `report_bad` parse the characters between two pauses from index `at_` on. A size
  // that they return is that of the bytes that they found, 0 if nothing matches.
  std::size_t next_frame();
  std::size_t whole_frame();
  std::size_t match_reply();
  [[nodiscard]] bool is_followed_by_frame(std::size_t size);
  [[nodiscard]] std::optional<std::size_t> request_before(Tick begin) const;
  [[nodiscard]] bool is_refusal(Bytes request, std::size_t from);
  [[nodiscard]] std::size_t echoed_reply_size(Bytes request, std::size_t from);
  std::size_t match_echoed_reply(std::size_t which, std::size_t size);
  std::size_t match_repeated();
  std::size_t match_request();
  [[nodiscard]] bool is_request(std::size_t size);
  std::size_t match_unsolicited();
  std::size_t take_bad();
  void report_bad(std::size_t size);

  // Returns the index of a request in `reply_sizes_`: a hash of its first two bytes.
  [[nodiscard]] static std::size_t size_index(Bytes request) {
    return (request[0] + 31u * (request.size() > 1 ? request[1] : 0u)) % 256;
  }
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
  // usual size in bytes of the reply to each request, by the hash of the request's first two bytes; 0: not known
  std::array<std::size_t, 256> reply_sizes_{};
  std::vector<Character> undecided_;  // characters stored until the channels' directions are known

  bool is_first_ = true;  // no frame was parsed yet: the capture may have begun within a frame or exchange

  // The members from here to the end are the state while the characters between two pauses are parsed.
  Channel* channel_ = nullptr;
  std::size_t at_ = 0;
  bool whole_ = true;  // true: no further characters will be added to those that are parsed
  bool cut_ = false;   // true: the capture ends without a pause behind its last character, so perhaps within a frame
  std::size_t last_reply_at_ = 0;
  std::size_t last_reply_size_ = 0;  // size in bytes of the last reply since the last pause; 0: there is none
};

}  // namespace absenc::capture
