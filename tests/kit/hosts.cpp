// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "tests/kit/frames.hpp"
#include "tests/kit/kit.hpp"
#include "tests/kit/player.hpp"

namespace absenc::kit {
namespace {

/// Result of a conversation to which the test has supplied the reply.
struct Outcome {
  bool ended = false;
  unsigned tested_requests = 0;
  Error error = Error::none;
  ReportedFields seen;
};

/// A conversation with a command that sends the request of a test vector; the test supplies the reply of the vector.
struct VectorReplay {
  const Unit& unit;
  const Vector& vector;
  const Options& options;
  const Command& command;
  const Values arguments;
  Findings& findings;

  const OwnedFrame request = frame_of(unit, vector.request);
  const OwnedFrame reply = frame_of(unit, vector.reply);
  const bool streams = unit.streams != nullptr && unit.streams(options);

  template <class Text>
  void require(bool holds, Text&& text) const {
    findings.require(holds, [&] {
      return std::string(vector.id) + ", " + std::string(command.name) + to_text(Arguments(arguments)) + ": " + text();
    });
  }

  template <class Item>
  Outcome converse(const std::vector<Item>& requests, const typename Player<Item>::Reply& reply_to_request,
                   const std::function<void(const Conversation<Item>&)>& on_emit = {}) const {
    std::vector<std::byte> storage(unit.host_storage);
    Conversation<Item>* conversation = unit.host(options, command, arguments, storage).template of<Item>();
    if (conversation == nullptr) return {};
    Player<Item> player(unit, options);
    Outcome outcome;
    outcome.ended = player.run(*conversation, requests, reply_to_request, [&] {
      if (on_emit) on_emit(*conversation);
    });
    outcome.tested_requests = player.tested_requests();
    outcome.error = conversation->error();
    conversation->report(outcome.seen);
    if (conversation->reading() != nullptr) outcome.seen.reading = *conversation->reading();
    require(outcome.ended, [] { return "does not end"; });
    require(outcome.error == Error::none || (outcome.seen.fields.empty() && !outcome.seen.reading),
            [&] { return "reports " + to_text(outcome.seen.fields) + " with an error"; });
    return outcome;
  }
  Outcome converse(const std::vector<Wire>& pieces) const {
    return converse<std::uint8_t>(request.bytes, [&](std::size_t) { return pieces; });
  }

  Error decoded(const OwnedFrame& frame, ReportedFields& seen) const {
    return unit.decode(options, request.frame(), frame.frame(), seen);
  }

  // Checks that the fields that both the conversation and the test vector report are equal.
  void require_report(const Outcome& outcome) const {
    const bool reads = command.verb == Verb::read || command.verb == Verb::read_part;
    unsigned shared = 0;
    for (const auto& [name, value] : expected_fields(vector)) {
      const auto found = outcome.seen.fields.find(name);
      if (found == outcome.seen.fields.end()) {
        require(!reads || !shows_place(name), [&, &missing = name] { return missing + " is not reported"; });
        continue;
      }
      ++shared;
      require(found->second == value, [&, &wrong = name] { return wrong + " is not what the frame has"; });
    }
    require(shared > 0 || (!reads && !outcome.seen.fields.empty()),
            [&] { return "reports " + to_text(outcome.seen.fields); });
    ReportedFields frame;
    const bool has_reading = decoded(reply, frame) == Error::none && frame.reading.has_value();
    require(!reads || outcome.seen.reading.has_value() == has_reading, [] { return "has another reading"; });
    if (!reads || !has_reading || !outcome.seen.reading) return;
    // The validity of the position is not compared: the conversation may have taken it from an earlier reply.
    require(outcome.seen.reading->singleturn == frame.reading->singleturn &&
                outcome.seen.reading->multiturn == frame.reading->multiturn,
            [] { return "reads another position"; });
  }
  [[nodiscard]] bool shows_place(const std::string& name) const {
    return std::any_of(unit.fields.begin(), unit.fields.end(),
                       [&](const FieldInfo& one) { return one.name == name && is_of_reading(one.role); });
  }

  // ---- Conversations on links that carry characters

  static std::vector<Wire> bytewise(Bytes bytes) {
    std::vector<Wire> pieces;
    for (const std::uint8_t byte : bytes) pieces.push_back({byte});
    return pieces;
  }

