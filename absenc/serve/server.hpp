// SPDX-License-Identifier: Apache-2.0
// The server of `absenc serve`, without the command line.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/serve/history.hpp"
#include "absenc/serve/outlets.hpp"

namespace absenc::serve {

struct Choices {
  // Names or addresses of encoders, as in the command `absenc read`; empty: all encoders of absenc.toml.
  std::vector<std::string> encoders{};
  double rate = 50;  // readings per second of encoders without rate_hz in absenc.toml; 0: as fast as possible
  int realtime = 0;  // real-time priority of encoders without realtime in absenc.toml, 1 to 99; 0: none
  std::string host = "127.0.0.1";
  std::uint16_t port = 8420;  // TCP port; 0: any free one
  std::string public_url{};   // URL at which a proxy on this computer shows the page; "": no proxy
  std::string token_file{};   // path of the file with tokens; "": no tokens
  std::string history{};      // path of the history file; "": no history
  HistoryLimits limits{};
  std::vector<OutletOption> outlets{};  // options that override the settings of MQTT and UDP in absenc.toml
};

class Server {
 public:
  /// Starts reading and serving. Throws UsageError, Failure, os::Failure or os::Interrupted.
  explicit Server(const Choices& choices);
  /// Stops all threads. This may take some seconds: running requests to encoders end first, and a connected MQTT broker
  /// gets the remaining messages.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Returns the URL of the web page: "http://127.0.0.1:8420/".
  [[nodiscard]] const std::string& url() const;
  [[nodiscard]] std::size_t encoders() const;
  /// Returns why the history cannot be written; "" if it can be written, or if the server has no history.
  [[nodiscard]] std::string history_trouble() const;
  /// Reads absenc.toml and the token file again and returns the changes in words. Throws UsageError, Failure,
  /// os::Failure or os::Interrupted. To be called from one thread only.
  std::string reload();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::vector<OutletOption> outlets_;
};

}  // namespace absenc::serve
