// SPDX-License-Identifier: Apache-2.0
// Files in which a server says that it reads a port, so that a program which finds the port in use can name the server.
#pragma once

#include <string>
#include <vector>

namespace absenc::os {

/// A file for each port, in $RUNTIME_DIRECTORY, which systemd gives to a service, or else in $XDG_RUNTIME_DIR/absenc,
/// from the constructor to the destructor. Without these folders, or where they cannot be written, there is none:
/// a program that opens the port then learns which process holds it, and no more.
class ServedPorts {
 public:
  /// `url`: of the server's page, as "http://127.0.0.1:8420/".
  explicit ServedPorts(std::string url) : url_(std::move(url)) {}
  ~ServedPorts() { set({}); }
  ServedPorts(const ServedPorts&) = delete;
  ServedPorts& operator=(const ServedPorts&) = delete;

  /// The paths of all ports that are read from now on.
  void set(const std::vector<std::string>& ports);

 private:
  std::string url_;
  std::vector<std::string> files_;
};

/// Returns the address of the page of the server that reads `port`, from $XDG_RUNTIME_DIR/absenc or /run/absenc;
/// "" where process `holder`, who has the port, has written none.
[[nodiscard]] std::string page_of_server(const std::string& port, const std::string& holder);

}  // namespace absenc::os
