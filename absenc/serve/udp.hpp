// SPDX-License-Identifier: Apache-2.0
// Sends good readings as JSON datagrams in the format of PlotJuggler, in its own thread.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "absenc/os/network.hpp"
#include "absenc/serve/fleet.hpp"
#include "absenc/serve/outlets.hpp"

namespace absenc::serve {

class UdpSender {
 public:
  /// Starts the sender thread. `fleet` must outlive this object. Throws os::Failure.
  UdpSender(const UdpSettings& settings, const Fleet& fleet);
  ~UdpSender();

 private:
  void work(const std::stop_token& stop);

  os::Datagrams socket_;
  const Fleet* fleet_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::jthread thread_;  // the last member: when the thread starts, all members that it uses exist
};

}  // namespace absenc::serve
