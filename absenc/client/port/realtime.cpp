// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/realtime.hpp"

#include <algorithm>
#include <exception>
#include <thread>

#include "absenc/client/error.hpp"
#include "absenc/os/realtime.hpp"

namespace absenc::client {

void require_realtime(int priority) {
  if (priority == 0) return;
  try {
    os::require_realtime(priority);
  } catch (const os::Failure& failure) {
    throw Failure(failure.what());
  }
}

void check_realtime(std::span<const EncoderAddress> encoders) {
  int highest = 0;
  for (const EncoderAddress& one : encoders) highest = std::max(highest, one.realtime);
  if (highest == 0) return;
  std::exception_ptr refused;
  std::thread([&] {
    try {
      require_realtime(highest);
    } catch (const Failure&) {
      refused = std::current_exception();
    }
  }).join();
  if (refused) std::rethrow_exception(refused);
}

}  // namespace absenc::client
