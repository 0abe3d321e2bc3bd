// SPDX-License-Identifier: Apache-2.0
// Live and captured agree: each command of each unit is run against its virtual encoder in virtual time, the same
// conversation is drawn as `absenc wave` draws it, and decoded as `absenc decode` decodes it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absenc/capture/annotate/drawing.hpp"
#include "absenc/client/captures/run.hpp"
#include "absenc/client/captures/sequence_watch.hpp"
#include "absenc/client/captures/words.hpp"
#include "absenc/client/emulation/virtual_device.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/row.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/client/way/address.hpp"
#include "absenc/host/session.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/protocol/all.hpp"
#include "absenc/sim/sim_port.hpp"
#include "absenc/sim/waveform.hpp"

namespace absenc::client {
namespace {

using namespace std::chrono_literals;
using capture::Annotation;

/// The values of one result of a conversation, or of one exchange of a capture.
struct Said {
  std::string what;  // the command, or the kind of the exchange and its frames
  Time begin{};
  Time end{};
  Error error = Error::none;
  std::string words{};
  Answer answer{};
  std::optional<Reading> reading{};
  bool reads = false;       // it tells what the encoder says, and nothing of its own
  bool tries = false;       // it may try what does not work
  unsigned exchanges = 0;   // requests, pulses or transfers of the conversation
  bool is_verdict = false;  // the error is not that of the last reply
};

/// Looks at what a host does.
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
  bool moved = false;  // it has set another rate, which no capture follows

 private:
  Port<Item>& port_;
};

std::string to_text(const Reading& reading) {
  std::string text = "singleturn=" + std::to_string(reading.singleturn) + "/" +
                     std::to_string(reading.singleturn_bits) +
                     " valid_bits=" + std::to_string(reading.singleturn_valid_bits) +
                     " multiturn=" + std::to_string(reading.multiturn) + "/" + std::to_string(reading.multiturn_bits);
  text += std::string(" multiturn_valid=") + (reading.multiturn_valid ? "1" : "0");
  text += std::string(" known=") + (reading.singleturn_known ? "1" : "0") + (reading.multiturn_known ? "1" : "0");
  text += std::string(" ready=") + (reading.ready ? "1" : "0");
  text += " status=" + std::to_string(reading.status) + " of " + std::to_string(reading.status_reported);
  text += " alarms=" + std::to_string(reading.alarms) + " of " + std::to_string(reading.alarms_reported);
  return text;
}

/// A virtual encoder, its host and their wires.
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

  /// One after the other, with pauses in which no reply is under way.
  void run(const std::vector<const Command*>& commands, unsigned rounds) {
    if (device_.bytes() != nullptr) {
      run_on(*device_.bytes(), commands, rounds);
    } else {
      run_on(*device_.frames(), commands, rounds);
    }
  }

  void write(const std::string& path) {
    sink_.finish(waveform_, idle(), end_);
    std::ofstream out(path, std::ios::binary);
    capture::write_vcd(out, drawing_);
  }

  /// Before the first and behind the last character, so that decoders see a silent line.
  [[nodiscard]] Time idle() const { return std::max<Time>(1ms, 5 * line().character()); }
  EncoderAddress address;
  std::vector<Said> live;

 private:
  template <class Item>
  void run_on(Machine<Item>& device, const std::vector<const Command*>& commands, unsigned rounds) {
    sim::SimPort<Item> line_port(address.unit->link, line(), device);
    waveform_.observe(line_port.line());
    HostEnd<Item> port(line_port, line().rate);
    std::vector<std::byte> storage(address.unit->host_storage);
    const bool may_echo = address.device.faults == std::vector<std::string>{"echo=1"};
    host::Session<Item> session(*address.unit, address.options, port, storage,
                                may_echo ? host::EchoMode::automatic : host::EchoMode::off, 1);
    const Time pause = address.unit->timing.turnaround_limit + 2ms;
    const auto rest = [&] {
      const Time until = line_port.now() + pause;
      while (line_port.now() < until) static_cast<void>(line_port.wait({.at = until}));
    };
    for (unsigned round = 0; round < rounds; ++round) {
      for (const Command* command : commands) {
        for (const std::vector<std::int64_t>& arguments : arguments_of(*command)) {
          if (!converse(session, port, *command, arguments)) continue;
          rest();
          end_ = line_port.now();
          break;
        }
      }
    }
  }

