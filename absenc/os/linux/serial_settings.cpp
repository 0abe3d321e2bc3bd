// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/serial_settings.hpp"

#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>

namespace absenc::os {

namespace {

static_assert(sizeof(termios2) == sizeof(TerminalState));

// Flags of termios for 5, 6, 7 and 8 data bits in a character.
constexpr std::array<tcflag_t, 4> sizes{CS5, CS6, CS7, CS8};

void write_line(termios2& state, const LineSettings& settings) {
  state.c_iflag = 0;
  state.c_oflag = 0;
  state.c_lflag = 0;
  state.c_cflag &= ~static_cast<tcflag_t>(CBAUD | CIBAUD | CSIZE | CSTOPB | PARENB | PARODD | CMSPAR | CRTSCTS);
  state.c_cflag |= BOTHER | CREAD | CLOCAL;
  state.c_cflag |= sizes[std::min<std::size_t>(settings.data_bits, 8) - 5];
  if (settings.parity != Parity::none) state.c_cflag |= PARENB;
  if (settings.parity == Parity::odd) state.c_cflag |= PARODD;
  if (settings.stop_bits == 2) state.c_cflag |= CSTOPB;
  state.c_ispeed = settings.rate;
  state.c_ospeed = settings.rate;
  // VMIN 1 distinguishes two cases: a non-blocking read without data fails with EAGAIN, a read at the end of the
  // stream returns 0.
  state.c_cc[VMIN] = 1;
  state.c_cc[VTIME] = 0;
}

LineSettings read_line(const termios2& state) {
  LineSettings settings;
  settings.rate = state.c_ospeed;
  if ((state.c_cflag & PARENB) != 0) settings.parity = (state.c_cflag & PARODD) != 0 ? Parity::odd : Parity::even;
  settings.stop_bits = (state.c_cflag & CSTOPB) != 0 ? 2 : 1;
  const auto* const size = std::find(sizes.begin(), sizes.end(), state.c_cflag & CSIZE);
  settings.data_bits = static_cast<std::uint8_t>(5 + (size - sizes.begin()));
  return settings;
}

}  // namespace

std::optional<TerminalState> terminal_state(int descriptor) {
  termios2 state{};
  if (::ioctl(descriptor, TCGETS2, &state) < 0) return std::nullopt;
  return std::bit_cast<TerminalState>(state);
}

std::uint32_t terminal_rate(int descriptor) {
  termios2 state{};
  return ::ioctl(descriptor, TCGETS2, &state) < 0 ? 0 : read_line(state).rate;
}

void restore_terminal(int descriptor, const TerminalState& state) { ::ioctl(descriptor, TCSETSW2, &state); }

std::optional<LineSettings> set_terminal(int descriptor, const LineSettings& settings) {
  termios2 state{};
  if (::ioctl(descriptor, TCGETS2, &state) < 0) return std::nullopt;
  write_line(state, settings);
  int result = 0;
  do {
    result = ::ioctl(descriptor, TCSETSW2, &state);
  } while (result < 0 && errno == EINTR);
  if (result < 0 || ::ioctl(descriptor, TCGETS2, &state) < 0) return std::nullopt;
  return read_line(state);
}

}  // namespace absenc::os
