// SPDX-License-Identifier: Apache-2.0
// An encoder that is read for long: it may be unplugged and come back, and its position goes on past the end of its
// counter. For read, record and monitor.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/host/unwrap.hpp"
#include "absenc/host/velocity.hpp"
#include "tools/absenc/encoder.hpp"

namespace absenc::tool {

/// What one attempt to read has brought. Times are those of os::now.
struct Sample {
  enum class Kind : std::uint8_t {
    reading,
    failed,  // the encoder or the line
    lost,    // the port has just gone away
    absent,  // it is still away
    back,    // it is there again, but nothing was read yet
  };

  Kind kind = Kind::absent;
  Time at{};  // a reading: when it was latched
  Reading reading{};
  bool confirmed = false;  // two readings in a row agreed
  bool doubtful = false;   // it looked valid, but none agreed with it: it is marked invalid
  bool position_valid = false;
  std::int64_t position = 0;  // counts, continued past the end of the counter
  bool restarted = false;     // how far it went since the reading before is not known: `position` starts again
  bool speed_valid = false;
  double speed = 0;  // `speed_delay` before `at`: rpm, of linear encoders mm/s
  Time speed_delay{};
  Trouble trouble{};      // failed
  std::string message{};  // lost, absent, back, restarted
};

class LiveEncoder {
 public:
  /// `period` is the distance of readings that is intended; 0: as near as can be. Nothing is opened yet.
  LiveEncoder(const EncoderUri& uri, Time period);

  /// Opens the port, so that a first failure can end the command instead of being waited out. Throws as
  /// Encoder::connect.
  void connect();
  /// Reads once, or waits a quarter of a second and tries to open the port again. Throws os::Interrupted, UsageError
  /// and ToolFailure.
  Sample next();
  /// The position starts again from the next reading: after a command that moves the zero.
  void forget_position();

  /// Connected unless the last sample said otherwise.
  [[nodiscard]] Encoder& encoder() { return *encoder_; }
  [[nodiscard]] const Encoder& encoder() const { return *encoder_; }
  /// Good ones so far.
  [[nodiscard]] std::uint64_t readings() const { return readings_; }
  /// How often the port went away.
  [[nodiscard]] std::uint64_t losses() const { return losses_; }
  /// How often the position started again, because a pause was too long to know how often the shaft turned.
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }
  /// Good readings a second.
  [[nodiscard]] double rate() const;
  /// As Encoder::bad_exchanges, with times of os::now.
  [[nodiscard]] std::vector<BadExchangeText> bad_exchanges() const;
  /// A sentence when the shaft can turn too fast for the intended rate to follow its turns; otherwise "".
  [[nodiscard]] std::string rate_note() const;

 private:
  Sample search();
  Sample take(Reading reading);
  void note_restart(Sample& sample, const Reading& reading);

  std::unique_ptr<Encoder> encoder_;
  Time period_;
  host::Unwrapper unwrapper_;
  host::Velocity velocity_;
  host::Rate rate_;
  Time offset_{};  // from the port's clock to ours
  Time lost_at_{};
  Time next_try_{};
  bool was_there_ = false;
  std::uint64_t readings_ = 0;
  std::uint64_t losses_ = 0;
  Time unwrapped_at_{};  // of the last valid position
  std::uint64_t restarts_ = 0;
};

/// "" of a reading; "lost", "back"; of a failed attempt the name of the error
[[nodiscard]] std::string_view event_name(const Sample& sample);

/// `summary`, and why there are more exchanges than readings.
[[nodiscard]] std::string exchanges_text(const host::Counters& counters, std::uint64_t readings);

/// "rpm", or of linear encoders "mm/s"
[[nodiscard]] std::string_view speed_unit(const Reading& reading);

/// Sets the position in counts and the speed, of linear encoders (`unit_um` is not 0) both in millimetres; what is not
/// valid is null.
void set_motion(Json& json, const Sample& sample, double unit_um);

}  // namespace absenc::tool
