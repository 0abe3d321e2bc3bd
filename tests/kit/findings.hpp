// SPDX-License-Identifier: Apache-2.0
// What the kit finds wrong with a unit, as text: tests of units demand that there is nothing, tests of the kit that a
// toy with a mistake is found.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace absenc::kit {

class Findings {
 public:
  /// The first ones are kept, all are counted.
  void add(std::string text) {
    if (texts_.size() < 20) texts_.push_back(std::move(text));
    ++count_;
  }
  /// `text()` is made only where it is needed.
  template <class Text>
  void require(bool holds, Text&& text) {
    ++looks_;
    if (!holds) add(text());
  }
  void note(std::string text) { notes_.push_back(std::move(text)); }

  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// How many things were demanded: a check that looks at nothing finds nothing.
  [[nodiscard]] std::uint64_t looks() const { return looks_; }
  /// Figures for people.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  std::vector<std::string> texts_;
  std::vector<std::string> notes_;
  std::uint64_t count_ = 0;
  std::uint64_t looks_ = 0;
};

}  // namespace absenc::kit
