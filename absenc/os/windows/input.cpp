// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/input.hpp"

#include "absenc/os/windows/waitable.hpp"

namespace absenc::os {

std::ptrdiff_t read_what_is_there(int descriptor, MutableBytes into) { return waitable_of(descriptor)->read(into); }

void allow_background(int) {}  // a console has no background

}  // namespace absenc::os
