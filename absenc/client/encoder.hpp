// SPDX-License-Identifier: Apache-2.0
// An encoder, opened by its address or its name.
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

/// Whether the single-turn position of a sample can be used, or why not.
enum class PositionState : std::uint8_t {
  good,
  unconfirmed,  ///< no second reading confirmed the position: `Sample::doubtful` is true
  starting,     ///< the encoder is still starting: `Reading::ready` is false
  invalid,      ///< the encoder reports that the position is invalid
  unknown,      ///< no reply has reported whether the position is valid
  none,         ///< the sample is not a reading, or its reading has no position
};

/// Returns a sentence for people that describes `state`.
[[nodiscard]] std::string_view text_of(PositionState state);

/// Result of one attempt to read the encoder or to open its port. Times are those of os::now.
struct Sample {
  /// Kind of a sample: a reading, a failure, or an event of the port.
  enum class Kind : std::uint8_t {
    reading,
    failed,  ///< the attempt failed because of the encoder or the line
    lost,    ///< the port was lost during this attempt
    absent,  ///< the port is not open and could not be opened
    back,    ///< the port is open again; nothing was read yet
  };

  Kind kind = Kind::absent;  ///< Whether this sample holds a reading, a failure or an event.
  /// Time at which the encoder latched the position (`latched` of the reading), or time of the failure or of the event.
  Time at{};
  Reading reading{};  ///< The reading; default-constructed if `kind` is not `reading`.
  /// Whether the position agrees with the one that was read before it (host::FirstReading).
  bool confirmed = false;
  /// Whether the encoder was ready and its position valid, but not `confirmed`.
  bool doubtful = false;
  bool position_valid = false;  ///< Whether `position` is valid.
  /// Position in counts, continued past the end of the encoder's counter; see `position_valid`.
  std::int64_t position = 0;
  /// Whether `position` starts again at this sample, after a jump or after too long a pause.
  bool restarted = false;
  /// Whether `speed` is valid: the latch times of this position and an earlier one must determine it closely enough.
  bool speed_valid = false;
  /// Mean speed from an earlier position to this one, in rpm (mm/s for linear encoders); 0 unless `speed_valid`.
  double speed = 0;
  /// Greatest difference between `speed` and the true mean speed, in the same unit; errors of the encoder are not
  /// included.
  double speed_uncertainty = 0;
  Time speed_delay{};     ///< Time by which the speed lags behind the position.
  JointAngles angles{};   ///< Angles of joint and motor; empty unless the address has settings of the drive.
  Trouble trouble{};      ///< Description of the failure; empty unless `kind` is `failed`.
  std::string message{};  ///< Text of the event: port lost, absent or back, or position restarted; "": no event.

  /// Returns whether `reading.singleturn` can be used, or why not.
  [[nodiscard]] PositionState position_state() const;

  /// Returns `speed` with its uncertainty; nothing if the speed is invalid.
  [[nodiscard]] std::optional<Estimate> measured_speed() const;
  /// Returns the speed in rpm; nothing for a linear encoder or if the speed is invalid.
  [[nodiscard]] std::optional<Estimate> speed_rpm() const;
  /// Returns the speed in mm/s; nothing for a rotary encoder or if the speed is invalid.
  [[nodiscard]] std::optional<Estimate> speed_mm_s() const;

  /// Returns the text of the failure, or of the event; "" if the sample has neither.
  [[nodiscard]] std::string text() const { return kind == Kind::failed ? trouble.text() : message; }
};

/// Rate and length of a series of samples.
struct SampleChoices {
  double rate_hz = 0;       ///< Readings per second; 0: as fast as possible.
  std::uint64_t count = 0;  ///< Number of samples; 0: no limit.
  Time deadline = never;    ///< Time of os::now at which the series ends, even during a wait.
};

class Samples;

/// An encoder, connected or not. One thread at a time may use it; any thread may call `cancel`.
class Encoder {
 public:
  /// Connection and state of an encoder; for the library itself only.
  struct Parts;

  /// Moves the encoder; afterwards the other object may only be destroyed or assigned to.
  Encoder(Encoder&&) noexcept;
  /// Moves the encoder; afterwards the other object may only be destroyed or assigned to.
  Encoder& operator=(Encoder&&) noexcept;
  ~Encoder();

  /// Opens the port, or shares that of another encoder on the line. Throws os::Failure, UsageError, Failure.
  void connect();
  /// Releases the port; counters and statistics remain.
  void disconnect();
  /// Returns whether the encoder has a port.
  [[nodiscard]] bool connected() const;

  /// Returns a reading of the position; a valid position that no second one confirmed is marked as unknown. Connects
  /// first if needed. Throws EncoderFailure, Failure, UsageError, os::Failure, os::Interrupted, Cancelled, and
  /// DeadlinePassed if a wait for the encoder reaches `deadline`, a time of os::now.
  [[nodiscard]] Reading read(Time deadline = never);
  /// Returns a reading with the alarms; its position need not be confirmed.
  [[nodiscard]] Reading read_alarms();
  /// Returns a range of samples. A lost port does not end it.
  [[nodiscard]] Samples samples(const SampleChoices& choices = {});
  /// Takes one sample and returns it; if the encoder is not connected, tries to open the port. Throws os::Failure,
  /// os::Interrupted, UsageError, Failure, Cancelled.
  Sample next();

