// SPDX-License-Identifier: Apache-2.0
// Collects what readings take on a line of characters beside their last exchange: a reading may need several requests,
// and it repeats those that fail.
#pragma once

#include <utility>
#include <vector>

#include "absenc/client/doctor/observations.hpp"
#include "absenc/client/doctor/stream_frames.hpp"

namespace absenc::client {

class ExchangeLog {
 public:
  /// `seen` takes what is collected; all must outlive this.
  ExchangeLog(const Unit& unit, const Options& options, Observations& seen)
      : unit_(unit), options_(options), seen_(seen) {}

  /// Takes a request that was sent, and what came until the next one. One that nobody answers is left out.
  void add_exchange(Attempted one) {
    const Frame request = one.exchange.request.frame();
    if (unit_.is_answered != nullptr && !unit_.is_answered(options_, request)) return;
    one.error = one.answered ? unit_.check(options_, request, one.exchange.reply.frame()) : Error::timeout;
    exchanges_.push_back(std::move(one));
  }
  /// Takes bytes that came.
  void add_bytes(Bytes items, Time at) {
    constexpr std::size_t most = 1u << 20;
    if (stream_.bytes.size() >= most) return;
    stream_.bytes.insert(stream_.bytes.end(), items.begin(), items.end());
    stream_.marks.push_back({at, stream_.bytes.size()});
  }
  /// Ends a reading, which will be the next one of `seen.readings`; its last exchange is its own.
  void add_reading(const Attempted& one) {
    // Most units need one request a reading: then nothing is kept twice.
    if (exchanges_.size() > 1 && seen_.exchanges.empty()) seen_.exchanges = seen_.readings;
    if (exchanges_.size() > 1 || !seen_.exchanges.empty()) {
      for (std::size_t i = 0; i + 1 < exchanges_.size(); ++i) seen_.exchanges.push_back(std::move(exchanges_[i]));
      seen_.exchanges.push_back(one);
      if (!exchanges_.empty()) seen_.exchanges.back().began = exchanges_.back().began;  // of the request
    }
    exchanges_.clear();
  }
  /// Ends the readings of an encoder that sends by itself.
  void conclude_stream() {
    if (const std::size_t within = bytes_among_others(unit_, options_, stream_)) {
      seen_.never_silent = true;
      seen_.unsolicited = stream_.bytes;
      seen_.within_frames = within;
      seen_.listened = stream_.marks.back().at - stream_.marks.front().at;
    } else {
      seen_.exchanges = stream_frames(unit_, options_, stream_);
    }
    stream_ = {};
  }

 private:
  const Unit& unit_;
  const Options& options_;
  Observations& seen_;
  std::vector<Attempted> exchanges_;  // of the present reading
  StreamBytes stream_;
};

}  // namespace absenc::client
