// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "absenc/client/encoder/pace.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/process.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/parameters.hpp"
#include "tools/absenc/rate.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

struct Measurement {
  std::vector<Time> latencies;  // latencies of all good readings, the shortest first
  // For each two consecutive readings, the time between their beginnings minus the period; the smallest first. Empty if
  // no rate was given.
  std::vector<Time> deviations;
  Time period{};
  std::uint64_t failed = 0;
  Time duration{};
  Time processor{};
  std::uint64_t items = 0;
};

// Reads the encoder for `seconds` and measures the readings. With `rate` 0, each reading begins directly after the
// previous one.
Measurement measure(Connection& encoder, double seconds, double rate) {
  Measurement measurement;
  // Memory is reserved before the measurement, because allocations during it would delay readings.
  const auto expected = static_cast<std::size_t>(std::min(rate * seconds, 1e7));
  measurement.latencies.reserve(expected);
  measurement.deviations.reserve(expected);
  encoder.read();  // this reading is not measured, because the first readings confirm the position and detect echo
  const Time start = os::now();
  const Time end = start + Time(static_cast<std::int64_t>(seconds * 1e9));
  const Time processor_before = os::processor_time();
  const std::uint64_t items_before = encoder.items();
  Pace pace(rate);
  measurement.period = pace.period();
  const host::Take which = rate > 0 ? host::Take::newest : host::Take::every;
  Time before = start;
  Time last_begun = start;
  try {
    while (before < end && !os::interrupted()) {
      if (rate > 0) {
        os::sleep_until(pace.next());
        const Time begun = os::now();
        if (before != start) measurement.deviations.push_back(abs(begun - last_begun - pace.period()));
        before = last_begun = begun;
      }
      const Outcome outcome = encoder.read(which);
      const Time after = os::now();
      if (outcome.error == Error::none) {
        measurement.latencies.push_back(after - before);
      } else {
        ++measurement.failed;
      }
      before = after;
    }
  } catch (const os::Interrupted&) {  // Ctrl-C ends the measurement; the readings made so far count
  }
  measurement.duration = before - start;
  measurement.processor = os::processor_time() - processor_before;
  measurement.items = encoder.items() - items_before;
  std::sort(measurement.latencies.begin(), measurement.latencies.end());
  std::sort(measurement.deviations.begin(), measurement.deviations.end());
  return measurement;
}

// Returns the time that the fraction `share` of the sorted times does not exceed.
Time percentile(const std::vector<Time>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
  return sorted[std::min(rank, sorted.size() - 1)];
}

struct Percentile {
  std::string_view name;
  double share;
};
constexpr std::array<Percentile, 4> percentiles{{{"50", 0.5}, {"90", 0.9}, {"99", 0.99}, {"99.9", 0.999}}};

// Returns the fraction of the time in which characters were on the line; 0 if it cannot be calculated.
double line_share(const Connection& encoder, const Measurement& measurement) {
  const LineSettings& line = encoder.uri().line;
  const LinkKind link = encoder.unit().link;
  if (line.rate == 0 || (link != LinkKind::half_duplex && link != LinkKind::full_duplex)) return 0;
  return static_cast<double>(measurement.items) * static_cast<double>(line.byte_time().count()) /
         static_cast<double>(measurement.duration.count());
}

double readings_a_second(const Measurement& measurement) {
  const double seconds = std::chrono::duration<double>(measurement.duration).count();
  return static_cast<double>(measurement.latencies.size()) / seconds;
}

double microseconds(Time time) { return static_cast<double>(time.count()) / 1e3; }

