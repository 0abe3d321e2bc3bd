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

  /// `trace`: the encoder whose points it wants; "": none. Null when there are too many.
  [[nodiscard]] std::shared_ptr<Stream> open(const std::string& trace);

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
  };
  mutable std::mutex mutex_;
  std::vector<Open> open_;
  std::uint64_t dropped_before_ = 0;  // by those that have gone
};

}  // namespace absenc::serve
