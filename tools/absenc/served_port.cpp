// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/served_port.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "absenc/host/drive.hpp"
#include "absenc/host/echo.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/serial.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/unit_text.hpp"

namespace absenc::tool {

namespace {

using namespace std::chrono_literals;

constexpr Time time_between_tries = 250ms;

/// Goes from one port to the next: the last one may have gone away between a transfer and its `sent`.
class Movable final : public Machine<std::uint8_t> {
 public:
  explicit Movable(Machine<std::uint8_t>& inner) : inner_(&inner) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::sent) sending_ = false;
    inner_->feed(event);
  }

  Step<std::uint8_t> next(Time now) override {
    const Step<std::uint8_t> step = inner_->next(now);
    if (step.kind == Step<std::uint8_t>::Kind::transfer) sending_ = true;
    return step;
  }

  void left(Time now) {
    if (sending_) feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});
  }

 private:
  Machine<std::uint8_t>* inner_;
  bool sending_ = false;
};

class Server {
 public:
  Server(Movable& machine, const EncoderUri& uri, Time send_slack, Time end)
      : machine_(&machine), uri_(&uri), send_slack_(send_slack), end_(end) {}

  // Until the end of the time, by Ended.
  [[noreturn]] void run() {
    for (;;) {
      try {
        serve();
      } catch (const os::Failure& failure) {
        if (state_ == State::new_here) throw;
        if (state_ == State::open) print_message(fmt::format("{}\n  Waiting for it to come back.", failure.what()));
        state_ = State::away;
      }
      if (os::now() >= end_) throw os::Ended{};
      os::sleep_until(std::min(os::now() + time_between_tries, end_));
    }
  }

 private:
  enum class State : std::uint8_t { new_here, open, away };

  void serve() {
    os::SerialPort port(uri_->path, uri_->line, uri_->rs485);
    if (uri_->latency) port.set_latency(*uri_->latency);
    port.set_send_slack(send_slack_);
    port.set_end(end_);
    if (state_ == State::away) {
      machine_->left(port.now());
      print_message(fmt::format("the port {} is back", uri_->path));
    } else {
      print_line(fmt::format("ready: {}", uri_->path));
    }
    state_ = State::open;
    host::drive(*machine_, port, [] { return true; });
  }

  Movable* machine_;
  const EncoderUri* uri_;
  Time send_slack_;
  Time end_;
  State state_ = State::new_here;
};

}  // namespace

EncoderUri parse_served_port(const Unit& unit, std::string_view text) {
  const EncoderUri uri = parse_encoder(fmt::format("{}:{}", unit.id, text));
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

void serve_port(Machine<std::uint8_t>& device, const EncoderUri& uri, Time send_slack, Time end) {
  // Only a host can find out by itself whether it hears itself: it speaks first.
  host::EchoFilter line(uri.echo == host::EchoMode::on ? host::EchoMode::on : host::EchoMode::off);
  line.attach(device);
  Movable machine(line);
  try {
    Server(machine, uri, send_slack, end).run();
  } catch (const os::Interrupted&) {
  } catch (const os::Ended&) {
  }
}

}  // namespace absenc::tool
