// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/biss/host.hpp"

namespace absenc::biss {

void ReadPosition::clocked(BitView samples) {
  const unsigned follows = (found().life_counter + 1u) & low_mask(life_counter_bits);
  const Error error = take(samples);
  if (error != Error::none || format().check == Check::crc6) return conclude(error);
  if (second_) return conclude(found().life_counter == follows ? Error::none : Error::sequence_mismatch);
  second_ = true;
  ask();
}

}  // namespace absenc::biss
