// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <set>

#include "tests/kit/frames.hpp"
#include "tests/kit/kit.hpp"

namespace absenc::kit {
namespace {

constexpr std::size_t most_open_bits = 16;

class Decoding {
 public:
  Decoding(const Unit& unit, const Vector& vector, const Options& options, Findings& findings)
      : unit_(unit), vector_(vector), options_(options), findings_(findings) {}

  void whole() {
    ReportedFields seen;
    const Error error = decode(reply_, seen);
    require(error == vector_.error, [&] { return "is " + std::string(text_of(error).name); });
    require(seen.fields == expected_fields(vector_), [&] { return "decodes to " + to_text(seen.fields); });
    require((seen.readings == 1) == seen.has_position() && seen.readings <= 1, [&] {
      return "gives " + std::to_string(seen.readings) + " readings of a position, but its fields show " +
             (seen.has_position() ? "one" : "none") + ": put a reading exactly where there is a position field";
    });
    if (seen.reading) reading_shows(seen);
  }

  // Fails for a test vector with open bytes (bytes that its author left out), and reports which values they must
  // have.
  void complete() {
    std::vector<Pair> good;
    const std::vector<Wire> requests = filled(vector_.request, vector_.open_request, [&](const Wire& request) {
      ReportedFields seen;
      return vector_.open_request.count == 0 ||
             unit_.decode(options_, frame_of(unit_, request).frame(), {}, seen) == Error::none;
    });
    // Each valid request is tried with the reply: a request may be valid, but not the one that this reply answers.
    for (const Wire& request : requests) {
      const std::vector<Wire> replies = filled(vector_.reply, vector_.open_reply, [&](const Wire& reply) {
        ReportedFields seen;
        const Error error =
            unit_.decode(options_, frame_of(unit_, request).frame(), frame_of(unit_, reply).frame(), seen);
        return error == vector_.error && seen.fields == expected_fields(vector_);
      });
      for (const Wire& reply : replies) good.push_back({request, reply});
    }
    tell_open("request", vector_.open_request, good, &Pair::request);
    tell_open("reply", vector_.open_reply, good, &Pair::reply);
  }

  // Checks that the request of a test vector, without its reply, does not exclude options that are possible with the
  // reply.
  void unanswered() {
    if (unit_.probe == nullptr) return;
    struct Against final : EvidenceSink {
      void put(const OptionEvidence& one) override {
        if (!one.possible && one.value == own.values[one.option]) why = one.why;
      }
      Options own;
      std::string_view why;
    };
    const auto against = [&](Bytes reply) {
      Against found;
      Options options = found.own = options_;
      const Capture capture{vector_.request, reply};
      unit_.probe(options, {&capture, 1}, found);
      return found.why;
    };
    const std::string_view why = against({});
    require(why.empty() || why == against(vector_.reply),
            [&] { return "its request alone speaks against its options: " + std::string(why); });
  }

  // Checks that the decoder refuses requests with missing or additional bytes.
  void good_request() {
    if (request_.empty() || request_.can || unit_.link == LinkKind::clocked) return;
    const bool has_bits = carries_bits(unit_.link);
    const auto unknown = [&](const OwnedFrame& request, std::string_view what) {
      ReportedFields seen;
      const Error error = unit_.decode(options_, request.frame(), {}, seen);
      require(error != Error::none && seen.fields.empty(),
              [&] { return "its request " + std::string(what) + " is accepted"; });
    };
    for (std::size_t size = 1; size < request_.elements(); ++size) {
      const OwnedFrame begin = request_.cut(size);
      const FrameEnd end = unit_.frame_end(options_, Direction::request, begin.bytes);
      if (has_bits || end.kind != FrameEnd::Kind::complete) unknown(begin, "cut after " + std::to_string(size));
    }
    if (!has_bits) unknown(request_.between({}, std::array<std::uint8_t, 1>{0}), "with another byte");
  }

