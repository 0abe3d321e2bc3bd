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
#include <fstream>
#include <string_view>

#include "absenc/os/linux/sys_file.hpp"
#include "absenc/os/served_port.hpp"

namespace absenc::os {

namespace {

namespace fs = std::filesystem;

bool is_number(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

// Returns the first symbolic link in `folder` that leads to `file`; "" if no link does.
std::string link_to(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (fs::equivalent(entry.path(), file, error)) return entry.path();
  }
  return {};
}

// Returns a text like "socat (process 4711)" or, for absenc with its verb, "absenc serve (process 4711)".
std::string program(const std::string& process) {
  std::string name = first_line(fs::path("/proc") / process / "comm");
  if (name == "absenc") {
    std::ifstream words(fs::path("/proc") / process / "cmdline");
    std::string verb;
    std::getline(words, verb, '\0');
    if (std::getline(words, verb, '\0')) name += " " + verb;
  } else if (name == "absenc-serve") {  // the program that the verb starts
    name = "absenc serve";
  }
  return (name.empty() ? "a program" : name) + " (process " + process + ")";
}

// A line of /proc/locks is like "1: FLOCK  ADVISORY  WRITE 4711 00:1a:7 0 EOF".
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

// Only root can inspect the processes of other users.
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
  using Holder = Failure::Holder;
  const std::string holder = holder_of(path);
  const std::string what = "the port " + path + " is in use by ";
  if (holder.empty()) return {what + "another program: end it, or use another port", Holder::unknown};
  constexpr std::string_view server = "absenc serve (process ";
  if (!holder.starts_with(server)) {
    const Holder who = holder.starts_with("absenc ")         ? Holder::absenc
                       : holder.starts_with("ModemManager ") ? Holder::modem_manager
                                                             : Holder::program;
    return {what + holder + ": end it, or use another port", who};
  }
  // The message does not advise to end `absenc serve`, because it may read this encoder for several clients.
  const std::string process = holder.substr(server.size(), holder.size() - server.size() - 1);
  const std::string page = page_of_server(path, process);
  const std::string where =
      page.empty() ? "its page and its API (/api/encoders) show what it reads"
                   : "`curl --silent " + page + "api/encoders` prints what it reads, and " + page + " shows it";
  return {what + holder + ": " + where, Holder::server};
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
    // PCs list 4 or 32 ports of the 16550 driver whether they exist or not; type 0 is "unknown".
    if (first_line(entry.path() / "type") == "0") continue;
    ports.push_back("/dev/" + entry.path().filename().string());
  }
  std::sort(ports.begin(), ports.end());
  return ports;
}

bool is_written_as_port(std::string_view place) { return place.find('/') != std::string_view::npos; }

std::string port_named(std::string_view name) {
  std::string path = "/dev/" + std::string(name);
  const std::vector<std::string> all = serial_ports();
  return std::find(all.begin(), all.end(), path) == all.end() ? std::string() : path;
}

std::string example_port(unsigned which) { return "/dev/ttyUSB" + std::to_string(which); }

std::string way_to_shorter_latency(const std::string& terminal) {
  return "`echo 1 | sudo tee /sys/class/tty/" + terminal + "/device/latency_timer`";
}

std::optional<unsigned> latency_timer(const std::string& terminal, const fs::path& sys) {
  return first_number(sys / terminal / "device" / "latency_timer");
}

std::string driver_of(const std::string& terminal, const fs::path& sys) {
  std::error_code error;
  // Since Linux 6.5 two more devices, `port` and `ctrl`, lie in /sys between a terminal and its UART
  // (serial_base_bus.c).
  for (fs::path device = fs::canonical(sys / terminal / "device", error); !error; device = device.parent_path()) {
    const std::string driver = fs::canonical(device / "driver", error).filename();
    if (error || (driver != "port" && driver != "ctrl")) return driver;
  }
  return {};
}

std::string holder_of(const std::string& path) {
  std::error_code ignored;
  const fs::path file = fs::canonical(path, ignored);
  struct stat status {};
  std::string holder;
  if (::stat(path.c_str(), &status) == 0) holder = lock_holder(status);
  // A pseudo-terminal is always open in the program that made it, which does not block the port.
  if (holder.empty() && !file.native().starts_with("/dev/pts/")) holder = opener(file);
  return holder;
}

ListedPort inspect_port(const std::string& path, const fs::path& sys, const fs::path& links) {
  const std::string terminal = fs::path(path).filename();
  ListedPort port{path, link_to(path, links), driver_of(terminal, sys), usb_adapter(terminal, sys),
                  latency_timer(terminal, sys)};
  const AdapterChip* chip = port.usb ? chip_of(*port.usb) : nullptr;
  if (chip != nullptr) port.highest_rate = chip->highest_rate;
  // A bit of a UART takes sixteen periods of its clock (Documentation/ABI/testing/sysfs-tty).
  const std::uint32_t clock = first_number(sys / terminal / "uartclk").value_or(0);
  if (clock >= 16) port.highest_rate = clock / 16;
  if (::access(path.c_str(), R_OK | W_OK) != 0) port.refusal = open_failure(path, errno).what();
  port.holder = holder_of(path);
  return port;
}

Failure open_failure(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
    case ENXIO:
    case ENODEV:
      return no_port(path);
    // EIO: the kernel lists a 16550 that does not exist, or the line was hung up after opening.
    case EIO:
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
