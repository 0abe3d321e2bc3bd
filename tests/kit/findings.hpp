// SPDX-License-Identifier: Apache-2.0
// Collects the defects ("findings") that the kit finds in a unit, as texts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace absenc::kit {

class Findings {
 public:
  /// Adds a finding. Counts all findings, but stores the texts of the first 20 only.
  void add(std::string text) {
    if (texts_.size() < 20) texts_.push_back(std::move(text));
    ++count_;
  }
  /// Adds `text()` as a finding if `holds` is false. `text()` is not called if `holds` is true.
  template <class Text>
  void require(bool holds, Text&& text) {
    ++check_count_;
    if (!holds) add(text());
  }
  void note(std::string text) { notes_.push_back(std::move(text)); }

  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Returns the number of calls of `require`; 0 shows a test that nothing was checked.
  [[nodiscard]] std::uint64_t check_count() const { return check_count_; }
  /// Returns measured figures, such as the number of exchanges, for a test to print.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  std::vector<std::string> texts_;
  std::vector<std::string> notes_;
  std::uint64_t count_ = 0;
  std::uint64_t check_count_ = 0;
};

}  // namespace absenc::kit
