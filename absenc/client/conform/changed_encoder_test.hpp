// SPDX-License-Identifier: Apache-2.0
// Virtual encoders that disobey requests which change them, for tests.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absenc/client/conform/mutant_test.hpp"
#include "absenc/client/row.hpp"
#include "absenc/host/session.hpp"
#include "absenc/os/error.hpp"
#include "absenc/sim/rough_line.hpp"

namespace absenc::client {

using ByteList = std::vector<std::uint8_t>;

/// An encoder that ignores some requests, damages some replies or corrupts some writes.
template <class Item>
class Disobedient final : public Machine<Item> {
 public:
  using Kind = typename Event<Item>::Kind;

  explicit Disobedient(const VirtualDevice& device)
      : line_(machine_of<Item>(device)), device_(*device.device().template of<Item>()) {}

  void feed(const Event<Item>& event) override {
    // On a clocked link a request has no bytes, so each start of the clock counts as a request.
    if (event.kind == Kind::received || event.kind == Kind::selected) {
      ++requests;
      const bool is_ignored_now = requests >= ignored_from && requests < ignored_until;
      const bool is_ignored_request =
          !ignored_request.empty() &&
          std::equal(event.items.begin(), event.items.end(), ignored_request.begin(), ignored_request.end());
      if (is_ignored_now || (is_ignored_request && obeyed_++ >= obeyed_times)) return;
    }
    const ByteList before = memory();
    line_.feed(event);
    look(before);
  }
  Step<Item> next(Time now) override {
    const ByteList before = memory();
    Step<Item> step = line_.next(now);
    look(before);
    const bool is_damaged = damaged_at != 0 && requests == damaged_at;
    if (step.kind != Step<Item>::Kind::transfer || !is_damaged || step.out.empty()) return step;
    reply_.assign(step.out.begin(), step.out.end());
    if constexpr (std::is_same_v<Item, CanFrame>) {
      reply_.back().data[0] ^= 1;
    } else {
      reply_.back() ^= 1;
    }
    step.out = reply_;
    return step;
  }

  std::vector<Item> ignored_request{};  // request that the encoder ignores; empty: none
  unsigned obeyed_times = 0;            // number of times that the encoder obeys `ignored_request` before it ignores it
  // number, from 1, of the first request that the encoder ignores; 0 together with `ignored_until` 0: it ignores none
  unsigned ignored_from = 0;
  unsigned ignored_until = 0;  // number of the first request that the encoder does not ignore any more
  // number of the request whose reply gets a wrong bit; 0: no reply does
  unsigned damaged_at = 0;
  unsigned change = 0;      // number, from 1, of the memory change that `spoil` corrupts; 0: no change is corrupted
  bool spoils_all = false;  // whether `spoil` corrupts each change of the memory
  // corrupts the memory, given its new content and its previous content
  std::function<void(MutableBytes, const ByteList&)> spoil{};
  unsigned requests = 0;

 private:
  [[nodiscard]] ByteList memory() const { return {device_.memory().begin(), device_.memory().end()}; }
  void look(const ByteList& before) {
    if (std::equal(before.begin(), before.end(), device_.memory().begin())) return;
    if (++changes_ != change && !spoils_all) return;
    spoil(device_.memory(), before);
  }

  Machine<Item>& line_;
  Device<Item>& device_;
  unsigned changes_ = 0;
  unsigned obeyed_ = 0;
  std::vector<Item> reply_;
};

/// A port that calls `end` in its wait number `at`, counted from 1; if `lost` is set, the line is lost after that.
template <class Item>
class EndingPort final : public Port<Item> {
 public:
  explicit EndingPort(Port<Item>& port) : port_(port) {}
  Time now() override { return port_.now(); }
  void begin(const Step<Item>& step) override { port_.begin(step); }
  Event<Item> wait(const Step<Item>& step) override {
    if (++steps == at && end) end();
    if (lost && steps >= at) throw os::Failure(os::Failure::Kind::lost, "the line is lost");
    return port_.wait(step);
  }

  unsigned steps = 0;
  unsigned at = 0;
  bool lost = false;
  std::function<void()> end{};

 private:
  Port<Item>& port_;
};

/// A disobedient virtual encoder on a line that can be lost, with a memory that tests inspect.
template <class Item>
struct ChangedEncoder {
  explicit ChangedEncoder(const EncoderAddress& where) : address(where) {
    link.device = std::make_unique<VirtualDevice>(*address.unit, address.options, address.device);
    link.device->power_on(Time{});
    device = link.device->device().template of<Item>();
    mutant = std::make_unique<Disobedient<Item>>(*link.device);
    line = std::make_unique<sim::RoughLine<Item>>(address.unit->link, address.line.with_some_rate(), *mutant, 1);
    port = std::make_unique<EndingPort<Item>>(*line);
  }
  [[nodiscard]] ByteList memory() const { return {device->memory().begin(), device->memory().end()}; }
  /// Returns position and settings as text. The memory is left out, because an encoder may count its writes in it.
  [[nodiscard]] std::string settings() const {
    // Sets the port to the baud rate of the address and waits for 2 s: the conformance test may have ended while the
    // line had another baud rate, or just after a restart of the encoder.
    line->begin({.kind = Step<Item>::Kind::configure, .rate = address.line.with_some_rate().rate});
    const Step<Item> rest{.at = line->now() + std::chrono::seconds(2)};
    while (line->now() < rest.at && line->wait(rest).kind != Event<Item>::Kind::timer) {
    }
    std::string text;
    const auto add_value = [&](const Command& command, std::string_view field) {
      std::vector<std::byte> storage(address.unit->host_storage);
      host::Session<Item> session(*address.unit, address.options, *line, storage);
      const Conversation<Item>* ended = session.run(command);
      AnswerSink sink;
      ended->report(sink);
      EXPECT_EQ(ended->error(), Error::none) << command.name << " of an encoder that conform has left";
      if (ended->error() != Error::none) return;
      text += fmt::format("{} {}\n", command.name, to_text(sink.answer[field]));
    };
    for (const Clause& clause : clauses_of(*address.unit)) {
      if (!clause.field.empty()) add_value(*find_command(*address.unit, clause.setting), clause.field);
    }
    const auto position = std::ranges::find(address.unit->fields, Role::position, &FieldInfo::role);
    if (position != address.unit->fields.end()) add_value(*find_command(*address.unit, Verb::read), position->name);
    return text;
  }
  // Runs the conformance test on a link that does not own `device`, because `device` is inspected after the test.
  [[nodiscard]] Conformance run(bool resets = false, const std::function<bool()>& over = {}) const {
    Link port_link;
    if constexpr (std::is_same_v<Item, CanFrame>) {
      port_link.frames = port.get();
    } else {
      port_link.bytes = port.get();
    }
    return conform(address, std::move(port_link), {.readings = 3, .changes = true, .resets = resets, .over = over},
                   "NAME");
  }

  EncoderAddress address;
  Link link;
  Device<Item>* device = nullptr;
  std::unique_ptr<Disobedient<Item>> mutant;
  std::unique_ptr<sim::RoughLine<Item>> line;
  std::unique_ptr<EndingPort<Item>> port;
};

}  // namespace absenc::client
