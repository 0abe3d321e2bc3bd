// SPDX-License-Identifier: Apache-2.0
// Tests those rows of README's table of order codes that set the option `mode`, each with a virtual encoder.
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "absenc/host/session.hpp"
#include "absenc/protocol/raa38/serial/bench_test.hpp"
#include "absenc/protocol/raa38/unit.hpp"
#include "absenc/sim/sim_port.hpp"

namespace absenc::raa38::serial {
namespace {

struct Row {
  std::string paragraph;
  std::string options;
  std::string link;
};

std::string without_marks(std::string text) {
  std::erase(text, '`');
  const auto first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::vector<Row> rows_of_readme() {
  std::ifstream file(ABSENC_SOURCE_DIR "/absenc/protocol/raa38/README.md");
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("| 3.")) continue;
    std::vector<std::string> cells;
    std::istringstream cut(line);
    for (std::string cell; std::getline(cut, cell, '|');) cells.push_back(without_marks(cell));
    if (cells.size() < 5 || cells[3].find("mode=") == std::string::npos) continue;
    rows.push_back({cells[1], cells[3], cells[4]});
  }
  return rows;
}

Options options_of(const std::string& text) {
  std::istringstream words(text);
  std::vector<std::string> settings;
  for (std::string word; words >> word;) settings.push_back(word);
  std::vector<OptionText> texts;
  for (const std::string_view setting : settings) {
    texts.push_back({setting.substr(0, setting.find('=')), setting.substr(setting.find('=') + 1)});
  }
  Options options;
  EXPECT_EQ(resolve_options(serial_unit, {}, texts, options).kind, OptionError::Kind::none) << text;
  return options;
}

void read_and_set_zero(const Row& row, LinkKind kind) {
  const Options options = options_of(row.options);
  testing::Shaft14 shaft;
  shaft.put(0, 383);
  std::vector<std::byte> device_storage(serial_unit.device_storage);
  Device<std::uint8_t>& device = *serial_unit.device(options, shaft, device_storage).bytes;
  device.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  sim::SimPort<std::uint8_t> port(kind, testing::line_of_tests, device);
  std::vector<std::byte> storage(serial_unit.host_storage);
  host::Session<std::uint8_t> session(serial_unit, options, port, storage, host::EchoMode::automatic);
  const auto* read = session.read(*find_command(serial_unit, Verb::read));
  ASSERT_NE(read->reading(), nullptr) << read->detail();
  EXPECT_EQ(read->reading()->singleturn, 383u);
  EXPECT_TRUE(session.confirmed());
  const auto* zero = session.run(*find_command(serial_unit, Verb::zero));
  const bool has_zero = row.options.find("zeroing=") != std::string::npos;
  EXPECT_EQ(zero->error(), has_zero ? Error::none : Error::unsupported) << zero->detail();
  EXPECT_EQ(session.read(*find_command(serial_unit, Verb::read))->reading()->singleturn, has_zero ? 0u : 383u);
  EXPECT_EQ(device.violation_count(), 0u);
}

TEST(Raa38SerialOrders, ReadsAndZeroesEveryOrder) {
  std::set<std::string> paragraphs;
  for (const Row& row : rows_of_readme()) {
    SCOPED_TRACE(row.paragraph + ": " + row.options);
    paragraphs.insert(row.paragraph);
    const bool rs485 = row.paragraph.starts_with("3.1");
    EXPECT_EQ(row.link.find("rs485=off") == std::string::npos, rs485);
    const ExtraWires wires = serial_unit.extra_wires(options_of(row.options));
    EXPECT_EQ(row.link.find("trigger=") != std::string::npos, wires.trigger);
    EXPECT_EQ(row.link.find("clear=") != std::string::npos, wires.clear);
    read_and_set_zero(row, rs485 ? LinkKind::half_duplex : LinkKind::full_duplex);
  }
  EXPECT_EQ(paragraphs.size(), 16u);
}

}  // namespace
}  // namespace absenc::raa38::serial
