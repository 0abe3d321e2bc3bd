// SPDX-License-Identifier: Apache-2.0
// Header that an Arduino sketch includes first, followed by the headers of its encoder, such as
// "absenc/protocol/tformat/host.hpp".
#pragma once

#include <Arduino.h>

#if __cplusplus < 202002L
#error "absenc needs C++20: esp32 3.0 and newer has it, other cores with compiler.cpp.extra_flags=-std=gnu++20"
#endif

// Macros of Arduino.h that clash with names of this library or the standard library.
#undef abs
#undef bit
#undef degrees
#undef max
#undef min
#undef radians
#undef round
#undef word

#include "absenc/host/carrier.hpp"
