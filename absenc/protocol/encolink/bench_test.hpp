// SPDX-License-Identifier: Apache-2.0
// For tests: a virtual AksIM-2 and a host on one wire in virtual time.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absenc/protocol/encolink/device.hpp"
#include "absenc/protocol/encolink/host.hpp"
#include "absenc/protocol/encolink/listen.hpp"
#include "absenc/protocol/encolink/procedures.hpp"
#include "absenc/protocol/encolink/unit.hpp"
#include "absenc/sim/bench_test.hpp"
#include "absenc/sim/line.hpp"

namespace absenc::encolink::testing {

inline constexpr Format single{.resolution = 20, .multiturn_bits = 0};
inline constexpr Format multi{.resolution = 20, .multiturn_bits = 16};

using TestShaft = sim::testing::TestShaft<20>;

/// Changes what the encoder sends; by default nothing. `frame` counts replies from 0.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<void(unsigned frame, std::vector<std::uint8_t>& reply)>;
  explicit Tampered(VirtualEncoder& encoder) : encoder_(encoder) {}
  void set(Tamper tamper) {
    tamper_ = std::move(tamper);
    frames_ = 0;
  }

  void feed(const Event<std::uint8_t>& event) override { encoder_.feed(event); }
  Step<std::uint8_t> next(Time now) override {
    for (;;) {
      Step<std::uint8_t> step = encoder_.next(now);
      if (step.kind != Step<std::uint8_t>::Kind::transfer || !tamper_) return step;
      out_.assign(step.out.begin(), step.out.end());
      tamper_(frames_++, out_);
      step.out = out_;
      if (!out_.empty()) return step;
      encoder_.feed({.kind = Event<std::uint8_t>::Kind::sent, .at = now});  // nothing comes out
    }
  }

 private:
  VirtualEncoder& encoder_;
  Tamper tamper_;
  unsigned frames_ = 0;
  std::vector<std::uint8_t> out_;
};

/// How a command ended, and what it told.
struct Told final : FieldSink {
  void put(const FieldValue& value) override {
    const std::string name(value.info->name);
    numbers[name] = value.number;
    reals[name] = value.real;
    texts[name] = std::string(value.bytes.begin(), value.bytes.end());
  }
  Error error = Error::none;
  std::string detail;
  std::optional<Reading> reading;
  std::map<std::string, std::int64_t> numbers;
  std::map<std::string, double> reals;
  std::map<std::string, std::string> texts;
};

inline Told told_by(const Conversation<std::uint8_t>& conversation) {
  Told told;
  told.error = conversation.error();
  told.detail = conversation.detail();
  if (const Reading* const reading = conversation.reading()) told.reading = *reading;
  conversation.report(told);
  return told;
}

/// The options that make this format.
inline Options options_of(const Format& format) {
  Options options;
  const std::array<std::int64_t, 8> values{format.resolution,
                                           format.multiturn_bits,
                                           format.has_ch2 ? 1 : 0,
                                           static_cast<std::int64_t>(format.offset_sign),
                                           format.stream_rate,
                                           static_cast<std::int64_t>(format.offset_unit),
                                           static_cast<std::int64_t>(format.generation),
                                           format.identity_size};
  std::copy(values.begin(), values.end(), options.values.begin());
  return options;
}

inline Format on(Wire wire, Format format) {
  format.wire = wire;
  return format;
}

/// A conversation of the unit, made as everybody makes it.
class Made {
 public:
  Made(const Format& format, std::string_view name, std::vector<std::int64_t> arguments) {
    const Unit& one = format.wire == Wire::spi ? spi_unit : unit;
    const Command& command = *find_command(one, name);
    for (std::size_t i = arguments.size(); i < command.arguments.size(); ++i) {
      arguments.push_back(command.arguments[i].default_value);
    }
    storage_.resize(one.host_storage);
    conversation_ = one.host(options_of(format), command, arguments, storage_).bytes;
  }
  Conversation<std::uint8_t>& operator*() const { return *conversation_; }

 private:
  std::vector<std::byte> storage_;
  Conversation<std::uint8_t>* conversation_;
};

struct Bench {
  using OnEmit = std::function<void(const Conversation<std::uint8_t>&)>;

  explicit Bench(const Format& built = multi, Wire wire = Wire::uart)
      : format(on(wire, built)), encoder(format, shaft) {
    shaft.put(7, 0x12345);
    encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
    line.attach(sim::Role::device, device);
  }

  /// Runs a machine to its end. `on_emit` is called at every emit.
  void drive(Machine<std::uint8_t>& machine, const std::function<void()>& on_emit = {}) {
    emits = 0;
    const Time start = line.now();
    const std::uint64_t before = encoder.answered();
    const auto emitted = [&] {
      ++emits;
      if (on_emit) on_emit();
      return true;
    };
    host = line.attach(sim::Role::host, machine, emitted);
    finished = line.run(host, line.now() + std::chrono::seconds(60));
    took = line.now() - start;
    frames = encoder.answered() - before;
  }
  /// Runs a command of the unit, told what `format` says.
  Told run(std::string_view command, std::vector<std::int64_t> arguments = {}, const OnEmit& on_emit = {}) {
    const Made made(format, command, std::move(arguments));
    drive(*made, [&] {
      if (on_emit) on_emit(*made);
    });
    return told_by(*made);
  }
  /// What the host knows of the encoder from here on.
  void tell(const Format& told) { format = on(format.wire, told); }
  void pass(Time time) { line.run_until(line.now() + time); }
  void restart(Device<std::uint8_t>::PowerOn kind) {
    encoder.power_off(line.now());
    encoder.power_on(line.now(), kind);
  }
  void condition(std::size_t index, std::int64_t value) { encoder.set_condition(index, value, line.now()); }

  Format format;
  TestShaft shaft;
  VirtualEncoder encoder;
  Tampered device{encoder};
  sim::Line<std::uint8_t> line{format.wire == Wire::spi ? LinkKind::exchange : LinkKind::full_duplex,
                               format.wire == Wire::spi ? spi_settings : uart_settings};
  std::size_t host = 0;
  unsigned emits = 0;
  std::uint64_t frames = 0;  // that the encoder sent, those with and before the identity too
  Time took{};
  bool finished = true;
};

}  // namespace absenc::encolink::testing