  void characters() const {
    const Outcome whole = converse({reply.bytes});
    require(request.empty() || whole.tested_requests > 0, [] { return "is not sent"; });
    // The error is compared only for a command with one request: after a good reply, other commands may send a further
    // request, which gets no reply here.
    if (is_one_question()) {
      require(whole.error == vector.error, [&] { return "ends with " + std::string(text_of(whole.error).name); });
    }
    if (whole.error == Error::none && vector.error == Error::none) require_report(whole);
    // A reply with additional bytes is not sent byte by byte: those bytes would belong to the next reply.
    const FrameEnd end = unit.frame_end(options, Direction::reply, vector.reply);
    if (end.kind != FrameEnd::Kind::complete || end.size >= reply.bytes.size()) {
      const Outcome pieces = converse(bytewise(reply.bytes));
      require(pieces.error == whole.error && pieces.seen.fields == whole.seen.fields,
              [] { return "another result when it comes byte by byte"; });
    }
    if (vector.error != Error::none || whole.error != Error::none) return;
    damaged();
  }
  [[nodiscard]] bool is_one_question() const {
    return command.arguments.empty() && (command.verb == Verb::read || command.verb == Verb::read_part ||
                                         command.verb == Verb::info || command.verb == Verb::temperature);
  }
  void damaged() const {
    for (std::size_t size = 1; size < reply.bytes.size(); ++size) {
      refused(reply.cut(size), [&] { return "takes a reply cut after " + std::to_string(size); });
    }
    for (std::size_t bit = 0; bit < reply.bit_count(); ++bit) {
      if (unit.is_checked != nullptr && !unit.is_checked(options, request.frame(), reply.frame(), bit)) continue;
      refused(reply.flipped(bit), [&] { return "takes a reply with bit " + std::to_string(bit) + " flipped"; });
    }
    for (const std::uint8_t byte : std::to_array<std::uint8_t>({0x00, 0x1A, 0x55, 0xFF})) {
      const std::array garbage{byte};
      const auto text = [&] { return "takes a reply with garbage " + to_text(Bytes(garbage)) + " around it"; };
      refused(reply.between(garbage, {}), text);
      refused(reply.between({}, garbage), text, false);
    }
    refused(
        reply.between({}, reply.bytes), [] { return std::string("takes a reply that comes twice"); }, false);
  }

  // Checks that the conversation refuses the frame, unless the decoder accepts it.
  template <class Text>
  void refused(const OwnedFrame& frame, Text&& text, bool in_pieces = true) const {
    ReportedFields ignored;
    if (decoded(frame, ignored) == Error::none) return;
    require(converse({frame.bytes}).error != Error::none, text);
    if (!in_pieces) return;
    require(converse(bytewise(frame.bytes)).error != Error::none, [&] { return text() + ", byte by byte"; });
  }

  // ---- Unsolicited frames: streams of eight frames, at most one of them damaged

  void stream() const {
    if (vector.error != Error::none) return;
    const unsigned undamaged = stream_with(reply, [] { return std::string("of good frames only"); });
    require(undamaged >= 2, [&] { return "finds " + std::to_string(undamaged) + " of eight good frames"; });
    for (std::size_t size = 1; size < reply.bytes.size(); ++size) {
      stream_with(reply.cut(size), [&] { return "with one cut after " + std::to_string(size); });
    }
    for (std::size_t bit = 0; bit < reply.bit_count(); ++bit) {
      if (unit.is_checked != nullptr && !unit.is_checked(options, request.frame(), reply.frame(), bit)) continue;
      stream_with(reply.flipped(bit), [&] { return "with one whose bit " + std::to_string(bit) + " is flipped"; });
    }
    for (const std::uint8_t byte : std::to_array<std::uint8_t>({0x00, 0x1A, 0x55, 0xFF})) {
      stream_with(reply.between(std::array{byte}, {}), [] { return std::string("with garbage between"); });
    }
  }
  // Runs a stream of seven good frames, with the frame `odd` between them, frame by frame and again byte by byte.
  // Returns the number of good results.
  template <class Text>
  unsigned stream_with(const OwnedFrame& odd, Text&& text) const {
    unsigned good = 0;
    for (const bool in_bytes : {false, true}) {
      Wire all;
      std::vector<Wire> pieces;
      for (unsigned i = 0; i < 8; ++i) {
        const Wire& one = i == 4 ? odd.bytes : reply.bytes;
        all.insert(all.end(), one.begin(), one.end());
        pieces.push_back(one);
      }
      if (in_bytes) pieces = bytewise(all);
      converse<std::uint8_t>(
          {}, [&](std::size_t) { return pieces; },
          [&](const Conversation<std::uint8_t>& now) {
            if (now.error() != Error::none) return;
            ++good;
            ReportedFields seen;
            now.report(seen);
            for (const auto& [name, value] : expected_fields(vector)) {
              require(seen.fields.contains(name) && seen.fields[name] == value,
                      [&, &wrong = name] { return "a stream " + text() + " shows another " + wrong; });
            }
          });
    }
    return good;
  }

