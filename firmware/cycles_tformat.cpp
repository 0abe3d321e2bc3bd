// SPDX-License-Identifier: Apache-2.0
// A drive with a T-format encoder, at 2.5 Mbit/s and 16 000 cycles per second: a position with alarms takes 51 us of
// the 62.5 us of a cycle, so that a command takes a cycle for each of its requests.
#include "absenc/core/bytes.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/protocol/tformat/unit.hpp"
#include "firmware/cycles.hpp"

namespace absenc::firmware {
namespace {

constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};
constexpr Time period = 62'500ns;
constexpr Time character = tformat::line_settings.character();
constexpr Time latency = 11 * character;  // the DMA channel reports a reply only when all 11 characters have arrived

struct Read {
  Conversation<std::uint8_t>& operator()() { return *new (memory) tformat::ReadPosition(format); }
  alignas(tformat::ReadPosition) std::byte memory[sizeof(tformat::ReadPosition)];
};

/// The line between drive and encoder. It carries blocks of bytes in both directions; blocks that overlap destroy each
/// other.
class Bench {
 public:
  Bench(const Options& options, Time begin)
      : device_(*tformat::unit.device(options, shaft_, device_memory_).bytes),
        axis_(read_, {.period = firmware::period, .line = tformat::line_settings, .answer = 12us, .latency = latency},
              begin + period),
        drive_(drive_end_, latency),
        encoder_(encoder_end_) {
    device_.power_on(begin, Device<std::uint8_t>::PowerOn::skip);
    encoder_.start(device_, begin);
    drive_.start(axis_, begin);
  }

  void add(host::Service<std::uint8_t>& service) {
    axis_.add(service);
    drive_.wake(machine::now());
    run_line(*this);
  }
  [[nodiscard]] Time next() const { return std::min({drive_.due(), encoder_.due(), request_.end, reply_.end}); }
  // Handles one event that is due at `time`. The encoder is told `time`, the drive the present time.
  void pass(Time time) {
    now_ = time;
    if (request_.end <= time) {
      request_.end = never;
      if (is_disturbed_) {
        encoder_.line_error(time);
      } else {
        encoder_.received(request_.bytes.view(), time);
      }
      is_disturbed_ = false;
      drive_.sent(machine::now());
    } else if (reply_.end <= time) {
      reply_.end = never;
      if (is_disturbed_) {
        drive_.line_error(machine::now());
      } else if (!is_silent_) {
        drive_.received(reply_.bytes.view(), machine::now());
      }
      is_disturbed_ = false;
      encoder_.sent(time);
    } else if (encoder_.due() <= time) {
      encoder_.tick(time);
    } else {
      drive_.tick(machine::now());
    }
  }
  [[nodiscard]] CycleCheck& check() { return check_; }
  [[nodiscard]] Device<std::uint8_t>& device() { return device_; }
  [[nodiscard]] const Unit& unit() const { return tformat::unit; }
  [[nodiscard]] std::uint32_t faults() const { return faults_; }

 private:
  /// Bytes on the line, which a DMA channel delivers when the last of them has arrived.
  struct Block {
    void begin(Bytes sent, Time at) {
      bytes.clear();
      bytes.append(sent);
      end = at + static_cast<int>(sent.size()) * character;
    }
    ByteBuffer<16> bytes{};
    Time end = never;
  };
  struct DriveEnd {
    void begin(const ByteStep& step) {
      bench.is_disturbed_ = bench.reply_.end != never;
      bench.request_.begin(step.out, machine::now());
    }
    void result(bool) { bench.check_.take(bench.axis_.cycle(), bench.axis_.cycle().begun + period); }
    Bench& bench;
  };
  struct EncoderEnd {
    void begin(const ByteStep& step) { bench.begin_reply(step.out); }
    void result(bool) {}
    Bench& bench;
  };

  // One of a hundred replies has a flipped bit, comes 20 us late, or is missing.
  void begin_reply(Bytes bytes) {
    reply_.begin(bytes, now_);
    is_silent_ = false;
    is_disturbed_ = request_.end != never;
    if (random_.below(100) != 0) return;
    ++faults_;
    switch (random_.below(3)) {
      case 0:
        reply_.bytes[random_.below(static_cast<std::uint32_t>(bytes.size()))] ^=
            static_cast<std::uint8_t>(1u << random_.below(8));
        break;
      case 1:
        reply_.end += 20us;
        break;
      default:
        is_silent_ = true;
    }
  }

  AcceleratingShaft shaft_{};
  alignas(std::max_align_t) std::array<std::byte, 2048> device_memory_;
  Device<std::uint8_t>& device_;
  Read read_{};
  host::CyclicHost<std::uint8_t, Read&> axis_;
  DriveEnd drive_end_{*this};
  EncoderEnd encoder_end_{*this};
  host::Carrier<std::uint8_t, DriveEnd> drive_;
  host::Carrier<std::uint8_t, EncoderEnd> encoder_;
  Block request_{};
  Block reply_{};
  bool is_silent_ = false;
  bool is_disturbed_ = false;  // whether drive and encoder have sent at the same time, which destroys the bytes of both
  Time now_{};
  Random random_{};
  std::uint32_t faults_ = 0;
  CycleCheck check_{5us, false};
};

}  // namespace
}  // namespace absenc::firmware

void absenc::machine::on_alarm() { firmware::run_line(*firmware::bench<firmware::Bench>); }

int main() {
  using namespace absenc;
  firmware::run_program<firmware::Bench>(tformat::unit, "TS5700N8500", {},
                                         {.period = firmware::period,
                                          .temperature = "temperature",
                                          .alarm = tformat::alarms::over_heat,
                                          .clear = "clear-alarms",
                                          .page = 2,
                                          .addresses = 127,
                                          .bytes = 256,
                                          .takes_cycles = true});
}
