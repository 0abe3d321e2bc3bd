// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/terminal_pair.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>

#include <array>
#include <cerrno>

#include "absenc/os/error.hpp"

namespace absenc::os {

TerminalPair open_terminal_pair() {
  const auto check = [](bool good) {
    if (!good) throw system_failure("making a pseudo-terminal", errno);
  };
  constexpr int flags = O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC;
  TerminalPair pair{.master = Descriptor(::posix_openpt(flags))};
  check(static_cast<bool>(pair.master) && ::grantpt(pair.master.get()) == 0 && ::unlockpt(pair.master.get()) == 0);
  std::array<char, 64> name{};
  check(::ptsname_r(pair.master.get(), name.data(), name.size()) == 0);
  pair.path = name.data();
  pair.slave = Descriptor(::open(pair.path.c_str(), flags));
  check(static_cast<bool>(pair.slave));
  termios settings{};
  check(::tcgetattr(pair.slave.get(), &settings) == 0);
  ::cfmakeraw(&settings);  // with the terminal's echo on, requests would be sent back to the host
  check(::tcsetattr(pair.slave.get(), TCSANOW, &settings) == 0);
  return pair;
}

}  // namespace absenc::os