  void good_reply() {
    std::size_t flipped = 0;
    for (std::size_t bit = 0; bit < reply_.bit_count(); ++bit) {
      if (unit_.is_checked != nullptr && !unit_.is_checked(options_, request_.frame(), reply_.frame(), bit)) continue;
      ++flipped;
      refused(reply_.flipped(bit), [&] { return "with bit " + std::to_string(bit) + " flipped"; });
    }
    // A CAN frame without data may be valid: in some frames only the identifier has a meaning.
    const bool means_nothing = reply_.can && flipped == 0;
    for (std::size_t size = reply_.can ? 0 : 1; size < reply_.elements() && !means_nothing; ++size) {
      refused(reply_.cut(size), [&] { return "cut after " + std::to_string(size); });
    }
    if (reply_.can) {
      if (!means_nothing) other_frames();
    } else if (!carries_bits(unit_.link)) {
      refused(reply_.between({}, vector_.reply), [] { return std::string("twice"); });
      ends();
    }
  }

 private:
  struct Pair {
    Wire request;
    Wire reply;
  };

  [[nodiscard]] std::size_t open_bits(OpenBytes open) const { return open.count * (carries_bits(unit_.link) ? 1 : 8); }

  // Returns copies of the frame with its open bytes (bytes that the test vector leaves out) filled with each value for
  // which `is_good` is true. Returns nothing if there are too many values to try.
  template <class IsGood>
  [[nodiscard]] std::vector<Wire> filled(Bytes frame, OpenBytes open, const IsGood& is_good) const {
    const bool is_bits = carries_bits(unit_.link);
    std::vector<Wire> good;
    Wire one(frame.begin(), frame.end());
    for (std::uint32_t value = 0; open_bits(open) <= most_open_bits && value >> open_bits(open) == 0; ++value) {
      for (std::size_t i = 0; i < open.count; ++i) {
        one[open.first + i] = static_cast<std::uint8_t>(is_bits ? '0' + (value >> i & 1) : value >> 8 * i & 0xFF);
      }
      if (is_good(one)) good.push_back(one);
    }
    return good;
  }

  void tell_open(std::string_view name, OpenBytes open, const std::vector<Pair>& good, Wire Pair::*part) {
    if (open.count == 0) return;
    std::set<Wire> values;
    for (const Pair& one : good) values.insert(one.*part);
    require(false, [&] {
      std::string text = std::string(name) + " is not complete: ";
      if (open_bits(open) > most_open_bits) return text + "it has more than 16 open bits, too many to try";
      if (values.empty()) return text + "with no value of the open bytes does the vector decode to what it states";
      text += "paste \"" + pasted(*values.begin()) + "\"";
      return values.size() == 1
                 ? text
                 : text + ", or another of " + std::to_string(values.size()) + " that decode to the same";
    });
  }
  [[nodiscard]] std::string pasted(const Wire& frame) const {
    if (carries_bits(unit_.link)) return {frame.begin(), frame.end()};
    std::string text;
    for (const std::uint8_t byte : frame) {
      for (const int digit : {byte >> 4, byte & 15}) text += "0123456789ABCDEF"[digit];
    }
    return text;
  }

  template <class Text>
  void require(bool holds, Text&& text) {
    findings_.require(holds, [&] { return std::string(vector_.id) + " " + text(); });
  }

  // Decodes a reply. If the unit has a decoder of many frames, checks that this decoder has the same result.
  Error decode(const OwnedFrame& reply, ReportedFields& seen) {
    const Error error = unit_.decode(options_, request_.frame(), reply.frame(), seen);
    if (decoder_ == nullptr) return error;
    ReportedFields many;
    const Error same = decoder_->decode(request_.frame(), reply.frame(), many);
    require(same == error && many.fields == seen.fields && many.readings == seen.readings,
            [&] { return "decodes to something else among many frames: " + to_text(many.fields); });
    return error;
  }

