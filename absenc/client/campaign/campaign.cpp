// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <deque>
#include <optional>
#include <type_traits>

#include "absenc/client/campaign/check_code.hpp"
#include "absenc/client/campaign/guarded.hpp"
#include "absenc/client/campaign/rough_setup.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/real_number.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/sim/place.hpp"

namespace absenc::client {

namespace {

using namespace std::chrono_literals;

constexpr std::array<LineFault, 14> all_faults{{
    {"bit", "each data bit of a reply, by itself: it is flipped", 0.0005},
    {"burst", "a reply: a run of 2 to 16 bits is damaged", 0.002},
    {"double", "a reply: one byte comes twice (clocked lines: a bit)", 0.002},
    {"talker", "a reply: somebody else sends random bytes over it", 0.002},
    {"late", "a reply comes 10 us to 10 s late", 0.001},
    {"drop", "a reply: one byte is lost", 0.002},
    {"corrupt", "a reply: 1 to 3 bits are flipped", 0},
    {"truncate", "a reply: its end is missing", 0.001},
    {"delay", "a reply comes 200 us late", 0},
    {"echo", "a reply: the request's bytes come before it", 0.002},
    {"garbage", "a reply: 1 to 4 random bytes come before it", 0.001},
    {"silence", "a reply does not come", 0.001},
    {"repeat", "a reply comes twice", 0.001},
    {"request_corrupt", "each byte of a request: 1 to 3 bits are flipped", 0.0005},
}};

double require_rate(std::string_view text, std::string_view written) {
  const std::optional<double> rate = parse_real(written);
  if (rate && *rate >= 0 && *rate <= 1) return *rate;
  throw UsageError(fmt::format("fault \"{}\": the rate must be a number from 0 to 1", text));
}

Rates rates_of(std::span<const std::string> written) {
  Rates rates;
  std::vector<std::string_view> names;
  for (const LineFault& fault : line_faults()) {
    names.push_back(fault.name);
    if (written.empty()) rates.set(fault.name, fault.usual);
  }
  for (const std::string& text : written) {
    const OptionText fault = split_setting(text);
    if (std::find(names.begin(), names.end(), fault.name) == names.end()) {
      throw UsageError(fmt::format("there is no fault \"{}\"{}", fault.name, suggestion(fault.name, names)));
    }
    rates.set(fault.name, require_rate(text, fault.value));
  }
  return rates;
}

/// A shaft at rest at a position that can be set.
struct PlacedShaft final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {.position = position}; }
  std::int64_t position = 0;
};

/// A series of readings over a line with faults, each with the shaft at another position, and the counts of errors.
template <class Item>
class Campaign {
 public:
  Campaign(const Unit& unit, const Options& options, const Rates& rates, std::uint64_t seed)
      : unit_(unit), options_(options), bench_(unit, options, shaft_, rates, seed) {}

  void run(std::uint64_t exchanges, CampaignResult& result) {
    const Command* read = find_command(unit_, Verb::read);
    while (result.exchanges < exchanges) one(*read, result);
    result.damaged = bench_.damaged();
    const std::uint64_t errors = bench_.session.counters().bad();
    result.failed = {errors, result.exchanges};
    result.given_up.of = result.recovered.of = result.readings;
    result.wrong.of = result.older.of = result.changed.of = result.exchanges;
  }

