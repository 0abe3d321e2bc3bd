// SPDX-License-Identifier: Apache-2.0
// Measures the decoding of an asynchronous line of 2.5 Mbit/s, sampled at 20 MS/s.
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absenc/capture/lines/pipeline.hpp"

namespace {

using namespace absenc::capture;
namespace fs = std::filesystem;

constexpr std::uint64_t samples_per_second = 20'000'000;
constexpr unsigned ticks_per_bit = 8;
constexpr std::uint64_t ticks_per_character = 10 * ticks_per_bit;
constexpr std::uint64_t megabyte = 1'000'000;

[[noreturn]] void fail(const char* what) {
  std::perror(what);
  std::exit(1);
}

struct Cost {
  double time;  // elapsed time of the measured work, in seconds
  // processor time of all threads and child processes, in seconds; unlike `time`, it is the same on a busy machine
  double processor;
};

double processor_seconds() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  rusage children{};
  getrusage(RUSAGE_CHILDREN, &children);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
  };
  return static_cast<double>(used.tv_sec) + static_cast<double>(used.tv_nsec) * 1e-9 + seconds(children.ru_utime) +
         seconds(children.ru_stime);
}

Cost cost_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  const double processor = processor_seconds();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          processor_seconds() - processor};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return (values[values.size() / 2] + values[(values.size() - 1) / 2]) / 2;
}

double least(const std::vector<double>& values) { return *std::min_element(values.begin(), values.end()); }

std::uint8_t byte_at(std::uint64_t index) { return static_cast<std::uint8_t>(index * 0x9E3779B97F4A7C15 >> 56); }

/// A capture file in a temporary folder, deleted at the end.
class File {
 public:
  explicit File(std::uint64_t size) : size_(size / ticks_per_character * ticks_per_character) {
    std::string folder = (fs::temp_directory_path() / "absenc-capture-bench-XXXXXX").string();
    if (mkdtemp(folder.data()) == nullptr) fail("mkdtemp");
    folder_ = folder;
    path_ = folder_ / "capture.bin";
    write();
    descriptor_ = open(path_.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0) fail("open");
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    close(descriptor_);
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  [[nodiscard]] const fs::path& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::uint64_t characters() const { return size_ / ticks_per_character; }
  void read(std::uint64_t offset, std::span<std::uint8_t> into) const {
    if (pread(descriptor_, into.data(), into.size(), static_cast<off_t>(offset)) != static_cast<ssize_t>(into.size())) {
      fail("pread");
    }
  }

 private:
  // Writes the capture: channel 0 has characters without pauses, the other channels have arbitrary levels.
  void write() const {
    const int out = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (out < 0) fail("open");
    std::vector<std::uint8_t> buffer;
    for (std::uint64_t i = 0; i < characters(); ++i) {
      const unsigned bits = static_cast<unsigned>(byte_at(i)) << 1 | 0x200;
      for (unsigned bit = 0; bit < 10; ++bit) {
        const auto others = static_cast<unsigned>((i * 10 + bit) * 0x9E3779B97F4A7C15 >> 57 << 1);
        buffer.insert(buffer.end(), ticks_per_bit, static_cast<std::uint8_t>(others | (bits >> bit & 1)));
      }
      if (buffer.size() < 4 * megabyte && i + 1 < characters()) continue;
      if (::write(out, buffer.data(), buffer.size()) != static_cast<ssize_t>(buffer.size())) fail("write");
      buffer.clear();
    }
    close(out);
  }

  std::uint64_t size_;
  fs::path folder_;
  fs::path path_;
  int descriptor_ = -1;
};

class RawReader final : public Reader {
 public:
  explicit RawReader(const File& file) : file_(file) {
    layout_.channels = {"0", "1", "2", "3", "4", "5", "6", "7"};
    layout_.ticks_per_second = samples_per_second;
    layout_.ticks = file.size();
  }
  [[nodiscard]] const Layout& layout() const override { return layout_; }
  [[nodiscard]] bool claim(Block& block) override {
    if (next_ == file_.size()) return false;
    block.first = block.file_offset = next_;
    block.file_size = std::min(block_size, file_.size() - next_);
    block.end = next_ += block.file_size;
    return true;
  }
  void fill(Block& block) override {
    block.samples.resize(block.file_size);
    file_.read(block.file_offset, block.samples);
  }
  [[nodiscard]] const std::vector<Damage>& damages() const override { return damages_; }