Json measurement_json(const Connection& encoder, const Measurement& measurement) {
  Json latency = Json::object();
  for (const auto& [name, share] : percentiles) {
    latency.set(fmt::format("p{}", name), microseconds(percentile(measurement.latencies, share)));
  }
  latency.set("max", microseconds(measurement.latencies.back()));
  const auto count = static_cast<double>(measurement.latencies.size());
  Json json = Json::object()
                  .set("protocol", encoder.unit().id)
                  .set("seconds", std::chrono::duration<double>(measurement.duration).count())
                  .set("readings", measurement.latencies.size())
                  .set("failed", measurement.failed)
                  .set("readings_per_s", readings_a_second(measurement))
                  .set("latency_us", latency)
                  .set("cpu_us_per_reading", microseconds(measurement.processor) / count)
                  .set("line_share", line_share(encoder, measurement))
                  .set("errors", errors_to_json(encoder.counters()))
                  .set("ok", true);
  if (!measurement.deviations.empty()) {
    json.set("cycle_us", Json::object()
                             .set("period", microseconds(measurement.period))
                             .set("deviation_p99.9", microseconds(percentile(measurement.deviations, 0.999)))
                             .set("deviation_max", microseconds(measurement.deviations.back())));
  }
  return json;
}

std::string measurement_text(const Connection& encoder, const Measurement& measurement) {
  std::string latencies;
  for (const auto& [name, share] : percentiles) {
    latencies += fmt::format("{} % {}, ", name, to_text(percentile(measurement.latencies, share)));
  }
  const auto count = static_cast<std::int64_t>(measurement.latencies.size());
  std::vector<std::vector<std::string>> rows{
      {"readings",
       fmt::format("{} in {}: {:.0f} a second", count, to_text(measurement.duration), readings_a_second(measurement))},
      {"latency", fmt::format("{}longest {}", latencies, to_text(measurement.latencies.back()))},
      {"processor", fmt::format("{} a reading", to_text(measurement.processor / count))},
      {"exchanges", summary(encoder.counters())},
  };
  if (!measurement.deviations.empty()) {
    rows.push_back(
        {"cycle", fmt::format("every {}; deviation of 99.9 % of the readings {} at most, greatest {}",
                              to_text(measurement.period), to_text(percentile(measurement.deviations, 0.999)),
                              to_text(measurement.deviations.back()))});
  }
  const double share = line_share(encoder, measurement);
  if (share > 0) {
    rows.push_back({"line", fmt::format("what was sent and received fills {:.1f} % of the time at {} baud", 100 * share,
                                        encoder.uri().line.rate)});
  }
  return table(rows);
}

int run_bench(const Invocation& invocation) {
  os::catch_interrupts();
  const EncoderAddress uri = parse_address(invocation.text("encoder"), reading_settings(invocation));
  const double seconds = invocation.real("--seconds", 5, 0.01, 86400);
  const double rate = readings_a_second(invocation, 0);
  const std::unique_ptr<Connection> encoder = open_connection(uri);
  const Outcome first = encoder->read();
  if (first.error != Error::none) throw EncoderFailure(encoder->trouble(first));
  const Measurement measurement = measure(*encoder, seconds, rate);
  if (measurement.latencies.empty()) {
    throw Failure(fmt::format("there was no good reading; exchanges: {}", summary(encoder->counters())));
  }
  print_line(invocation.has("--json") ? measurement_json(*encoder, measurement).line()
                                      : measurement_text(*encoder, measurement));
  return measurement.failed == 0 ? exit_good : exit_failed;
}

constexpr std::array<Parameter, 6> bench_parameters{{
    parameter::encoder,
    {"--seconds", "S", "how long", "5"},
    {"--rate", "HZ",
     "readings a second, and how far the times between two deviate from the period; 0: as many as the line allows",
     "0"},
    parameter::realtime,
    parameter::json,
    parameter::option,
}};

constexpr std::array<Example, 3> bench_examples{{
    {"absenc bench tformat:/dev/ttyUSB0", "how fast this adapter is"},
    {"absenc bench tformat:tcp:192.168.1.20:4001 --seconds 60 --json", "a serial server for a minute"},
    {"absenc bench tformat:/dev/ttyUSB0 --rate 1000 --realtime 40",
     "how punctual a cycle of 1 ms is in a real-time thread"},
}};

}  // namespace

const Subcommand bench_subcommand{"bench",
                                  "measure readings a second, latency, punctuality, errors and processor time",
                                  "",
                                  bench_parameters,
                                  bench_examples,
                                  run_bench};

}  // namespace absenc::tool
