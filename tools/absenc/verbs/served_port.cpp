// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/verbs/served_port.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>

#include "absenc/client/emulation/attended.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/socketcan.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/text/output.hpp"

namespace absenc::tool {

namespace {

using namespace std::chrono_literals;

constexpr Time time_between_tries = 250ms;

/// Goes from one port to the next: the last one may have gone away between a transfer and its `sent`.
template <class Item>
class Movable final : public Machine<Item> {
 public:
  explicit Movable(Machine<Item>& inner) : inner_(&inner) {}

  void feed(const Event<Item>& event) override {
    if (event.kind == Event<Item>::Kind::sent) sending_ = false;
    inner_->feed(event);
  }

  Step<Item> next(Time now) override {
    const Step<Item> step = inner_->next(now);
    if (step.kind == Step<Item>::Kind::transfer) sending_ = true;
    if (step.kind == Step<Item>::Kind::configure) rate_ = step.settings.rate;
    return step;
  }

  void left(Time now) {
    if (sending_) feed({.kind = Event<Item>::Kind::sent, .at = now});
  }

  /// What it has set the last port to; 0: nothing.
  [[nodiscard]] std::uint32_t rate() const { return rate_; }

 private:
  Machine<Item>* inner_;
  bool sending_ = false;
  std::uint32_t rate_ = 0;
};

/// `Open` makes the port.
template <class Item, class Open>
class Server {
 public:
  Server(Machine<Item>& machine, const std::string& name, Time end, const Open& open)
      : machine_(machine), name_(name), end_(end), open_(open) {}

  // Until a signal or the end of the time.
  void run() {
    try {
      go_on();
    } catch (const os::Interrupted&) {
    } catch (const os::Ended&) {
    }
  }

 private:
  enum class State : std::uint8_t { new_here, open, away };

  [[noreturn]] void go_on() {
    for (;;) {
      try {
        serve();
      } catch (const os::Failure& failure) {
        // What the port cannot do, it cannot do later either.
        const bool unable = state_ == State::open && failure.kind() == os::Failure::Kind::unsupported;
        if (state_ == State::new_here || unable) throw;
        if (state_ == State::open) print_message(fmt::format("{}\n  Waiting for it to come back.", failure.what()));
        state_ = State::away;
      }
      if (os::now() >= end_) throw os::Ended{};
      os::sleep_until(std::min(os::now() + time_between_tries, end_));
    }
  }

  void serve() {
    const auto port = open_();
    port->set_end(end_);
    if (state_ == State::away) {
      machine_.left(port->now());
      if (machine_.rate() != 0) {
        port->begin({.kind = Step<Item>::Kind::configure, .settings = {.rate = machine_.rate()}});
      }
      print_message(fmt::format("the port {} is back", name_));
    } else {
      print_line(fmt::format("ready: {}", name_));
    }
    state_ = State::open;
    host::drive(machine_, *port, [] { return true; });
  }

  Movable<Item> machine_;
  std::string name_;
  Time end_;
  Open open_;
  State state_ = State::new_here;
};

}  // namespace

EncoderAddress parse_served_port(const Unit& unit, std::string_view text) {
  const EncoderAddress uri = parse_address(fmt::format("{}:{}", unit.id, text));
  if (uri.place != Place::serial) {
    throw UsageError(fmt::format("--port is \"{}\", but must be a serial port, as in /dev/ttyUSB1", text));
  }
  std::string_view rest = text.substr(std::min(text.find('?'), text.size()));
  while (!rest.empty()) {
    rest.remove_prefix(1);
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view name = split_setting(rest.substr(0, end)).name;
    if (find_link_parameter(name) == nullptr) {
      throw UsageError(fmt::format("{} is no setting of a port: write --option or --model for the encoder", name));
    }
    rest.remove_prefix(end);
  }
  return uri;
}

void serve_port(Machine<std::uint8_t>& device, const EncoderAddress& uri, Time end) {
  // Only a host can find out by itself whether it hears itself: it speaks first.
  host::EchoFilter line(uri.echo == host::EchoMode::on ? host::EchoMode::on : host::EchoMode::off);
  line.attach(device);
  Server(static_cast<Machine<std::uint8_t>&>(line), uri.path, end, [&] {
    auto port = std::make_unique<os::SerialPort>(uri.path, uri.line, uri.rs485);
    if (uri.latency) port->set_latency(*uri.latency);
    port->set_send_slack(send_slack);
    return port;
  }).run();
}

void serve_interface(Machine<CanFrame>& device, const std::string& interface, const LineSettings& line, Time end) {
  Server(device, interface, end, [&] { return std::make_unique<os::SocketCan>(interface, line); }).run();
}

}  // namespace absenc::tool