  // The least values, or else the greatest: not every number between is one that the encoder has.
  static std::vector<std::vector<std::int64_t>> arguments_of(const Command& command) {
    std::vector<std::vector<std::int64_t>> all(2);
    for (const Argument& argument : command.arguments) {
      all[0].push_back(argument.required ? argument.minimum : argument.default_value);
      all[1].push_back(argument.required ? argument.maximum : argument.default_value);
    }
    return all;
  }

  // False: the command cannot be run so.
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
    said.tries = command.verb == Verb::run;
    said.reads = command.verb <= Verb::read_part;
    AnswerSink sink;
    if (said.error == Error::none) conversation->report(sink);
    if (said.error == Error::none && conversation->reading() != nullptr) {
      said.reading = *conversation->reading();
      sink.put_reading(*said.reading);
    }
    said.answer = sink.answer;
    if constexpr (std::is_same_v<Item, CanFrame>) {
      said.is_verdict = said.error == Error::cross_check_failed;
    } else {
      // Only the last reply is compared: a procedure adds a verdict of its own.
      const Exchange<Item> last = conversation->exchange();
      NoFields nowhere;
      const bool has_bytes = address.unit->link != LinkKind::clocked && !last.received.empty();
      said.is_verdict = has_bytes && address.unit->decode(address.options, {.bytes = last.sent},
                                                          {.bytes = last.received}, nowhere) == Error::none;
    }
    // A clock is in the capture.
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

struct Captured final : capture::AnnotationSink {
  Captured(const Stage& stage, const Options& with, const TickClock& ticks)
      : unit(*stage.address.unit), options(with), clock(ticks), lead(stage.idle()) {}

  void put(const Annotation& one) override {
    Said said{.what = std::string(name_of(one.kind)) + " " + wire(one.request) + " -> " + wire(one.reply)};
    said.begin = clock.time(one.begin) - lead;
    said.end = clock.time(one.end) - lead;
    said.error = one.error;
    said.words = message_of(unit, options, one);
    AnswerSink sink;
    if (has_fields(one)) {
      for (const FieldValue& field : one.contents.fields) sink.put(field);
      if (one.contents.reading != nullptr) sink.put_reading(*one.contents.reading);
      if (one.contents.reading != nullptr) said.reading = *one.contents.reading;
    }
    said.answer = sink.answer;
    if (one.remark == capture::Remark::cut) said.words = "cut";
    rows.push_back(std::move(said));
  }
  [[nodiscard]] std::string wire(const Frame& frame) const {
    return frame.empty() ? "" : to_wire_text(unit.link, frame);
  }

  const Unit& unit;
  const Options& options;
  const TickClock& clock;
  Time lead;
  std::vector<Said> rows;
};

std::vector<Said> decode(const Stage& stage, const std::string& path) {
  const Unit& unit = *stage.address.unit;
  CaptureChoices choices{path, {}};
  if (unit.line.rate == 0) choices.how.baud = stage.line().rate;
  CaptureRun run(unit, stage.address.options, choices);
  const Options& options = run.settle_options();
  const TickClock clock(run.ticks_per_second());
  Captured captured(stage, options, clock);
  SequenceWatch watched(captured);
  static_cast<void>(run.run(watched, [](capture::Tick) {}));
  return captured.rows;
}

std::string to_text(const Said& said) {
  std::string text = said.what + " [" + std::to_string(said.begin.count()) + ".." + std::to_string(said.end.count()) +
                     "] " + std::string(text_of(said.error).name) + " (" + said.words + ")";
  for (std::size_t i = 0; i < said.answer.columns.size(); ++i) {
    text += " " + std::string(said.answer.columns[i].name) + "=" + client::to_text(said.answer.values[i]);
  }
  if (said.reading) text += "\n      " + to_text(*said.reading);
  return text;
}

/// Compares one result with the rows of its time.
class Comparison {
 public:
  Comparison(const Unit& unit, const LineSettings& line, bool faulty, const std::vector<Said>& rows)
      : rows_(rows), faulty_(faulty) {
    // The row of a CAN frame is there where the waveform's frame ends, whose receiver waits for the bus to be idle.
    tolerance_ = unit.link == LinkKind::can ? line.bits(160) : 2 * line.character();
  }

