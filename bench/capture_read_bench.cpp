// SPDX-License-Identifier: Apache-2.0
// Measures how fast captures are read: raw samples compared with std::fread, sigrok sessions with libzip; VCD and CSV
// without comparison.
#include <zip.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "absenc/capture/files/open.hpp"
#include "bench/ratio.hpp"

namespace {

using namespace absenc::capture;

constexpr std::size_t samples_size = 64 << 20;
// number of bytes of samples in each of the files logic-1-1, logic-1-2 and so on, into which a sigrok session divides
// its samples; the same as sigrok-cli writes
constexpr std::size_t piece_size = 4 << 20;

void require_that(bool condition) {
  if (!condition) std::abort();
}

// The capture files of this run, in a folder that is deleted at the end.
struct Files {
  Files()
      : folder(std::filesystem::temp_directory_path() / ("absenc-bench-" + std::to_string(std::random_device()()))) {
    std::filesystem::create_directory(folder);
    // Makes samples of eight lines. About every 32 samples one line changes.
    std::mt19937 random(1);
    std::vector<char> samples(samples_size);
    unsigned levels = 0xFF;
    for (char& sample : samples) {
      if (random() % 32 == 0) levels ^= 1u << random() % 8;
      sample = static_cast<char>(levels);
    }
    std::ofstream(raw(), std::ios::binary).write(samples.data(), static_cast<std::streamsize>(samples.size()));
    write_session(samples);
    write_dump(samples);
    write_csv(samples);
  }
  ~Files() { std::filesystem::remove_all(folder); }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  [[nodiscard]] std::string raw() const { return folder / "raw"; }
  [[nodiscard]] std::string session() const { return folder / "session.sr"; }
  [[nodiscard]] std::string dump() const { return folder / "dump.vcd"; }
  [[nodiscard]] std::string csv() const { return folder / "digital.csv"; }

  void write_session(const std::vector<char>& samples) const {
    zip_t* archive = zip_open(session().c_str(), ZIP_CREATE, nullptr);
    const std::string metadata = "[device 1]\ncapturefile=logic-1\ntotal probes=8\nsamplerate=24 MHz\nunitsize=1\n";
    const auto add = [&](const std::string& name, const char* data, std::size_t size) {
      require_that(zip_file_add(archive, name.c_str(), zip_source_buffer(archive, data, size, 0), 0) >= 0);
    };
    add("version", "2", 1);
    add("metadata", metadata.data(), metadata.size());
    for (std::size_t i = 0; i < samples_size / piece_size; ++i) {
      add("logic-1-" + std::to_string(i + 1), samples.data() + i * piece_size, piece_size);
    }
    require_that(zip_close(archive) == 0);
  }

  void write_dump(const std::vector<char>& samples) const {
    std::ofstream file(dump());
    file << "$timescale 1 ns $end\n";
    for (int i = 0; i < 8; ++i) file << "$var wire 1 " << static_cast<char>('!' + i) << " D" << i << " $end\n";
    file << "$enddefinitions $end\n";
    unsigned before = 0;
    for (std::size_t i = 0; i < samples.size() / 2; ++i) {
      const auto now = static_cast<unsigned char>(samples[i]);
      if (now == before) continue;
      file << '#' << 41 * i;
      for (unsigned bit = 0; bit < 8; ++bit) {
        if (((now ^ before) >> bit & 1) != 0) file << ' ' << (now >> bit & 1) << static_cast<char>('!' + bit);
      }
      file << '\n';
      before = now;
    }
  }

  // Writes the changes in the first half of `samples` in the CSV format of Saleae's Logic 2.
  void write_csv(const std::vector<char>& samples) const {
    std::ofstream file(csv());
    file << "Time [s],0,1,2,3,4,5,6,7\n";
    int before = -1;
    for (std::size_t i = 0; i < samples.size() / 2; ++i) {
      const auto now = static_cast<unsigned char>(samples[i]);
      if (now == before) continue;
      std::array<char, 64> row{};
      const auto time = static_cast<double>(i) / 24e6;
      file.write(row.data(), std::snprintf(row.data(), row.size(), "%.9f", time));
      for (unsigned bit = 0; bit < 8; ++bit) file << ',' << (now >> bit & 1);
      file << '\n';
      before = now;
    }
  }

  std::filesystem::path folder;
};

const Files& files() {
  static const Files made;
  return made;
}

void read_blocks(benchmark::State& state, const std::string& path, const OpenChoices& choices) {
  Block block;
  for (auto _ : state) {
    const auto reader = open_capture(std::filesystem::path(path), choices);
    while (reader->claim(block)) {
      reader->fill(block);
      benchmark::DoNotOptimize(block.samples.data());
      benchmark::ClobberMemory();
    }
    require_that(reader->damages().empty());
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(std::filesystem::file_size(path)));
}

void raw_samples(benchmark::State& state) {
  read_blocks(state, files().raw(), {.channels = 8, .samples_per_second = 24'000'000});
}
BENCHMARK(raw_samples)->Unit(benchmark::kMillisecond);

// The reference for the benchmark `raw_samples`: reads the same file by std::fread, without the buffer of the C
// library.
void raw_samples_reference(benchmark::State& state) {
  std::vector<char> buffer(1 << 20);
  const std::string path = files().raw();
  for (auto _ : state) {
    std::FILE* file = std::fopen(path.c_str(), "rb");
    std::setvbuf(file, nullptr, _IONBF, 0);
    while (std::fread(buffer.data(), 1, buffer.size(), file) == buffer.size()) benchmark::DoNotOptimize(buffer.data());
    std::fclose(file);
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(samples_size));
}
BENCHMARK(raw_samples_reference)->Unit(benchmark::kMillisecond);

void sigrok_session(benchmark::State& state) { read_blocks(state, files().session(), {}); }
BENCHMARK(sigrok_session)->Unit(benchmark::kMillisecond);

void sigrok_session_reference(benchmark::State& state) {
  std::vector<char> buffer(piece_size);
  const std::string path = files().session();
  for (auto _ : state) {
    zip_t* archive = zip_open(path.c_str(), ZIP_RDONLY, nullptr);
    for (zip_uint64_t i = 2; i < samples_size / piece_size + 2; ++i) {
      zip_file_t* entry = zip_fopen_index(archive, i, 0);
      require_that(zip_fread(entry, buffer.data(), buffer.size()) == static_cast<zip_int64_t>(buffer.size()));
      // reads up to the end of the data, where libzip checks the checksum
      require_that(zip_fread(entry, buffer.data(), 1) == 0);
      zip_fclose(entry);
      benchmark::DoNotOptimize(buffer.data());
    }
    zip_discard(archive);
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(std::filesystem::file_size(path)));
}
BENCHMARK(sigrok_session_reference)->Unit(benchmark::kMillisecond);

void value_change_dump(benchmark::State& state) { read_blocks(state, files().dump(), {}); }
BENCHMARK(value_change_dump)->Unit(benchmark::kMillisecond);

void logic_csv(benchmark::State& state) { read_blocks(state, files().csv(), {}); }
BENCHMARK(logic_csv)->Unit(benchmark::kMillisecond);

}  // namespace

int main(int argc, char** argv) { return absenc::bench::run_with_ratios(argc, argv); }
