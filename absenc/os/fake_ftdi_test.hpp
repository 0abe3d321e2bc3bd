// SPDX-License-Identifier: Apache-2.0
// Test replacement for FTDI chips on USB: an MPSSE with a virtual encoder, in step with the real clock.
#pragma once

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "absenc/os/error.hpp"
#include "absenc/os/ftdi_usb.hpp"
#include "absenc/os/signals.hpp"
#include "tests/ftdi/wires.hpp"

namespace absenc::os::testing {

[[nodiscard]] inline FtdiAdapter ftdi_chip(std::uint16_t product, std::uint16_t release, std::string serial) {
  FtdiAdapter adapter{.usb = {.vendor = 0x0403, .product = product, .release = release}};
  adapter.usb.serial_number = std::move(serial);
  describe_chip(adapter);
  return adapter;
}

/// A computer with one FT232H, whose channel leads to a virtual encoder.
class FakeFtdi final : public FtdiUsb {
 public:
  explicit FakeFtdi(ftdi::Wires& wires) : mpsse(wires) {}

  std::vector<FtdiAdapter> adapters() override { return plugged; }
  std::unique_ptr<FtdiChannel> open(const FtdiAdapter& adapter, char channel) override {
    opened = adapter.words() + '/' + channel;
    mpsse.reset(os::now());
    return std::make_unique<Channel>(*this);
  }

  std::vector<FtdiAdapter> plugged{ftdi_chip(0x6014, 0x0900, "FT1ABC")};
  ftdi::Mpsse mpsse;
  std::string opened;   // adapter and channel that were opened last
  unsigned writes = 0;  // number of USB transfers to the chip
  bool is_unplugged = false;
  bool is_deaf = false;             // whether the chip answers nothing
  std::vector<std::uint8_t> stale;  // replies that an earlier program left

 private:
  struct Channel final : FtdiChannel {
    explicit Channel(FakeFtdi& fake) : all(&fake) {}
    void write(Bytes commands) override {
      if (all->is_unplugged) throw Failure(Failure::Kind::lost, "unplugged");
      ++all->writes;
      all->mpsse.take(commands, os::now());
    }
    std::size_t read(MutableBytes into) override {
      if (all->is_unplugged) throw Failure(Failure::Kind::lost, "unplugged");
      if (!all->stale.empty()) {
        const std::size_t size = std::min(into.size(), all->stale.size());
        std::copy_n(all->stale.begin(), size, into.begin());
        all->stale.erase(all->stale.begin(), all->stale.begin() + static_cast<std::ptrdiff_t>(size));
        return size;
      }
      constexpr Time latency = std::chrono::milliseconds(1);
      sleep_until(std::min(os::now() + latency, all->mpsse.ready_at(latency)));
      if (all->is_deaf) return 0;
      const std::vector<std::uint8_t> ready = all->mpsse.replies(os::now(), latency, into.size());
      std::copy(ready.begin(), ready.end(), into.begin());
      return ready.size();
    }
    FakeFtdi* all;
  };
};

}  // namespace absenc::os::testing
