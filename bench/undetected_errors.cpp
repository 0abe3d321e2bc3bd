// SPDX-License-Identifier: Apache-2.0
// Inverts one to three bits of a good reply of each unit that is not on CAN, in every combination. Prints how many of
// the damaged replies give another position although every check of the unit accepts them, and which share of all
// replies these are at three bit error rates (docs/drive.md).
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "absenc/protocol/vector_check.hpp"
#include "absenc/sim/place.hpp"

namespace {

using namespace absenc;

/// Reply and request of a test vector of a unit, and the options with which both are decoded.
struct Example {
  std::string_view id{};
  Options options{};
  std::vector<std::uint8_t> request{};
  std::vector<std::uint8_t> reply{};
  std::size_t bits = 0;  // number of bits of the reply

  [[nodiscard]] Frame frame(LinkKind link) const { return {.bytes = reply, .bits = carries_bits(link) ? bits : 0}; }
  void flip(std::size_t bit) { reply[bit / 8] = static_cast<std::uint8_t>(reply[bit / 8] ^ 0x80u >> bit % 8); }
};

struct ReadingSink final : FieldSink {
  void put(const FieldValue&) override {}
  void put_reading(const Reading& one) override { reading = one; }
  std::optional<Reading> reading;
};

std::optional<Reading> reading_of(const Unit& unit, const Example& example) {
  ReadingSink sink;
  const Error error = unit.decode(example.options, {.bytes = example.request}, example.frame(unit.link), sink);
  return error == Error::none ? sink.reading : std::nullopt;
}

Options options_of(const Unit& unit, std::string_view text) {
  std::vector<OptionText> settings;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), one.size() + 1));
    settings.push_back({one.substr(0, one.find('=')), one.substr(one.find('=') + 1)});
  }
  Options options;
  static_cast<void>(resolve_options(unit, {}, settings, options));
  return options;
}

// Returns the test vector of the unit whose reply has the valid position with the most bits. Returns no value for a
// unit on CAN, because CAN's own checksum notices errors.
std::optional<Example> example_of(const Unit& unit) {
  std::optional<Example> best;
  unsigned widest = 0;
  if (unit.link == LinkKind::can) return best;
  for (const Vector& vector : unit.vectors) {
    if (vector.error != Error::none || vector.reply.empty()) continue;
    Example one;
    one.id = vector.id;
    one.options = options_of(unit, vector.options);
    one.request.assign(vector.request.begin(), vector.request.end());
    one.reply.assign(vector.reply.begin(), vector.reply.end());
    one.bits = 8 * one.reply.size();
    if (carries_bits(unit.link)) {
      const auto packed = bits_of_text(vector.reply);
      one.request.clear();
      one.reply.assign(packed.bytes().begin(), packed.bytes().end());
      one.bits = packed.size();
    }
    const std::optional<Reading> reading = reading_of(unit, one);
    if (!reading || !reading->singleturn_valid()) continue;
    if (reading->singleturn_bits + reading->multiturn_bits <= widest) continue;
    widest = reading->singleturn_bits + reading->multiturn_bits;
    best = one;
  }
  return best;
}

// Returns how many errors of one, two and three bits give another valid position.
std::array<std::uint64_t, 3> unnoticed(const Unit& unit, Example example) {
  const std::optional<Reading> right = reading_of(unit, example);
  std::array<std::uint64_t, 3> found{};
  const auto count = [&](std::size_t errors) {
    const std::optional<Reading> wrong = reading_of(unit, example);
    if (wrong && wrong->singleturn_valid() && !sim::same_place(wrong, right)) ++found[errors - 1];
  };
  for (std::size_t one = 0; one < example.bits; ++one) {
    example.flip(one);
    count(1);
    for (std::size_t two = one + 1; two < example.bits; ++two) {
      example.flip(two);
      count(2);
      for (std::size_t three = two + 1; three < example.bits; ++three) {
        example.flip(three);
        count(3);
        example.flip(three);
      }
      example.flip(two);
    }
    example.flip(one);
  }
  return found;
}

// Returns the number of errors of four bits that a frame of `bits` bits can have.
double of_four(std::size_t bits) {
  const auto n = static_cast<double>(bits);
  return n * (n - 1) * (n - 2) * (n - 3) / 24;
}

}  // namespace

int main() {
  std::printf("%-14s %-22s %5s %6s %8s %9s %9s %9s %9s\n", "unit", "vector", "bits", "1", "2", "3", "1e-6", "1e-5",
              "1e-4");
  for (const Unit* const unit : all_units()) {
    const std::optional<Example> example = example_of(*unit);
    if (!example) continue;
    const auto found = unnoticed(*unit, *example);
    std::printf("%-14s %-22s %5zu %6llu %8llu %9llu", std::string(unit->id).c_str(), std::string(example->id).c_str(),
                example->bits, static_cast<unsigned long long>(found[0]), static_cast<unsigned long long>(found[1]),
                static_cast<unsigned long long>(found[2]));
    const bool is_none = found == std::array<std::uint64_t, 3>{};
    for (const double rate : {1e-6, 1e-5, 1e-4}) {
      // if every error of up to three bits is noticed, the share of replies with four or more wrong bits is an upper
      // limit
      double share = is_none ? of_four(example->bits) * std::pow(rate, 4) : 0;
      for (unsigned errors = 1; errors <= found.size(); ++errors) {
        const double good = static_cast<double>(example->bits - errors);
        share += static_cast<double>(found[errors - 1]) * std::pow(rate, errors) * std::pow(1 - rate, good);
      }
      std::printf(" %s%.1e", is_none ? "<" : " ", share);
    }
    std::printf("\n");
  }
}