  // ---- Conversations on clocked links

  [[nodiscard]] bool bits() const {
    const bool taken = same_as_decoded(reply);
    for (std::size_t size = 0; size < reply.bits; ++size) same_as_decoded(reply.cut(size));
    for (std::size_t bit = 0; bit < reply.bits; ++bit) same_as_decoded(reply.flipped(bit));
    return taken;
  }
  bool same_as_decoded(const OwnedFrame& frame) const {
    bool taken = false;
    for (const std::uint8_t idle : std::to_array<std::uint8_t>({0x00, 0xFF})) {
      OwnedFrame clocked{.link = unit.link};
      const Outcome outcome = converse<std::uint8_t>(request.bytes, [&](std::size_t clocks) {
        clocked.bytes.assign((clocks + 7) / 8, idle);
        clocked.bits = clocks;
        for (std::size_t i = 0; i < std::min(clocks, frame.bits); ++i) {
          const auto mask = static_cast<std::uint8_t>(0x80u >> i % 8);
          clocked.bytes[i / 8] =
              static_cast<std::uint8_t>((clocked.bytes[i / 8] & ~mask) | (frame.bytes[i / 8] & mask));
        }
        return std::vector<Wire>{clocked.bytes};
      });
      ReportedFields seen;
      const Error error = decoded(clocked, seen);
      // The conversation may refuse a reply that the decoder accepts: it may check more, such as a life counter.
      // A command may report values of several exchanges; those that it shares with the reply must be the same.
      const bool is_alone = unit.link == LinkKind::clocked;
      const bool as_decoded = error == Error::none && (is_alone ? outcome.seen.fields == seen.fields
                                                                : shares(outcome.seen.fields, seen.fields));
      // A command that finds out what the encoder sends may understand a reply that the decoder does not expect.
      const bool is_judged = is_alone || is_one_question();
      require(outcome.error != Error::none || as_decoded || !is_judged, [&] {
        return "makes " + to_text(outcome.seen.fields) + " of " + to_text(clocked) + ", which is " +
               std::string(text_of(error).name) + " " + to_text(seen.fields);
      });
      taken = taken || outcome.seen.reading.has_value();
    }
    return taken;
  }

  // Returns whether every field that is in both `reported` and `decoded` has the same value in both.
  [[nodiscard]] static bool shares(const std::map<std::string, Value>& reported,
                                   const std::map<std::string, Value>& decoded) {
    return std::ranges::all_of(reported, [&](const auto& one) {
      const auto found = decoded.find(one.first);
      return found == decoded.end() || found->second == one.second;
    });
  }

  // ---- Conversations on CAN