  /// The contradiction in words; "" if there is none.
  std::string operator()(const Said& live) {
    within_.clear();
    for (const Said& row : rows_) {
      if (row.end >= live.begin && row.begin < live.end + tolerance_ && row.words != "cut") within_.push_back(&row);
    }
    const std::string why = live.error == Error::none ? compare_good(live) : compare_bad(live);
    if (why.empty()) return {};
    std::string text = why + "\n  live: " + to_text(live);
    constexpr std::size_t most_shown = 8;
    for (std::size_t i = within_.size() - std::min(most_shown, within_.size()); i < within_.size(); ++i) {
      text += "\n  row:  " + to_text(*within_[i]);
    }
    return text;
  }

 private:
  std::string compare_bad(const Said& live) const {
    const bool told = std::any_of(within_.begin(), within_.end(), [&](const Said* row) {
      return live.is_verdict ? row->error == Error::none : row->error == live.error;
    });
    if (told) return {};
    const bool any =
        std::any_of(within_.begin(), within_.end(), [](const Said* row) { return row->error != Error::none; });
    // A host may be more careful: what answers a request that it repeated may answer the one before.
    return (any || faulty_) && live.exchanges != 1 ? "" : "no row has the error";
  }

  std::string compare_good(const Said& live) const {
    for (const Said* row : within_) {
      // A procedure may ask for somebody who is not there, or wake an encoder that is silent at first.
      const bool silent = row->error == Error::timeout || row->error == Error::line_stuck;
      const bool is_silence = silent && live.exchanges > 1;
      if (row->error != Error::none && !is_silence && !faulty_ && !live.tries) return "a row has an error";
    }
    if (live.reading) {
      if (std::string why = compare_position(live); !why.empty()) return why;
    }
    std::map<std::string, std::string> told;
    for (const Said* row : within_) {
      if (live.exchanges == 0 && live.reading && !is_of(*row, *live.reading)) continue;
      for (std::size_t i = 0; i < row->answer.columns.size(); ++i) {
        told[std::string(row->answer.columns[i].name)] = client::to_text(row->answer.values[i]);
      }
    }
    for (std::size_t i = 0; i < live.answer.columns.size(); ++i) {
      const std::string name(live.answer.columns[i].name);
      const auto found = told.find(name);
      if (found == told.end() && live.reads && live.exchanges != 0) return "no row has " + name;
      if (found != told.end() && found->second != client::to_text(live.answer.values[i])) {
        return "another " + name + ": " + found->second;
      }
    }
    return {};
  }

  [[nodiscard]] bool is_of(const Said& row, const Reading& reading) const {
    return row.end > reading.received - tolerance_ && row.end < reading.received + tolerance_;
  }

  // The last row has it, or its parts are in several.
  std::string compare_position(const Said& live) const {
    const Said* row = nullptr;
    for (const Said* one : within_) {
      const bool fits = live.exchanges != 0 || is_of(*one, *live.reading);
      if (one->reading && one->error == Error::none && fits) row = one;
    }
    // How long the frames of a stream are the first good one tells.
    const bool knows_size = std::any_of(
        rows_.begin(), rows_.end(), [&](const Said& one) { return one.reading && one.end < live.reading->received; });
    if (row == nullptr) return live.exchanges != 0 || knows_size ? "no row has a position" : "";
    Reading all = *row->reading;
    for (const Said* one : within_) {
      if (!one->reading) continue;
      if (all.multiturn_bits == 0 && live.reading->multiturn_bits != 0 && one->reading->singleturn_bits == 0) {
        all.multiturn = one->reading->multiturn;
        all.multiturn_bits = one->reading->multiturn_bits;
        all.multiturn_valid = one->reading->multiturn_valid;
      }
    }
    // A capture remembers earlier conversations; a host that reads once does not.
    const Reading& known = *live.reading;
    all.alarms &= known.alarms_reported;
    all.alarms_reported &= known.alarms_reported;
    all.status &= known.status_reported;
    all.status_reported &= known.status_reported;
    if (!known.singleturn_known) {
      all.singleturn_known = false;
      all.singleturn_valid_bits = known.singleturn_valid_bits;
    }
    if (!known.multiturn_known) {
      all.multiturn_known = false;
      all.multiturn_valid = known.multiturn_valid;
    }
    return to_text(known) == to_text(all) ? "" : "another position: " + to_text(all);
  }

