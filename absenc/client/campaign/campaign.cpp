// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <deque>
#include <memory>
#include <type_traits>

#include "absenc/client/campaign/check_code.hpp"
#include "absenc/client/emulation/virtual_device.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/session.hpp"
#include "absenc/sim/place.hpp"
#include "absenc/sim/rough_line.hpp"

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

struct Rates {
  sim::RoughRates line;
  sim::FaultRates device;
  bool by_device = false;  // any of `device`

  void set(std::string_view name, double rate) {
    if (double* const own = of_line(name)) {
      *own = rate;
      return;
    }
    const auto found = std::find(sim::fault_names.begin(), sim::fault_names.end(), name);
    device[static_cast<sim::FaultKind>(found - sim::fault_names.begin())] = rate;
    by_device = by_device || rate > 0;
  }

 private:
  double* of_line(std::string_view name) {
    if (name == "bit") return &line.bit;
    if (name == "burst") return &line.burst;
    if (name == "double") return &line.doubled;
    if (name == "talker") return &line.talker;
    if (name == "late") return &line.late;
    return nullptr;
  }
};

double require_rate(std::string_view text, std::string_view written) {
  const std::string number(written);
  char* end = nullptr;
  const double rate = std::strtod(number.c_str(), &end);
  if (!number.empty() && *end == 0 && rate >= 0 && rate <= 1) return rate;
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

/// Stands where it is put.
struct Hand final : Shaft {
  [[nodiscard]] ShaftState at(Time) const override { return {.position = position}; }
  std::int64_t position = 0;
};

/// One unit's host and virtual encoder, and what came of it.
template <class Item>
class Bench {
 public:
  Bench(const Unit& unit, const Options& options, const Rates& rates, std::uint64_t seed)
      : unit_(unit),
        options_(options),
        rates_(rates),
        random_(seed),
        device_storage_(unit.device_storage),
        host_storage_(unit.host_storage),
        device_(make_device()),
        faulty_(device_, rates.device, seed + 1),
        line_(unit.link, line_settings(unit, options).with_some_rate(),
              rates.by_device ? static_cast<Machine<Item>&>(faulty_) : device_, seed + 2),
        session_(unit, options, line_, host_storage_,
                 unit.link == LinkKind::half_duplex ? host::EchoMode::automatic : host::EchoMode::off),
        unasked_(unit.link == LinkKind::can || (unit.streams != nullptr && unit.streams(options))) {
    line_.set_rates(rates.line);
  }

  void run(std::uint64_t exchanges, CampaignResult& result) {
    const Command* read = find_command(unit_, Verb::read);
    while (result.exchanges < exchanges) one(*read, result);
    result.damaged = line_.counts().damaged + damaged_by_device();
    const std::uint64_t errors = session_.counters().bad();
    result.failed = {errors, result.exchanges};
    result.given_up.of = result.recovered.of = result.readings;
    result.wrong.of = result.older.of = result.changed.of = result.exchanges;
  }

  /// Good replies that carry a position, of an undamaged line.
  std::vector<GoodReply> good_replies(unsigned count) {
    std::vector<GoodReply> replies;
    if constexpr (!std::is_same_v<Item, CanFrame>) {
      for (unsigned i = 0; i < count; ++i) {
        move();
        (void)session_.run(*find_command(unit_, Verb::read));
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
  struct Place {
    Time since;
    std::int64_t position;
  };
  using Faulty = std::conditional_t<std::is_same_v<Item, CanFrame>, sim::FaultyNode, sim::FaultyDevice>;

  Device<Item>& make_device(Time now = {}) {
    const Any<Device> made = unit_.device(options_, shaft_, device_storage_);
    Device<Item>* device = nullptr;
    if constexpr (std::is_same_v<Item, CanFrame>) {
      device = made.frames;
    } else {
      device = made.bytes;
    }
    if (device == nullptr) throw UsageError(fmt::format("{} has no virtual encoder with these options", unit_.id));
    device->power_on(now, Device<Item>::PowerOn::skip);
    return *device;
  }

  // Somewhere else: whatever is taken for this place was never another.
  void move() {
    shaft_.position = static_cast<std::int64_t>(random_.next());
    constexpr Time longest = 30s;  // nothing is later
    if (places_.size() > 1 && places_[1].since + longest < line_.now()) places_.pop_front();
    places_.push_back({line_.now(), shaft_.position});
    // What is sent unasked has said where it was before; a chip is not selected again at once.
    if (unasked_) {
      line_.rest(line_.now() + 5ms);
      line_.drop();
    }
    if (unit_.link == LinkKind::spi) line_.rest(line_.now() + 20us);
  }

  void one(const Command& read, CampaignResult& result) {
    move();
    line_.mark();
    const sim::RoughCounts before = line_.counts();
    const std::uint64_t repeated = session_.counters().repeated;
    const Conversation<Item>* ended = session_.run(read);
    ++result.readings;
    // What nobody asks for is counted by its frames.
    const sim::RoughCounts& now = line_.counts();
    const std::uint64_t asked = now.requests - before.requests;
    result.exchanges += asked != 0 ? asked : std::max<std::uint64_t>(1, now.replies - before.replies);
    if (ended->error() != Error::none) {
      ++result.given_up.count;
      pause();
      if (was_changed(read)) ++result.changed.count;
      return;
    }
    if (session_.counters().repeated != repeated) ++result.recovered.count;
    const Reading* reading = ended->reading();
    if (reading == nullptr || sim::is_at(*reading, shaft_.position)) return;
    const bool old = is_old(*reading);
    if (was_changed(read)) {
      ++result.changed.count;
      return;
    }
    ++result.wrong.count;
    if (old) ++result.older.count;
  }

  // A request that was misheard may be one that changes the encoder, and what it says is so from then on: seen over a
  // good line. Then another takes its place.
  bool was_changed(const Command& read) {
    if (rates_.device[sim::FaultKind::request_corrupt] <= 0) return false;
    line_.set_rates({});
    faulty_.set_rates({});
    line_.rest(line_.now() + (unasked_ ? 11s : 20s));  // nothing is late any more
    line_.drop();
    const Conversation<Item>* now = session_.run(read);
    const bool changed =
        now->error() != Error::none || (now->reading() != nullptr && !sim::is_at(*now->reading(), shaft_.position));
    if (changed) (void)make_device(line_.now());  // in the same place
    line_.set_rates(rates_.line);
    faulty_.set_rates(rates_.device);
    return changed;
  }

  // Who has given up tries again after a while, of 10 us to 10 s, each decade as often: a line that holds up a reply
  // holds up those behind it. What comes all the time holds up nobody so long.
  void pause() {
    const double decades = (unasked_ ? 4 : 6) * static_cast<double>(random_.next() >> 11) * 0x1p-53;
    line_.rest(line_.now() + Time(static_cast<std::int64_t>(1e4 * std::pow(10.0, decades))));
  }

  [[nodiscard]] bool is_old(const Reading& reading) const {
    const std::span<const Time> old = line_.old_frames();
    return std::any_of(old.begin(), old.end(), [&](Time sent) {
      const auto after = std::upper_bound(places_.begin(), places_.end(), sent,
                                          [](Time time, const Place& place) { return time < place.since; });
      return after != places_.begin() && sim::is_at(reading, std::prev(after)->position);
    });
  }

  [[nodiscard]] std::uint64_t damaged_by_device() const {
    if constexpr (std::is_same_v<Item, CanFrame>) {
      return faulty_.damaged_frames();
    } else {
      return faulty_.damaged_replies();
    }
  }

  const Unit& unit_;
  const Options& options_;
  Rates rates_;
  sim::Random random_;
  Hand shaft_;
  std::vector<std::byte> device_storage_;
  std::vector<std::byte> host_storage_;
  Device<Item>& device_;
  Faulty faulty_;
  sim::RoughLine<Item> line_;
  host::Session<Item> session_;
  bool unasked_;
  std::deque<Place> places_;
};

std::optional<CheckWorth> worth_of(const Unit& unit, const Options& options, double bit_errors) {
  if (unit.link == LinkKind::can) return {};
  constexpr unsigned frames = 20'000;  // one that is moved passes always or never: many of them
  constexpr unsigned samples = 500'000;
  const std::vector<GoodReply> replies = Bench<std::uint8_t>(unit, options, {}, 7).good_replies(frames);
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

// Wilson's score interval: holds also where nothing, or all, was counted.
double wilson(const Share& share, double side) {
  if (share.of == 0) return side > 0 ? 1 : 0;
  if (share.count == 0 && side < 0) return 0;  // not what rounding leaves
  constexpr double z = 1.96;
  const auto n = static_cast<double>(share.of);
  const double p = share.rate();
  const double middle = p + z * z / (2 * n);
  const double half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return std::clamp((middle + side * half) / (1 + z * z / n), 0.0, 1.0);
}

}  // namespace

double Share::low() const { return wilson(*this, -1); }
double Share::high() const { return wilson(*this, 1); }

std::span<const LineFault> line_faults() { return all_faults; }

CampaignResult campaign(std::string_view protocol, const CampaignChoices& choices) {
  const Unit& unit = require_unit(protocol);
  const Options options = require_options(unit, choices.model, choices.options);
  const Rates rates = rates_of(choices.faults);
  CampaignResult result{.protocol = std::string(unit.id)};
  if (options.model != nullptr) result.model = options.model->name;
  result.worth = worth_of(unit, options, rates.line.bit);
  const std::clock_t begin = std::clock();
  if (unit.link == LinkKind::can) {
    Bench<CanFrame>(unit, options, rates, choices.seed).run(choices.exchanges, result);
  } else {
    Bench<std::uint8_t>(unit, options, rates, choices.seed).run(choices.exchanges, result);
  }
  result.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  return result;
}

}  // namespace absenc::client
