// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "absenc/os/error.hpp"
#include "absenc/os/linux/sys_file.hpp"
#include "absenc/os/linux/usb_device.hpp"

namespace absenc::os {

using Kind = Failure::Kind;

namespace fs = std::filesystem;

namespace {

constexpr std::uint16_t ftdi_vendor = 0x0403;

constexpr const char* rule = "60-absenc-ftdi.rules";

std::string three_digits(unsigned number) {
  std::string text = std::to_string(number);
  return std::string(3 - std::min<std::size_t>(3, text.size()), '0') + text;
}

ListedFtdi listed_only;
FtdiUsb* all_ftdi = &listed_only;

}  // namespace

Failure ftdi_no_permission(const FtdiAdapter& adapter) {
  return {Kind::no_permission, "no permission to open the " + adapter.words() + " (" + adapter.device +
                                   "): copy the udev rule " + rule +
                                   " of absenc to /etc/udev/rules.d (the package absenc installs it), then "
                                   "unplug the adapter and plug it in"};
}

std::vector<FtdiAdapter> ListedFtdi::adapters() { return ftdi_adapters(); }

std::unique_ptr<FtdiChannel> ListedFtdi::open(const FtdiAdapter& adapter, char) {
  throw Failure(Kind::unsupported, "the " + adapter.words() +
                                       " cannot be used: this program was built without absenc::ftdi; build it with "
                                       "that library");
}

FtdiUsb& system_ftdi() { return *all_ftdi; }

void set_system_ftdi(FtdiUsb& usb) { all_ftdi = &usb; }

std::vector<FtdiAdapter> ftdi_adapters(const fs::path& sys, const fs::path& dev) {
  std::vector<FtdiAdapter> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(sys, ignored)) {
    FtdiAdapter adapter{.usb = usb_device(entry.path())};
    if (adapter.usb.vendor != ftdi_vendor) continue;
    describe_chip(adapter);
    const std::uint32_t bus = first_number(entry.path() / "busnum").value_or(0);
    const std::uint32_t address = first_number(entry.path() / "devnum").value_or(0);
    adapter.bus = static_cast<std::uint8_t>(bus);
    adapter.address = static_cast<std::uint8_t>(address);
    adapter.device = dev / three_digits(bus) / three_digits(address);
    if (::access(adapter.device.c_str(), R_OK | W_OK) != 0) adapter.refusal = ftdi_no_permission(adapter).what();
    found.push_back(std::move(adapter));
  }
  std::sort(found.begin(), found.end(), [](const FtdiAdapter& one, const FtdiAdapter& other) {
    return std::pair(one.bus, one.address) < std::pair(other.bus, other.address);
  });
  return found;
}

}  // namespace absenc::os
