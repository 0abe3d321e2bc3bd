// SPDX-License-Identifier: Apache-2.0
// Stub of the part of Arduino's core that a sketch with a serial port needs. An encoder on Serial1 replies to requests;
// in every third reply one bit is flipped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <deque>

#define HIGH 0x1
#define LOW 0x0
#define INPUT 0x0
#define OUTPUT 0x1
#define PI 3.1415926535897932384626433832795
#define abs(x) ((x) > 0 ? (x) : -(x))
#define bit(b) (1UL << (b))
#define constrain(amt, low, high) ((amt) < (low) ? (low) : ((amt) > (high) ? (high) : (amt)))
#define degrees(rad) ((rad)*57.295779513082320876798154814105)
#define max(a, b) ((a) > (b) ? (a) : (b))
#define min(a, b) ((a) < (b) ? (a) : (b))
#define radians(deg) ((deg)*0.017453292519943295769236907684886)
#define round(x) ((x) >= 0 ? (long)((x) + 0.5) : (long)((x)-0.5))
#define sq(x) ((x) * (x))
#define word(...) makeWord(__VA_ARGS__)
#define lowByte(w) ((uint8_t)((w)&0xff))
#define highByte(w) ((uint8_t)((w) >> 8))

inline int direction = -1;
inline void pinMode(int, int) {}
inline void digitalWrite(int, int value) { direction = value; }

// Each call of micros advances the clock by 10 us, so that a loop which only polls the clock ends.
inline std::uint32_t microseconds_passed = 0xFFFF'0000;
inline std::uint32_t micros() { return microseconds_passed += 10; }

class HardwareSerial {
 public:
  void begin(unsigned long baud) { baud_ = baud; }
  std::size_t write(const std::uint8_t* bytes, std::size_t size) {
    if (direction != HIGH || baud_ != 2'500'000 || size != 1 || bytes[0] != 0x1A) return 0;
    waiting_.assign({0x1A, 0x00, 0x45, 0x23, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00, 0x4A});
    if (++requests_ % 3 == 0) waiting_[4] ^= 0x10;
    return size;
  }
  void flush() {}
  int available() { return direction == LOW ? static_cast<int>(waiting_.size()) : 0; }
  int read() {
    const int byte = waiting_.front();
    waiting_.pop_front();
    return byte;
  }
  void print(unsigned long number) { std::printf("%lu", number); }
  void print(char character) { std::printf("%c", character); }
  void println(unsigned long number) { std::printf("%lu\n", number); }
  void println(const char* text) { std::printf("%s\n", text); }

 private:
  unsigned long baud_ = 0;
  unsigned requests_ = 0;
  std::deque<std::uint8_t> waiting_;
};
inline HardwareSerial Serial, Serial1;
