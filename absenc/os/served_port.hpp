// SPDX-License-Identifier: Apache-2.0
// Files that record which server reads a port.
#pragma once

#include <string>
#include <vector>

namespace absenc::os {

/// The files in which one server records the ports that it reads, at most one file per port, in $RUNTIME_DIRECTORY or
/// $XDG_RUNTIME_DIR/absenc.
class ServedPorts {
 public:
  /// `url` is the address of the server's page, for example "http://127.0.0.1:8420/".
  explicit ServedPorts(std::string url) : url_(std::move(url)) {}
  ~ServedPorts() { set({}); }
  ServedPorts(const ServedPorts&) = delete;
  ServedPorts& operator=(const ServedPorts&) = delete;

  /// Sets the paths of all ports that the server reads from now on.
  void set(const std::vector<std::string>& ports);

 private:
  std::string url_;
  std::vector<std::string> files_;
};

/// Returns the address of the page of the server with process number `holder` that reads `port`; "" if unknown.
[[nodiscard]] std::string page_of_server(const std::string& port, const std::string& holder);

}  // namespace absenc::os
