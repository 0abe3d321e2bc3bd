// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/served_port.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace absenc::os {

namespace {

namespace fs = std::filesystem;

fs::path folder_in(const char* variable, const char* name) {
  const char* value = std::getenv(variable);
  return value == nullptr || *value == '\0' ? fs::path() : fs::path(value) / name;
}

// Returns the name of the file that records the server of `port`: the same for a symbolic link and for its target.
std::string file_name(const std::string& port) {
  std::error_code error;
  const fs::path path = fs::canonical(port, error);
  std::string name = error ? port : path.string();
  std::replace(name.begin(), name.end(), '/', '!');
  return name;
}

}  // namespace

void ServedPorts::set(const std::vector<std::string>& ports) {
  fs::path folder = folder_in("RUNTIME_DIRECTORY", "");
  if (folder.empty()) folder = folder_in("XDG_RUNTIME_DIR", "absenc");
  std::vector<std::string> files;
  std::error_code error;
  if (!folder.empty() && !ports.empty()) fs::create_directory(folder, error);
  for (const std::string& port : ports) {
    if (folder.empty()) break;
    std::string file = folder / file_name(port);
    // The file is written under another name and renamed, because other programs may read it at any time.
    const std::string part = file + "." + std::to_string(::getpid());
    std::ofstream(part) << ::getpid() << " " << url_ << "\n";
    // All users may read the file, even if the umask of the service denies that.
    fs::permissions(part, fs::perms::group_read | fs::perms::others_read, fs::perm_options::add, error);
    fs::rename(part, file, error);
    if (error) {
      fs::remove(part, error);
    } else {
      files.push_back(std::move(file));
    }
  }
  for (const std::string& old : files_) {
    if (std::find(files.begin(), files.end(), old) == files.end()) fs::remove(old, error);
  }
  files_ = std::move(files);
}

std::string page_of_server(const std::string& port, const std::string& holder) {
  for (const fs::path& folder : {folder_in("XDG_RUNTIME_DIR", "absenc"), fs::path("/run/absenc")}) {
    if (folder.empty()) continue;
    std::ifstream file(folder / file_name(port));
    std::string process;
    std::string url;
    // A server that was killed leaves its file behind, so the process number must match.
    if (file >> process >> url && process == holder) return url;
  }
  return {};
}

}  // namespace absenc::os
