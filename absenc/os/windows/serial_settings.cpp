// SPDX-License-Identifier: Apache-2.0
// Line settings of a port: the structure DCB. Any baud rate can be requested; GetCommState reports the rate of the
// driver.
#include "absenc/os/serial_settings.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "absenc/os/pulse_wire.hpp"
#include "absenc/os/windows/errors.hpp"
#include "absenc/os/windows/overlapped.hpp"
#include "absenc/os/windows/serial_calls.hpp"

namespace absenc::os {

namespace {

static_assert(sizeof(DCB) <= sizeof(TerminalState));

SerialCalls of_windows;
SerialCalls* all_calls = &of_windows;

bool fail() {
  errno = errno_of(::GetLastError());
  return false;
}

bool get(int descriptor, DCB& state) {
  state = {};
  state.DCBlength = sizeof state;
  if (serial_handle(descriptor) != nullptr) return serial_calls().get_state(serial_handle(descriptor), state) || fail();
  errno = ENOTTY;
  return false;
}

void write_line(DCB& state, const LineSettings& settings) {
  const DWORD rts = state.fRtsControl;
  state = {};
  state.DCBlength = sizeof state;
  state.BaudRate = settings.rate;
  state.fBinary = TRUE;
  state.fParity = settings.parity != Parity::none ? TRUE : FALSE;
  state.ByteSize = static_cast<BYTE>(std::min<unsigned>(settings.data_bits, 8));
  state.Parity = settings.parity == Parity::none ? NOPARITY : settings.parity == Parity::odd ? ODDPARITY : EVENPARITY;
  state.StopBits = settings.stop_bits == 2 ? TWOSTOPBITS : ONESTOPBIT;
  // Another rate leaves the direction of RS-485 as it is.
  state.fRtsControl = (rts == RTS_CONTROL_HANDSHAKE ? RTS_CONTROL_ENABLE : rts) & 3;
  state.fDtrControl = DTR_CONTROL_ENABLE;
}

LineSettings read_line(const DCB& state) {
  LineSettings settings;
  settings.rate = state.BaudRate;
  settings.parity = state.Parity == ODDPARITY ? Parity::odd : state.Parity == EVENPARITY ? Parity::even : Parity::none;
  settings.stop_bits = state.StopBits == TWOSTOPBITS ? 2 : 1;
  settings.data_bits = state.ByteSize;
  return settings;
}

}  // namespace

bool SerialCalls::get_state(HANDLE port, DCB& state) { return ::GetCommState(port, &state) != 0; }

bool SerialCalls::set_state(HANDLE port, const DCB& state) {
  DCB copy = state;
  return ::SetCommState(port, &copy) != 0;
}

bool SerialCalls::escape(HANDLE port, DWORD function) { return ::EscapeCommFunction(port, function) != 0; }

bool SerialCalls::flush(HANDLE port) { return ::FlushFileBuffers(port) != 0; }

SerialCalls& serial_calls() { return *all_calls; }

void set_serial_calls(SerialCalls* calls) { all_calls = calls == nullptr ? &of_windows : calls; }

HANDLE serial_handle(int descriptor) {
  const auto* const stream = dynamic_cast<PortStream*>(waitable_of(descriptor));
  return stream == nullptr ? nullptr : stream->port();
}

std::optional<TerminalState> terminal_state(int descriptor) {
  DCB state{};
  if (!get(descriptor, state)) return std::nullopt;
  TerminalState saved{};
  std::memcpy(saved.data(), &state, sizeof state);
  return saved;
}

std::uint32_t terminal_rate(int descriptor) {
  DCB state{};
  return get(descriptor, state) ? state.BaudRate : 0;
}

void restore_terminal(int descriptor, const TerminalState& state) {
  DCB saved{};
  std::memcpy(&saved, state.data(), sizeof saved);
  if (const HANDLE port = serial_handle(descriptor)) serial_calls().set_state(port, saved);
}

std::optional<LineSettings> set_terminal(int descriptor, const LineSettings& settings) {
  DCB state{};
  if (!get(descriptor, state)) return std::nullopt;
  write_line(state, settings);
  if (!serial_calls().set_state(serial_handle(descriptor), state)) {
    // A driver refuses a rate, parity or number of bits that it cannot do: the caller finds out by what it has.
    if (const DWORD error = ::GetLastError(); error != ERROR_INVALID_PARAMETER) {
      errno = errno_of(error);
      return std::nullopt;
    }
  }
  if (!get(descriptor, state)) return std::nullopt;
  return read_line(state);
}

int WireKernel::set_modem_line(int descriptor, ModemLine line, bool set) {
  const DWORD function = line == ModemLine::rts ? (set ? SETRTS : CLRRTS) : (set ? SETDTR : CLRDTR);
  return serial_calls().escape(serial_handle(descriptor), function) || fail() ? 0 : -1;
}

bool has_gpio_lines() { return false; }

}  // namespace absenc::os
