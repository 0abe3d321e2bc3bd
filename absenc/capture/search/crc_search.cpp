// SPDX-License-Identifier: Apache-2.0
#include "absenc/capture/search/crc_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "absenc/capture/search/crc_frames.hpp"

namespace absenc::capture {

namespace {

// log2 of one in a million: a solution whose chance of being an accident is smaller is accepted as certain
constexpr double settled_log2 = -20;
// Highest degree of a common divisor that is factorised; a divisor of higher degree has too many factors.
constexpr int most_common_degree = 63;
constexpr unsigned widest = 16;

class CrcSearch {
 public:
  explicit CrcSearch(std::span<const CheckedFrame> frames) : frames_(frames) {}

  CheckSearch run() {
    if (frames_.all.size() < 2) return {};
    const std::size_t step = frames_.of_bits ? 1 : 8;
    for (unsigned width = 3; width <= widest; ++width) {
      Shape shape;
      shape.width = width;
      shape.check_size = frames_.of_bits ? width : (width + 7) / step;
      each_order(shape);
    }
    if (!frames_.of_bits) sums();
    for (CheckSolution& solution : found_.solutions) solution.chance_log2 += std::log2(static_cast<double>(shapes_));
    std::stable_sort(found_.solutions.begin(), found_.solutions.end(),
                     [](const CheckSolution& a, const CheckSolution& b) { return a.chance_log2 < b.chance_log2; });
    return std::move(found_);
  }

 private:
  struct Key {
    std::uint32_t init, xorout;
    bool init_open;
    auto operator<=>(const Key&) const = default;
  };
  // Possible positions of the first byte or bit that the checksum covers, for each polynomial and each pair of init and
  // xorout.
  using Firsts = std::map<std::uint32_t, std::map<Key, std::vector<std::size_t>>>;

  void each_order(Shape shape) {
    const unsigned orders = frames_.of_bits ? 1 : 2;
    for (unsigned refin = 0; refin < orders; ++refin) {
      for (unsigned refout = 0; refout < 2; ++refout) {
        for (unsigned low_first = 0; low_first < (shape.width > 8 ? orders : 1); ++low_first) {
          for (unsigned padded = 0; padded < (shape.width > 8 ? orders : 1); ++padded) {
            shape.refin = refin != 0;
            shape.refout = refout != 0;
            shape.low_first = low_first != 0;
            shape.padded = padded != 0;
            each_place(shape);
          }
        }
      }
    }
  }

  void each_place(Shape shape) {
    for (shape.trailing = 0; shape.trailing + shape.check_size < frames_.shortest; ++shape.trailing) {
      if (!take_checks(shape)) continue;
      if (never_changes(shape)) {
        shapes_ += frames_.shortest - shape.trailing - shape.check_size;
        continue;
      }
      Firsts solutions;
      for (std::size_t first = 0; first < frames_.shortest - shape.trailing - shape.check_size; ++first) {
        ++shapes_;
        find_solutions(shape, first, solutions);
      }
      for (const auto& [poly, keys] : solutions) keep(shape, poly, keys);
    }
  }

  [[nodiscard]] bool never_changes(const Shape& shape) const {
    return std::all_of(frames_.all.begin(), frames_.all.end(), [&](const CheckedFrame* frame) {
      return check_of(*frame, shape) == check_of(*frames_.all.front(), shape);
    });
  }

  // Returns how many linearly independent checksums the frames contain.
  [[nodiscard]] double known_checks(const Shape& shape, std::size_t first) {
    Shape plain;
    plain.trailing = shape.trailing;
    const auto [known, is_new] = known_.try_emplace({plain.trailing, first});
    if (!is_new) return known->second;
    // linearly independent differences of two frames of equal length, each of a different degree as polynomial
    std::vector<Polynomial> basis;
    for (const auto& [length, frames] : frames_.lengths) {
      const Polynomial base = content(*frames.front(), plain, first);
      for (const CheckedFrame* frame : frames) {
        Polynomial difference = content(*frame, plain, first);
        difference ^= base;
        for (bool reduced = true; reduced;) {
          const auto same = std::find_if(basis.begin(), basis.end(),
                                         [&](const Polynomial& one) { return one.degree() == difference.degree(); });
          reduced = difference.degree() >= 0 && same != basis.end();
          if (reduced) difference ^= *same;
        }
        if (difference.degree() >= 0) basis.push_back(difference);
      }
    }
    return known->second = static_cast<double>(basis.size() + frames_.lengths.size());
  }

  // Returns the covered bits and the checksum of `frame` as one polynomial.
  static Polynomial content(const CheckedFrame& frame, const Shape& plain, std::size_t first) {
    Polynomial word;
    covered_bits(frame, plain, first, [&word](bool bit) { word.append(bit); });
    return word;
  }

