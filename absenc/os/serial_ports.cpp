// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/serial_ports.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <string_view>

namespace absenc::os {

namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

bool is_number(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

// "sleep (process 4711)"
std::string program(const std::string& process) {
  const std::string name = first_line(fs::path("/proc") / process / "comm");
  return (name.empty() ? "a program" : name) + " (process " + process + ")";
}

// The process that holds a flock on the file, from a line like "1: FLOCK  ADVISORY  WRITE 4711 00:1a:7 0 EOF".
std::string lock_holder(const struct stat& file) {
  std::ifstream locks("/proc/locks");
  std::string number, kind, mode, access, process, inode, rest;
  while (locks >> number >> kind >> mode >> access >> process >> inode && std::getline(locks, rest)) {
    unsigned device_major = 0, device_minor = 0;
    unsigned long long index = 0;
    const int fields = std::sscanf(inode.c_str(), "%x:%x:%llu", &device_major, &device_minor, &index);
    if (kind == "FLOCK" && fields == 3 && index == file.st_ino && device_major == major(file.st_dev) &&
        device_minor == minor(file.st_dev) && is_number(process)) {
      return program(process);
    }
  }
  return {};
}

// A process that has the file open; only those of the same user can be looked into.
std::string opener(const fs::path& file) {
  std::error_code ignored;
  for (const auto& process : fs::directory_iterator("/proc", ignored)) {
    const std::string id = process.path().filename();
    if (!is_number(id) || id == std::to_string(::getpid())) continue;
    for (fs::directory_iterator entry(process.path() / "fd", ignored), end; entry != end; entry.increment(ignored)) {
      if (fs::read_symlink(entry->path(), ignored) == file) return program(id);
    }
  }
  return {};
}

Failure in_use(const std::string& path) {
  std::error_code ignored;
  const fs::path file = fs::canonical(path, ignored);
  struct stat status {};
  std::string holder;
  if (::stat(path.c_str(), &status) == 0) holder = lock_holder(status);
  // A pseudo-terminal is always open in the program that made it, which is not the one that is in the way.
  if (holder.empty() && !file.native().starts_with("/dev/pts/")) holder = opener(file);
  if (holder.empty()) holder = "another program";
  return {Failure::Kind::in_use, "the port " + path + " is in use by " + holder + ": end it, or use another port"};
}

Failure no_permission(const std::string& path) {
  const std::string what = "no permission to open " + path;
  struct stat status {};
  if (::stat(path.c_str(), &status) < 0) return {Failure::Kind::no_permission, what + ": try as root"};
  const group* group = ::getgrgid(status.st_gid);
  const passwd* user = ::getpwuid(status.st_uid);
  const std::string group_name = group != nullptr ? group->gr_name : std::to_string(status.st_gid);
  const std::string user_name = user != nullptr ? user->pw_name : std::to_string(status.st_uid);
  constexpr mode_t group_access = S_IRGRP | S_IWGRP;
  if ((status.st_mode & group_access) != group_access) {
    return {Failure::Kind::no_permission, what + ", which only its owner " + user_name + " may: try as " + user_name};
  }
  return {Failure::Kind::no_permission, what + ", which the group " + group_name + " may: run `sudo usermod -aG " +
                                            group_name + " $USER` and log in again"};
}

Failure no_port(const std::string& path) {
  std::string there;
  for (const std::string& port : serial_ports()) there += (there.empty() ? "" : ", ") + port;
  return {Failure::Kind::not_found, "there is no port " + path +
                                        (there.empty() ? ", nor any other serial port: is the adapter plugged in?"
                                                       : ": this machine has " + there)};
}

}  // namespace

std::vector<std::string> serial_ports(const fs::path& sys) {
  std::vector<std::string> ports;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(sys, ignored)) {
    if (!fs::exists(entry.path() / "device", ignored)) continue;
    // PCs list 4 or 32 ports of the 16550 driver whether they are there or not; type 0 is "unknown".
    if (first_line(entry.path() / "type") == "0") continue;
    ports.push_back("/dev/" + entry.path().filename().string());
  }
  std::sort(ports.begin(), ports.end());
  return ports;
}

std::optional<unsigned> latency_timer(const std::string& terminal, const fs::path& sys) {
  const std::string text = first_line(sys / terminal / "device" / "latency_timer");
  unsigned milliseconds = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), milliseconds);
  if (error != std::errc{}) return std::nullopt;
  return milliseconds;
}

Failure open_failure(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
    case ENXIO:
    case ENODEV:
      return no_port(path);
    case EIO:  // from the terminal's ioctl: a 16550 that is only listed, or a line that was hung up since it was opened
      return {Failure::Kind::not_found, "the port " + path +
                                            " is there, but no hardware is behind it, or not any more: check the name, "
                                            "or plug it in again"};
    case EACCES:
    case EPERM:
      return no_permission(path);
    case EBUSY:
    case EWOULDBLOCK:
      return in_use(path);
    case ENOTTY:
    case EISDIR:
      return {Failure::Kind::unsupported, path + " is not a serial port: check the name"};
    default:
      return system_failure("opening " + path, error);
  }
}

}  // namespace absenc::os
