// SPDX-License-Identifier: Apache-2.0
// Options and fields as JSON and as the rows of a table.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absenc/client/row.hpp"
#include "absenc/client/text/row_text.hpp"
#include "absenc/client/text/unit_text.hpp"

namespace absenc::tool {

using namespace client;

/// {"singleturn_bits":17,...}
[[nodiscard]] Json options_to_json(const Unit& unit, const Options& options);

/// Puts fields into a JSON object; with a reading, behind what does not hold `singleturn_valid` and the like: false, or
/// null where nobody has reported whether it holds. What has no such field holds.
struct JsonFields final : FieldSink {
  void put(const FieldValue& value) override;
  void put_reading(const Reading& reading) override;
  Json fields = Json::object();

 private:
  struct Judged {
    const FieldInfo* info;
    Validity validity;
  };
  std::vector<Judged> judged_;
};

/// For `table`: name, value, unit or meaning; a row for each flag that is set.
[[nodiscard]] std::vector<std::vector<std::string>> to_table(const Row& row);

/// Puts fields into the rows of a table: name, value, unit or meaning; a row for each flag that is set.
struct FieldTable final : FieldSink {
  void put(const FieldValue& value) override;
  void put_reading(const Reading& reading) override;
  std::vector<std::vector<std::string>> rows;

 private:
  struct Judged {
    const FieldInfo* info;
    std::size_t row;
  };
  void put_flags(const FieldInfo& field, std::uint64_t bits);

  std::vector<Judged> judged_;
  std::vector<std::pair<std::size_t, const FlagInfo*>> sends_to_alarms_;  // rows of flags whose action that is
  bool shows_alarms_ = false;
};

}  // namespace absenc::tool
