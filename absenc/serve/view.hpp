// SPDX-License-Identifier: Apache-2.0
// What is known of encoders, as JSON and for Prometheus. What is not live is never given as a present value.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/serve/fleet.hpp"
#include "absenc/serve/watch.hpp"

namespace absenc::serve {

[[nodiscard]] inline double seconds_of(Time time) { return std::chrono::duration<double>(time).count(); }

/// At a glance: state, age_s, position, turns, speed with its uncertainty, alarms in words, errors of the last minute.
/// Values are null unless the encoder is live and they hold.
[[nodiscard]] client::Json overview(const Watch& watch, const Snapshot& snapshot);

/// What of it holds until it is told otherwise: state, why it is not live, alarms in words, status; no value.
[[nodiscard]] client::Json condition_json(const Watch& watch, const Snapshot& snapshot);

/// Positions in mm, not degrees.
[[nodiscard]] bool is_linear(const Watch& watch);

/// All of it: also counters, latencies, the last bad exchanges, the fields of the last reply, and the commands that it
/// has with their arguments.
[[nodiscard]] client::Json details(const Watch& watch);

/// {"encoder":name,"points":[[at_ms,position,speed,speed_uncertainty],...]}; a speed that is not known is
/// null.
[[nodiscard]] client::Json points(const Watch& watch, std::span<const Point> taken);

/// {"encoders":[{"encoder":name,"seconds":[[at_s,position,speed],...]},...]}: last position and mean speed of the last
/// 60 seconds in which it was read, null where its position or speed did not hold.
[[nodiscard]] client::Json last_minute(const Fleet::Watches& watches);

/// Of the server, beside the encoders.
struct ServerFigures {
  std::size_t streams = 0;
  std::uint64_t stream_drops = 0;  // messages that slow readers lost
  std::uint64_t history_lost = 0;  // rows that could not be written
  std::uint64_t wrong_tokens = 0;  // requests
};

/// The text format of Prometheus.
[[nodiscard]] std::string metrics(const Fleet::Watches& watches, const ServerFigures& figures);

}  // namespace absenc::serve
