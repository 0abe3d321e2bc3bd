// SPDX-License-Identifier: Apache-2.0
// Compares results of commands, in virtual time, with those decoded from a capture of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/captures/comparison_test.hpp"
#include "absenc/client/captures/run.hpp"
#include "absenc/client/captures/sequence_watch.hpp"
#include "absenc/client/captures/stage_test.hpp"
#include "absenc/client/captures/words.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/testing.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

using capture::Annotation;

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
    said.answer = std::move(sink.answer);
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
  return std::move(captured.rows);
}

/// The address of a virtual encoder, and whether it differs from another tested address only in a detail.
struct Encoder {
  std::string address;
  bool is_detail = false;
};

std::vector<Encoder> encoders_of(const Unit& unit) {
  const std::string plain = "sim:" + std::string(unit.id);
  std::vector<std::string> bases{plain + "?motion=rpm=600"};
  for (const Model& model : unit.models) bases.push_back(plain + "?model=" + std::string(model.name));
  for (const Option& option : unit.options) {
    for (const std::string_view choice : option.choices) {
      bases.push_back(plain + "?" + std::string(option.name) + "=" + std::string(choice));
    }
  }
  std::vector<Encoder> all;
  for (const std::string& base : bases) {
    const bool is_first = &base == &bases.front();
    const std::string moved = is_first ? base : base + "&motion=rpm=600";
    all.push_back({moved, !is_first});
    const std::vector<std::string> alarms = reportable_alarms(unit, parse_address(moved).options);
    if (!alarms.empty()) {
      std::string every = moved;
      for (const std::string& name : alarms) every += "&alarm=" + name;
      all.push_back({every, !is_first});
    }
    if (!is_first) continue;
    for (const std::string_view fault : sim::fault_names) {
      if (fault == "echo" && unit.link != LinkKind::half_duplex)
        continue;  // an adapter can echo only on a line with a single pair of wires
      const std::string rate = fault == "request_corrupt" ? "0.1" : fault == "echo" ? "1" : "0.4";
      for (const char seed : {'1', '2'}) {
        all.push_back({moved + "&fault=" + std::string(fault) + "=" + rate + "&seed=" + seed, seed != '1'});
      }
    }
    for (const std::string& name : alarms) all.push_back({moved + "&alarm=" + name, true});
    for (const Condition& condition : unit.conditions) {
      for (const std::int64_t value : {condition.minimum, condition.maximum}) {
        if (value == condition.normal) continue;
        all.push_back({moved + "&condition=" + std::string(condition.name) + "=" + std::to_string(value), true});
      }
    }
  }
  return all;
}

constexpr std::uintmax_t long_file = 300'000;  // a capture file of more bytes than this counts as long

/// The commands of one capture: either all commands that change nothing, except scans, or one command that changes the
/// encoder.
struct Together {
  std::vector<const Command*> commands;
  // whether the capture of a command that changes the encoder is long: then it is not repeated for encoders that differ
  // only in a detail
  bool is_long = false;
};

std::vector<Together> commands_of(const Unit& unit) {
  std::vector<Together> all(1);
  for (const Command& command : unit.commands) {
    if (command.verb == Verb::scan) continue;
    if (command.changes_encoder) {
      all.push_back({{&command}});
    } else {
      all[0].commands.push_back(&command);
    }
  }
  return all;
}

class LiveAndCaptured : public ::testing::TestWithParam<const Unit*> {
 protected:
  void compare(const std::string& address, Together& together) {
    std::optional<Stage> stage;
    try {
      stage.emplace(address);
    } catch (const UsageError&) {
      return;  // skips a combination of option values that no virtual encoder can have
    }
    stage->run(together.commands);
    if (stage->live.empty()) return;
    const std::string path = (directory_.path() / "capture.vcd").string();
    stage->write(path);
    const bool changes = together.commands[0]->changes_encoder;
    together.is_long = together.is_long || (changes && std::filesystem::file_size(path) > long_file);
    ++captures;
    std::vector<Said> rows;
    try {
      rows = decode(*stage, path);
    } catch (const std::exception& failure) {
      ADD_FAILURE() << address << " " << together.commands[0]->name << ": " << failure.what();
      return;
    }
    Comparison comparison(unit, stage->line(), !stage->address.device.faults.empty(), rows);
    for (const Said& live : stage->live) {
      ++compared;
      const std::string why = comparison(live);
      if (why.empty()) continue;
      if (++failures_[live.what + why.substr(0, why.find_first_of(":\n"))] <= 2)
        ADD_FAILURE() << address << "\n" << why;
    }
  }

  const Unit& unit = *GetParam();
  std::size_t compared = 0;
  std::size_t captures = 0;

 private:
  os::testing::TemporaryDirectory directory_;
  std::map<std::string, unsigned> failures_;
};

TEST_P(LiveAndCaptured, Agree) {
  std::vector<Together> all = commands_of(unit);
  for (const Encoder& encoder : encoders_of(unit)) {
    for (Together& together : all) {
      if (!together.is_long || !encoder.is_detail) compare(encoder.address, together);
    }
  }
  std::printf("%s: %zu results in %zu captures\n", unit.id.data(), compared, captures);
  EXPECT_GT(compared, 0u);
}

Said said_with(std::string_view column, std::int64_t value) {
  Said said{.what = "command"};
  said.end = std::chrono::microseconds(1);
  said.answer.columns = {{column, "", ColumnType::int64, ""}};
  said.answer.values = {value};
  said.exchanges = 2;
  return said;
}

// In the conversation of this test, the second request has another command code than the first.
TEST(Comparison, TakesExchangeFieldFromAnyRowAndOthersFromLast) {
  std::array<FieldInfo, 2> fields{};
  fields[0].name = "command";
  fields[0].role = Role::exchange;
  fields[1].name = "state";
  Unit unit{};
  unit.link = LinkKind::half_duplex;
  unit.fields = fields;
  const LineSettings line{.rate = 1'000'000};
  for (const FieldInfo& field : fields) {
    const std::vector<Said> rows{said_with(field.name, 15), said_with(field.name, 3)};
    Comparison comparison(unit, line, false, rows);
    EXPECT_EQ(comparison(said_with(field.name, 15)).empty(), field.role == Role::exchange);
    EXPECT_EQ(comparison(said_with(field.name, 3)), "");
    EXPECT_TRUE(comparison(said_with(field.name, 16)).starts_with("another " + std::string(field.name) + ": 3"));
  }
}

INSTANTIATE_TEST_SUITE_P(Units, LiveAndCaptured, ::testing::ValuesIn(all_units()), [](const auto& one) {
  std::string name(one.param->id);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

}  // namespace
}  // namespace absenc::client
