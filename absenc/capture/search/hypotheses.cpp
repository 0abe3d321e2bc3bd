// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/search/hypotheses.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

namespace absenc::capture {

namespace {

constexpr std::int64_t most_bits = 64;
// Number of exchanges that are tried first: options that explain none of them are given up.
constexpr std::size_t telling = 32;

struct NoEvidence final : EvidenceSink {
  void put(const OptionEvidence&) override {}
};

bool same_resolution(const Resolution& one, const Resolution& other) {
  return one.singleturn_bits == other.singleturn_bits && one.multiturn_bits == other.multiturn_bits;
}

bool is_number_of_bits(const Option& option) { return option.choices.empty() && option.maximum <= most_bits; }

/// Returns whether one of the hypotheses has the option values of `options`.
bool contains(std::span<const Hypothesis> all, const Options& options) {
  return std::any_of(all.begin(), all.end(),
                     [&](const Hypothesis& one) { return one.options.values == options.values; });
}

/// A hash of the decoded content of frames, by which hypotheses that decode the same are recognised.
class Meaning final : public FieldSink {
 public:
  void put(const FieldValue& value) override {
    add(reinterpret_cast<std::uintptr_t>(value.info));
    add(static_cast<std::uint64_t>(value.number));
    add(std::bit_cast<std::uint64_t>(value.real));
    for (const std::uint8_t byte : value.bytes) add(byte);
  }
  void put_reading(const Reading& reading) override {
    add(reading.singleturn);
    add(reading.multiturn);
    add(reading.singleturn_bits << 16 | reading.multiturn_bits);
  }
  void add(std::uint64_t value) { hash_ = (hash_ ^ value) * 0x9E3779B97F4A7C15u ^ hash_ >> 29; }
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325u;
};

class HypothesisSearch {
 public:
  HypothesisSearch(const Unit& unit, std::span<const ObservedExchange> exchanges)
      : unit_(unit), exchanges_(exchanges) {}

  /// Adds a hypothesis unless it explains no exchange, or fewer exchanges than those already found, or decodes the
  /// exchanges to the same content as one of them.
  void add(const Options& options, bool at_least = false) {
    if (contains(best_, options)) return;
    ++tried_;
    const std::size_t count = explained(options);
    if (count == 0 || count < most_) return;
    if (count > most_) {
      best_.clear();
      meanings_.clear();
    }
    most_ = count;
    const std::uint64_t meaning = meaning_of(options);
    if (std::find(meanings_.begin(), meanings_.end(), meaning) != meanings_.end()) return;
    meanings_.push_back(meaning);
    best_.push_back({options, weigh(unit_, options, exchanges_), tried_, at_least});
  }

  /// Adds the options that the unit derives from the frames where its document leaves them open.
  void probe(Options options) {
    if (unit_.probe == nullptr) return;
    NoEvidence nowhere;
    std::vector<Capture> captures;
    for (const ObservedExchange& one : exchanges_) captures.push_back({one.request.bytes, one.reply.bytes});
    if (!unit_.probe(options, captures, nowhere)) return;
    options.model = nullptr;
    add(options);
  }

  /// Adds variants of `base`: with other numbers of bits, and with another value of one option that has a list of
  /// choices.
  void vary(const Options& base) {
    vary_bits(base);
    for (std::size_t i = 0; i < unit_.options.size(); ++i) {
      const auto count = static_cast<std::int64_t>(unit_.options[i].choices.size());
      for (std::int64_t value = 0; value < count; ++value) {
        if (value == base[i]) continue;
        Options other = base;
        other.values[i] = value;
        other.model = nullptr;
        add(other);
        vary_bits(other);
      }
    }
  }

  /// Adds variants of `base` in which one option that has a list of choices has another value.
  void vary_motion(const Options& base) {
    for (std::size_t i = 0; i < unit_.options.size(); ++i) {
      const auto count = static_cast<std::int64_t>(unit_.options[i].choices.size());
      for (std::int64_t value = 0; value < count; ++value) {
        if (value == base[i]) continue;
        Options other = base;
        other.values[i] = value;
        other.model = nullptr;
        add(other);
      }
    }
  }

  [[nodiscard]] bool explains_all() const { return most_ == exchanges_.size(); }
  std::vector<Hypothesis> take() {
    std::stable_sort(best_.begin(), best_.end(), is_likelier);
    return std::move(best_);
  }
  [[nodiscard]] std::span<const Hypothesis> best() const { return best_; }

 private:
  [[nodiscard]] std::uint64_t meaning_of(const Options& options) const {
    Meaning meaning;
    for (const ObservedExchange& one : exchanges_) {
      meaning.add(explains(unit_, options, one) ? 1 : 0);
      static_cast<void>(unit_.decode(options, one.request.frame(), one.reply.frame(), meaning));
    }
    return meaning.hash();
  }