  /// Takes `count` readings and returns the replies that contain a position; returns none on CAN.
  std::vector<GoodReply> good_replies(unsigned count) {
    std::vector<GoodReply> replies;
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      for (unsigned i = 0; i < count; ++i) {
        move();
        (void)bench_.session.run(*find_command(unit_, Verb::read));
        GoodReply good{{line_.request().begin(), line_.request().end()}, {line_.reply().begin(), line_.reply().end()}};
        if (unit_.link == LinkKind::clocked) {
          good.request.clear();
          good.bits = line_.bits();
        }
        if (has_position(unit_, options_, good)) replies.push_back(std::move(good));
      }
    }
    return replies;
  }

 private:
  struct Placement {
    Time since;
    std::int64_t position;
  };

  // Moves the shaft to a random position of 64 bits, so that an older position is recognised.
  void move() {
    shaft_.position = static_cast<std::int64_t>(bench_.random.next());
    // positions that the shaft left longer ago are forgotten, because no fault delays a reply for so long
    constexpr Time longest = 30s;
    if (places_.size() > 1 && places_[1].since + longest < line_.now()) places_.pop_front();
    places_.push_back({line_.now(), shaft_.position});
    // Lets unsolicited frames with the old position arrive for 5 ms and drops them. On SPI, leaves a pause of 20 us
    // before the next transfer, because chip select must be released for some time.
    if (bench_.unsolicited) {
      line_.rest(line_.now() + 5ms);
      line_.drop();
    }
    if (unit_.link == LinkKind::spi) line_.rest(line_.now() + 20us);
  }

  void one(const Command& read, CampaignResult& result) {
    move();
    line_.mark();
    const sim::RoughCounts before = line_.counts();
    const std::uint64_t repeated = bench_.session.counters().repeated;
    const Conversation<Item>* ended = bench_.session.run(read);
    const auto is_right = [this](const Reading& reading) { return sim::is_at(reading, shaft_.position); };
    ++result.readings;
    result.exchanges += bench_.exchanges_since(before);
    if (ended->error() != Error::none) {
      ++result.given_up.count;
      bench_.pause();
      if (bench_.was_changed(read, is_right)) ++result.changed.count;
      return;
    }
    if (bench_.session.counters().repeated != repeated) ++result.recovered.count;
    const Reading* reading = ended->reading();
    if (reading == nullptr || is_right(*reading)) return;
    const bool old = is_old(*reading);
    if (bench_.was_changed(read, is_right)) {
      ++result.changed.count;
      return;
    }
    ++result.wrong.count;
    if (old) ++result.older.count;
  }

  [[nodiscard]] bool is_old(const Reading& reading) const {
    const std::span<const Time> old = line_.old_frames();
    return std::any_of(old.begin(), old.end(), [&](Time sent) {
      const auto after = std::upper_bound(places_.begin(), places_.end(), sent,
                                          [](Time time, const Placement& place) { return time < place.since; });
      return after != places_.begin() && sim::is_at(reading, std::prev(after)->position);
    });
  }

  const Unit& unit_;
  const Options& options_;
  PlacedShaft shaft_;
  RoughBench<Item> bench_;
  sim::RoughLine<Item>& line_ = bench_.line;
  std::deque<Placement> places_;
};

std::optional<CheckWorth> worth_of(const Unit& unit, const Options& options, double bit_errors) {
  if (unit.link == LinkKind::can) return {};
  // Many replies at different shaft positions are needed to estimate how many damaged replies are accepted: a frame
  // that is shifted by some bits passes the checksum only at some shaft positions.
  constexpr unsigned frames = 20'000;
  constexpr unsigned samples = 500'000;
  const std::vector<GoodReply> replies = Campaign<std::uint8_t>(unit, options, {}, 7).good_replies(frames);
  if (replies.empty()) return {};
  const std::optional<CheckCode> code = CheckCode::learn(unit, options, replies);
  if (!code) return {};
  CheckWorth worth{.check_bits = code->check_bits(), .frame_bits = code->bits()};
  constexpr unsigned most = 8;
  const std::vector<double> words = code->weights(most);
  const auto first = std::find_if(words.begin() + 1, words.end(), [](double count) { return count > 0; });
  if (first != words.end()) {
    worth.distance = static_cast<unsigned>(first - words.begin());
    worth.words = *first;
  }
  if (bit_errors <= 0) return worth;
  worth.unseen = code->unseen(bit_errors);
  const Estimated taken = code->taken(unit, options, replies, bit_errors, samples);
  worth.taken = taken.value;
  worth.taken_deviation = taken.deviation;
  return worth;
}

}  // namespace

std::span<const LineFault> line_faults() { return all_faults; }

CampaignResult campaign(std::string_view protocol, const CampaignChoices& choices) {
  const Unit& unit = require_unit(protocol);
  const Options options = require_options(unit, choices.model, choices.options);
  const Rates rates = rates_of(choices.faults);
  CampaignResult result{.protocol = std::string(unit.id)};
  if (options.model != nullptr) result.model = options.model->name;
  result.worth = worth_of(unit, options, rates.line.bit);
  const std::clock_t begin = std::clock();
  if (choices.rpm) {
    result.guarded = read_guarded(unit, options, rates, choices, result);
  } else if (unit.link == LinkKind::can) {
    Campaign<CanFrame>(unit, options, rates, choices.seed).run(choices.exchanges, result);
  } else {
    Campaign<std::uint8_t>(unit, options, rates, choices.seed).run(choices.exchanges, result);
  }
  result.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  return result;
}

}  // namespace absenc::client
