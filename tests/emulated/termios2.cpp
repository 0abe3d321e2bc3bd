// SPDX-License-Identifier: Apache-2.0
// A library that is loaded before the C library of a command in qemu's user mode emulation, which has no calls for
// rates of serial ports by number (TCGETS2, TCSETS2). Here those calls keep the rate and use the old calls, which is
// enough for pseudo-terminals, because these have no rate.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <dlfcn.h>
#include <linux/ioctl.h>

#include <array>
#include <cstdarg>

namespace {

struct Rates {
  unsigned in = 38400, out = 38400;
};
std::array<Rates, 1024> rates_by_descriptor;

// The old structure is the beginning of the new one. These are the numbers of the old calls on ARM.
constexpr unsigned long old_get = 0x5401, old_set = 0x5402;

}  // namespace

extern "C" int ioctl(int descriptor, unsigned long request, ...) {
  static const auto next = reinterpret_cast<int (*)(int, unsigned long, void*)>(dlsym(RTLD_NEXT, "ioctl"));
  va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  const bool gets = request == TCGETS2;
  const bool sets = request >= TCSETS2 && request <= TCSETSF2;
  if ((!gets && !sets) || descriptor < 0 || descriptor >= static_cast<int>(rates_by_descriptor.size())) {
    return next(descriptor, request, argument);
  }
  auto& settings = *static_cast<termios2*>(argument);
  Rates& rates = rates_by_descriptor[static_cast<unsigned>(descriptor)];
  if (gets) {
    const int result = next(descriptor, old_get, argument);
    settings.c_ispeed = rates.in;
    settings.c_ospeed = rates.out;
    return result;
  }
  rates = {settings.c_ispeed, settings.c_ospeed};
  termios2 without_rate = settings;
  without_rate.c_cflag = (settings.c_cflag & ~static_cast<unsigned>(CBAUD | CIBAUD)) | B38400;
  return next(descriptor, old_set + (request - TCSETS2), &without_rate);
}