 private:
  static constexpr std::uint64_t block_size = 256 * 1024;
  const File& file_;
  Layout layout_;
  std::uint64_t next_ = 0;
  std::vector<Damage> damages_;
};

// Decodes the file and returns the time that this took. Ends the program if more than 20 characters are wrong or
// missing.
Cost decode(const File& file, unsigned threads) {
  RawReader reader(file);
  std::uint64_t count = 0;
  std::uint64_t wrong = 0;
  const std::vector<AsyncLine> lines{{0, {.baud = 2'500'000, .idle = Idle::high}}};
  AsyncOutcome outcome;
  const Cost cost = cost_of([&] {
    outcome = decode_async(reader, lines, threads, [&](const DecodedPart& part) {
      for (const Character& c : part.characters)
        wrong += c.bad_stop || c.value != byte_at(c.begin / ticks_per_character);
      count += part.characters.size();
      return true;
    });
  });
  // At the begin of the capture, the decoder may take edges within the first character for start bits, so a few
  // characters may be wrong.
  if (!outcome.problem.empty() || wrong > 20 || count + 20 < file.characters()) {
    std::fprintf(stderr, "%llu of %llu characters, %llu wrong: %s\n", static_cast<unsigned long long>(count),
                 static_cast<unsigned long long>(file.characters()), static_cast<unsigned long long>(wrong),
                 outcome.problem.c_str());
    std::exit(1);
  }
  return cost;
}

// Reads the blocks that the decoder reads, adds up their samples without decoding them, and returns the time that this
// took.
Cost plain_read(const File& file) {
  RawReader reader(file);
  std::uint64_t sum = 0;
  const Cost cost = cost_of([&] {
    for (Block block; reader.claim(block);) {
      reader.fill(block);
      for (std::size_t i = 0; i + 8 <= block.samples.size(); i += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, block.samples.data() + i, 8);
        sum += word;
      }
    }
  });
  // the output depends on the sum of all samples, so the compiler cannot omit the calculation of the sum
  if (sum == 1) std::puts("");
  return cost;
}

// Returns half the time that two decodings at once take: no decoding with two threads can be faster on this machine.
double two_independent(const File& file) {
  return cost_of([&] {
           std::jthread other([&] { decode(file, 1); });
           decode(file, 1);
         }).time /
         2;
}

void throughput(bool quick) {
  const File file((quick ? 100 : 400) * megabyte);
  std::vector<double> plain;
  std::vector<double> one;
  const auto size = static_cast<double>(file.size());
  for (int round = 0; round < (quick ? 7 : 15); ++round) {
    plain.push_back(size / plain_read(file).processor * 1e-9);
    one.push_back(size / decode(file, 1).processor * 1e-9);
  }
  std::printf(
      "asynchronous, 8 channels in a byte, one decoded, one core: %.2f GS/s; the plain read of the file: %.2f GB/s\n",
      median(one), median(plain));
}

// Measures decoding with two threads. The shortest of many runs counts, because only some runs find both cores free.
void two_threads(bool quick) {
  const File file(50 * megabyte);
  std::vector<double> alone;
  std::vector<double> together;
  std::vector<double> possible;
  for (int round = 0; round < (quick ? 30 : 300); ++round) {
    alone.push_back(decode(file, 1).time);
    together.push_back(decode(file, 2).time);
    possible.push_back(two_independent(file));
  }
  std::printf(
      "ratio of two threads to one: %.2f; two threads that have nothing to do with each other: %.2f (%u cores)\n",
      least(alone) / least(together), least(alone) / least(possible), std::thread::hardware_concurrency());
}

void against_sigrok(bool quick) {
  if (std::system("command -v sigrok-cli >/dev/null") != 0) {
    std::puts("against sigrok-cli: skipped, it is not installed (apt-get install sigrok-cli)");
    return;
  }
  const File file((quick ? 1 : 4) * megabyte);
  const std::string command = "sigrok-cli -I binary:numchannels=8:samplerate=20000000 -i '" + file.path().string() +
                              "' -P uart:rx=0:baudrate=2500000 -A uart=rx-data >'" +
                              (file.path().parent_path() / "out").string() + "'";
  std::vector<double> ours;
  const File longer(100 * megabyte);
  for (int round = 0; round < 5; ++round)
    ours.push_back(static_cast<double>(longer.size()) / decode(longer, 1).processor);
  const auto run = [&] {
    if (std::system(command.c_str()) != 0) std::exit(1);
  };
  const double theirs = static_cast<double>(file.size()) / cost_of(run).processor;
  if (fs::file_size(file.path().parent_path() / "out") < file.characters() * 8) {
    std::fprintf(stderr, "sigrok-cli decoded less than was sent\n");
    std::exit(1);
  }
  std::printf("sigrok-cli's uart decoder, by processor time: %.2f MS/s; ratio: %.0f times its rate\n", theirs * 1e-6,
              median(ours) / theirs);
}

void compare_file_sizes(bool quick) {
  const std::uint64_t most = (quick ? 100 : 4000) * megabyte;
  const File small(10 * megabyte);
  std::error_code ignored;
  if (fs::space(fs::temp_directory_path(), ignored).available < most + 1000 * megabyte) {
    std::printf("10 MB against %llu MB: skipped, the disk of %s has not enough room\n",
                static_cast<unsigned long long>(most / megabyte), fs::temp_directory_path().c_str());
    return;
  }
  const File big(most);
  plain_read(big);  // reads the file, so that as much of it as possible is in the page cache
  std::vector<double> ratios;
  for (int round = 0; round < (quick ? 5 : 7); ++round) {
    double alone = 0;
    for (int i = 0; i < 20; ++i) alone += decode(small, 1).processor;
    const double each = decode(big, 1).processor / static_cast<double>(big.characters());
    ratios.push_back(each / (alone / 20 / static_cast<double>(small.characters())));
  }
  std::printf("cost of a character in %llu MB against one in 10 MB: %.2f\n",
              static_cast<unsigned long long>(most / megabyte), median(ratios));
}

}  // namespace

int main(int argc, char** argv) {
  const bool quick = argc > 1;  // a benchmark that is started with any argument makes only a short run
  static_cast<void>(argv);
  throughput(quick);
  two_threads(quick);
  against_sigrok(quick);
  compare_file_sizes(quick);
  return 0;
}