  /// Runs a command of the unit by name and returns the fields of its result. Optional arguments may be left out at the
  /// end. Does not ask for confirmation. Throws EncoderFailure, Failure, os::Failure, os::Interrupted, UsageError,
  /// Cancelled.
  Answer run(std::string_view command, std::span<const std::int64_t> arguments = {});
  /// Runs a command of the unit by name, with arguments in the order of the command.
  Answer run(std::string_view command, std::initializer_list<std::int64_t> arguments) {
    return run(command, std::span(arguments.begin(), arguments.size()));
  }

  /// Returns access to the memory. The encoder must be connected and must not be moved meanwhile.
  [[nodiscard]] Memory memory() { return Memory(*this); }

  /// Returns access to the settings. The encoder must be connected and must not be moved meanwhile.
  [[nodiscard]] Settings settings() { return Settings(*this); }

  /// Cancels from any thread: until `resume`, waits throw Cancelled, and a loop over samples ends.
  void cancel();
  /// Withdraws `cancel`, so that the encoder can be used again.
  void resume();

  /// Sets a function that is polled during waits; true ends them as `cancel` does. Empty: none. Returns the previous
  /// function.
  std::function<bool()> end_when(std::function<bool()> over);

  /// Returns the state of the last command that changes the encoder; see change.hpp.
  [[nodiscard]] const Change& change() const;

  /// Makes the continued position start again; call it after a command that moves the zero.
  void forget_position();

  /// Returns protocol and port of the address, without settings: "tformat:/dev/ttyUSB0".
  [[nodiscard]] std::string address() const;
  /// Returns the unit of the encoder.
  [[nodiscard]] const Unit& unit() const;
  /// Returns the options of the encoder.
  [[nodiscard]] const Options& options() const;
  /// Returns the settings of the address that describe joint and motor.
  [[nodiscard]] const Joint& joint() const;
  /// Returns notes about the port, one sentence each; none while the encoder is not connected.
  [[nodiscard]] const std::vector<std::string>& notes() const;
  /// Returns the counts of all conversations: good ones, errors by kind, repeated attempts.
  [[nodiscard]] const host::Counters& counters() const;
  /// Returns the latencies of the good conversations, from the request to the end of the reply.
  [[nodiscard]] const host::Latencies& latencies() const;
  /// Returns the stored bad exchanges, the newest first, with times of os::now.
  [[nodiscard]] std::vector<BadExchangeText> bad_exchanges() const;
  /// Returns how many readings `read`, `next` and `samples` took without an error since the encoder was opened.
  [[nodiscard]] std::uint64_t readings() const;
  /// Returns how often the port was lost since the encoder was opened.
  [[nodiscard]] std::uint64_t losses() const;
  /// Returns in how many samples the continued position started again (`Sample::restarted`).
  [[nodiscard]] std::uint64_t restarts() const;
  /// Returns the number of readings per second, averaged over about the last second.
  [[nodiscard]] double rate() const;
  /// Returns a warning if the rate of `samples` is too low to follow the turns of a fast shaft; "" if not.
  [[nodiscard]] std::string rate_note() const;

 private:
  explicit Encoder(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
};

/// Opens and connects an encoder and returns it. `text` is an address, as "tformat:/dev/ttyUSB0?model=23-bit" or
/// "sim:esl", or a name of absenc.toml; `settings` ("name=value") are added to it. With the setting realtime=PRIORITY,
/// 1 to 99, each thread that uses the encoder becomes a real-time thread (SCHED_FIFO) and stays one, and the memory of
/// the process is locked. Throws os::Failure, UsageError, and Failure if the kernel refuses that.
[[nodiscard]] Encoder open(std::string_view text, std::span<const std::string> settings = {});

/// An input range of samples. With a rate they are due at equal distances in time, without drift.
class Samples {
 public:
  /// Type of the values in the range.
  using value_type = Sample;
  /// Iterator over the range.
  using Iterator = InputIterator<Samples>;

  /// Takes samples of `encoder`, which must outlive this object.
  Samples(Encoder& encoder, const SampleChoices& choices);
  /// Moves the samples; afterwards the other object may only be destroyed or assigned to.
  Samples(Samples&&) noexcept;
  /// Moves the samples; afterwards the other object may only be destroyed or assigned to.
  Samples& operator=(Samples&&) noexcept;
  ~Samples();

  /// Takes the first sample and returns an iterator to it; call it once.
  [[nodiscard]] Iterator begin();
  /// Returns the end of the range, for comparison with an iterator.
  [[nodiscard]] static Iterator::End end() { return {}; }
  /// Returns the last sample, or null at the end of the range; valid until `advance`.
  [[nodiscard]] const Sample* current() const;
  /// Waits for the next sample and takes it, or ends the range.
  void advance();

 private:
  struct Parts;

  std::unique_ptr<Parts> parts_;
};

/// Returns a word for the sample: "lost", "back" or "restarted", the name of an error, or "".
[[nodiscard]] std::string_view event_name(const Sample& sample);

/// Returns the unit of the speed: "rpm", or "mm/s" for a linear encoder.
[[nodiscard]] std::string_view speed_unit(const Reading& reading);

}  // namespace absenc::client
