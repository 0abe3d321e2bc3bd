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
  std::vector<std::string> encoders{};  // addresses as for `absenc read`; empty: all of absenc.toml
  double rate = 50;                     // readings per second of encoders without rate_hz in absenc.toml; 0: as fast as
                                        // possible
  std::string host = "127.0.0.1";
  std::uint16_t port = 8420;  // TCP port; 0: any free one
  std::string public_url{};   // URL of a proxy; "": no proxy
  std::string token_file{};   // file with tokens; "": none
  std::string history{};      // path of the history file; "": no history
  HistoryLimits limits{};
  std::vector<OutletOption> outlets{};  // override the settings of MQTT and UDP in absenc.toml
};

class Server {
 public:
  /// Starts all threads before it returns. Throws UsageError, Failure, os::Failure.
  explicit Server(const Choices& choices);
  /// Ends within the time that one reading may take.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Returns the URL of the page: "http://127.0.0.1:8420/".
  [[nodiscard]] const std::string& url() const;
  [[nodiscard]] std::size_t encoders() const;
  /// Returns why the history cannot be written; "" without an error or without a history.
  [[nodiscard]] std::string history_trouble() const;
  /// Reads absenc.toml again and returns the changes in words. Throws UsageError: then nothing has changed. Call it
  /// from one thread only.
  std::string reload();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::vector<OutletOption> outlets_;
};

}  // namespace absenc::serve
