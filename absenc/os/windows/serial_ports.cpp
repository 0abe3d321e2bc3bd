// SPDX-License-Identifier: Apache-2.0
// Serial ports as SetupAPI and the registry list them; none is opened.
#include "absenc/os/serial_ports.hpp"

#include <windows.h>
// SetupAPI needs the types of windows.h.
#include <devguid.h>
#include <setupapi.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <string_view>

#include "absenc/os/port_facts.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

namespace fs = std::filesystem;

constexpr int highest_number = 256;

// Returns the number of "COM5", in any case of letters; nothing if `name` is no name of a port.
std::optional<int> port_number(std::string_view name) {
  constexpr std::string_view prefix = "COM";
  const bool begins = name.size() > prefix.size() &&
                      std::equal(prefix.begin(), prefix.end(), name.begin(),
                                 [](char a, char b) { return a == std::toupper(static_cast<unsigned char>(b)); });
  if (!begins) return std::nullopt;
  int number = 0;
  const char* const end = name.data() + name.size();
  const auto parsed = std::from_chars(name.data() + prefix.size(), end, number);
  if (parsed.ptr != end || parsed.ec != std::errc() || number < 1 || number > highest_number) return std::nullopt;
  return number;
}

// Returns "COM5" for "com5"; other names are returned as they are.
std::string usual_name(const std::string& path) {
  const std::optional<int> number = port_number(path);
  return number ? "COM" + std::to_string(*number) : path;
}

/// A device of the class Ports.
struct PortDevice {
  std::string port{};      // "COM5"
  std::string words{};     // "USB Serial Port (COM5)"
  std::string maker{};     // "FTDI"
  std::string driver{};    // name of the driver's service, "FTSER2K"
  std::string hardware{};  // "FTDIBUS\COMPORT&VID_0403&PID_6001"
  std::string instance{};  // "FTDIBUS\VID_0403+PID_6001+A50285BIA\0000"
  std::optional<unsigned> latency_timer{};
};

std::optional<std::string> registry_text(HKEY key, const wchar_t* name) {
  std::array<wchar_t, 512> text{};
  DWORD size = sizeof text - sizeof(wchar_t);
  DWORD type = 0;
  const LSTATUS error = ::RegQueryValueExW(key, name, nullptr, &type, reinterpret_cast<BYTE*>(text.data()), &size);
  return error == ERROR_SUCCESS && type == REG_SZ ? std::optional(utf8(text.data())) : std::nullopt;
}

std::string property(HDEVINFO devices, SP_DEVINFO_DATA& device, DWORD which) {
  std::array<wchar_t, 1024> text{};
  ::SetupDiGetDeviceRegistryPropertyW(devices, &device, which, nullptr, reinterpret_cast<BYTE*>(text.data()),
                                      static_cast<DWORD>(sizeof text - sizeof(wchar_t)), nullptr);
  return utf8(text.data());
}

PortDevice describe(HDEVINFO devices, SP_DEVINFO_DATA& device) {
  PortDevice one;
  const HKEY key = ::SetupDiOpenDevRegKey(devices, &device, DICS_FLAG_GLOBAL, 0, DIREG_DEV, KEY_READ);
  if (key != INVALID_HANDLE_VALUE) {
    one.port = registry_text(key, L"PortName").value_or("");
    DWORD number = 0;
    DWORD size = sizeof number;
    if (::RegQueryValueExW(key, L"LatencyTimer", nullptr, nullptr, reinterpret_cast<BYTE*>(&number), &size) ==
        ERROR_SUCCESS) {
      one.latency_timer = number;
    }
    ::RegCloseKey(key);
  }
  one.words = property(devices, device, SPDRP_FRIENDLYNAME);
  one.maker = property(devices, device, SPDRP_MFG);
  one.driver = property(devices, device, SPDRP_SERVICE);
  one.hardware = property(devices, device, SPDRP_HARDWAREID);
  std::array<wchar_t, 512> instance{};
  ::SetupDiGetDeviceInstanceIdW(devices, &device, instance.data(), static_cast<DWORD>(instance.size() - 1), nullptr);
  one.instance = utf8(instance.data());
  return one;
}

std::vector<PortDevice> port_devices() {
  std::vector<PortDevice> found;
  const HDEVINFO devices = ::SetupDiGetClassDevsW(&GUID_DEVCLASS_PORTS, nullptr, nullptr, DIGCF_PRESENT);
  if (devices == INVALID_HANDLE_VALUE) return found;
  SP_DEVINFO_DATA device{};
  device.cbSize = sizeof device;
  for (DWORD i = 0; ::SetupDiEnumDeviceInfo(devices, i, &device) != 0; ++i) {
    PortDevice one = describe(devices, device);
    if (port_number(one.port)) found.push_back(std::move(one));  // printers are in this class, too
  }
  ::SetupDiDestroyDeviceInfoList(devices);
  return found;
}

std::optional<PortDevice> device_of(const std::string& port) {
  for (PortDevice& one : port_devices()) {
    if (one.port == usual_name(port)) return std::move(one);
  }
  return std::nullopt;
}

// Returns the ports of all drivers, also of those that are in no class of SetupAPI.
std::vector<std::string> mapped_ports() {
  std::vector<std::string> ports;
  HKEY key = nullptr;
  if (::RegOpenKeyExW(HKEY_LOCAL_MACHINE, L"HARDWARE\\DEVICEMAP\\SERIALCOMM", 0, KEY_READ, &key) != ERROR_SUCCESS) {
    return ports;
  }
  for (DWORD i = 0;; ++i) {
    std::array<wchar_t, 256> name{};
    std::array<wchar_t, 256> value{};
    DWORD name_size = static_cast<DWORD>(name.size());
    DWORD value_size = sizeof value - sizeof(wchar_t);
    if (::RegEnumValueW(key, i, name.data(), &name_size, nullptr, nullptr, reinterpret_cast<BYTE*>(value.data()),
                        &value_size) != ERROR_SUCCESS) {
      break;
    }
    ports.push_back(utf8(value.data()));
  }
  ::RegCloseKey(key);
  return ports;
}

