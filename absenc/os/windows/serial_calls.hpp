// SPDX-License-Identifier: Apache-2.0
// The calls of Windows for a serial port, which tests replace: a pseudo-terminal under wine has no modem lines.
#pragma once

#include <windows.h>

namespace absenc::os {

/// Each function returns whether it succeeded; GetLastError has the reason if not.
struct SerialCalls {
  virtual ~SerialCalls() = default;
  virtual bool get_state(HANDLE port, DCB& state);
  virtual bool set_state(HANDLE port, const DCB& state);
  /// Calls EscapeCommFunction with SETRTS, CLRRTS, SETDTR or CLRDTR.
  virtual bool escape(HANDLE port, DWORD function);
  /// Waits until the port has sent all bytes.
  virtual bool flush(HANDLE port);
};
[[nodiscard]] SerialCalls& serial_calls();
/// Replaces the result of `serial_calls` by `calls`, which must outlive all ports. Null: those of Windows again.
void set_serial_calls(SerialCalls* calls);

/// Returns the handle of a serial port that DescriptorPort owns; null if `descriptor` is something else.
[[nodiscard]] HANDLE serial_handle(int descriptor);

}  // namespace absenc::os