  // Checks that the decoder refuses the reply and reports no field of it.
  template <class Text>
  void refused(const OwnedFrame& reply, Text&& text) {
    ReportedFields seen;
    const Error error = decode(reply, seen);
    require(error != Error::none && seen.fields.empty() && !seen.reading, [&] { return text() + " is accepted"; });
  }

  void reading_shows(const ReportedFields& seen) {
    const Reading& reading = *seen.reading;
    const auto is = [&](Role role, std::int64_t number) {
      return seen.numbers(role) == std::vector<std::int64_t>{number};
    };
    require(reading.singleturn_bits == 0 || is(Role::position, static_cast<std::int64_t>(reading.singleturn)),
            [] { return "has a reading of another position"; });
    require(reading.multiturn_bits == 0 || is(Role::turns, reading.turns()),
            [] { return "has a reading of other turns"; });
  }

  void ends() {
    const OwnedFrame with_more = reply_.between({}, std::array<std::uint8_t, 1>{0});
    const FrameEnd whole = unit_.frame_end(options_, Direction::reply, with_more.bytes);
    require(whole.kind == FrameEnd::Kind::complete && whole.size == reply_.bytes.size(), [&] {
      return "ends after " + std::to_string(whole.size) + " instead of " + std::to_string(reply_.bytes.size()) +
             " bytes if another byte follows: see reply_size";
    });
    for (std::size_t size = 0; size < reply_.bytes.size(); ++size) {
      require(unit_.frame_end(options_, Direction::reply, reply_.cut(size).bytes).kind == FrameEnd::Kind::incomplete,
              [&] { return "is taken for complete after " + std::to_string(size); });
    }
  }

  // Checks that the decoder refuses CAN frames of the extended format, remote frames and, after a request, frames
  // with an unknown identifier.
  void other_frames() {
    for (unsigned bit = 0; bit < 11 && !request_.empty(); ++bit) {
      OwnedFrame other = reply_;
      other.can->id ^= 1u << bit;
      if (is_of_a_vector(other.can->id)) continue;
      refused(other, [&] { return "with bit " + std::to_string(bit) + " of its identifier flipped"; });
    }
    OwnedFrame extended = reply_;
    extended.can->extended = true;
    refused(extended, [] { return std::string("with an identifier of 29 bits"); });
    OwnedFrame remote = reply_;
    remote.can->remote = true;
    refused(remote, [] { return std::string("as a remote frame"); });
  }

  // Returns whether the valid reply of any test vector has the CAN identifier `id`.
  [[nodiscard]] bool is_of_a_vector(std::uint32_t id) const {
    return std::any_of(unit_.vectors.begin(), unit_.vectors.end(), [&](const Vector& one) {
      const OwnedFrame reply = frame_of(unit_, one.reply);
      return reply.can && reply.can->id == id && one.error == Error::none;
    });
  }

  const Unit& unit_;
  const Vector& vector_;
  Options options_;
  Findings& findings_;
  OwnedFrame request_ = frame_of(unit_, vector_.request);
  OwnedFrame reply_ = frame_of(unit_, vector_.reply);
  std::unique_ptr<std::byte[]> storage_ = std::make_unique<std::byte[]>(unit_.decoder_storage);
  FrameDecoder* decoder_ =
      unit_.decoder != nullptr ? unit_.decoder(options_, {storage_.get(), unit_.decoder_storage}) : nullptr;
};

}  // namespace

Findings check_decoding(const Unit& unit) {
  Findings findings;
  for (const Vector& vector : unit.vectors) {
    const std::optional<Options> options = options_of(unit, vector.options);
    findings.require(options.has_value(), [&] { return std::string(vector.id) + " has options that do not exist"; });
    if (!options) continue;
    Decoding decoding(unit, vector, *options, findings);
    if (!vector.is_complete()) {
      decoding.complete();
      continue;
    }
    decoding.whole();
    if (vector.error != Error::none) continue;
    decoding.unanswered();
    decoding.good_request();
    if (!vector.reply.empty()) decoding.good_reply();
  }
  return findings;
}

}  // namespace absenc::kit
