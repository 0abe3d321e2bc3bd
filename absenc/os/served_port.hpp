// SPDX-License-Identifier: Apache-2.0
// Files that record which server reads a port, so that a program which finds the port in use can name the server.
#pragma once

#include <string>
#include <vector>

namespace absenc::os {

/// The files of one server: one file per port in $RUNTIME_DIRECTORY, which systemd gives to a service, or else in
/// $XDG_RUNTIME_DIR/absenc. `set` writes them, the destructor removes them. Without these variables, or if the files
/// cannot be written, there are none: a program that opens the port then finds only the process that holds it.
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

/// Returns the address of the page of the server that reads `port`, from $XDG_RUNTIME_DIR/absenc or /run/absenc; "" if
/// process `holder`, which holds the port, has written none.
[[nodiscard]] std::string page_of_server(const std::string& port, const std::string& holder);

}  // namespace absenc::os