// Returns the hexadecimal number behind `name` in `text`, "VID_0403"; 0 if there is none.
std::uint16_t number_behind(std::string_view text, std::string_view name) {
  const std::size_t at = text.find(name);
  std::uint16_t number = 0;
  if (at != std::string_view::npos) {
    const std::string_view digits = text.substr(at + name.size(), 4);
    std::from_chars(digits.data(), digits.data() + digits.size(), number, 16);
  }
  return number;
}

// FTDI's driver has the serial number behind the last '+', followed by the letter of the channel; other drivers have it
// behind the last '\', where Windows puts a number with '&' for adapters without a serial number.
std::string serial_number_of(const PortDevice& device) {
  const std::string& text = device.instance;
  if (text.starts_with("FTDIBUS\\")) {
    const std::size_t end = text.find('\\', 8);
    const std::size_t begin = text.rfind('+', end);
    if (begin == std::string::npos || end == std::string::npos) return {};
    return text.substr(begin + 1, end - begin - 2);
  }
  const std::string last = text.substr(text.rfind('\\') + 1);
  return last.find('&') == std::string::npos ? last : std::string();
}

std::optional<UsbAdapter> usb_of(const PortDevice& device) {
  const std::string ids = device.hardware + " " + device.instance;
  UsbAdapter usb{.vendor = number_behind(ids, "VID_"),
                 .product = number_behind(ids, "PID_"),
                 .release = number_behind(ids, "REV_"),
                 .maker = device.maker,
                 .name = device.words.substr(0, device.words.find(" (COM"))};
  if (usb.vendor == 0) return std::nullopt;
  usb.serial_number = serial_number_of(device);
  return usb;
}

}  // namespace

std::vector<std::string> serial_ports(const fs::path&) {
  std::vector<std::string> ports = mapped_ports();
  for (const PortDevice& one : port_devices()) ports.push_back(one.port);
  std::sort(ports.begin(), ports.end(), [](const std::string& one, const std::string& other) {
    return std::pair(port_number(one).value_or(0), one) < std::pair(port_number(other).value_or(0), other);
  });
  ports.erase(std::unique(ports.begin(), ports.end()), ports.end());
  return ports;
}

bool is_written_as_port(std::string_view place) {
  return port_number(place).has_value() || place.starts_with(R"(\\.\)");
}

std::string port_named(std::string_view name) {
  const std::optional<int> number = port_number(name);
  return number ? "COM" + std::to_string(*number) : std::string();
}

std::string example_port(unsigned which) { return "COM" + std::to_string(3 + which); }

std::string way_to_shorter_latency(const std::string& terminal) {
  return "set it to 1 in Device Manager, " + terminal + ", Port Settings, Advanced";
}

std::optional<unsigned> latency_timer(const std::string& terminal, const fs::path&) {
  const std::optional<PortDevice> device = device_of(terminal);
  return device ? device->latency_timer : std::nullopt;
}

std::string driver_of(const std::string& terminal, const fs::path&) {
  const std::optional<PortDevice> device = device_of(terminal);
  return device ? device->driver : std::string();
}

std::optional<UsbAdapter> usb_adapter(const std::string& terminal, const fs::path&) {
  const std::optional<PortDevice> device = device_of(terminal);
  return device ? usb_of(*device) : std::nullopt;
}

std::string holder_of(const std::string&) { return {}; }  // Windows does not say which program has a port

ListedPort inspect_port(const std::string& path, const fs::path&, const fs::path&) {
  ListedPort port{.path = path};
  const std::optional<PortDevice> device = device_of(path);
  if (!device) return port;
  port.driver = device->driver;
  port.usb = usb_of(*device);
  port.latency_timer = device->latency_timer;
  const AdapterChip* const chip = port.usb ? chip_of(*port.usb) : nullptr;
  if (chip != nullptr) port.highest_rate = chip->highest_rate;
  return port;
}

PortFacts port_facts(const std::string& path, const fs::path&) {
  PortFacts facts;
  if (const std::optional<PortDevice> device = device_of(path)) {
    facts.driver = device->driver;
    facts.latency_timer = device->latency_timer;
  }
  return facts;
}

bool is_modem_driver(const std::string& driver) { return driver == "Modem" || driver == "qcusbser"; }

bool is_bare_uart(const std::string& driver) { return driver == "Serial"; }

Failure open_failure(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENODEV: {
      std::string there;
      for (const std::string& port : serial_ports()) there += (there.empty() ? "" : ", ") + port;
      return {Failure::Kind::not_found, "there is no port " + path +
                                            (there.empty() ? ", nor any other serial port: is the adapter plugged in?"
                                                           : ": this machine has " + there)};
    }
    case EACCES:  // Windows opens a port for one program, and denies it to others
    case EBUSY:
      return {"the port " + path + " is in use by another program: end it, or use another port",
              Failure::Holder::unknown};
    case ENOTTY:
    case EBADF:
    case EINVAL:
      return {Failure::Kind::unsupported, path + " is not a serial port: check the name"};
    case EIO:
    case ETIMEDOUT:
      return {Failure::Kind::not_found,
              "the port " + path + " is there, but its adapter does not answer: unplug it and plug it in again"};
    default:
      return system_failure("opening " + path, error);
  }
}

}  // namespace absenc::os
