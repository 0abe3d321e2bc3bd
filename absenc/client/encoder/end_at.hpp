// SPDX-License-Identifier: Apache-2.0
// Ends waits for an encoder at a deadline.
#pragma once

#include <functional>
#include <utility>

#include "absenc/client/encoder.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

class EndAt {
 public:
  EndAt(Encoder& encoder, Time end) : encoder_(encoder), before_(encoder.end_when({})) {
    encoder.end_when([end, this] { return os::now() >= end || (before_ && before_()); });
  }
  EndAt(const EndAt&) = delete;
  EndAt& operator=(const EndAt&) = delete;
  ~EndAt() { encoder_.end_when(std::move(before_)); }

 private:
  Encoder& encoder_;
  std::function<bool()> before_;
};

}  // namespace absenc::client
