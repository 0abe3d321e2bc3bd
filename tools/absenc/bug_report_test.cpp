// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/bug_report.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <sstream>

#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::tool {
namespace {

using testing::HasSubstr;
using testing::Not;

// Collects the names of fields.
struct Names final : FieldSink {
  void put(const FieldValue& value) override { names.emplace_back(value.info->name); }
  std::vector<std::string> names;
};

std::vector<std::string> words_of(std::string_view text) {
  std::istringstream all{std::string(text)};
  return {std::istream_iterator<std::string>(all), {}};
}

std::string reported(const Unit& unit, const Options& options, const Frame& request, const Frame& reply,
                     ReportedExchanges::SerialNumbers serial_numbers) {
  ReportedExchanges exchanges(unit, options, serial_numbers);
  exchanges.add({.sent = Time{1}, .answered_after = Time{2000}, .request = request, .reply = reply});
  return exchanges.text();
}

TEST(BugReport, MasksEachReplyWithASerialNumberAndNoOther) {
  std::size_t masked = 0;
  std::size_t shown = 0;
  for (const Unit* unit : all_units()) {
    if (unit->link != LinkKind::half_duplex && unit->link != LinkKind::full_duplex) continue;
    for (const Vector& vector : unit->vectors) {
      if (!vector.is_complete() || vector.reply.empty()) continue;
      const Options options = require_options(*unit, {}, words_of(vector.options));
      const WireFrame request{{vector.request.begin(), vector.request.end()}, 0, {}};
      const WireFrame reply{{vector.reply.begin(), vector.reply.end()}, 0, {}};
      Names names;
      if (unit->decode(options, request.frame(), reply.frame(), names) != Error::none) continue;
      const bool has_serial = std::ranges::any_of(names.names, [](const auto& one) { return is_serial_number(one); });
      const std::string text =
          reported(*unit, options, request.frame(), reply.frame(), ReportedExchanges::SerialNumbers::masked);
      const std::string bytes = to_compact_wire_text(unit->link, reply.frame());
      if (has_serial) {
        EXPECT_THAT(text, Not(HasSubstr(bytes))) << vector.id;
        EXPECT_THAT(text, HasSubstr(" masked ")) << vector.id;
        EXPECT_THAT(reported(*unit, options, request.frame(), reply.frame(), ReportedExchanges::SerialNumbers::shown),
                    HasSubstr(bytes));
      } else {
        EXPECT_THAT(text, HasSubstr(bytes)) << vector.id;
      }
      ++(has_serial ? masked : shown);
    }
  }
  EXPECT_GT(masked, 0u);
  EXPECT_GT(shown, 100u);
}

TEST(BugReport, KnowsEachFieldThatIsASerialNumber) {
  std::size_t found = 0;
  for (const Unit* unit : all_units()) {
    for (const FieldInfo& field : unit->fields) {
      const bool is_one =
          field.meaning.starts_with("serial number") || field.name.find("serial") != std::string_view::npos;
      EXPECT_EQ(is_serial_number(field.name), is_one) << unit->id << ": " << field.name;
      found += is_one ? 1 : 0;
    }
  }
  EXPECT_GT(found, 2u);
}

}  // namespace
}  // namespace absenc::tool