  [[nodiscard]] std::size_t explained(const Options& options) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < exchanges_.size(); ++i) {
      if (explains(unit_, options, exchanges_[i])) ++count;
      const bool hopeless = count == 0 && i + 1 == telling;
      if (hopeless || count + exchanges_.size() - i - 1 < most_) return 0;
    }
    return count;
  }

  // Adds, of the variants of `base` that explain the most exchanges, the one with the fewest bits, because frames
  // cannot show whether an encoder has more bits.
  void vary_bits(const Options& base) {
    const std::vector<std::size_t> bits = resolution_options(unit_);
    std::optional<Options> fewest;
    std::size_t most = 0;
    unsigned sum = 0;
    const auto try_options = [&](const Options& options) {
      ++tried_;
      const std::size_t count = explained(options);
      const Resolution resolution = unit_.resolution(options);
      const unsigned bits_of = resolution.singleturn_bits + resolution.multiturn_bits;
      if (count == 0 || count < most || (count == most && bits_of >= sum)) return;
      most = count;
      sum = bits_of;
      fewest = options;
    };
    for (std::size_t i = 0; i < bits.size(); ++i) {
      for (std::size_t j = i; j < bits.size(); ++j) try_pair(base, bits[i], bits[j], try_options);
    }
    if (fewest) add(*fewest, true);
  }

  template <class TryOptions>
  void try_pair(Options options, std::size_t one, std::size_t other, const TryOptions& try_options) const {
    options.model = nullptr;
    const Option& first = unit_.options[one];
    const Option& second = unit_.options[other];
    for (std::int64_t a = first.minimum; a <= first.maximum; ++a) {
      options.values[one] = a;
      if (one == other) {
        try_options(options);
        continue;
      }
      for (std::int64_t b = second.minimum; b <= second.maximum; ++b) {
        options.values[other] = b;
        try_options(options);
      }
    }
  }

  const Unit& unit_;
  std::span<const ObservedExchange> exchanges_;
  std::vector<Hypothesis> best_;
  // for each hypothesis in `best_`: hash of the content to which it decodes the exchanges
  std::vector<std::uint64_t> meanings_;
  std::size_t most_ = 0;
  std::size_t tried_ = 0;
};

}  // namespace

double Hypothesis::chance() const { return std::min(0.0, evidence.chance() + std::log10(static_cast<double>(tried))); }

bool Hypothesis::is_proven() const { return evidence.frames + std::log10(static_cast<double>(tried)) <= is_found; }

std::vector<std::size_t> resolution_options(const Unit& unit) {
  Options defaults;
  for (std::size_t i = 0; i < unit.options.size(); ++i) defaults.values[i] = unit.options[i].default_value;
  const Resolution usual = unit.resolution(defaults);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    if (!is_number_of_bits(option)) continue;
    bool changes = false;
    for (std::int64_t value = option.minimum; value <= option.maximum && !changes; ++value) {
      Options other = defaults;
      other.values[i] = value;
      changes = !same_resolution(unit.resolution(other), usual);
    }
    if (changes) found.push_back(i);
  }
  return found;
}

std::vector<Options> likely_options(const Unit& unit, std::span<const OptionText> settings) {
  std::vector<Options> all;
  Options options;
  for (const Model& model : unit.models) {
    if (resolve_options(unit, model.name, settings, options).kind == OptionError::Kind::none) all.push_back(options);
  }
  Options plain;
  for (std::size_t i = 0; i < unit.options.size(); ++i) plain.values[i] = unit.options[i].default_value;
  if (resolve_options(unit, {}, settings, options).kind != OptionError::Kind::none) return all;
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const bool is_set = std::any_of(settings.begin(), settings.end(),
                                    [&](const OptionText& setting) { return setting.name == unit.options[i].name; });
    if (is_set) plain.values[i] = options[i];
  }
  const bool known =
      std::any_of(all.begin(), all.end(), [&](const Options& one) { return one.values == plain.values; });
  if (!known) all.push_back(plain);
  return all;
}

std::vector<Hypothesis> find_hypotheses(const Unit& unit, std::span<const OptionText> settings,
                                        std::span<const ObservedExchange> exchanges) {
  if (exchanges.empty()) return {};
  HypothesisSearch search(unit, exchanges);
  const std::vector<Options> likely = likely_options(unit, settings);
  for (const Options& options : likely) {
    if (options.model != nullptr || !search.explains_all()) search.add(options);
  }
  if (!search.explains_all()) {
    for (const Options& options : likely) search.probe(options);
  }
  if (!search.explains_all() && !likely.empty()) search.vary(likely.back());
  std::vector<Hypothesis> found(search.best().begin(), search.best().end());
  for (const Hypothesis& one : found) {
    if (one.evidence.frames > frames_suffice && one.evidence.motion) search.vary_motion(one.options);
  }
  return search.take();
}

}  // namespace absenc::capture
