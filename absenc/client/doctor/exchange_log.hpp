// SPDX-License-Identifier: Apache-2.0
// Collects all exchanges of readings on a line of characters. A reading may need several requests and repeats failed
// ones, and itself stores only its last exchange.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/doctor/stream_frames.hpp"

namespace absenc::client {

class ExchangeLog {
 public:
  /// `seen` receives the exchanges; all arguments must outlive the object.
  ExchangeLog(const Unit& unit, const Options& options, Observations& seen)
      : unit_(unit), options_(options), seen_(seen) {}

  /// Adds a request and the bytes received until the next one. A request that expects no reply is left out.
  void add_exchange(Attempted one) {
    const Frame request = one.exchange.request.frame();
    if (unit_.is_answered != nullptr && !unit_.is_answered(options_, request)) return;
    one.error = one.answered ? unit_.check(options_, request, one.exchange.reply.frame()) : Error::timeout;
    exchanges_.push_back(std::move(one));
  }
  /// Adds received bytes.
  void add_bytes(Bytes items, Time at) {
    constexpr std::size_t most = 1u << 20;
    if (stream_.bytes.size() >= most) return;
    stream_.bytes.insert(stream_.bytes.end(), items.begin(), items.end());
    stream_.marks.push_back({at, stream_.bytes.size()});
  }
  /// Ends a reading, which becomes the next one of `seen.readings` with its last exchange.
  void add_reading(const Attempted& one) {
    // Most units need one request per reading; then nothing is stored twice.
    if (exchanges_.size() > 1 && seen_.exchanges.empty()) seen_.exchanges = seen_.readings;
    if (exchanges_.size() > 1 || !seen_.exchanges.empty()) {
      for (std::size_t i = 0; i + 1 < exchanges_.size(); ++i) seen_.exchanges.push_back(std::move(exchanges_[i]));
      seen_.exchanges.push_back(one);
      if (!exchanges_.empty()) seen_.exchanges.back().began = exchanges_.back().began;  // time of the request
    }
    exchanges_.clear();
  }
  /// Ends the readings of an encoder that sends by itself, and cuts its stream into frames.
  void conclude_stream() {
    if (const std::size_t within = bytes_among_others(unit_, options_, stream_)) {
      seen_.never_silent = true;
      seen_.unsolicited = stream_.bytes;
      seen_.within_frames = within;
      seen_.listened = stream_.marks.back().at - stream_.marks.front().at;
    } else {
      seen_.exchanges = stream_frames(unit_, options_, stream_);
      const bool has_damage = std::ranges::any_of(seen_.exchanges, is_damaged);
      // If the readings lost no frame, a damaged piece was only cut at the wrong pause.
      if (has_damage && std::ranges::none_of(seen_.readings, has_lost)) seen_.exchanges.clear();
    }
    stream_ = {};
  }

 private:
  static bool is_damaged(const Attempted& one) { return one.answered && one.error != Error::none; }
  static bool has_lost(const Attempted& one) { return one.error != Error::none || one.discarded != 0; }

  const Unit& unit_;
  const Options& options_;
  Observations& seen_;
  std::vector<Attempted> exchanges_;  // exchanges of the present reading
  StreamBytes stream_;
};

}  // namespace absenc::client
