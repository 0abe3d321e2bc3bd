// SPDX-License-Identifier: Apache-2.0
// Compares pairs of benchmarks NAME and NAME_reference: prints how many times faster NAME is.
#pragma once

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <map>
#include <ostream>
#include <string>
#include <vector>

namespace absenc::bench {

/// Hides the value of `object` from the compiler. Unlike benchmark::DoNotOptimize, it never changes the object.
template <class Object>
void hide(Object& object) {
  asm volatile("" : : "r"(&object) : "memory");
}

/// Prints the table of results as Google Benchmark does, then for each pair the ratio of the two medians over all
/// repetitions.
class RatioReporter : public benchmark::ConsoleReporter {
 public:
  RatioReporter() : ConsoleReporter(isatty(STDOUT_FILENO) != 0 ? OO_ColorTabular : OO_Tabular) {}

  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      if (run.run_type == Run::RT_Aggregate && run.aggregate_name == "median") {
        medians_[run.run_name.function_name] = run.GetAdjustedCPUTime();
      }
    }
  }
  void Finalize() override {
    for (const auto& [name, time] : medians_) {
      const auto reference = medians_.find(name + "_reference");
      if (reference == medians_.end()) continue;
      GetOutputStream() << "ratio " << name << ": " << reference->second / time << " times its reference\n";
    }
  }

 private:
  std::map<std::string, double> medians_;
};

/// Runs all benchmarks with repetitions interleaved at random. Returns the exit status.
inline int run_with_ratios(int argc, char** argv) {
  std::vector<std::string> arguments(argv, argv + argc);
  arguments.insert(arguments.begin() + 1, {"--benchmark_enable_random_interleaving=true", "--benchmark_repetitions=9",
                                           "--benchmark_display_aggregates_only=true"});
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  int count = static_cast<int>(pointers.size());
  benchmark::Initialize(&count, pointers.data());
  if (benchmark::ReportUnrecognizedArguments(count, pointers.data())) return 1;
  RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return 0;
}

}  // namespace absenc::bench
