// SPDX-License-Identifier: Apache-2.0
// An encoder, opened by name: single readings, long series of samples that survive a lost port and a counter that
// wraps, and commands.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/estimate.hpp"
#include "absenc/client/input_range.hpp"
#include "absenc/client/joint.hpp"
#include "absenc/client/memory.hpp"
#include "absenc/client/row.hpp"
#include "absenc/client/settings.hpp"
#include "absenc/client/trouble.hpp"
#include "absenc/host/session.hpp"
#include "absenc/host/statistics.hpp"

namespace absenc::client {

/// Whether the position of a sample can be used; `text_of` has a sentence for each.
enum class PositionState : std::uint8_t {
  good,
  unconfirmed,  ///< `Sample::doubtful` is true
  starting,     ///< `Reading::ready` is false
  invalid,      ///< the validity is `Validity::invalid`
  unknown,      ///< the validity is `Validity::unknown`
  none,         ///< the sample is not a reading, or its reading has no position
};

/// Returns the state in words, for people.
[[nodiscard]] std::string_view text_of(PositionState state);

/// Result of one attempt to read. Times are those of os::now.
struct Sample {
  /// The kind of a sample.
  enum class Kind : std::uint8_t {
    reading,
    failed,  ///< the attempt failed because of the encoder or the line
    lost,    ///< the port was lost during this attempt
    absent,  ///< the port is still lost
    back,    ///< the port is open again; nothing was read yet
  };

  Kind kind = Kind::absent;  ///< What this sample holds.
  Time at{};                 ///< Time at which a reading was latched, or of the event.
  Reading reading{};         ///< The reading; default if `kind` is not a reading.
  bool confirmed = false;    ///< Two consecutive readings agreed.
  /// The position was valid but no second reading agreed with it, so it is marked invalid.
  bool doubtful = false;
  bool position_valid = false;  ///< Whether `position` is valid.
  std::int64_t position = 0;    ///< Position in counts, continued past the end of the encoder's counter.
  /// The position jumped, or the distance since the last reading is unknown, so `position` starts again.
  bool restarted = false;
  /// Whether `speed` is valid: the times of the positions must determine it closely enough.
  bool speed_valid = false;
  /// Mean speed between two positions in rpm (mm/s for linear encoders), `speed_delay` before `at`.
  double speed = 0;
  /// Greatest distance of `speed` from the true mean between the instants at which the two positions were latched, in
  /// the same unit. It includes the times of requests and replies and one count of each position, but not errors and
  /// noise of the encoder.
  double speed_uncertainty = 0;
  Time speed_delay{};     ///< Time by which the speed lags behind the position.
  JointAngles angles{};   ///< Angles of joint and motor, if the address has settings of the drive.
  Trouble trouble{};      ///< Description of a failed attempt.
  std::string message{};  ///< Text of the event: lost, absent, back or restarted.

  /// Returns whether `reading.singleturn` can be used. For turns see `reading.multiturn_validity()`; for the position
  /// past the end of the counter see `position_valid`.
  [[nodiscard]] PositionState position_state() const;

  /// Returns the speed with its uncertainty, in rpm (mm/s for linear encoders); nothing if it is invalid.
  [[nodiscard]] std::optional<Estimate> measured_speed() const;
  /// Returns the speed of a rotary encoder in rpm; nothing for a linear one.
  [[nodiscard]] std::optional<Estimate> speed_rpm() const;
  /// Returns the speed of a linear encoder in mm/s; nothing for a rotary one.
  [[nodiscard]] std::optional<Estimate> speed_mm_s() const;

  /// Returns the reason for a missing reading, or the event; "" for a reading without an event.
  [[nodiscard]] std::string text() const { return kind == Kind::failed ? trouble.text() : message; }
};

/// Rate and length of a series of samples.
struct SampleChoices {
  double rate_hz = 0;       ///< Readings per second; 0: as fast as possible.
  std::uint64_t count = 0;  ///< Number of samples; 0: no limit.
  Time deadline = never;    ///< Time of os::now at which the series ends, even during a wait.
};

class Samples;

/// An open encoder. One thread at a time may use it; only `cancel` may be called from another thread.
class Encoder {
 public:
  /// The connection and the state of an encoder. Only the library itself can use it.
  struct Parts;

  /// Moves the encoder; the other one may only be destroyed or assigned to.
  Encoder(Encoder&&) noexcept;
  /// Moves the encoder; the other one may only be destroyed or assigned to.
  Encoder& operator=(Encoder&&) noexcept;
  ~Encoder();

  /// Opens the port again after `disconnect` or after its loss. Throws os::Failure, UsageError.
  void connect();
  /// Closes the port and keeps counters and statistics. The next reading or command opens the port again.
  void disconnect();
  /// Returns whether the port is open: from `open` until `disconnect`, or until a sample reports the loss of the port.
  [[nodiscard]] bool connected() const;