  void frames() const {
    std::vector<CanFrame> requests;
    if (request.can) requests.push_back(*request.can);
    const auto converse_with = [&](const std::vector<CanFrame>& frames) {
      return converse<CanFrame>(requests, [&](std::size_t) {
        Player<CanFrame>::Pieces pieces;
        for (const CanFrame& frame : frames) pieces.push_back({frame});
        return pieces;
      });
    };
    // A test vector with an error is skipped: other nodes of the bus may send such frames.
    if (vector.error != Error::none) return;
    const CanFrame other{.id = 0x7A5, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    std::vector<CanFrame> echo = requests;
    echo.push_back(*reply.can);
    for (const std::vector<CanFrame>& frames :
         {std::vector{*reply.can}, std::vector{other, *reply.can}, std::vector{*reply.can, other}, echo}) {
      const Outcome outcome = converse_with(frames);
      require(outcome.error == Error::none, [&] { return "ends with " + std::string(text_of(outcome.error).name); });
      if (outcome.error == Error::none) require_report(outcome);
    }
    for (const std::vector<CanFrame>& frames : {std::vector<CanFrame>{}, std::vector{other}, requests}) {
      require(converse_with(frames).error == Error::timeout, [] { return "does not wait for its reply"; });
    }
    for (std::uint8_t size = 0; size < reply.can->size; ++size) {
      require(converse_with({*reply.cut(size).can}).error != Error::none,
              [&] { return "takes a frame of " + std::to_string(size) + " bytes"; });
    }
  }
};

/// Returns arguments with which the command has the exchange of the test vector; nothing if there are none.
std::optional<Values> arguments_for(const Unit& unit, const Options& options, const Command& command,
                                    const Vector& vector) {
  ReportedFields request_fields;
  Values values = least_arguments(command);
  if (!vector.request.empty() && !values.empty()) {
    (void)unit.decode(options, frame_of(unit, vector.request).frame(), {}, request_fields);
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (const auto& [name, value] : request_fields.fields) {
        if (name == command.arguments[i].name) values[i] = value.number;
      }
    }
  }
  const Result<Wire> request = encoded(unit, options, command, values);
  if (request && std::ranges::equal(*request, vector.request)) return values;
  // A command that sends no request suits the vector if it waits for unsolicited frames.
  const bool unsolicited = !request && request.error() == Error::unsupported && vector.request.empty() &&
                           command.verb == Verb::read && unit.streams != nullptr && unit.streams(options);
  if (unsolicited) return values;
  return std::nullopt;
}

// Returns whether the reply of the test vector decodes without an error to a reading.
bool has_reading(const Unit& unit, const Options& options, const Vector& vector) {
  ReportedFields seen;
  return unit.decode(options, frame_of(unit, vector.request).frame(), frame_of(unit, vector.reply).frame(), seen) ==
             Error::none &&
         seen.reading.has_value();
}

void feed_vector(const Unit& unit, const Vector& vector, const Options& options, unsigned& readings,
                 Findings& findings) {
  for (const Command& command : unit.commands) {
    if (command.changes_encoder || command.verb == Verb::scan) continue;
    const std::optional<Values> arguments = arguments_for(unit, options, command, vector);
    if (!arguments) continue;
    if (unit.link == LinkKind::can && command.verb != Verb::read) continue;
    const VectorReplay feeding{unit, vector, options, command, *arguments, findings};
    bool taken = command.verb == Verb::read && has_reading(unit, options, vector);
    if (unit.link == LinkKind::can) {
      feeding.frames();
    } else if (carries_bits(unit.link)) {
      taken = feeding.bits() && taken;
    } else if (feeding.streams) {
      feeding.stream();
    } else {
      feeding.characters();
    }
    if (taken) ++readings;
  }
}

/// A conversation of the command `read`, which has been run until it waits for the reply to its first request, or until
/// it is clear that it does not wait for a reply.
template <class Item>
class Asked {
 public:
  using Kind = typename Step<Item>::Kind;

  Asked(const Unit& unit, const Options& options) : storage_(unit.host_storage) {
    const Command& command = *find_command(unit, Verb::read);
    conversation_ = unit.host(options, command, least_arguments(command), storage_).template of<Item>();
    if (conversation_ == nullptr) return;
    Step<Item> step = conversation_->next(now_);
    // The conversation may first wait for silence on the line.
    for (unsigned i = 0; i < 10 && (step.kind == Kind::configure || step.kind == Kind::wait); ++i) {
      now_ += std::chrono::milliseconds(1);
      if (step.kind == Kind::wait) feed(Event<Item>::Kind::silence);
      step = conversation_->next(now_);
    }
    if (step.kind != Kind::transfer || step.out.empty()) return;
    now_ = std::max(now_, step.at);
    feed(Event<Item>::Kind::sent);
    step = conversation_->next(now_);
    if (step.kind == Kind::wait) wait_ = step;
  }

  /// Returns how long the host waits for a reply; nothing if it does not wait.
  [[nodiscard]] std::optional<Time> patience() const {
    if (!wait_) return std::nullopt;
    return wait_->answer != Time{} ? wait_->answer : wait_->gap;
  }

