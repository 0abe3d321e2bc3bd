// SPDX-License-Identifier: Apache-2.0
// The open event streams, through which web pages get events.
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
  // An event stream whose client has taken no data for this time may be closed to make room for a new one.
  static constexpr Time stall_time = std::chrono::seconds(5);

  /// Opens an event stream; null if there are too many. May close another stream for it. `trace`: the encoder whose
  /// plot points the stream sends; "": none. `peer`: IP address of the client.
  [[nodiscard]] std::shared_ptr<Stream> open(const std::string& trace, const std::string& peer);

  /// Sends a server-sent event to all streams.
  void send(std::string_view event, const client::Json& data);
  /// Sends a server-sent event to the streams that send the plot points of `encoder`.
  void send_traced(const std::string& encoder, std::string_view event, const client::Json& data);

  /// Removes streams whose client has disconnected.
  void tidy();
  [[nodiscard]] std::set<std::string> traced() const;
  [[nodiscard]] std::size_t count() const;
  /// Returns the number of events that slow clients have lost.
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  struct Open {
    std::shared_ptr<Stream> stream;
    std::string trace;
    std::string peer;
  };
  bool make_room(const std::string& peer);
  bool abort_slowest(const std::string& peer, Time taken_before);

  mutable std::mutex mutex_;
  std::vector<Open> open_;
  std::uint64_t dropped_before_ = 0;  // number of events that streams had lost before they were closed
};

}  // namespace absenc::serve
