// SPDX-License-Identifier: Apache-2.0
// An FT232H for ftdi_test.py: a function of the kernel's FunctionFS whose bulk endpoints are an MPSSE of test code,
// with a virtual encoder on its pins. Usage: ftdi_device FOLDER WHAT [VCD]. FOLDER: where FunctionFS is mounted; WHAT:
// "PROTOCOL?settings" as behind sim:, "flash" or "nothing". VCD: a file for the waveform. Prints "ready", then takes
// lines from standard input and answers each with "done": "delay NS", "stuck 0|1", "no-transceiver", "no-clock",
// "swap-clock", "flip N", "good", "counts" (prints counters first).
#include <fcntl.h>
#include <linux/usb/functionfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "absenc/client/port/address.hpp"
#include "absenc/client/port/virtual_device.hpp"
#include "absenc/os/signals.hpp"
#include "tests/ftdi/flash.hpp"
#include "tests/ftdi/wires.hpp"

using namespace absenc;

namespace {

constexpr std::uint16_t packet = 512;  // bytes of a bulk packet of high-speed USB

// Descriptors of an FT232H: one interface of the vendor's class with a bulk endpoint in each direction (0x81, 0x02).
// All numbers in USB are little-endian, as the computers on which this test runs.
static_assert(std::endian::native == std::endian::little);
#pragma pack(push, 1)
struct Endpoint {
  std::uint8_t length = 7, type = USB_DT_ENDPOINT, address, attributes = USB_ENDPOINT_XFER_BULK;
  std::uint16_t packet_size;
  std::uint8_t interval = 0;
};
struct Function {
  usb_interface_descriptor interface { 9, USB_DT_INTERFACE, 0, 0, 2, 0xFF, 0xFF, 0xFF, 1 };
  Endpoint in, out;
};
struct Descriptors {
  usb_functionfs_descs_head_v2 head;
  std::uint32_t full_count = 3, high_count = 3;
  Function full{.in = {.address = 0x81, .packet_size = 64}, .out = {.address = 0x02, .packet_size = 64}};
  Function high{.in = {.address = 0x81, .packet_size = packet}, .out = {.address = 0x02, .packet_size = packet}};
};
struct Strings {
  usb_functionfs_strings_head head;
  std::uint16_t language = 0x0409;
  char text[16] = "Single RS232-HS";
};
#pragma pack(pop)

[[noreturn]] void fail(const char* what) {
  std::perror(what);
  std::_Exit(1);
}

int open_endpoint(const std::string& folder, const char* name) {
  const int file = ::open((folder + '/' + name).c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) fail(name);
  return file;
}

class Chip {
 public:
  Chip(const std::string& folder, ftdi::Wires& wires) : control_(open_endpoint(folder, "ep0")), mpsse_(wires) {
    Descriptors descriptors{};
    descriptors.head = {FUNCTIONFS_DESCRIPTORS_MAGIC_V2, sizeof descriptors,
                        FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_ALL_CTRL_RECIP};
    if (::write(control_, &descriptors, sizeof descriptors) < 0) fail("descriptors");
    Strings strings{};
    strings.head = {FUNCTIONFS_STRINGS_MAGIC, sizeof strings, 1, 1};
    if (::write(control_, &strings, sizeof strings) < 0) fail("strings");
    in_ = open_endpoint(folder, "ep1");
    out_ = open_endpoint(folder, "ep2");
    for (void (Chip::*run)() : {&Chip::serve_control, &Chip::serve_out, &Chip::serve_in}) {
      std::thread(run, this).detach();
    }
  }

  /// Calls `use` with the MPSSE while no other thread uses it.
  template <class Use>
  void with(Use use) {
    const std::lock_guard lock(mutex_);
    use(mpsse_);
  }

  std::atomic<unsigned> writes{0}, packets{0};

 private:
  // Requests of the FTDI driver to the chip (the kernel's ftdi_sio.h).
  enum Request : std::uint8_t {
    reset = 0,
    modem_status = 5,
    set_latency = 9,
    get_latency = 10,
    set_mode = 11,
    pins = 12
  };

  void serve_control() {
    for (;;) {
      usb_functionfs_event event{};
      if (::read(control_, &event, sizeof event) < static_cast<ssize_t>(sizeof event)) {
        if (errno == EINTR || errno == EAGAIN) continue;
        return;
      }
      if (event.type == FUNCTIONFS_ENABLE || event.type == FUNCTIONFS_DISABLE) {
        with([](ftdi::Mpsse& mpsse) { mpsse.reset(os::now()); });
        is_mpsse_ = false;
      }
      if (event.type == FUNCTIONFS_SETUP) answer(event.u.setup);
    }
  }

  void answer(const usb_ctrlrequest& request) {
    const std::lock_guard lock(mutex_);
    std::vector<std::uint8_t> reply;
    switch (request.bRequest) {
      case reset:  // 0: the chip, 1: replies, 2: commands
        if (request.wValue == 0) mpsse_.purge(true, true);
        if (request.wValue == 1) mpsse_.purge(false, true);
        if (request.wValue == 2) mpsse_.purge(true, false);
        break;
      case modem_status:
        reply = {0x32, 0x60};
        break;
      case set_latency:
        latency_ = std::chrono::milliseconds(request.wValue & 0xFF);
        break;
      case get_latency:
        reply = {static_cast<std::uint8_t>(std::chrono::duration_cast<std::chrono::milliseconds>(latency_).count())};
        break;
      case set_mode:  // 2: MPSSE; all others are not simulated
        is_mpsse_ = request.wValue >> 8 == 2;
        mpsse_.reset(os::now());
        break;
      case pins:
        reply = {mpsse_.levels()};
        break;
      default:  // baud rate, flow control and so on: without a meaning for the MPSSE
        if ((request.bRequestType & USB_DIR_IN) != 0) reply.assign(request.wLength, 0xFF);  // an empty EEPROM
    }
    changed_.notify_all();
    if ((request.bRequestType & USB_DIR_IN) != 0) {
      reply.resize(std::min<std::size_t>(reply.size(), request.wLength));
      static_cast<void>(::write(control_, reply.data(), reply.size()));
    } else {
      static_cast<void>(::read(control_, nullptr, 0));
    }
  }

