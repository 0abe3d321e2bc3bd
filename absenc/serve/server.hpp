// SPDX-License-Identifier: Apache-2.0
// `absenc serve` without its command line: encoders that are read, a page, HTTP, history, MQTT, UDP.
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
  std::vector<std::string> encoders{};  // as for `absenc read`; none: all of absenc.toml
  double rate = 50;                     // readings a second, where absenc.toml has no rate_hz; 0: as fast as can be
  std::string host = "127.0.0.1";
  std::uint16_t port = 8420;  // 0: any that is free
  std::string public_url{};   // of a proxy; "": none
  std::string token_file{};   // "": none
  std::string history{};      // the file; "": none is kept
  HistoryLimits limits{};
  std::vector<OutletOption> outlets{};  // win over what absenc.toml says of MQTT and UDP
};

class Server {
 public:
  /// Everything runs when it returns. Throws UsageError, Failure, os::Failure.
  explicit Server(const Choices& choices);
  /// Within the time that one reading may take.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// "http://127.0.0.1:8420/"
  [[nodiscard]] const std::string& url() const;
  [[nodiscard]] std::size_t encoders() const;
  /// Why the history cannot be written; "" when nothing is wrong, or none is kept.
  [[nodiscard]] std::string history_trouble() const;
  /// Reads absenc.toml again; returns what changed, in words. Throws UsageError: then nothing did. From one thread.
  std::string reload();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::vector<OutletOption> outlets_;
};

}  // namespace absenc::serve