  // Reads the checksums of all frames; returns false if a checksum field has bits above the width that are not 0.
  bool take_checks(const Shape& shape) {
    checks_.clear();
    for (const auto& [length, frames] : frames_.lengths) {
      for (const CheckedFrame* frame : frames) {
        const std::optional<std::uint32_t> check = check_of(*frame, shape);
        if (!check) return false;
        checks_[frame] = *check;
      }
    }
    return true;
  }

  void find_solutions(const Shape& shape, std::size_t first, Firsts& solutions) {
    const bool differences = frames_.lengths.size() < frames_.all.size();
    if (differences) {
      for (const std::uint32_t poly : polynomials(shape, first, std::nullopt)) fit(shape, first, poly, solutions);
      return;
    }
    for (const auto& [init, xorout] : usual(shape)) {
      for (const std::uint32_t poly : polynomials(shape, first, std::pair(init, xorout))) {
        solutions[poly][{init, xorout, false}].push_back(first);
      }
    }
  }

  static std::array<std::pair<std::uint32_t, std::uint32_t>, 4> usual(const Shape& shape) {
    const auto ones = static_cast<std::uint32_t>(low_mask(shape.width));
    return {{{0, 0}, {ones, 0}, {0, ones}, {ones, ones}}};
  }

  // Returns possible polynomials without their highest power. `start`: init and xorout, if they are known.
  std::vector<std::uint32_t> polynomials(const Shape& shape, std::size_t first,
                                         std::optional<std::pair<std::uint32_t, std::uint32_t>> start) {
    Polynomial common;
    for (const auto& [length, frames] : frames_.lengths) {
      std::optional<Polynomial> before;
      for (const CheckedFrame* frame : frames) {
        Polynomial word =
            codeword(*frame, shape, first, checks_[frame], start ? start->first : 0, start ? start->second : 0);
        if (start) {
          common = greatest_common_divisor(word, common);
        } else {
          if (before) {
            Polynomial difference = word;
            common = greatest_common_divisor(difference ^= *before, common);
          }
          before = word;
        }
        if (common.degree() >= 0 && common.degree() < static_cast<int>(shape.width)) return {};
      }
    }
    if (common.degree() < 0) return {};
    if (common.degree() > most_common_degree) {
      ++found_.open;
      return {};
    }
    std::vector<std::uint32_t> found = divisors_of_degree(common.low(), shape.width);
    for (std::uint32_t& one : found) one &= static_cast<std::uint32_t>(low_mask(shape.width));
    return found;
  }

  // Finds init and xorout for `poly`: all usual pairs that fit the frames, or otherwise the first pair that fits.
  void fit(const Shape& shape, std::size_t first, std::uint32_t poly, Firsts& solutions) {
    bool is_usual = false;
    for (const auto& [init, xorout] : usual(shape)) {
      if (xorout_for(shape, first, poly, init) != xorout) continue;
      solutions[poly][{init, xorout, false}].push_back(first);
      is_usual = true;
    }
    if (is_usual) return;
    const bool one_length = frames_.lengths.size() == 1;
    const std::uint32_t inits = one_length ? 1 : 1u << shape.width;
    for (std::uint32_t init = 0; init < inits; ++init) {
      const std::optional<std::uint32_t> xorout = xorout_for(shape, first, poly, init);
      if (xorout) solutions[poly][{init, *xorout, one_length}].push_back(first);
      if (xorout) break;
    }
  }

  // Returns the xorout with which the first frame of every length has the right checksum; nothing if there is none.
  std::optional<std::uint32_t> xorout_for(const Shape& shape, std::size_t first, std::uint32_t poly,
                                          std::uint32_t init) {
    std::optional<std::uint32_t> xorout;
    for (const auto& [length, frames] : frames_.lengths) {
      const CheckedFrame& frame = *frames.front();
      const std::uint32_t needed = crc_of(frame, shape, first, poly, init) ^ checks_[&frame];
      if (xorout && *xorout != needed) return std::nullopt;
      xorout = needed;
    }
    return xorout;
  }

  // Stores the solutions for `poly`: all with usual init and xorout, or otherwise the one whose checksum covers most of
  // the frame.
  void keep(const Shape& shape, std::uint32_t poly, const std::map<Key, std::vector<std::size_t>>& keys) {
    const auto is_usual = [&](const Key& key) {
      const auto all = usual(shape);
      return !key.init_open && std::find(all.begin(), all.end(), std::pair(key.init, key.xorout)) != all.end();
    };
    const bool any_usual = std::any_of(keys.begin(), keys.end(), [&](const auto& one) { return is_usual(one.first); });
    const std::pair<const Key, std::vector<std::size_t>>* widest_cover = nullptr;
    for (const auto& one : keys) {
      if (any_usual && is_usual(one.first)) add(shape, poly, one.first, one.second, 2);
      if (widest_cover == nullptr || one.second.front() < widest_cover->second.front()) widest_cover = &one;
    }
    if (any_usual) return;
    const double free_bits = (frames_.lengths.size() == 1 ? 1 : 2) * static_cast<double>(shape.width);
    add(shape, poly, widest_cover->first, {widest_cover->second.front()}, free_bits);
  }

