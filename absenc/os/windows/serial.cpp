// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/serial.hpp"

#include <cerrno>
#include <cstring>
#include <string_view>

#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/overlapped.hpp"
#include "absenc/os/windows/serial_calls.hpp"
#include "absenc/os/windows/text.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

namespace {

// The name of a device must begin like this; without it CreateFile knows only COM1 to COM9.
constexpr std::string_view device_prefix = R"(\\.\)";

Descriptor open_port(const std::string& path, SerialUse use) {
  const std::string name = path.starts_with(device_prefix) ? path : std::string(device_prefix) + path;
  const DWORD access = use == SerialUse::receive ? GENERIC_READ : GENERIC_READ | GENERIC_WRITE;
  constexpr DWORD alone = 0;  // another program cannot open the port meanwhile
  Handle port(::CreateFileW(utf16(name).c_str(), access, alone, nullptr, OPEN_EXISTING, FILE_FLAG_OVERLAPPED, nullptr));
  if (!port) throw open_failure(path, errno_of(::GetLastError()));
  DCB state{};
  state.DCBlength = sizeof state;
  if (!serial_calls().get_state(port.get(), state)) throw open_failure(path, errno_of(::GetLastError()));
  return descriptor_of(std::make_unique<PortStream>(std::move(port)));
}

PortStream& stream_of(int descriptor) { return dynamic_cast<PortStream&>(*waitable_of(descriptor)); }

// Sets how the driver controls RTS. Returns false if it refuses.
bool control_rts(int descriptor, DWORD control) {
  DCB state{};
  state.DCBlength = sizeof state;
  const HANDLE port = serial_handle(descriptor);
  if (!serial_calls().get_state(port, state)) return false;
  state.fRtsControl = static_cast<BYTE>(control & 3);
  return serial_calls().set_state(port, state);
}

}  // namespace

bool is_pseudo_terminal(const std::string&) { return false; }

SerialPort::SerialPort(const std::string& path, const LineSettings& settings, Rs485 rs485, const PulseWires& wires,
                       WireKernel& kernel, SerialUse use)
    : DescriptorPort(open_port(path, use), "the port " + path), path_(path) {
  const auto before = terminal_state(descriptor());
  if (!before) throw open_failure(path, errno);
  before_ = *before;
  ::PurgeComm(serial_handle(descriptor()), PURGE_TXCLEAR);
  try {
    apply(settings);
    const bool with_rts = uses_rts(wires, rs485);
    if (use == SerialUse::receive) {
      kernel.set_modem_line(descriptor(), ModemLine::rts, false);  // the adapter must not send
    } else {
      set_direction(with_rts ? Rs485::off : rs485);
      if (rs485 == Rs485::rts) switch_by_rts(kernel);
      take_wires(wires, kernel);
    }
  } catch (...) {
    restore_terminal(descriptor(), before_);
    throw;
  }
  shorten_latency();
  stream_of(descriptor()).discard_received();
}

SerialPort::~SerialPort() {
  stream_of(descriptor()).drain(1s);  // the last bytes leave at their rate
  restore_terminal(descriptor(), before_);
}

// A change of the rate leaves parity and stop bits unchanged.
void SerialPort::change_rate(std::uint32_t rate) {
  LineSettings settings = line_;
  settings.rate = rate;
  wait_until_sent();  // written bytes must leave at the old rate
  apply(settings);
}

bool SerialPort::is_gadget() const { return false; }

std::string SerialPort::rate_instead(std::uint32_t, std::uint32_t given) const {
  return "it stays at " + std::to_string(given) + ": use another rate, or another adapter";
}

// RTS is set while a port is open, as on other systems; with `on` the driver sets it only while it sends, and with
// `rts` it is clear until this port sets it. An adapter that switches by itself ignores RTS.
void SerialPort::set_direction(Rs485 rs485) {
  if (rs485 != Rs485::on) {
    control_rts(descriptor(), rs485 == Rs485::rts ? RTS_CONTROL_DISABLE : RTS_CONTROL_ENABLE);
    return;
  }
  kernel_direction_ = control_rts(descriptor(), RTS_CONTROL_TOGGLE);
  if (!kernel_direction_) {
    throw Failure(Failure::Kind::unsupported, "the driver of the port " + path_ +
                                                  " cannot switch the direction of RS-485 by RTS: use an adapter that "
                                                  "does it by itself, without rs485=on, or rs485=rts");
  }
}

void SerialPort::wait_until_sent() {
  stream_of(descriptor()).flush(os::now() + 1s);
  if (!serial_calls().flush(serial_handle(descriptor()))) fail(errno_of(::GetLastError()));
}

void SerialPort::shorten_latency() {
  set_latency(10ms);
  if (const auto milliseconds = latency_timer(path_)) {
    set_latency(latency() + std::chrono::milliseconds(*milliseconds));
    if (*milliseconds > 1) {
      notes_.push_back("the latency timer of " + path_ + " is " + std::to_string(*milliseconds) +
                       " ms, which limits the readings a second: " + way_to_shorter_latency(path_));
    }
  }
}

}  // namespace absenc::os
