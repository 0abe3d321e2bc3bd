// SPDX-License-Identifier: Apache-2.0
// `absenc serve` without its command line: reads encoders and provides a page, HTTP, history, MQTT and UDP.
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
  // Addresses of encoders as for `absenc read`; empty: all encoders of absenc.toml.
  std::vector<std::string> encoders{};
  double rate = 50;  // readings per second of encoders without rate_hz in absenc.toml; 0: as fast as possible
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
  /// Starts reading and serving: all threads run when it returns. Throws UsageError, Failure, os::Failure,
  /// os::Interrupted.
  explicit Server(const Choices& choices);
  /// Stops all threads. Waits for a reading or a command in progress, and up to a second for a broker to receive the
  /// spooled messages.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Returns the URL of the web page: "http://127.0.0.1:8420/".
  [[nodiscard]] const std::string& url() const;
  [[nodiscard]] std::size_t encoders() const;
  /// Returns why the history cannot be written; "" if it can, or if the server has no history.
  [[nodiscard]] std::string history_trouble() const;
  /// Reads absenc.toml and the token file again and returns the changes in words. Throws UsageError if a file is
  /// invalid: the encoders and outlets then continue as before. Throws Failure or os::Failure if an outlet cannot be
  /// started, and os::Interrupted. Call it from one thread only.
  std::string reload();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::vector<OutletOption> outlets_;
};

}  // namespace absenc::serve
