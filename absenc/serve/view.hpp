// SPDX-License-Identifier: Apache-2.0
// State of encoders and server, as JSON and for Prometheus.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/serve/fleet.hpp"
#include "absenc/serve/watch.hpp"

namespace absenc::serve {

[[nodiscard]] inline double seconds_of(Time time) { return std::chrono::duration<double>(time).count(); }

/// Returns the JSON by which the overview page shows an encoder. Position, speed and alarms are null if the encoder
/// is not live.
[[nodiscard]] client::Json overview(const Watch& watch, const Snapshot& snapshot);

/// Returns the state, alarms and status of an encoder as JSON, without its position.
[[nodiscard]] client::Json condition_json(const Watch& watch, const Snapshot& snapshot);

/// Returns whether the encoder of `watch` is linear: its positions are in mm instead of degrees.
[[nodiscard]] bool is_linear(const Watch& watch);

/// Returns the JSON of `overview` together with counters, latencies, the fields of a recent reply, and the commands.
[[nodiscard]] client::Json details(const Watch& watch);

/// Returns plot points as {"encoder":name,"points":[[at_ms,position,speed,speed_uncertainty],...]}.
[[nodiscard]] client::Json points(const Watch& watch, std::span<const Point> taken);

/// Returns the last minute with readings of each encoder, with the last position and the mean speed of each second:
/// {"encoders":[{"encoder":name,"seconds":[[at_s,position,speed],...]},...]}.
[[nodiscard]] client::Json last_minute(const Fleet::Watches& watches);

/// Statistics of the server.
struct ServerFigures {
  std::size_t streams = 0;
  std::uint64_t stream_drops = 0;  // number of events of event streams that slow clients have lost
  std::uint64_t history_lost = 0;  // number of rows of the history that could not be written
  std::uint64_t wrong_tokens = 0;  // number of requests with a wrong token
};

/// Returns the metrics of the server and of all encoders in the text format of Prometheus.
[[nodiscard]] std::string metrics(const Fleet::Watches& watches, const ServerFigures& figures);

}  // namespace absenc::serve