  void serve_out() {
    std::vector<std::uint8_t> bytes(64 * packet);
    for (;;) {
      const ssize_t size = ::read(out_, bytes.data(), bytes.size());
      if (size < 0) {
        if (errno == EINTR || errno == EAGAIN) continue;
        if (!wait_for_plug()) return;
        continue;
      }
      ++writes;
      const std::lock_guard lock(mutex_);
      if (is_mpsse_) mpsse_.take(Bytes(bytes).first(static_cast<std::size_t>(size)), os::now());
      changed_.notify_all();
    }
  }

  // Sends a packet when replies are ready, and an empty one with the two bytes of the state each time the latency timer
  // ends.
  void serve_in() {
    for (;;) {
      std::vector<std::uint8_t> bytes{0x32, 0x60};
      {
        std::unique_lock lock(mutex_);
        const Time end = os::now() + latency_;
        for (;;) {
          const Time ready = std::min(end, mpsse_.ready_at(latency_));
          const Time now = os::now();
          if (now >= ready) break;
          changed_.wait_for(lock, ready - now);
        }
        // Each packet begins with the state; full packets may follow each other in one transfer.
        std::vector<std::uint8_t> replies = mpsse_.replies(os::now(), latency_, packet - 2);
        bytes.insert(bytes.end(), replies.begin(), replies.end());
        for (int more = 1; more < 64 && replies.size() == packet - 2; ++more) {
          replies = mpsse_.replies(os::now(), latency_, packet - 2);
          if (replies.empty()) break;
          bytes.insert(bytes.end(), {0x32, 0x60});
          bytes.insert(bytes.end(), replies.begin(), replies.end());
        }
      }
      ++packets;
      if (::write(in_, bytes.data(), bytes.size()) >= 0) continue;
      if (errno == EINTR || errno == EAGAIN) continue;
      if (!wait_for_plug()) return;
    }
  }

  // Waits a moment after an error if it says that the chip is unplugged; otherwise returns false.
  static bool wait_for_plug() {
    if (errno != ESHUTDOWN) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return true;
  }

  int control_, in_ = -1, out_ = -1;
  std::mutex mutex_;
  std::condition_variable changed_;
  ftdi::Mpsse mpsse_;
  Time latency_ = std::chrono::milliseconds(16);
  bool is_mpsse_ = false;
};

struct Nothing final : ftdi::Wires {
  void change(Time, std::uint8_t, std::uint8_t) override {}
  bool data(Time) override { return true; }
};

int run(const std::string& folder, const std::string& what, const char* vcd) {
  std::unique_ptr<client::VirtualDevice> device;
  std::unique_ptr<ftdi::Wires> wires;
  ftdi::EncoderWires* encoder = nullptr;
  if (what == "flash") {
    wires = std::make_unique<ftdi::FlashWires>();
  } else if (what == "nothing") {
    wires = std::make_unique<Nothing>();
  } else {
    const client::EncoderAddress address = client::parse_address("sim:" + what);
    device = std::make_unique<client::VirtualDevice>(*address.unit, address.options, address.device);
    device->power_on(os::now());
    auto made = std::make_unique<ftdi::EncoderWires>(address.unit->link, address.line, *device->bytes());
    encoder = made.get();
    if (vcd != nullptr) encoder->record();
    wires = std::move(made);
  }
  Chip chip(folder, *wires);
  std::puts("ready");
  std::fflush(stdout);
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string order;
    long long number = 0;
    words >> order >> number;
    chip.with([&](ftdi::Mpsse& mpsse) {
      if (order == "counts") {
        std::printf("writes %u packets %u misused %u unknown %u rate %.0f\n", chip.writes.exchange(0),
                    chip.packets.exchange(0), mpsse.misused(), mpsse.unknown(), mpsse.rate());
      }
      if (encoder == nullptr) return;
      if (order == "good") encoder->fault = {};
      if (order == "delay") encoder->fault.delay = Time(number);
      if (order == "stuck") encoder->fault.stuck = number != 0;
      if (order == "no-transceiver") encoder->fault.no_transceiver = true;
      if (order == "no-clock") encoder->fault.no_clock = true;
      if (order == "swap-clock") encoder->fault.clock_swapped = true;
      if (order == "flip") encoder->fault.flip_every = static_cast<std::uint32_t>(number);
    });
    std::puts("done");
    std::fflush(stdout);
  }
  if (vcd != nullptr && encoder != nullptr) {
    std::ofstream file(vcd);
    chip.with([&](ftdi::Mpsse&) {
      encoder->pass(os::now());
      encoder->write_vcd(file);
    });
  }
  std::fflush(stdout);
  std::_Exit(0);  // the threads wait in system calls
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 3) return 2;
  try {
    return run(arguments[1], arguments[2], count > 3 ? arguments[3] : nullptr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
