// SPDX-License-Identifier: Apache-2.0
// Every reading as a datagram of JSON, as PlotJuggler takes it, in a thread of its own. What nobody takes is lost.
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
  /// `fleet` outlives it. Throws os::Failure: there is no such host.
  UdpSender(const UdpSettings& settings, const Fleet& fleet);
  ~UdpSender();

 private:
  void work(const std::stop_token& stop);

  os::Datagrams socket_;
  const Fleet* fleet_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::serve