  /// Reads the position and all alarms that the encoder can report. A position that a second one did not confirm is
  /// invalid. Opens a lost port again. Throws EncoderFailure, os::Failure, Cancelled, and DeadlinePassed without a
  /// reading at `deadline` (a time of os::now), up to 20 ms and the duration of one exchange later.
  [[nodiscard]] Reading read(Time deadline = never);
  /// Reads the alarms, with the command that reads each alarm by name if the unit has one.
  [[nodiscard]] Reading read_alarms();
  /// Returns samples for a loop, which continues after a lost port is back. The loop ends after `count` samples, at the
  /// deadline, or with `cancel`.
  [[nodiscard]] Samples samples(const SampleChoices& choices = {});
  /// Takes one sample: reads once, or waits a quarter of a second and tries to open the port again. Throws
  /// os::Interrupted, UsageError, Failure, Cancelled.
  Sample next();

  /// Runs a command of the unit by name. Arguments that are left out have their defaults. Does not ask the user for
  /// confirmation, even if the command changes the encoder, but reads back written values. Throws EncoderFailure,
  /// os::Failure, UsageError, Cancelled.
  Answer run(std::string_view command, std::span<const std::int64_t> arguments = {});
  /// Runs a command of the unit with arguments in their order.
  Answer run(std::string_view command, std::initializer_list<std::int64_t> arguments) {
    return run(command, std::span(arguments.begin(), arguments.size()));
  }

  /// Returns the memory of the encoder, which must be connected. This object must stay where it is.
  [[nodiscard]] Memory memory() { return Memory(*this); }

  /// Returns the settings of the encoder, which must be connected. This object must stay where it is.
  [[nodiscard]] Settings settings() { return Settings(*this); }

  /// Cancels from any thread: every wait, now or later, ends with Cancelled; a loop over samples ends without it.
  void cancel();
  /// Withdraws `cancel`, so that the encoder can be used again.
  void resume();

  /// Sets a function that is polled during every wait, also for the time of the next sample. Once it returns true, the
  /// wait ends with Cancelled. Empty: none. Returns the previous function.
  std::function<bool()> end_when(std::function<bool()> over);

  /// Returns the state of the last command that changes the encoder; an exception of that command carries the same
  /// (change.hpp).
  [[nodiscard]] const Change& change() const;

  /// Starts the continued position again at the next reading; for use after a command that moves the zero.
  void forget_position();

  /// Returns protocol and port, without the settings: "tformat:/dev/ttyUSB0".
  [[nodiscard]] std::string address() const;
  /// Returns the unit of the encoder.
  [[nodiscard]] const Unit& unit() const;
  /// Returns the options of the encoder.
  [[nodiscard]] const Options& options() const;
  /// Returns the settings of the drive in the address.
  [[nodiscard]] const Joint& joint() const;
  /// Returns a sentence for each setting of the port that could be better.
  [[nodiscard]] const std::vector<std::string>& notes() const;
  /// Returns counts of all exchanges: good ones, errors by kind, repetitions.
  [[nodiscard]] const host::Counters& counters() const;
  /// Returns the latencies, from the end of a request to the end of its reply.
  [[nodiscard]] const host::Latencies& latencies() const;
  /// Returns the last bad exchanges, the newest first, with times of os::now.
  [[nodiscard]] std::vector<BadExchangeText> bad_exchanges() const;
  /// Returns the number of good readings so far.
  [[nodiscard]] std::uint64_t readings() const;
  /// Returns how often the port was lost.
  [[nodiscard]] std::uint64_t losses() const;
  /// Returns how often the continued position started again, because of a jump or of a pause too long to count the
  /// turns.
  [[nodiscard]] std::uint64_t restarts() const;
  /// Returns the rate of good readings, per second.
  [[nodiscard]] double rate() const;
  /// Returns a sentence if the shaft can turn too fast for the intended rate to follow its turns; otherwise "".
  [[nodiscard]] std::string rate_note() const;

 private:
  explicit Encoder(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
};

/// Opens an encoder and connects it. `text` is an address, "tformat:/dev/ttyUSB0?model=23-bit" or "sim:esl", or a name
/// of absenc.toml; `settings` ("name=value") act as if appended to it. Throws os::Failure; UsageError, which names the
/// wrong part and the nearest right one.
[[nodiscard]] Encoder open(std::string_view text, std::span<const std::string> settings = {});

/// An input range of samples at equal distances in time, without drift. A sample whose time has passed is left out.
class Samples {
 public:
  /// Type of the items.
  using value_type = Sample;
  /// Iterator of the range.
  using Iterator = InputIterator<Samples>;

  /// Samples `encoder`, which must outlive this object.
  Samples(Encoder& encoder, const SampleChoices& choices);
  /// Moves the samples; the other object may only be destroyed or assigned to.
  Samples(Samples&&) noexcept;
  /// Moves the samples; the other object may only be destroyed or assigned to.
  Samples& operator=(Samples&&) noexcept;
  ~Samples();

  /// Takes the first sample; call it once.
  [[nodiscard]] Iterator begin();
  /// Returns the end of the range.
  [[nodiscard]] static Iterator::End end() { return {}; }
  /// Returns the sample at the iterator, or null at the end. It is valid until `advance`.
  [[nodiscard]] const Sample* current() const;
  /// Waits for the next sample.
  void advance();

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
};

/// Returns "" for a reading, "lost" or "back" for those events, and the name of the error for a failed attempt.
[[nodiscard]] std::string_view event_name(const Sample& sample);

/// Returns "rpm", or "mm/s" for a linear encoder.
[[nodiscard]] std::string_view speed_unit(const Reading& reading);

}  // namespace absenc::client
