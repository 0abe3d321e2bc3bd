// SPDX-License-Identifier: Apache-2.0
// Lets a program that includes this file use the ports that need libraries of the system, if it is built with them. The
// headers need no call.
#pragma once

#ifdef ABSENC_FTDI
#include "absenc/os/ftdi.hpp"
#endif
#ifdef ABSENC_GPIO
#include "absenc/os/gpio.hpp"
#endif
