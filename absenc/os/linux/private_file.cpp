// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/private_file.hpp"

#include <sys/stat.h>

namespace absenc::os {

// The group may read the file, for example that of a service.
std::string command_to_deny_others(const std::string& path) {
  struct stat file {};
  const bool others = ::stat(path.c_str(), &file) == 0 && (file.st_mode & (S_IWGRP | S_IRWXO)) != 0;
  return others ? "chmod 600 " + path : std::string();
}

}  // namespace absenc::os
