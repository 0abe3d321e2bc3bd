// SPDX-License-Identifier: Apache-2.0
// An encoder by its name: read once or for long, when it may be unplugged and come back and its position goes on past
// the end of its counter, and told to run commands.
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
  unconfirmed,  // `Sample::doubtful`
  starting,     // not `Reading::ready`
  invalid,      // `Validity::invalid`
  unknown,      // `Validity::unknown`
  none,         // the sample is no reading, or has no position
};

[[nodiscard]] std::string_view text_of(PositionState state);

/// What one attempt to read has brought. Times are those of os::now.
struct Sample {
  /// What a sample holds.
  enum class Kind : std::uint8_t {
    reading,
    failed,  // the encoder or the line
    lost,    // the port has just gone away
    absent,  // it is still away
    back,    // it is there again, but nothing was read yet
  };

  Kind kind = Kind::absent;      ///< What this sample holds.
  Time at{};                     ///< a reading: when it was latched
  Reading reading{};             ///< The reading; default if `kind` is not a reading.
  bool confirmed = false;        ///< two readings in a row agreed
  bool doubtful = false;         ///< it looked valid, but none agreed with it: it is marked invalid
  bool position_valid = false;   ///< Whether the position holds.
  std::int64_t position = 0;     ///< counts, continued past the end of the counter
  bool restarted = false;        ///< it jumped, or how far it went meanwhile is not known: `position` starts again
  bool speed_valid = false;      ///< the times of the positions leave little of it open; otherwise there is none
  double speed = 0;              ///< rpm, of linear encoders mm/s: the mean between two positions, as it was
                                 ///< `speed_delay` before `at`
  double speed_uncertainty = 0;  ///< the same unit: how far that mean can be from the true one between the instants at
                                 ///< which the two were latched. From the times of requests and replies and from one
                                 ///< count of each position; errors and noise of the encoder are not in it
  Time speed_delay{};            ///< Time by which the speed lags behind the position.
  JointAngles angles{};          ///< of joint and motor, where the address says how the encoder sits in its drive
  Trouble trouble{};             ///< failed
  std::string message{};         ///< lost, absent, back, restarted

  /// Whether `reading.singleturn` can be used. Of turns `reading.multiturn_validity()` says it, of the position that
  /// goes on past the counter's end `position_valid`.
  [[nodiscard]] PositionState position_state() const;

  /// The speed with its uncertainty where it is valid, in rpm, of linear encoders in mm/s.
  [[nodiscard]] std::optional<Estimate> measured_speed() const;
  /// The same of a rotary encoder; nothing of a linear one.
  [[nodiscard]] std::optional<Estimate> speed_rpm() const;
  /// The same of a linear encoder; nothing of a rotary one.
  [[nodiscard]] std::optional<Estimate> speed_mm_s() const;

  /// Why there is no reading, or what happened; "" of a reading that goes on.
  [[nodiscard]] std::string text() const { return kind == Kind::failed ? trouble.text() : message; }
};

/// How an encoder is to be read.
struct SampleChoices {
  double rate_hz = 0;       ///< readings a second; 0: as fast as can be
  std::uint64_t count = 0;  ///< 0: without end
  Time deadline = never;    ///< of os::now; the loop ends there, whatever it waits for
};

class Samples;

/// One thread at a time uses it; only `cancel` may come from another.
class Encoder {
 public:
  /// The connection and the state of an encoder. Only the library itself can use it.
  struct Parts;

  /// Moves the encoder; the other one may only be destroyed or assigned to.
  Encoder(Encoder&&) noexcept;
  /// Moves the encoder; the other one may only be destroyed or assigned to.
  Encoder& operator=(Encoder&&) noexcept;
  ~Encoder();

  /// Opens the port again after `disconnect`, or after it was lost. Throws os::Failure, UsageError.
  void connect();
  /// Closes the port. Counters and statistics stay; a reading or a command opens it again.
  void disconnect();
  /// Whether the port is open: it is from `open` until `disconnect`, or until a sample reports it lost.
  [[nodiscard]] bool connected() const;

