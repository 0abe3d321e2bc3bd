// SPDX-License-Identifier: Apache-2.0
// Opens FTDI chips by libftdi. No other file includes it.
#include <ftdi.h>
#include <unistd.h>

#include <chrono>

#include "absenc/os/error.hpp"
#include "absenc/os/ftdi.hpp"
#include "absenc/os/linux/usb_device.hpp"
#include "absenc/os/serial_ports.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::os {

using namespace std::chrono_literals;

using Kind = Failure::Kind;

namespace {

// In milliseconds. After this time without a packet the chip sends one without replies, which a reading would have to
// fetch before its own. Replies do not wait for it, because the chip is told to send them at once (0x87).
constexpr unsigned char latency_ms = 16;

constexpr int usb_timeout_ms = 3000;

constexpr Time file_removal = 300ms;  // longest time between the failure of a transfer and the removal of the file

Failure ftdi_in_use(const FtdiAdapter& adapter) {
  const std::string holder = holder_of(adapter.device);
  return {
      "the " + adapter.words() + " is in use by " + (holder.empty() ? "another program" : holder) + ": end that first",
      Failure::Holder::program};
}

Failure lost(const FtdiAdapter& adapter) {
  return {Kind::lost, "the " + adapter.words() + " went away: was it unplugged?"};
}

class Channel final : public FtdiChannel {
 public:
  Channel(const FtdiAdapter& adapter, char channel) : adapter_(adapter), context_(::ftdi_new()) {
    if (context_ == nullptr) throw Failure(Kind::system, "libftdi did not start: is the computer out of memory?");
    try {
      open(channel);
    } catch (...) {
      ::ftdi_free(context_);
      throw;
    }
  }
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  // Switching the MPSSE off makes the pins inputs, so that the line rests.
  ~Channel() override {
    ::ftdi_set_bitmode(context_, 0, BITMODE_RESET);
    ::ftdi_usb_close(context_);
    ::ftdi_free(context_);
  }

  void write(Bytes commands) override {
    const int size = static_cast<int>(commands.size());
    check(::ftdi_write_data(context_, commands.data(), size) == size, "write");
  }
  [[nodiscard]] std::size_t read(MutableBytes into) override {
    const int size = ::ftdi_read_data(context_, into.data(), static_cast<int>(into.size()));
    check(size >= 0, "read");
    return static_cast<std::size_t>(size);
  }

 private:
  void open(char channel) {
    ::ftdi_set_interface(context_, static_cast<ftdi_interface>(INTERFACE_A + (channel - 'A')));
    context_->module_detach_mode = AUTO_DETACH_REATACH_SIO_MODULE;
    if (::ftdi_usb_open_bus_addr(context_, adapter_.bus, adapter_.address) < 0) throw refusal();
    context_->usb_read_timeout = context_->usb_write_timeout = usb_timeout_ms;
    check(::ftdi_set_latency_timer(context_, latency_ms) == 0, "set the latency timer");
    check(::ftdi_set_bitmode(context_, 0, BITMODE_RESET) == 0, "reset");
    check(::ftdi_tcioflush(context_) == 0, "flush");
    check(::ftdi_set_bitmode(context_, 0, BITMODE_MPSSE) == 0, "switch the MPSSE on");
  }

  // libftdi reports the step that failed, but not always the reason, so the device file is tried.
  [[nodiscard]] Failure refusal() const {
    if (::access(adapter_.device.c_str(), F_OK) != 0) return lost(adapter_);
    if (::access(adapter_.device.c_str(), R_OK | W_OK) != 0) return ftdi_no_permission(adapter_);
    const std::string text = ::ftdi_get_error_string(context_);
    if (text.find("claim") != std::string::npos) return ftdi_in_use(adapter_);
    return {Kind::system, "libftdi could not open the " + adapter_.words() + ": " + text};
  }

  void check(bool good, const char* what) const {
    if (good) return;
    // The kernel removes the file of an unplugged chip some time after the transfer has failed.
    for (const Time limit = os::now() + file_removal; os::now() < limit; os::sleep_until(os::now() + 10ms)) {
      if (::access(adapter_.device.c_str(), F_OK) != 0) throw lost(adapter_);
    }
    throw Failure(Kind::lost, "USB failed to " + std::string(what) + " the " + adapter_.words() + " (" +
                                  ::ftdi_get_error_string(context_) + "): unplug it and plug it in");
  }

  FtdiAdapter adapter_;
  ftdi_context* context_;
};

struct SystemFtdi final : ListedFtdi {
  std::unique_ptr<FtdiChannel> open(const FtdiAdapter& adapter, char channel) override {
    return std::make_unique<Channel>(adapter, channel);
  }
};

}  // namespace

bool use_ftdi() {
  static SystemFtdi usb;
  set_system_ftdi(usb);
  return true;
}

}  // namespace absenc::os