  // Adds a solution. Its `chance_log2` does not consider yet how many layouts were tried; `run` adds that at the end.
  // `free_bits`: number of bits of init and xorout that were chosen to fit.
  void add(const Shape& shape, std::uint32_t poly, const Key& key, std::vector<std::size_t> firsts, double free_bits) {
    CheckSolution solution;
    solution.parameters = {
        shape.width,  static_cast<std::uint16_t>(poly),      static_cast<std::uint16_t>(key.init), shape.refin,
        shape.refout, static_cast<std::uint16_t>(key.xorout)};
    solution.low_first = shape.low_first;
    solution.padded = shape.padded;
    solution.init_open = key.init_open;
    solution.first = std::move(firsts);
    solution.check_size = shape.check_size;
    solution.trailing = shape.trailing;
    solution.chance_log2 = shape.width - 1 + free_bits - known_checks(shape, solution.first.front()) * shape.width;
    // Over bytes, this CRC equals the exclusive or of all bytes, which `sums` finds.
    if (!frames_.of_bits && shape.width == 8 && poly == 1 && shape.refin == shape.refout) return;
    found_.solutions.push_back(std::move(solution));
  }

  void sums() {
    Shape shape;
    shape.width = 8;
    shape.check_size = 1;
    for (shape.trailing = 0; shape.trailing + 1 < frames_.shortest; ++shape.trailing) {
      const bool is_check = !never_changes(shape);
      for (const CheckKind kind : {CheckKind::sum, CheckKind::difference, CheckKind::exclusive_or}) {
        // Possible positions of the first byte that the checksum covers, for each constant of the sum.
        std::map<std::uint8_t, std::vector<std::size_t>> firsts;
        for (std::size_t first = 0; first < frames_.shortest - shape.trailing - 1; ++first) {
          ++shapes_;
          const std::optional<std::uint8_t> constant =
              is_check ? sum_constant(kind, shape, first) : std::optional<std::uint8_t>();
          if (constant) firsts[*constant].push_back(first);
        }
        // Constants other than 00 and FF count only if neither 00 nor FF explains the frames.
        const bool any_usual = firsts.contains(0) || firsts.contains(0xFF);
        for (auto& [constant, first] : firsts) {
          const bool is_usual = constant == 0 || constant == 0xFF;
          if (any_usual && !is_usual) continue;
          CheckSolution solution;
          solution.kind = kind;
          solution.parameters = {8, 0, constant, false, false, 0};
          solution.first = std::move(first);
          solution.check_size = 1;
          solution.trailing = shape.trailing;
          solution.chance_log2 = (is_usual ? 1 : 8) - 8 * known_checks(shape, solution.first.front());
          found_.solutions.push_back(std::move(solution));
        }
      }
    }
  }

  std::optional<std::uint8_t> sum_constant(CheckKind kind, const Shape& shape, std::size_t first) const {
    std::optional<std::uint8_t> constant;
    for (const CheckedFrame* frame : frames_.all) {
      const std::size_t end = frame->bytes.size() - shape.trailing - 1;
      unsigned sum = 0;
      for (std::size_t i = first; i < end; ++i) {
        sum = kind == CheckKind::exclusive_or ? sum ^ frame->bytes[i] : sum + frame->bytes[i];
      }
      const unsigned check = frame->bytes[end];
      const unsigned rest = kind == CheckKind::exclusive_or ? check ^ sum
                            : kind == CheckKind::sum        ? check - sum
                                                            : check + sum;
      const auto needed = static_cast<std::uint8_t>(rest);
      if (constant && *constant != needed) return std::nullopt;
      constant = needed;
    }
    return constant;
  }

  Frames frames_;
  std::map<const CheckedFrame*, std::uint32_t> checks_;
  // stored results of the function `known_checks`; key: number of bytes or bits behind the checksum, and position of
  // the first byte or bit that it covers
  std::map<std::pair<std::size_t, std::size_t>, double> known_;
  std::size_t shapes_ = 0;
  CheckSearch found_;
};

}  // namespace

CheckSearch find_checks(std::span<const CheckedFrame> frames) { return CrcSearch(frames).run(); }

unsigned frames_to_settle(const CheckSolution& solution) {
  if (solution.chance_log2 <= settled_log2) return 0;
  return static_cast<unsigned>(std::ceil((solution.chance_log2 - settled_log2) / solution.parameters.width));
}

}  // namespace absenc::capture