  /// The position, with all alarms that the encoder can tell. A position that no second one confirmed is not valid. A
  /// port that was lost is opened again. Throws EncoderFailure, os::Failure, Cancelled; DeadlinePassed when there is
  /// none at `deadline` (of os::now), up to 20 ms and what one exchange takes later.
  [[nodiscard]] Reading read(Time deadline = never);
  /// A reading for its alarms: where the unit has a command that reads all of them by name, by that one.
  [[nodiscard]] Reading read_alarms();
  /// For a loop over samples that goes on when the port is lost and comes back. Ends after `count`, or by `cancel`.
  [[nodiscard]] Samples samples(const SampleChoices& choices = {});
  /// One sample: reads once, or waits a quarter of a second and tries to open the port again. Throws os::Interrupted,
  /// UsageError, Failure, Cancelled.
  Sample next();

  /// A command of the unit by its name; of arguments that are left out the defaults count. Nobody is asked, even if it
  /// changes the encoder, but what is written is read back. Throws EncoderFailure, os::Failure, UsageError, Cancelled.
  Answer run(std::string_view command, std::span<const std::int64_t> arguments = {});
  /// Runs a command of the unit with arguments in their order.
  Answer run(std::string_view command, std::initializer_list<std::int64_t> arguments) {
    return run(command, std::span(arguments.begin(), arguments.size()));
  }

  /// Its bytes, of an encoder that is connected and while this object stays where it is.
  [[nodiscard]] Memory memory() { return Memory(*this); }

  /// What it is set to, of an encoder that is connected and while this object stays where it is.
  [[nodiscard]] Settings settings() { return Settings(*this); }

  /// From any thread: what waits, and all later waiting, ends with Cancelled, a loop over samples without.
  void cancel();
  /// Ends what `cancel` began: the encoder can be used again.
  void resume();

  /// Waiting, also for the time of the next sample, ends with Cancelled also from the moment on in which `over` is
  /// true. Empty: never. Returns what was so before.
  std::function<bool()> end_when(std::function<bool()> over);

  /// The state of the last command that changes the encoder; its exception carries the same (change.hpp).
  [[nodiscard]] const Change& change() const;

  /// The position starts again from the next reading: after a command that moves the zero.
  void forget_position();

  /// Returns protocol and port, without the settings: "tformat:/dev/ttyUSB0".
  [[nodiscard]] std::string address() const;
  /// Returns the unit of the encoder.
  [[nodiscard]] const Unit& unit() const;
  /// Returns the options of the encoder.
  [[nodiscard]] const Options& options() const;
  /// How it sits in its drive, as its address says.
  [[nodiscard]] const Joint& joint() const;
  /// What could be better about the port, a sentence each.
  [[nodiscard]] const std::vector<std::string>& notes() const;
  /// Of all exchanges: good ones, errors by kind, repetitions.
  [[nodiscard]] const host::Counters& counters() const;
  /// From the end of a request to the end of its reply.
  [[nodiscard]] const host::Latencies& latencies() const;
  /// The last bad exchanges, the newest first, with times of os::now.
  [[nodiscard]] std::vector<BadExchangeText> bad_exchanges() const;
  /// Good readings so far.
  [[nodiscard]] std::uint64_t readings() const;
  /// How often the port went away.
  [[nodiscard]] std::uint64_t losses() const;
  /// How often the position started again, because a pause was too long to know how often the shaft turned, or because
  /// it jumped.
  [[nodiscard]] std::uint64_t restarts() const;
  /// Good readings a second.
  [[nodiscard]] double rate() const;
  /// A sentence when the shaft can turn too fast for the intended rate to follow its turns; otherwise "".
  [[nodiscard]] std::string rate_note() const;

 private:
  explicit Encoder(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
};

/// "tformat:/dev/ttyUSB0?model=23-bit", "sim:esl", or a name of absenc.toml, connected; `settings` ("name=value") count
/// as if they stood behind it. Throws os::Failure; UsageError, which names what is wrong and what is nearest.
[[nodiscard]] Encoder open(std::string_view text, std::span<const std::string> settings = {});

/// An input range of samples, at equal distances that do not drift; one that was missed is left out.
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

  /// Takes the first sample. Once.
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

/// "" of a reading; "lost", "back"; of a failed attempt the name of the error
[[nodiscard]] std::string_view event_name(const Sample& sample);

/// "rpm", or of linear encoders "mm/s"
[[nodiscard]] std::string_view speed_unit(const Reading& reading);

}  // namespace absenc::client
