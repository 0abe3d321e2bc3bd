// SPDX-License-Identifier: Apache-2.0
// The encoders that are served: those of absenc.toml, or those that were named.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/serve/watch.hpp"

namespace absenc::serve {

class Fleet {
 public:
  using Watches = std::vector<std::shared_ptr<Watch>>;

  /// `names` as for `absenc read`; none: all of absenc.toml. `rate` in readings a second of those for which the file
  /// has no `rate_hz`; 0: as fast as can be. `server_events` outlives it. Throws UsageError.
  Fleet(std::vector<std::string> names, double rate, ServerEvents& server_events);
  ~Fleet();
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  /// Ends all threads that read, and what they do for others. What they have counted can still be taken.
  void end();

  /// Reads absenc.toml again; those that it describes as before go on undisturbed. Throws UsageError: then all do.
  /// Returns what changed, in words. From one thread.
  std::string reload();

  [[nodiscard]] Watches all() const;
  /// Null when there is none of this name.
  [[nodiscard]] std::shared_ptr<Watch> find(std::string_view name) const;
  /// The names of the others on its line.
  [[nodiscard]] std::vector<std::string> company_of(const Watch& watch) const;

 private:
  struct Wanted;
  struct Served {
    std::string description;
    std::shared_ptr<Watch> watch;
  };
  [[nodiscard]] std::vector<Wanted> wanted() const;

  std::vector<std::string> names_;
  double rate_;
  ServerEvents* server_events_;
  mutable std::mutex mutex_;
  std::vector<Served> served_;
};

}  // namespace absenc::serve
