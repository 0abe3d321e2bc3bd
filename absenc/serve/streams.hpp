// SPDX-License-Identifier: Apache-2.0
// The open event streams: what they are told is written once for all of them.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/text/json.hpp"
#include "absenc/serve/http.hpp"

namespace absenc::serve {

class Streams {
 public:
  static constexpr std::size_t most = 300;
  static constexpr std::size_t most_of_address = 200;
  static constexpr Time patience = std::chrono::seconds(5);  // without it, one that takes nothing gives way to others

  /// `trace`: the encoder whose points it wants; "": none. `peer`: the address of whoever wants it. Null when there are
  /// too many. An address that has the most of them gives one up for another that has fewer.
  [[nodiscard]] std::shared_ptr<Stream> open(const std::string& trace, const std::string& peer);

  /// To all of them, as an event of server-sent events.
  void tell(std::string_view event, const client::Json& data);
  /// To those that want the points of this encoder.
  void tell_traced(const std::string& encoder, std::string_view event, const client::Json& data);

  /// Forgets those whose client has gone.
  void tidy();
  [[nodiscard]] std::set<std::string> traced() const;
  [[nodiscard]] std::size_t count() const;
  /// Messages that slow clients have lost so far.
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  struct Open {
    std::shared_ptr<Stream> stream;
    std::string trace;
    std::string peer;
  };
  bool make_room(const std::string& peer);
  bool break_off_slowest(const std::string& peer, Time taken_before);

  mutable std::mutex mutex_;
  std::vector<Open> open_;
  std::uint64_t dropped_before_ = 0;  // by those that have gone
};

}  // namespace absenc::serve
