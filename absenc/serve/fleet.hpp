// SPDX-License-Identifier: Apache-2.0
// The served encoders: those named on the command line, or all of absenc.toml.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/error.hpp"
#include "absenc/serve/watch.hpp"

namespace absenc::serve {

class Fleet {
 public:
  using Watches = std::vector<std::shared_ptr<Watch>>;

  /// `names`: names or addresses of encoders; empty: all of absenc.toml. `rate`: readings per second of encoders
  /// without `rate_hz` in the file; 0: as fast as possible. `realtime`: real-time priority of encoders without
  /// `realtime` in the file; 0: none. `server_events` must outlive this object. Throws UsageError, Failure,
  /// os::Interrupted.
  Fleet(std::vector<std::string> names, double rate, int realtime, ServerEvents& server_events);
  ~Fleet();
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  /// Ends the reading threads of all encoders, and waits for the end of each. Orders that have not begun are refused.
  void end();

  /// Reads absenc.toml again; encoders with unchanged settings continue. Returns the changes in words, also for which
  /// encoders there is no thread: they are not served until a later call has one for them. Throws UsageError, Failure
  /// if the file cannot be read, os::Interrupted. Call it from one thread only.
  std::string reload();

  [[nodiscard]] Watches all() const;
  /// Returns the encoder named `name`; null if no such encoder is served.
  [[nodiscard]] std::shared_ptr<Watch> find(std::string_view name) const;
  /// Returns the names of the other encoders on the same line as `watch`.
  [[nodiscard]] std::vector<std::string> others_on_line(const Watch& watch) const;

 private:
  struct Configured;
  struct Served {
    std::string description;
    std::shared_ptr<Watch> watch;
  };
  /// Changes of the served encoders, by their names.
  struct Reloaded {
    std::size_t unchanged = 0;
    std::vector<std::string> ended{};
    std::vector<std::string> begun{};
    std::vector<std::string> left_out{};       // encoders that are not read, for the reason `failure`
    std::optional<client::Failure> failure{};  // why the first of `left_out` could not begin
  };
  [[nodiscard]] std::vector<Configured> configured() const;
  /// Ends the encoders that are not in `all` with the same settings, and begins the others of `all`. Once there is no
  /// thread for one, no further one is begun. Throws os::Interrupted.
  [[nodiscard]] Reloaded change_to(const std::vector<Configured>& all);
  /// Starts to read an encoder, beside `others` other ones. Throws Failure if there is no thread or memory for it.
  [[nodiscard]] std::shared_ptr<Watch> start(const Configured& encoder, Time offset, std::size_t others) const;

  std::vector<std::string> names_;
  double rate_;
  int realtime_;
  ServerEvents* server_events_;
  mutable std::mutex mutex_;
  std::vector<Served> served_;
};

}  // namespace absenc::serve