  const std::vector<Said>& rows_;
  bool faulty_;
  Time tolerance_{};
  std::vector<const Said*> within_;
};

std::vector<std::string> addresses_of(const Unit& unit) {
  const std::string plain = "sim:" + std::string(unit.id);
  std::vector<std::string> bases{plain + "?motion=rpm=600"};
  for (const Model& model : unit.models) bases.push_back(plain + "?model=" + std::string(model.name));
  for (const Option& option : unit.options) {
    for (const std::string_view choice : option.choices) {
      bases.push_back(plain + "?" + std::string(option.name) + "=" + std::string(choice));
    }
  }
  std::vector<std::string> all;
  for (const std::string& base : bases) {
    const std::string moved = &base == &bases.front() ? base : base + "&motion=rpm=600";
    all.push_back(moved);
    if (unit.alarms != nullptr) {
      std::string every = moved;
      for (const FlagInfo& flag : unit.alarms->flags) {
        if (!flag.name.empty()) every += "&alarm=" + std::string(flag.name);
      }
      all.push_back(every);
    }
    if (&base != &bases.front()) continue;
    for (const std::string_view fault : sim::fault_names) {
      if (fault == "echo" && unit.link != LinkKind::half_duplex) continue;  // an adapter's, on one pair of wires
      const std::string rate = fault == "request_corrupt" ? "0.1" : fault == "echo" ? "1" : "0.4";
      for (const char seed : {'1', '2'}) {
        all.push_back(moved + "&fault=" + std::string(fault) + "=" + rate + "&seed=" + seed);
      }
    }
    if (unit.alarms != nullptr) {
      for (const FlagInfo& flag : unit.alarms->flags) {
        if (!flag.name.empty()) all.push_back(moved + "&alarm=" + std::string(flag.name));
      }
    }
    for (const Condition& condition : unit.conditions) {
      for (const std::int64_t value : {condition.minimum, condition.maximum}) {
        if (value == condition.normal) continue;
        all.push_back(moved + "&condition=" + std::string(condition.name) + "=" + std::to_string(value));
      }
    }
  }
  return all;
}

class LiveAndCaptured : public ::testing::TestWithParam<const Unit*> {};

TEST_P(LiveAndCaptured, Agree) {
  const Unit& unit = *GetParam();
  const os::testing::TemporaryDirectory directory;
  std::vector<std::vector<const Command*>> together(1);
  for (const Command& command : unit.commands) {
    if (command.changes_encoder || command.verb == Verb::scan) {
      if (command.verb != Verb::scan) together.push_back({&command});
    } else {
      together[0].push_back(&command);
    }
  }
  std::size_t compared = 0;
  std::size_t captures = 0;
  std::map<std::string, unsigned> failures;
  for (const std::string& text : addresses_of(unit)) {
    for (const auto& commands : together) {
      std::optional<Stage> stage;
      try {
        stage.emplace(text);
      } catch (const UsageError&) {
        continue;  // options that exclude each other
      }
      stage->run(commands, 1);
      if (stage->live.empty()) continue;
      const std::string path = directory.path() / "capture.vcd";
      stage->write(path);
      ++captures;
      std::vector<Said> rows;
      try {
        rows = decode(*stage, path);
      } catch (const std::exception& failure) {
        ADD_FAILURE() << text << " " << commands[0]->name << ": " << failure.what();
        continue;
      }
      Comparison compare(unit, stage->line(), !stage->address.device.faults.empty(), rows);
      for (const Said& live : stage->live) {
        ++compared;
        const std::string why = compare(live);
        if (why.empty()) continue;
        if (++failures[live.what + why.substr(0, why.find('\n'))] > 2) continue;
        ADD_FAILURE() << text << "\n" << why;
      }
    }
  }
  std::printf("%s: %zu results in %zu captures\n", unit.id.data(), compared, captures);
  EXPECT_GT(compared, 0u);
}

INSTANTIATE_TEST_SUITE_P(Units, LiveAndCaptured, ::testing::ValuesIn(all_units()), [](const auto& one) {
  std::string name(one.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

}  // namespace
}  // namespace absenc::client