  /// Returns the time from the end of a reply that is cut short after its first byte to the next request, or to the
  /// end of the conversation, after which another conversation may send a request. Returns nothing if the host does
  /// not wait for a reply.
  [[nodiscard]] std::optional<Time> rest_after_cut_reply() requires(!std::is_same_v<Item, CanFrame>) {
    constexpr std::array<std::uint8_t, 1> begin{};
    if (!wait_) return std::nullopt;
    const Time end = now_ += std::chrono::microseconds(1);
    feed(Event<Item>::Kind::received, begin);
    for (unsigned i = 0; i < 10; ++i) {
      const Step<Item> step = conversation_->next(now_);
      if (step.kind == Kind::transfer || step.kind == Kind::done) return std::max(now_, step.at) - end;
      if (step.kind != Kind::wait) continue;
      const bool is_silence = step.gap != Time{};
      now_ = is_silence ? now_ + step.gap : std::max(now_, step.at);
      feed(is_silence ? Event<Item>::Kind::silence : Event<Item>::Kind::timer);
    }
    return std::nullopt;
  }

 private:
  void feed(typename Event<Item>::Kind kind, std::span<const Item> items = {}) {
    conversation_->feed({.kind = kind, .at = now_, .items = items});
  }

  std::vector<std::byte> storage_;
  Conversation<Item>* conversation_ = nullptr;
  Time now_{};
  std::optional<Step<Item>> wait_{};
};

template <class Item>
std::optional<Time> wait_for_reply(const Unit& unit, const Options& options) {
  return Asked<Item>(unit, options).patience();
}

// Checks that `turnaround_limit`, the timeout that captures use, agrees with the longest timeout of the host.
void compare_limits(const Unit& unit, Findings& findings) {
  std::optional<Time> longest;
  for (const Configuration& configuration : configurations(unit)) {
    longest = std::max(longest, unit.link == LinkKind::can ? wait_for_reply<CanFrame>(unit, configuration.options)
                                                           : wait_for_reply<std::uint8_t>(unit, configuration.options));
  }
  if (!longest || host_clocks(unit.link)) return;
  const Time limit = unit.timing.turnaround_limit;
  findings.require(4 * limit >= 3 * *longest && 3 * limit <= 4 * *longest, [&] {
    return "captures wait " + std::to_string(limit.count()) + " ns for a reply, hosts " +
           std::to_string(longest->count()) + " ns";
  });
}

// Checks that a capture does not join a reply that was cut short with the next request of the host: the host pauses
// for at least `frame_pause`.
void compare_rests(const Unit& unit, Findings& findings) {
  if (unit.timing.frame_pause == Time{}) return;
  for (const Configuration& configuration : configurations(unit)) {
    const std::optional<Time> rest = Asked<std::uint8_t>(unit, configuration.options).rest_after_cut_reply();
    findings.require(!rest || *rest >= unit.timing.frame_pause, [&] {
      return configuration.text + ": " + std::to_string(rest->count()) +
             " ns after a reply that was cut short the host may ask again, but captures join frames up to " +
             std::to_string(unit.timing.frame_pause.count()) +
             " ns apart: HostTimes::gap_limit or Manner::pause must not be shorter than LineTiming::frame_pause";
    });
  }
}

// Checks that every command has a request, unless `encode` calls it unsupported.
void find_requests(const Unit& unit, Findings& findings) {
  const std::vector<Configuration> setups = configurations(unit);
  for (const Command& command : unit.commands) {
    Error error = Error::none;
    const bool any = std::any_of(setups.begin(), setups.end(), [&](const Configuration& configuration) {
      for (const Values& values : {least_arguments(command), most_arguments(command)}) {
        const Result<Wire> request = encoded(unit, configuration.options, command, values);
        if (request) return true;
        error = request.error();
      }
      return false;
    });
    findings.require(any || error == Error::unsupported, [&] {
      return std::string(command.name) + " has no request: " + std::string(text_of(error).name);
    });
  }
}

}  // namespace

Findings check_hosts(const Unit& unit) {
  Findings findings;
  unsigned readings = 0;
  for (const Vector& vector : unit.vectors) {
    if (vector.reply.empty()) continue;
    const std::optional<Options> options = options_of(unit, vector.options);
    if (options) feed_vector(unit, vector, *options, readings, findings);
  }
  findings.require(readings > 0, [] { return "no vector's position is read by a command"; });
  find_requests(unit, findings);
  compare_limits(unit, findings);
  compare_rests(unit, findings);
  return findings;
}

}  // namespace absenc::kit
