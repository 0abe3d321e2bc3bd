// SPDX-License-Identifier: Apache-2.0
// Checks doctor with every unit. `./dev tables` updates the tables in docs/doctor.md.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "absenc/client/doctor/examine.hpp"
#include "absenc/client/doctor/lines_test.hpp"
#include "absenc/client/doctor/modes_test.hpp"
#include "absenc/client/doctor/path_faults_test.hpp"
#include "absenc/client/reading.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/session.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::client {
namespace {

using Ids = std::set<std::string_view>;

constexpr std::size_t readings = 200;

/// A position whose bytes are not all zero: with zeros only, the rest of a truncated frame could be a good frame.
constexpr std::string_view at_no_zero = "singleturn=1383&";

struct Watched {
  std::shared_ptr<VirtualDevice> device;
  Examination examination{};

  [[nodiscard]] std::uint64_t injected() const {
    std::uint64_t sum = 0;
    if (const sim::FaultCounts* counts = device->faults()) {
      for (const std::uint64_t count : *counts) sum += count;
    }
    return sum;
  }
};

/// Returns a link to the virtual encoder `device`, in virtual time.
Link link_on(const EncoderAddress& address, const std::shared_ptr<VirtualDevice>& device) {
  struct Both {
    std::shared_ptr<VirtualDevice> device;
    std::unique_ptr<sim::SimPort<std::uint8_t>> bytes;
    std::unique_ptr<sim::SimPort<CanFrame>> frames;
  };
  auto both = std::make_shared<Both>();
  both->device = device;
  Link link;
  link.place = "here";
  const LineSettings line = address.line.with_some_rate();
  if (device->bytes() != nullptr) {
    both->bytes = std::make_unique<sim::SimPort<std::uint8_t>>(address.unit->link, line, *device->bytes());
    link.bytes = both->bytes.get();
  } else {
    both->frames = std::make_unique<sim::SimPort<CanFrame>>(address.unit->link, line, *device->frames());
    link.frames = both->frames.get();
  }
  link.owner = both;
  return link;
}

std::shared_ptr<VirtualDevice> device_of(const EncoderAddress& address) {
  auto device = std::make_shared<VirtualDevice>(*address.unit, address.options, address.device);
  device->power_on(Time{});
  return device;
}

EncoderAddress address_of(const Unit& unit, const std::string& mode, const std::string& what) {
  std::string settings = mode;
  if (!what.empty()) settings += (settings.empty() ? "" : "&") + what;
  return parse_address(fmt::format("sim:{}{}{}", unit.id, settings.empty() ? "" : "?", settings));
}

Watched examined(const EncoderAddress& address) {
  Watched watched{.device = device_of(address)};
  const Surroundings surroundings{[&](const EncoderAddress& to) { return link_on(to, watched.device); },
                                  [](const std::string&) { return os::PortFacts{}; }};
  watched.examination = examine(address, {.readings = readings, .limit = 60s}, surroundings);
  return watched;
}

Ids ids_of(const Examination& examination) {
  Ids ids;
  for (const Finding& one : examination.findings) ids.insert(one.id);
  return ids;
}

/// Result of one reading without doctor: the reported state, and the bytes on the wire.
struct Read {
  Error error = Error::unsupported;
  std::optional<Reading> reading{};
  std::string wire{};
};

template <class Item>
Read reading_on(const EncoderAddress& address, Port<Item>& port) {
  std::vector<std::byte> storage(address.unit->host_storage);
  host::Session<Item> session(*address.unit, address.options, port, storage, address.echo, 1);
  const Conversation<Item>* one = session.run(*find_command(*address.unit, Verb::read));
  Read read;
  if (one == nullptr) return read;
  read.error = one->error();
  if (one->reading() != nullptr && read.error == Error::none) read.reading = *one->reading();
  for (const auto& items : {one->exchange().sent, one->exchange().received}) {
    for (const Item& item : items) {
      if constexpr (std::is_same_v<Item, CanFrame>) {
        read.wire += fmt::format("{:x} {:02x} ", item.id, fmt::join(Bytes(item.data).first(item.size), ""));
      } else {
        read.wire += fmt::format("{:02x}", item);
      }
    }
    read.wire += " ";
  }
  return read;
}
Read reading_of(const EncoderAddress& address) {
  const Link link = link_on(address, device_of(address));
  return link.bytes != nullptr ? reading_on(address, *link.bytes) : reading_on(address, *link.frames);
}

/// Returns, as bits, the raised alarms, and those raised status flags that have an advice for the user.
std::uint64_t defects_of(const Unit& unit, const Reading& reading) {
  std::uint64_t bits = reading.alarms;
  unsigned at = 0;
  for (const Flags& flags : status_of(unit, reading)) {
    for (const FlagInfo* flag : raised(*flags.field, flags.bits)) {
      if (!flag->action.empty())
        bits |= std::uint64_t{1} << (32 + at + static_cast<std::size_t>(flag - flags.field->flags.data()));
    }
    at += 8;
  }
  return bits;
}

/// Ids of the findings that may result from a state that the encoder reports.
const Ids of_state{"starting", "alarm", "status", "position_invalid", "contradictory", "counter_stands", "refused"};

/// Returns the ids of the findings that may result from this kind of fault.
const Ids& causes_of(const Unit& unit, sim::FaultKind kind) {
  using enum sim::FaultKind;
  static const Ids damage{"damaged_bits",  "damaged_bursts", "sometimes_damaged", "always_damaged",
                          "bytes_missing", "position_jumps", "position_noise",    "stuck_bits",
                          "can_errors",    "turns_jump",     "turns_stand"};
  static const std::map<sim::FaultKind, Ids> others{
      // The finding sometimes_silent is possible because a late reply may come after the host has stopped listening for
      // it.
      {delay, {"reply_late", "sometimes_late", "sometimes_silent"}},
      {echo, {"wrong_echo", "two_answer", "extra_bytes"}},
      // Random bytes on a bus may look like two encoders that send at the same time.
      {garbage,
       {"same_address", "extra_bytes", "bytes_missing", "sometimes_damaged", "damaged_bits", "damaged_bursts",
        "always_damaged", "position_jumps", "position_noise", "stuck_bits", "turns_jump", "turns_stand"}},
      {silence, {"no_answer", "sometimes_silent", "miso_stuck"}},
      {repeat, {"two_answer", "extra_bytes"}},
      // A damaged request may look like another valid request, and its reply then does not fit.
      {request_corrupt,
       {"requests_damaged", "sometimes_silent", "no_answer", "refused", "damaged_bits", "damaged_bursts",
        "sometimes_damaged", "always_damaged", "bytes_missing", "contradictory", "position_jumps", "turns_jump"}},
  };
  // On a clocked or SPI line the host receives bits even without a reply.
  static const Ids clocked = [] {
    Ids all = damage;
    all.insert(
        {"miso_stuck", "data_at_rest", "sometimes_silent", "contradictory", "requests_damaged", "other_checksum"});
    return all;
  }();
  if (host_clocks(unit.link)) return clocked;
  const auto found = others.find(kind);
  return found == others.end() ? damage : found->second;
}

std::string sentences(const Examination& examination) {
  std::string text = examination.verdict();
  for (const Finding& one : examination.findings) text += "\n" + one.sentence();
  return text;
}

std::string differences(const Ids& ids, const Ids& allowed) {
  std::string text;
  for (const std::string_view id : ids) {
    if (!allowed.contains(id)) text += fmt::format(" {}", id);
  }
  return text;
}

class Matrix : public ::testing::TestWithParam<const Unit*> {
 protected:
  const Unit& unit() const { return *GetParam(); }
};

std::vector<std::string> readable_modes(const Unit& unit) {
  std::vector<std::string> modes;
  std::set<std::string> known;
  for (const std::string& mode : modes_of(unit)) {
    try {
      const EncoderAddress address = address_of(unit, mode, "");
      const Read one = reading_of(address);
      if (one.error == Error::none && known.insert(one.wire).second) modes.push_back(mode);
    } catch (const std::exception&) {  // skips option values that exclude each other
    }
  }
  return modes;
}

TEST_P(Matrix, AHealthyEncoderIsGoodAndItsVerdictSaysWhatWasLookedAt) {
  for (const std::string& mode : readable_modes(unit())) {
    const Watched one = examined(address_of(unit(), mode, ""));
    SCOPED_TRACE(fmt::format("{}?{}", unit().id, mode));
    EXPECT_TRUE(one.examination.healthy()) << one.examination.verdict();
    EXPECT_THAT(ids_of(one.examination), ::testing::IsEmpty());
    const std::string verdict = one.examination.verdict();
    EXPECT_NE(verdict.find(fmt::format("{} of {} readings", readings, readings)), std::string::npos) << verdict;
    const std::optional<Reading> reading = reading_of(address_of(unit(), mode, "")).reading;
    const bool is_reported = (reading->alarms_reported | reading->status_reported) != 0;
    const bool is_valid = is_reported && reading->singleturn_validity() == Validity::valid;
    EXPECT_EQ(verdict.find("each with a valid position") != std::string::npos, is_valid) << verdict;
    if (reading->alarms_reported == 0 || !std::ranges::all_of(alarms_of(unit(), *reading), &Flags::is_complete)) {
      EXPECT_EQ(verdict.find("no alarm"), std::string::npos) << verdict;
    }
  }
}

std::vector<std::string> states_of(const Unit& unit) {
  std::vector<std::string> states;
  const Options options = parse_address("sim:" + std::string(unit.id)).options;
  for (const std::string& name : reportable_alarms(unit, options)) states.push_back("alarm=" + name);
  for (const Condition& condition : unit.conditions) {
    for (const std::int64_t value : {condition.minimum, condition.maximum}) {
      if (value != condition.normal) states.push_back(fmt::format("condition={}={}", condition.name, value));
    }
  }
  return states;
}

TEST_P(Matrix, WhatTheEncoderReportsIsNeverGood) {
  std::size_t reported = 0;
  std::size_t unreported = 0;
  for (const std::string& mode : readable_modes(unit())) {
    const std::optional<Reading> usual = reading_of(address_of(unit(), mode, "")).reading;
    for (const std::string& state : states_of(unit())) {
      SCOPED_TRACE(fmt::format("{}?{} {}", unit().id, mode, state));
      std::optional<EncoderAddress> address;
      try {
        address = address_of(unit(), mode, state);
        static_cast<void>(device_of(*address));
      } catch (const std::exception&) {  // skips a state that the encoder cannot have with the options of this mode
        continue;
      }
      const auto [error, reading, wire] = reading_of(*address);
      const bool is_reported = error != Error::none || defects_of(unit(), *reading) != defects_of(unit(), *usual) ||
                               reading->ready != usual->ready ||
                               reading->singleturn_validity() != usual->singleturn_validity() ||
                               reading->multiturn_validity() != usual->multiturn_validity();
      const Examination examination = examined(*address).examination;
      const Ids ids = ids_of(examination);
      if (!is_reported) {
        ++unreported;
        continue;
      }
      ++reported;
      EXPECT_FALSE(examination.healthy()) << sentences(examination);
      EXPECT_EQ(differences(ids, of_state), "") << sentences(examination);
      const std::string text = sentences(examination);
      if (reading && reading->ready) {
        for (const Flags& flags : alarms_of(unit(), *reading)) {
          for (const std::string_view name : flag_names(*flags.field, flags.bits)) {
            EXPECT_NE(text.find(name), std::string::npos) << name << " is not named in\n" << text;
          }
        }
      }
    }
  }
  std::printf("%s: %zu states reported, %zu not\n", std::string(unit().id).c_str(), reported, unreported);
}

std::vector<std::string> damaged_modes(const Unit& unit) {
  std::vector<std::string> modes;
  std::set<bool> known;
  for (const std::string& mode : readable_modes(unit)) {
    const bool streams = unit.streams != nullptr && unit.streams(address_of(unit, mode, "").options);
    if (known.insert(streams).second) modes.push_back(mode);
  }
  return modes;
}

TEST_P(Matrix, DamageIsNeverGoodAndNamedAsWhatItIs) {
  for (const std::string& mode : damaged_modes(unit())) {
    for (std::size_t kind = 0; kind < sim::fault_names.size(); ++kind) {
      for (const double rate : {0.01, 0.1, 1.0}) {
        SCOPED_TRACE(fmt::format("{}?{} {}={}", unit().id, mode, sim::fault_names[kind], rate));
        const EncoderAddress address =
            address_of(unit(), mode, fmt::format("{}fault={}={}", at_no_zero, sim::fault_names[kind], rate));
        const Watched one = examined(address);
        const Examination& examination = one.examination;
        const bool all_good = examination.good == examination.tried;
        // Skips faults without an effect, such as a delay within the timeout.
        if (one.injected() == 0 || (all_good && examination.findings.empty())) continue;
        EXPECT_FALSE(examination.healthy()) << sentences(examination);
        EXPECT_EQ(differences(ids_of(examination), causes_of(unit(), static_cast<sim::FaultKind>(kind))), "")
            << sentences(examination);
      }
    }
  }
}

// ---- The tables of docs/doctor.md

std::string first_of(const Examination& examination) {
  const Finding* first = examination.first();
  return first == nullptr ? "good" : std::string(first->id);
}

std::string fault_table() {
  std::string table = "| protocol |";
  for (const std::string_view name : sim::fault_names) table += fmt::format(" {} |", name);
  table += "\n|---|";
  for (std::size_t i = 0; i < sim::fault_names.size(); ++i) table += "---|";
  table += "\n";
  for (const Unit* unit : all_units()) {
    table += fmt::format("| {} |", unit->id);
    for (const std::string_view name : sim::fault_names) {
      std::vector<std::string> ids;
      for (const double rate : {0.01, 0.1, 1.0}) {
        const std::string id =
            first_of(examined(address_of(*unit, "", fmt::format("{}fault={}={}", at_no_zero, name, rate))).examination);
        if (ids.empty() || ids.back() != id) ids.push_back(id);
      }
      table += fmt::format(" {} |", fmt::join(ids, ", "));
    }
    table += "\n";
  }
  return table;
}

std::string state_table() {
  std::string table = "| protocol | state of the encoder | first finding | evidence |\n|---|---|---|---|\n";
  for (const Unit* unit : all_units()) {
    for (const std::string& state : states_of(*unit)) {
      std::optional<Examination> examination;
      try {
        examination = examined(address_of(*unit, "", state)).examination;
      } catch (const std::exception&) {  // skips a state that the encoder cannot have with its default options
        continue;
      }
      const Finding* first = examination->first();
      table += fmt::format("| {} | {} | {} | {} |\n", unit->id, state, first_of(*examination),
                           first == nullptr ? examination->verdict().substr(6) : first->evidence);
    }
  }
  return table;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream read(text);
  for (std::string line; std::getline(read, line);) lines.push_back(line);
  return lines;
}

/// Returns the first cell of a row of a Markdown table, which names the protocol, with the bar before it.
std::string protocol_of(const std::string& row) { return row.substr(0, row.find('|', 1)); }

/// Replaces the table between the marks `<!-- name -->` and `<!-- end -->`.
void replace_table(std::string& text, const std::string& name, const std::string& table) {
  const std::string begin = fmt::format("<!-- {} -->\n", name);
  const std::size_t from = text.find(begin);
  const std::size_t to = text.find("<!-- end -->", from);
  if (from == std::string::npos || to == std::string::npos) throw std::runtime_error("docs/doctor.md has no " + begin);
  const std::vector<std::string> shown = lines_of(text.substr(from + begin.size(), to - from - begin.size()));
  std::vector<std::string> wanted = lines_of(table);
  std::erase_if(wanted, [&](const std::string& row) {
    return std::ranges::find(shown, protocol_of(row), protocol_of) == shown.end();
  });
  EXPECT_EQ(shown, wanted) << "docs/doctor.md, " << name << ": ./dev tables writes it anew";
  text.replace(from + begin.size(), to - from - begin.size(), table);
}

TEST(DoctorTables, StandInTheDocumentAsTheyAreToday) {
  const char* const sources = std::getenv("ABSENC_SOURCE_DIR");
  if (sources == nullptr) GTEST_SKIP() << "ABSENC_SOURCE_DIR names no sources";
  const std::string path = fmt::format("{}/docs/doctor.md", sources);
  std::stringstream read;
  read << std::ifstream(path).rdbuf();
  std::string text = read.str();
  replace_table(text, "faults", fault_table());
  replace_table(text, "path faults", path_faults::path_fault_table());
  replace_table(text, "states", state_table());
  if (std::getenv("ABSENC_UPDATE_DOCS") != nullptr) std::ofstream(path) << text;
}

std::string name_of_test(const ::testing::TestParamInfo<const Unit*>& one) {
  std::string name(one.param->id);
  for (char& letter : name) letter = letter == '-' ? '_' : letter;
  return name;
}

INSTANTIATE_TEST_SUITE_P(Units, Matrix, ::testing::ValuesIn(all_units().begin(), all_units().end()), name_of_test);

}  // namespace
}  // namespace absenc::client
