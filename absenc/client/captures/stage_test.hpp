// SPDX-License-Identifier: Apache-2.0
// Runs commands of a unit against its virtual encoder in virtual time, and draws the traffic.
#pragma once

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absenc/capture/annotate/drawing.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/port/virtual_device.hpp"
#include "absenc/client/row.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/session.hpp"
#include "absenc/sim/sim_port.hpp"
#include "absenc/sim/waveform.hpp"

namespace absenc::client {

/// The field values of one command of a host, or of one exchange of a capture.
struct Said {
  std::string what;  // description: the command, or the kind of the exchange with its frames
  Time begin{};
  Time end{};
  Error error = Error::none;
  std::string words{};
  Answer answer{};
  std::optional<Reading> reading{};
  // whether the verb is `read` or `read_part`, so that all values come from the encoder's replies
  bool reads = false;
  bool is_special = false;  // whether the verb is `run`; such a command may try requests that fail
  unsigned exchanges = 0;   // number of requests, pulses or transfers of the conversation
  // whether the error is a verdict over several replies, not an error of the last one
  bool is_verdict = false;
};

/// Forwards the steps of a host to the port and counts its transfers and pulses.
template <class Item>
class HostEnd final : public Port<Item> {
 public:
  HostEnd(Port<Item>& port, std::uint32_t of_line) : rate(of_line), port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const Step<Item>& step) override {
    if (step.kind == Step<Item>::Kind::configure) {
      moved = moved || step.rate != rate;
    } else {
      ++transfers;
    }
    port_.begin(step);
  }
  Event<Item> wait(const Step<Item>& step) override { return port_.wait(step); }

  std::uint32_t rate;
  unsigned transfers = 0;
  bool moved = false;  // whether the host has changed the rate of the line, which a capture cannot follow

 private:
  Port<Item>& port_;
};

/// Connects a virtual encoder and its host by wires.
class Stage {
 public:
  explicit Stage(const std::string& text)
      : address(parse_address(text)),
        device_(*address.unit, address.options, address.device),
        drawing_("capture"),
        sink_(drawing_, idle()),
        waveform_(address.unit->link, line(), sink_) {
    device_.power_on(Time{});
  }

  [[nodiscard]] LineSettings line() const { return address.line.with_some_rate(); }

  /// Runs the commands one after the other, and adds to `live` the results that a capture can also show.
  void run(const std::vector<const Command*>& commands) {
    if (device_.bytes() != nullptr) {
      run_on(*device_.bytes(), commands);
    } else {
      run_on(*device_.frames(), commands);
    }
  }

  void write(const std::string& path) {
    sink_.finish(waveform_, idle(), end_);
    std::ofstream out(path, std::ios::binary);
    capture::write_vcd(out, drawing_);
  }

  /// Returns the silence that decoders need before the first and after the last character.
  [[nodiscard]] Time idle() const { return std::max<Time>(std::chrono::milliseconds(1), 5 * line().character()); }
  EncoderAddress address;
  std::vector<Said> live;

 private:
  template <class Item>
  void run_on(Machine<Item>& device, const std::vector<const Command*>& commands) {
    sim::SimPort<Item> line_port(address.unit->link, line(), device);
    waveform_.observe(line_port.line());
    HostEnd<Item> port(line_port, line().rate);
    std::vector<std::byte> storage(address.unit->host_storage);
    const bool may_echo = address.device.faults == std::vector<std::string>{"echo=1"};
    host::Session<Item> session(*address.unit, address.options, port, storage,
                                may_echo ? host::EchoMode::automatic : host::EchoMode::off, 1);
    const Time pause = address.unit->timing.turnaround_limit + std::chrono::milliseconds(2);
    const auto rest = [&] {
      const Time until = line_port.now() + pause;
      while (line_port.now() < until) static_cast<void>(line_port.wait({.at = until}));
    };
    for (const Command* command : commands) {
      for (const std::vector<std::int64_t>& arguments : arguments_of(*command)) {
        if (!converse(session, port, *command, arguments)) continue;
        rest();
        end_ = line_port.now();
        break;
      }
    }
  }

  // Returns two lists of arguments for the command: the required arguments have their smallest values in the first list
  // and their greatest ones in the second; the other arguments have their defaults.
  static std::vector<std::vector<std::int64_t>> arguments_of(const Command& command) {
    std::vector<std::vector<std::int64_t>> all(2);
    for (const Argument& argument : command.arguments) {
      all[0].push_back(argument.required ? argument.minimum : argument.default_value);
      all[1].push_back(argument.required ? argument.maximum : argument.default_value);
    }
    return all;
  }

  // Runs a command with these arguments; returns false if the command cannot be run.
  template <class Item>
  bool converse(host::Session<Item>& session, HostEnd<Item>& port, const Command& command,
                const std::vector<std::int64_t>& arguments) {
    const Time begin = port.now();
    port.transfers = 0;
    const Conversation<Item>* conversation = session.run(command, arguments);
    if (conversation == nullptr || conversation->error() == Error::invalid_argument) return false;
    Said said{.what = std::string(command.name), .begin = begin, .end = port.now(), .error = conversation->error()};
    said.words = std::string(conversation->detail());
    said.exchanges = port.transfers;
    said.is_special = command.verb == Verb::run;
    said.reads = command.verb <= Verb::read_part;
    AnswerSink sink;
    if (said.error == Error::none) conversation->report(sink);
    if (said.error == Error::none && conversation->reading() != nullptr) {
      said.reading = *conversation->reading();
      sink.put_reading(*said.reading);
    }
    said.answer = std::move(sink.answer);
    if constexpr (std::is_same_v<Item, CanFrame>) {
      said.is_verdict = said.error == Error::cross_check_failed;
    } else {
      // If the last reply is good, the failure is a verdict of the procedure.
      const Exchange<Item> last = conversation->exchange();
      const bool has_bytes = !carries_bits(address.unit->link) && !last.received.empty();
      said.is_verdict = has_bytes && address.unit->check(address.options, {.bytes = last.sent},
                                                         {.bytes = last.received}) == Error::none;
    }
    // The error `not_still` compares two good replies, so it is always a verdict over several replies.
    said.is_verdict = said.is_verdict || said.error == Error::not_still;
    // After a change of the rate a capture cannot be decoded, except on clocked lines.
    const bool can_follow = !port.moved || address.unit->link == LinkKind::clocked;
    if (can_follow && said.error != Error::unsupported) live.push_back(std::move(said));
    return true;
  }

  Time end_{};
  VirtualDevice device_;
  capture::Drawing drawing_;
  capture::WaveformSink<sim::Waveform> sink_;
  sim::Waveform waveform_;
};

}  // namespace absenc::client
