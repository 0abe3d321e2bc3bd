// SPDX-License-Identifier: Apache-2.0
// Checks the messages about failed exchanges.
#include "absenc/client/port/diagnosis.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/protocol/all.hpp"
#include "tests/kit/world.hpp"

namespace absenc::client {
namespace {

using kit::Configuration;
using kit::ConversationResult;
using kit::World;

struct Message {
  std::string text;
  Diagnosis diagnosis;
};

Message message_of(const Unit& unit, const Options& options, const ConversationResult& ended) {
  const Diagnosis diagnosis = diagnose(unit, options, {.bytes = ended.sent}, {.bytes = ended.received});
  return {describe(unit.link, Subject::reply, ended.error, ended.detail, diagnosis), diagnosis};
}

/// Returns the parts of a message that occur in it more than once. "Checksum" and "CRC" are taken for the same word.
std::set<std::string> repeated_clauses(std::string message) {
  for (std::size_t at = 0; (at = message.find("CRC", at)) != std::string::npos;) message.replace(at, 3, "checksum");
  std::set<std::string> once;
  std::set<std::string> twice;
  for (std::size_t begin = 0; begin < message.size();) {
    const std::size_t end = std::min(message.find("; ", begin), message.find(": ", begin));
    const std::string clause = message.substr(begin, end - begin);
    if (!once.insert(clause).second) twice.insert(clause);
    begin = end == std::string::npos ? end : end + 2;
  }
  return twice;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

std::vector<const Unit*> units_of_bytes() {
  std::vector<const Unit*> units(all_units().begin(), all_units().end());
  std::erase_if(units, [](const Unit* unit) { return unit->link == LinkKind::can || host_clocks(unit->link); });
  return units;
}

TEST(Diagnosis, ASettingThatWouldHelpIsNamedOnce) {
  std::set<std::string> named;
  for (const Unit* unit : units_of_bytes()) {
    const Options here = kit::configurations(*unit).front().options;
    for (std::size_t i = 0; i < unit->options.size(); ++i) {
      for (std::size_t value = 0; value < unit->options[i].choices.size(); ++value) {
        Options there = here;
        there.values[i] = static_cast<std::int64_t>(value);
        World<std::uint8_t> world(*unit, there, 1);
        if (there.values == here.values || !world.made()) continue;
        world.move(0x2'4567'89AB);
        world.set_options(here);
        const Command& read = *find_command(*unit, Verb::read);
        const ConversationResult ended = world.run(read, kit::least_arguments(read), std::chrono::milliseconds(100));
        if (!ended.made || !ended.ended || ended.error == Error::none) continue;
        const auto& [text, diagnosis] = message_of(*unit, here, ended);
        EXPECT_EQ(repeated_clauses(text), std::set<std::string>{}) << unit->id;
        if (diagnosis.setting.empty()) continue;
        named.insert(std::string(unit->id));
        EXPECT_EQ(count_of(text, diagnosis.setting), 1u) << unit->id << ": " << text;
      }
    }
  }
  EXPECT_GE(named.size(), 2u);
}

TEST(Diagnosis, AMessageSaysNothingTwice) {
  unsigned messages = 0;
  for (const Unit* unit : units_of_bytes()) {
    const Options options = kit::configurations(*unit).front().options;
    for (std::size_t kind = 0; kind < sim::fault_names.size(); ++kind) {
      for (const Command& command : unit->commands) {
        World<std::uint8_t> world(*unit, options, 1);
        sim::FaultRates rates;
        rates.rates[kind] = 1;
        world.set_rates(rates);
        const ConversationResult ended =
            world.run(command, kit::least_arguments(command), std::chrono::milliseconds(20));
        if (!ended.made || !ended.ended || ended.error == Error::none) continue;
        const std::string text = message_of(*unit, options, ended).text;
        EXPECT_EQ(repeated_clauses(text), std::set<std::string>{}) << unit->id << " " << command.name;
        ++messages;
      }
    }
  }
  EXPECT_GT(messages, 100u);
}

WireFrame without_end(WireFrame frame) {
  if (frame.can) {
    --frame.can->size;
  } else {
    if (frame.bits % 8 < 2) frame.bytes.pop_back();
    if (frame.bits != 0) --frame.bits;
  }
  return frame;
}

WireFrame frame_of(const Unit& unit, Bytes bytes) {
  if (bytes.empty()) return {};
  const bool is_text = unit.link == LinkKind::can || carries_bits(unit.link);
  if (is_text) return parse_wire_text(unit.link, "vector", std::string(bytes.begin(), bytes.end()));
  return {.bytes = {bytes.begin(), bytes.end()}, .bits = 0, .can = {}};
}

std::vector<std::string> words_of(std::string_view text) {
  std::istringstream in{std::string(text)};
  return {std::istream_iterator<std::string>(in), {}};
}

// Returns the error message for an exchange whose frames have a wrong length; "" if they have another error or none.
std::string said_of(const Unit& unit, const Options& options, const WireFrame& request, const WireFrame& reply) {
  NoFields ignored;
  const Error error = unit.decode(options, request.frame(), reply.frame(), ignored);
  return error == Error::wrong_length ? sentence_for(unit, options, error, request.frame(), reply.frame()) : "";
}

TEST(FrameWords, WrongLengthIsSaidOfTheFrameThatHasIt) {
  std::set<LinkKind> links;
  for (const Unit* const unit : all_units()) {
    const std::string_view counted = unit->link == LinkKind::can ? "the frame has the wrong number of data bytes"
                                     : carries_bits(unit->link)  ? "the frame has the wrong number of bits"
                                                                 : "";
    for (const Vector& vector : unit->vectors) {
      if (vector.error != Error::none) continue;
      const Options options = require_options(*unit, {}, words_of(vector.options));
      const WireFrame request = frame_of(*unit, vector.request);
      const bool asks = vector.reply.empty();
      const std::string said = asks ? said_of(*unit, options, without_end(request), {})
                                    : said_of(*unit, options, request, without_end(frame_of(*unit, vector.reply)));
      if (said.empty()) continue;
      links.insert(unit->link);
      const std::string_view expected = !counted.empty() ? counted
                                        : asks           ? "the request has the wrong number of bytes"
                                                         : "the reply has the wrong number of bytes";
      EXPECT_EQ(said.substr(0, expected.size()), expected) << vector.id;
    }
  }
  EXPECT_EQ(links.size(), 5u) << "every kind of link was looked at";
}

}  // namespace
}  // namespace absenc::client
