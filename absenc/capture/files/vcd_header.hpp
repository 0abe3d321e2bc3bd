// SPDX-License-Identifier: Apache-2.0
// The declarations of a value change dump: they state which identifier drives which channels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "absenc/capture/files/text_words.hpp"

namespace absenc::capture {

/// The channels of one variable: `width` channels, of which `first` is the rightmost bit.
struct VcdVariable {
  std::size_t first = 0;
  std::size_t width = 0;  // number of bits of the variable, at least 1
};

class VcdHeader {
 public:
  /// Reads the declarations up to $enddefinitions. Throws OpenError if they are invalid.
  VcdHeader(TextWords& words, std::string_view name);

  /// Returns the variables of an identifier, possibly none; nullptr if it was not declared.
  [[nodiscard]] const std::vector<VcdVariable>* find(std::string_view identifier) const {
    const std::size_t code = short_code(identifier);
    if (code < short_.size()) return short_[code] < 0 ? nullptr : &variables_[static_cast<std::size_t>(short_[code])];
    const auto found = long_.find(std::string(identifier));
    return found == long_.end() ? nullptr : &variables_[found->second];
  }

  [[nodiscard]] const std::vector<std::string>& channels() const { return channels_; }
  [[nodiscard]] std::uint64_t ticks_per_second() const { return ticks_per_second_; }
  [[nodiscard]] std::size_t left_out() const { return left_out_; }

 private:
  // Identifiers of one or two printable characters are looked up in an array of this size.
  static constexpr std::size_t short_codes = 95 * 95;
  static std::size_t short_code(std::string_view identifier) {
    std::size_t code = 0;
    for (const char c : identifier) {
      if (c < '!' || c > '~' || identifier.size() > 2) return short_codes;
      code = 95 * code + static_cast<std::size_t>(c - '!') + 1;
    }
    return code;
  }

  struct Name {
    std::string scope;
    std::string name;
    std::string suffix;  // index of a bit in a vector, "[3]"
  };

  void read_section(std::string_view keyword);
  void read_timescale();
  void read_scope();
  void read_variable();
  std::string next(std::string_view where);
  void skip_to_end();
  std::vector<VcdVariable>& declare(const std::string& identifier);
  void name_channels();
  [[noreturn]] void fail(const std::string& what) const;

  TextWords& words_;
  std::string name_;
  std::vector<std::string> scopes_;
  std::vector<Name> names_;
  std::vector<std::string> channels_;
  std::vector<std::vector<VcdVariable>> variables_;
  std::vector<std::int32_t> short_;
  std::unordered_map<std::string, std::size_t> long_;
  std::uint64_t ticks_per_second_ = 0;
  std::size_t left_out_ = 0;
  std::uint64_t comments_ = 0;  // number of bytes in comments, which are not stored and whose number is not limited
};

}  // namespace absenc::capture
