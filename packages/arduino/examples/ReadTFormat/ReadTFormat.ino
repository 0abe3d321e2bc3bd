// SPDX-License-Identifier: Apache-2.0
// Reads a Smart-Abs (T-format, 17 bits and 16 bits of turns) on Serial1 behind an RS-485 transceiver, every 10 ms.
#include <absenc.h>

#include <optional>

#include "absenc/host/first_reading.hpp"
#include "absenc/protocol/tformat/host.hpp"

using namespace absenc;

constexpr int direction_pin = 2;                        // DE and /RE of the transceiver; high: transmit
constexpr std::uint32_t period_us = 10'000;             // time between two readings
constexpr std::uint32_t fastest_rpm = 6'000;            // highest speed of the axis
// Greatest delay between line and program, by loop() and the port's buffers.
constexpr Time latency = std::chrono::milliseconds(2);

constexpr tformat::Format format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11};

// Connects Serial1 with the carrier. loop() reports the end of transmission, because begin() must not call the carrier.
struct SerialLine {
  bool was_sent = false;
  bool is_over = false;

  void begin(const ByteStep& step) {
    digitalWrite(direction_pin, HIGH);
    Serial1.write(step.out.data(), step.out.size());
    Serial1.flush();  // waits until the last bit of the request is sent
    digitalWrite(direction_pin, LOW);
    was_sent = true;
  }
  void result(bool over) { is_over = over; }
};

SerialLine line;
host::Carrier<std::uint8_t, SerialLine> carrier(line, latency);
struct Read final : tformat::ReadPosition {
  using ReadPosition::ReadPosition;
};
std::optional<Read> position;  // made in place for each reading, because it cannot be copied
host::FirstReading first(fastest_rpm);

// Returns the time since the start, although micros() wraps after 71 minutes.
Time now() {
  static std::uint32_t last = 0;
  static std::uint64_t passed = 0;
  const std::uint32_t microseconds = micros();
  passed += microseconds - last;
  last = microseconds;
  return std::chrono::microseconds(passed);
}

void show() {
  if (position->error() != Error::none) {
    Serial.println(text_of(position->error()).name.data());
    return first.start_again();
  }
  const Reading& reading = *position->reading();
  if (!first.confirms(reading)) return;
  Serial.print(static_cast<unsigned long>(reading.multiturn));
  Serial.print(' ');
  Serial.println(static_cast<unsigned long>(reading.singleturn));
}

void setup() {
  pinMode(direction_pin, OUTPUT);
  digitalWrite(direction_pin, LOW);
  Serial.begin(115200);
  Serial1.begin(tformat::line_settings.rate);
}

void loop() {
  static Time next_start{};
  if (!carrier.is_busy() && now() >= next_start) {
    next_start = now() + std::chrono::microseconds(period_us);
    carrier.start(position.emplace(format), now());
  }
  if (line.was_sent) {
    line.was_sent = false;
    carrier.sent(now());
  }
  while (Serial1.available() > 0) {
    const auto byte = static_cast<std::uint8_t>(Serial1.read());
    carrier.received({&byte, 1}, now());
  }
  carrier.tick(now());
  if (line.is_over) {
    line.is_over = false;
    show();
  }
}
