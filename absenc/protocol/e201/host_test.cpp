// SPDX-License-Identifier: Apache-2.0
// Host conversations against the virtual E201-9S in virtual time.
#include "absenc/protocol/e201/host.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "absenc/protocol/e201/bench_test.hpp"

namespace absenc::e201 {
namespace {

using testing::Bench;
using testing::report;
using Fields = std::map<std::string, std::int64_t>;

/// Passes on what the interface does, but for requests that `tamper` answers itself.
class Tampered final : public Machine<std::uint8_t> {
 public:
  using Tamper = std::function<std::optional<std::string>(char letter)>;
  Tampered(VirtualAdapter& adapter, Tamper tamper) : adapter_(adapter), tamper_(std::move(tamper)) {}

  void feed(const Event<std::uint8_t>& event) override {
    if (event.kind == Event<std::uint8_t>::Kind::received) {
      const std::optional<std::string> answer = tamper_(static_cast<char>(event.items[0]));
      if (answer) {
        out_.assign(answer->begin(), answer->end());
        pending_ = !out_.empty();
        return;
      }
    }
    adapter_.feed(event);
  }
  Step<std::uint8_t> next(Time now) override {
    if (!pending_) return adapter_.next(now);
    pending_ = false;
    return {.kind = Step<std::uint8_t>::Kind::transfer, .out = out_, .at = now + 1ms};
  }

