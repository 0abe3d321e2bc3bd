// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/encoder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "absenc/client/encoder/end_at.hpp"
#include "absenc/client/encoder/pace.hpp"
#include "absenc/client/encoder/parts.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/reading.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/speed_limit.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"

namespace absenc::client {

Encoder::Encoder(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;
Encoder::~Encoder() = default;

Encoder open(std::string_view text, std::span<const std::string> settings) {
  Encoder encoder = make_encoder(parse_address(text, settings), Time{});
  encoder.connect();
  return encoder;
}

void Encoder::connect() { parts_->connect(); }
void Encoder::disconnect() { parts_->disconnect(); }
bool Encoder::connected() const { return parts_->connection->connected(); }
Sample Encoder::next() { return parts_->next(); }
void Encoder::forget_position() { parts_->forget_position(); }

void Encoder::cancel() { parts_->cancelled.store(true); }
void Encoder::resume() { parts_->cancelled.store(false); }

std::string Encoder::address() const { return address_of(parts_->connection->uri()); }
const Unit& Encoder::unit() const { return parts_->connection->unit(); }
const Options& Encoder::options() const { return parts_->connection->uri().options; }
const Joint& Encoder::joint() const { return parts_->connection->uri().joint; }
const std::vector<std::string>& Encoder::notes() const { return parts_->connection->notes(); }
const host::Counters& Encoder::counters() const { return parts_->connection->counters(); }
std::uint64_t Encoder::readings() const { return parts_->readings; }
std::uint64_t Encoder::losses() const { return parts_->losses; }
std::uint64_t Encoder::restarts() const { return parts_->restarts; }
const host::Latencies& Encoder::latencies() const { return parts_->connection->latencies(); }

namespace {

Reading read_once(Encoder& encoder) {
  if (!encoder.connected()) encoder.connect();
  Sample sample = encoder.next();
  if (sample.kind == Sample::Kind::failed) throw EncoderFailure(std::move(sample.trouble));
  if (sample.kind == Sample::Kind::lost) throw os::Failure(os::Failure::Kind::lost, sample.message);
  return sample.reading;
}

}  // namespace

Reading Encoder::read(Time deadline) {
  if (deadline == never) return read_once(*this);
  const EndAt end(*this, deadline);
  try {
    return read_once(*this);
  } catch (const Cancelled&) {
    if (parts_->cancelled || os::now() < deadline) throw;
    throw DeadlinePassed{};
  }
}

Reading Encoder::read_alarms() {
  if (!connected()) connect();
  return client::read_alarms(*parts_->connection);
}

Answer Encoder::run(std::string_view name, std::span<const std::int64_t> arguments) {
  const Command& command = require_command(unit(), name);
  if (!connected()) {
    if (!command.changes_encoder) connect();
    if (command.changes_encoder) before_change([this] { connect(); });
  }
  AnswerSink sink;
  run_into(*parts_->connection, command, complete_arguments(command, arguments), sink);
  return std::move(sink.answer);
}

std::function<bool()> Encoder::end_when(std::function<bool()> over) {
  return std::exchange(parts_->over, std::move(over));
}

struct Samples::Parts {
  Encoder* encoder;
  std::uint64_t count;  // number of samples that the range has; 0: no limit
  Time deadline;
  Pace pace;
  Sample sample{};
  std::uint64_t taken = 0;
  bool ended = false;
};

Samples Encoder::samples(const SampleChoices& choices) { return {*this, choices}; }

Samples::Samples(Encoder& encoder, const SampleChoices& choices)
    : parts_(std::make_unique<Parts>(Parts{&encoder, choices.count, choices.deadline, Pace(choices.rate_hz)})) {
  Encoder::Parts::of(encoder).period = parts_->pace.period();
}
Samples::Samples(Samples&&) noexcept = default;
Samples& Samples::operator=(Samples&&) noexcept = default;
Samples::~Samples() = default;

Samples::Iterator Samples::begin() {
  advance();
  return Iterator(*this);
}

const Sample* Samples::current() const { return parts_->ended ? nullptr : &parts_->sample; }

void Samples::advance() {
  Parts& loop = *parts_;
  loop.ended = loop.count != 0 && loop.taken == loop.count;
  if (loop.ended) return;
  const auto take = [&loop] {
    if (loop.taken != 0) Encoder::Parts::of(*loop.encoder).wait_until(loop.pace.next());
    loop.sample = loop.encoder->next();
    ++loop.taken;
  };
  try {
    if (loop.deadline == never) return take();
    if (os::now() >= loop.deadline) throw DeadlinePassed{};
    const EndAt end(*loop.encoder, loop.deadline);
    take();
  } catch (const Cancelled&) {
    loop.ended = true;
  }
}

const Change& Encoder::change() const { return parts_->connection->change(); }

double Encoder::rate() const { return parts_->rate.per_second(os::now()); }

std::vector<BadExchangeText> Encoder::bad_exchanges() const {
  std::vector<BadExchangeText> exchanges = parts_->connection->bad_exchanges();
  for (BadExchangeText& exchange : exchanges) exchange.at += parts_->offset;
  return exchanges;
}

PositionState Sample::position_state() const {
  if (kind != Kind::reading) return PositionState::none;
  if (!reading.ready) return PositionState::starting;
  if (doubtful) return PositionState::unconfirmed;
  switch (reading.singleturn_validity()) {
    case Validity::valid:
      return PositionState::good;
    case Validity::invalid:
      return PositionState::invalid;
    case Validity::unknown:
      return PositionState::unknown;
    case Validity::absent:
      break;
  }
  return PositionState::none;
}

std::optional<Estimate> Sample::measured_speed() const {
  if (!speed_valid) return {};
  return Estimate{speed, speed_uncertainty};
}

std::optional<Estimate> Sample::speed_rpm() const { return reading.unit_um > 0 ? std::nullopt : measured_speed(); }

std::optional<Estimate> Sample::speed_mm_s() const { return reading.unit_um > 0 ? measured_speed() : std::nullopt; }

std::string_view text_of(PositionState state) {
  switch (state) {
    case PositionState::good:
      return "the position is good: a second one agreed, and nothing that was reported is against it";
    case PositionState::unconfirmed:
      return "no second position agreed with this one: do not use it, read again";
    case PositionState::starting:
      return "the encoder is starting: read again";
    case PositionState::invalid:
      return "an alarm or a state that the encoder reports says that the position does not hold: look at its alarms";
    case PositionState::unknown:
      return "whether the position holds was not reported: read the alarms";
    case PositionState::none:
      break;
  }
  return "there is no position";
}

std::string_view event_name(const Sample& sample) {
  switch (sample.kind) {
    case Sample::Kind::lost:
      return "lost";
    case Sample::Kind::back:
      return "back";
    case Sample::Kind::failed:
      return text_of(sample.trouble.error).name;
    case Sample::Kind::reading:
      return sample.restarted ? "restarted" : "";
    default:
      return "";
  }
}

std::string_view speed_unit(const Reading& reading) { return reading.unit_um > 0 ? "mm/s" : "rpm"; }

std::string Encoder::rate_note() const {
  const EncoderAddress& uri = parts_->connection->uri();
  const Resolution resolution = uri.unit->resolution(uri.options);
  const host::SpeedLimit limit = speed_limit(uri);
  const Time longest = host::longest_gap(resolution, limit);
  if (parts_->period == Time{} || parts_->period < longest || resolution.unit_um > 0) return {};
  const auto seconds = [](Time time) { return std::chrono::duration<double>(time).count(); };
  return fmt::format(
      "at this rate the turns are followed up to {:.0f} rpm, but the shaft may reach {} rpm: {:.0f} readings a second "
      "would be enough; if it is slower, say so with max_rpm=RPM",
      std::floor(limit.rpm * seconds(longest) / seconds(parts_->period)), limit.rpm,
      std::floor(1 / seconds(longest)) + 1);
}

}  // namespace absenc::client
