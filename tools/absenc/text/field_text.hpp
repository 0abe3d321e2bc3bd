// SPDX-License-Identifier: Apache-2.0
// Prints options and fields as JSON or as rows of a table.
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

/// Returns the options of a unit as a JSON object like {"singleturn_bits":17,...}.
[[nodiscard]] Json options_to_json(const Unit& unit, const Options& options);

/// Puts decoded fields into a JSON object. A field that may be invalid gets a further key such as `singleturn_valid`.
struct JsonFields final : FieldSink {
  void put(const FieldValue& value) override;
  void put_reading(const Reading& reading) override;
  Json fields = Json::object();

 private:
  struct ValidatedField {
    const FieldInfo* info;
    Validity validity;
  };
  std::vector<ValidatedField> judged_;
};

/// Returns the rows of `table`: name, value with unit, and meaning of each field, and one more row for each set flag.
[[nodiscard]] std::vector<std::vector<std::string>> to_table(const Row& row);

/// Makes rows of a table from decoded fields: name, value with unit, and meaning of each field; one more row for each
/// set flag.
struct FieldTable final : FieldSink {
  void put(const FieldValue& value) override;
  void put_reading(const Reading& reading) override;
  std::vector<std::vector<std::string>> rows;

 private:
  struct ValidatedRow {
    const FieldInfo* info;
    std::size_t row;
  };
  void put_flags(const FieldInfo& field, std::uint64_t bits);

  std::vector<ValidatedRow> judged_;
  // number of the row, and the flag, for each flag whose advice is to read the alarms
  std::vector<std::pair<std::size_t, const FlagInfo*>> sends_to_alarms_;
  bool shows_alarms_ = false;
};

}  // namespace absenc::tool