 private:
  VirtualAdapter& adapter_;
  Tamper tamper_;
  std::vector<std::uint8_t> out_;
  bool pending_ = false;
};

template <class Conversation>
Conversation& run_tampered(Conversation& conversation, const Tampered::Tamper& tamper, Bench& bench) {
  Tampered tampered(bench.adapter, tamper);
  bench.line.replace(bench.device, tampered);
  bench.run(conversation);
  EXPECT_TRUE(bench.finished);
  bench.line.replace(bench.device, bench.adapter);
  return conversation;
}

Tampered::Tamper answering(char letter, const std::string& answer) {
  return [=](char asked) { return asked == letter ? std::optional(answer) : std::nullopt; };
}

TEST(E201Host, ReadsThePosition) {
  Bench bench;
  bench.shaft.state.position = (std::int64_t{1} << 32) + (std::int64_t{275096} << 13);
  ReadPosition read(bench.format);
  ASSERT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(report(read), (Fields{{"ack_bits", 3},
                                  {"multiturn", 1},
                                  {"singleturn", 275096},
                                  {"angle_deg", 188},
                                  {"error", 0},
                                  {"warning", 0},
                                  {"crc", 0x1C}}));
  EXPECT_TRUE(read.reading()->singleturn_valid());
  EXPECT_GT(read.reading()->received, read.reading()->latched);
  EXPECT_EQ(bench.adapter.violation_count(), 0u);
}

TEST(E201Host, ReadsAnSsiEncoder) {
  Bench bench(testing::ssi_format());
  bench.shaft.state.position = (std::int64_t{7} << 32) + (std::int64_t{0x1234} << 19);
  ReadPosition read(bench.format);
  ASSERT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(read.reading()->singleturn, 0x1234u);
  EXPECT_EQ(read.reading()->multiturn, 7u);
}

TEST(E201Host, ALinearEncoderHasMicrometres) {
  Format format = testing::biss_format({.position = 32});
  format.biss.scale = {true, 0.05};
  Bench bench(format);
  bench.shaft.state.position = 1'579'271;
  ReadPosition read(format);
  ASSERT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(read.reading()->unit_um, 0.05);
  EXPECT_EQ(report(read)["position"], 1'579'271);
  EXPECT_EQ(report(read)["position_um"], 78'963);
  EXPECT_EQ(report(read)["position_mm"], 78);
}

TEST(E201Host, ErrorAndWarningOfTheEncoder) {
  Bench bench;
  bench.adapter.raise_alarms(word_error);
  ReadPosition read(bench.format);
  ASSERT_EQ(bench.run(read).error(), Error::none);
  EXPECT_EQ(read.reading()->alarms, word_error);
  EXPECT_FALSE(read.reading()->singleturn_valid());
}

TEST(E201Host, OldFirmwareIsUnsupported) {
  Bench old(testing::biss_format(), {.firmware = {1, 15}});
  ReadPosition read(old.format);
  EXPECT_EQ(old.run(read).error(), Error::unsupported);
  EXPECT_NE(read.detail().find("1.16"), std::string_view::npos);
  ClockSweep sweep(old.format, 2);
  EXPECT_EQ(old.run(sweep).error(), Error::unsupported);
  // The same when it answers something else instead of nothing.
  ReadPosition answered(old.format);
  EXPECT_EQ(run_tampered(answered, answering('4', "?\r"), old).error(), Error::unsupported);

  Bench off;
  off.adapter.power_off(Time{});
  ReadPosition silent(off.format);
  EXPECT_EQ(off.run(silent).error(), Error::timeout);
  Bench deaf;
  ReadPosition only_version(deaf.format);
  EXPECT_EQ(run_tampered(only_version, answering('4', ""), deaf).error(), Error::timeout);
  EXPECT_NE(only_version.detail().find("not `4`"), std::string_view::npos);
}

TEST(E201Host, EachFailureHasItsAdvice) {
  struct Case {
    std::string reply;
    Error error;
    std::string_view found;
    std::string_view advice;
  };
  for (const Case& one :
       std::vector<Case>{{"c0014328fe300000\r", Error::bad_checksum, "delay of the line", "another MA clock"},
                         {"c000000000000001\r", Error::truncated, "ACK is too long", "lower MA clock"},
                         {"0000000000000000\r", Error::line_stuck, "", "supply-on"},
                         {"ffffffffffffffff\r", Error::line_stuck, "", "supply-on"},
                         {"e0014328ff300000\r", Error::bad_framing, "begin with 110", "lower MA clock"},
                         {"c000000000000000\r", Error::bad_framing, "no start bit", "lower MA clock"},
                         {"c0034328ff300000\r", Error::bad_framing, "CDS bit is 1", "lower MA clock"},
                         {"c0014328ff30000g\r", Error::bad_framing, "hexadecimal digits", "E201-9S"},
                         {"c0014328ff300000", Error::wrong_length, "16 hexadecimal digits and CR", "stream-off"},
                         {"c0014328ff3000000\r", Error::wrong_length, "16 hexadecimal digits and CR", "stream-off"}}) {
    Bench bench(testing::biss_format({.position = 19}));
    ReadPosition read(bench.format);
    run_tampered(read, answering('4', one.reply), bench);
    EXPECT_EQ(text_of(read.error()).name, text_of(one.error).name) << one.reply;
    EXPECT_NE(read.detail().find(one.found), std::string_view::npos) << one.reply << read.detail();
    EXPECT_NE(read.advice().find(one.advice), std::string_view::npos) << one.reply << read.advice();
    EXPECT_EQ(read.reading(), nullptr);
    EXPECT_TRUE(report(read).empty());
  }
}

TEST(E201Host, SupplyOffIsALineThatIsStuck) {
  Bench bench;
  SwitchSupply off(false);
  ASSERT_EQ(bench.run(off).error(), Error::none);
  EXPECT_EQ(report(off)["supply_mv"], 20);
  EXPECT_FALSE(bench.adapter.supplies());
  ReadPosition read(bench.format);
  EXPECT_EQ(bench.run(read).error(), Error::line_stuck);
  SwitchSupply on(true);
  ASSERT_EQ(bench.run(on).error(), Error::none);
  EXPECT_EQ(report(on)["supply_mv"], 4980);
  ReadPosition again(bench.format);
  EXPECT_EQ(bench.run(again).error(), Error::none);
  SwitchSupply broken(true);
  EXPECT_EQ(run_tampered(broken, answering('e', "0.1V 0mA\r"), bench).error(), Error::cross_check_failed);
  SwitchSupply unknown(false);
  EXPECT_EQ(run_tampered(unknown, answering('e', "whatever\r"), bench).error(), Error::none);
}

TEST(E201Host, InfoKeepsWhatItCannotRead) {
  Bench bench;
  Info info;
  ASSERT_EQ(bench.run(info).error(), Error::none);
  EXPECT_EQ(report(info), (Fields{{"version", 0},
                                  {"serial", 0},
                                  {"supply", 0},
                                  {"supply_mv", 4980},
                                  {"supply_ma", 62},
                                  {"clock", 4},
                                  {"clock_khz", 280}}));
  Info partly;
  ASSERT_EQ(run_tampered(partly, answering('e', ""), bench).error(), Error::none);
  EXPECT_FALSE(report(partly).contains("supply"));
  EXPECT_EQ(report(partly)["clock"], 4);
  Info nothing;
  EXPECT_EQ(run_tampered(nothing, answering('v', ""), bench).error(), Error::timeout);
}

TEST(E201Host, ClockAndWidthAreReadBack) {
  Bench bench;
  Set clock(command::set_clock, 6);
  ASSERT_EQ(bench.run(clock).error(), Error::none);
  EXPECT_EQ(bench.adapter.clock(), 6u);
  EXPECT_EQ(report(clock), (Fields{{"clock", 6}, {"clock_khz", 1100}}));
  Query query(command::clock);
  ASSERT_EQ(bench.run(query).error(), Error::none);
  EXPECT_EQ(report(query), report(clock));
  Set width(command::set_width, 26);
  ASSERT_EQ(bench.run(width).error(), Error::none);
  EXPECT_EQ(report(width), (Fields{{"width", 26}}));
  Set refused(command::set_clock, 2);
  EXPECT_EQ(run_tampered(refused, answering('M', ""), bench).error(), Error::cross_check_failed);
  Set answered(command::set_clock, 2);  // a reply that nobody describes does not disturb it
  bench.raw("M2\r");
  EXPECT_EQ(run_tampered(answered, answering('M', "M2 ok\r\n"), bench).error(), Error::none);
}

TEST(E201Host, ZeroIsReadBack) {
  Bench bench;
  bench.shaft.state.position = std::int64_t{275096} << 13;
  Zero zero(bench.format);
  ASSERT_EQ(bench.run(zero).error(), Error::none);
  EXPECT_EQ(report(zero), (Fields{{"counts", 0}}));
  bench.shaft.state.position -= std::int64_t{10} << 13;
  Query decimal(command::decimal);
  EXPECT_EQ(report(bench.run(decimal))["counts"], -10);
  ReadPosition read(bench.format);
  EXPECT_EQ(bench.run(read).reading()->singleturn, 275086u);  // the encoder's own position
  Tell clear(command::clear_zero);
  ASSERT_EQ(bench.run(clear).error(), Error::none);
  Query again(command::decimal);
  EXPECT_EQ(report(bench.run(again))["counts"], 275086);
  Zero ignored(bench.format);
  EXPECT_EQ(run_tampered(ignored, answering('z', ""), bench).error(), Error::cross_check_failed);
}

TEST(E201Host, ZeroNeedsAnEncoderThatStandsStill) {
  Bench bench;
  int looks = 0;
  Zero zero(bench.format);
  run_tampered(
      zero,
      [&looks](char letter) {
        return letter == '?' ? std::optional(std::to_string(++looks * 100) + "\r") : std::nullopt;
      },
      bench);
  EXPECT_EQ(zero.error(), Error::invalid_argument);
  EXPECT_EQ(looks, 2);
}

TEST(E201Host, AStreamIsNoReplyAndCanBeEnded) {
  Bench bench;
  bench.shaft.state.position = std::int64_t{275096} << 13;
  bench.raw("1");
  unsigned disturbed = 0;
  for (int i = 0; i < 100; ++i) {
    ReadPosition read(bench.format);
    bench.run(read);
    if (read.error() == Error::none) {
      EXPECT_EQ(read.position().word.position, 275096u);
    } else {
      EXPECT_EQ(text_of(read.error()).name, "wrong_length");
      ++disturbed;
    }
    bench.line.run_until(bench.line.now() + 100us);
  }
  EXPECT_GT(disturbed, 2u);
  Tell end(command::stream_off);
  EXPECT_EQ(bench.run(end).error(), Error::none);
  for (int i = 0; i < 100; ++i) {
    ReadPosition again(bench.format);
    EXPECT_EQ(bench.run(again).error(), Error::none);
  }
}

// ---- clock-sweep

/// 10 us of latency, 32 + 8 bits: up to 20 bits of ACK fit, so M8 (45 bits) and M7 (22) are too fast.
TEST(E201Sweep, CountsRecommendsAndRestores) {
  Bench bench(testing::biss_format({.position = 32}), {.clock = 7});
  ClockSweep sweep(bench.format, 5);
  std::vector<Fields> progress;
  bench.run(sweep, [&] {
    progress.push_back(report(sweep));
    return true;
  });
  ASSERT_EQ(sweep.error(), Error::none) << sweep.detail();
  EXPECT_EQ(report(sweep), (Fields{{"frames", 5},
                                   {"valid_35_khz", 5},
                                   {"valid_70_khz", 5},
                                   {"valid_140_khz", 5},
                                   {"valid_280_khz", 5},
                                   {"valid_560_khz", 5},
                                   {"valid_1100_khz", 5},
                                   {"valid_2200_khz", 0},
                                   {"valid_4400_khz", 0},
                                   {"recommended_clock", 4},
                                   {"recommended_khz", 280},
                                   {"restored_clock", 7},
                                   {"aborted", 0}}));
  EXPECT_EQ(bench.adapter.clock(), 7u);
  ASSERT_EQ(progress.size(), 8u);
  EXPECT_EQ(progress[0], (Fields{{"frames", 5}, {"valid_35_khz", 5}}));
}

TEST(E201Sweep, LineDelayMovesTheRecommendation) {
  // Two bits late at 4400 kHz, one at 2200, and 900 ns are the period at 1100: nothing fast is stable.
  Bench bench(testing::biss_format({.position = 19}), {.behaviour = {.latency = 0us, .line_delay = 905ns}});
  ClockSweep sweep(bench.format, 20);
  ASSERT_EQ(bench.run(sweep).error(), Error::none);
  EXPECT_LT(report(sweep)["valid_1100_khz"], 20);
  EXPECT_EQ(report(sweep)["valid_560_khz"], 20);
  EXPECT_EQ(report(sweep)["valid_2200_khz"], 0);
  EXPECT_EQ(sweep.recommended(), 3u);
}

TEST(E201Sweep, AbortRestoresTheClockAtAnyStep) {
  for (unsigned steps = 0; steps < 400; steps += 3) {
    Bench bench(testing::biss_format(), {.clock = 6});
    ClockSweep sweep(bench.format, 100);
    const std::size_t host = bench.line.attach(sim::Role::host, sweep);
    for (unsigned i = 0; i < steps && !bench.line.done(host); ++i) bench.line.step();
    const Time asked = bench.line.now();
    sweep.abort();
    ASSERT_TRUE(bench.line.run(host, asked + 1s));
    EXPECT_LT(bench.line.now() - asked, 30ms) << steps;
    EXPECT_EQ(sweep.error(), Error::none);
    EXPECT_EQ(bench.adapter.clock(), 6u) << steps;
    EXPECT_EQ(report(sweep)["aborted"], 1);
    EXPECT_EQ(report(sweep)["restored_clock"], 6);
    EXPECT_FALSE(report(sweep).contains("recommended_clock"));
  }
}

TEST(E201Sweep, WhatIsLeftIsTheClockThatWasSetLast) {
  Bench bench(testing::biss_format(), {.clock = 6});
  ClockSweep sweep(bench.format, 3);
  const std::size_t host = bench.line.attach(sim::Role::host, sweep);
  std::set<std::int64_t> left;
  while (!bench.line.done(host)) {
    bench.line.step();
    struct Left final : FieldSink {
      void put(const FieldValue& value) override { fields[std::string(value.info->name)] = value.number; }
      Fields fields;
    } sink;
    sweep.report_left(sink);
    if (sink.fields.empty()) {
      EXPECT_EQ(bench.adapter.clock(), 6u);
      continue;
    }
    EXPECT_EQ(sink.fields["previous_clock"], 6);
    left.insert(sink.fields["left_clock"]);
  }
  EXPECT_EQ(left, (std::set<std::int64_t>{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST(E201Sweep, NothingGoodIsTheErrorOfTheFrames) {
  Bench bench;
  bench.raw("f");
  ClockSweep sweep(bench.format, 2);
  EXPECT_EQ(bench.run(sweep).error(), Error::line_stuck);
  EXPECT_EQ(bench.adapter.clock(), 4u);
  EXPECT_TRUE(report(sweep).empty());
}

TEST(E201Sweep, AnErrorInTheMiddleStillRestores) {
  for (const auto& [answer, error] : std::to_array<std::pair<std::string, Error>>(
           {{"8\r", Error::cross_check_failed}, {"", Error::timeout}, {"8", Error::wrong_length}})) {
    Bench bench;
    ClockSweep sweep(bench.format, 2);
    int asked = 0;
    run_tampered(
        sweep,
        [&, text = answer](char letter) { return letter == 'm' && ++asked == 4 ? std::optional(text) : std::nullopt; },
        bench);
    EXPECT_EQ(text_of(sweep.error()).name, text_of(error).name);
    EXPECT_EQ(bench.adapter.clock(), 4u);
    EXPECT_TRUE(report(sweep).empty());
  }
}

TEST(E201Sweep, AClockThatCannotBeRestoredIsAnError) {
  Bench bench;
  ClockSweep sweep(bench.format, 1);
  int set = 0;
  run_tampered(
      sweep,
      [&set](char letter) { return letter == 'M' && ++set == 9 ? std::optional<std::string>("") : std::nullopt; },
      bench);
  EXPECT_EQ(sweep.error(), Error::cross_check_failed);
  EXPECT_NE(sweep.detail().find("could not be restored"), std::string_view::npos);
}

}  // namespace
}  // namespace absenc::e201
