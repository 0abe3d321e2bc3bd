// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/port/settings_file.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "absenc/client/configuration/settings_parser.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/named_encoder.hpp"

namespace absenc::client {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

NamedEncoders names_of(std::string_view text) { return NamedEncoders(parse_settings_file(text, "file")); }
SettingsFile read(std::string_view text) { return names_of(text).file(); }

std::string refusal(std::string_view text) {
  try {
    const NamedEncoders names = names_of(text);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "accepted";
}

std::string refusal_of(std::string_view line) {
  return refusal("[encoder.elbow]\nprotocol = \"tformat\"\nport = \"sim\"\n" + std::string(line));
}

TEST(SettingsFile, ValuesAreTextsInTheOrderOfTheFile) {
  const SettingsFile config = parse_settings_file(
      "[encoder.wrist]\n"
      "strict = false\n"
      "  encoder_id = 0x17\n"
      "alarm = [\"over_heat\", \"battery_alarm\"]\n"
      "[encoder.elbow]\n"
      "[bus.arm]\n"
      "[defaults]\n"
      "latency = 5\n",
      "file");
  EXPECT_EQ(config.path, "file");
  ASSERT_EQ(config.encoders.size(), 2u);
  EXPECT_EQ(config.encoders[0].name, "wrist");
  EXPECT_EQ(config.encoders[1].name, "elbow");
  EXPECT_EQ(config.encoders[1].place, "file:5:10");
  const std::vector<FileSetting>& settings = config.encoders[0].settings;
  ASSERT_EQ(settings.size(), 3u);
  EXPECT_EQ(settings[0].name, "strict");
  EXPECT_THAT(settings[0].values, ElementsAre("false"));
  EXPECT_EQ(settings[1].place, "file:3:3");
  EXPECT_THAT(settings[1].values, ElementsAre("23"));
  EXPECT_FALSE(settings[1].is_list);
  EXPECT_THAT(settings[2].values, ElementsAre("over_heat", "battery_alarm"));
  EXPECT_TRUE(settings[2].is_list);
  EXPECT_EQ(config.buses.at(0).name, "arm");
  ASSERT_NE(config.defaults.find("latency"), nullptr);
  EXPECT_THAT(config.defaults.find("latency")->values, ElementsAre("5"));
  EXPECT_EQ(config.defaults.find("echo"), nullptr);
}

TEST(SettingsFile, AnEmptyFileIsOne) { EXPECT_TRUE(read("# nothing yet\n").encoders.empty()); }

TEST(SettingsFile, SyntaxErrorsHaveAPlace) {
  EXPECT_THAT(refusal("[encoder.elbow\n"), AllOf(StartsWith("file:1:15: "), HasSubstr("expected ']'")));
  EXPECT_THAT(refusal("\n[encoder.elbow]\nport = sim\n"), StartsWith("file:3:8: "));
  EXPECT_THAT(refusal_of("port = \"/dev/ttyUSB0\"\n"), AllOf(StartsWith("file:4:"), HasSubstr("redefine")));
  EXPECT_THAT(refusal_of("[encoder.elbow]\n"), AllOf(StartsWith("file:4:"), HasSubstr("redefine")));
}

TEST(SettingsFile, Sections) {
  EXPECT_THAT(refusal("[encoders.elbow]\n"), AllOf(StartsWith("file:1:2: "), HasSubstr("did you mean encoder?")));
  EXPECT_THAT(refusal("latency = 5\n"), AllOf(StartsWith("file:1:1: "), HasSubstr("no section \"latency\"")));
  EXPECT_THAT(refusal("encoder = 3\n"), AllOf(StartsWith("file:1:1: "), HasSubstr("[encoder.NAME]")));
  EXPECT_THAT(refusal("[bus]\narm = \"sim\"\n"), AllOf(StartsWith("file:2:1: "), HasSubstr("[bus.arm]")));
  EXPECT_THAT(refusal("[[defaults]]\n"), AllOf(StartsWith("file:1:3: "), HasSubstr("[defaults]")));
}

TEST(SettingsFile, Services) {
  const SettingsFile config = read("[serve.mqtt]\nbroker = \"mqtt://hall\"\nspool_mb = 5\n[serve.udp]\nto = \"a:1\"\n");
  ASSERT_EQ(config.services.size(), 2u);
  EXPECT_EQ(config.services[0].name, "mqtt");
  ASSERT_NE(config.services[0].find("spool_mb"), nullptr);
  EXPECT_THAT(config.services[0].find("spool_mb")->values, ElementsAre("5"));
  EXPECT_EQ(config.services[1].place, "file:4:8");
  EXPECT_THAT(refusal("[serve]\nmqtt = 3\n"), AllOf(StartsWith("file:2:1: "), HasSubstr("[serve.mqtt]")));
}

TEST(SettingsFile, Types) {
  EXPECT_THAT(refusal_of("bus = 3\n"), AllOf(StartsWith("file:4:1: "), HasSubstr("bus is a whole number")));
  EXPECT_THAT(refusal_of("model = true\n"), AllOf(StartsWith("file:4:1: "), HasSubstr("text in quotes")));
  EXPECT_THAT(refusal_of("model = 2.5\n"), HasSubstr("model is a number with a fraction"));
  EXPECT_THAT(refusal_of("latency = {ms = 2}\n"), HasSubstr("latency is a table"));
  EXPECT_THAT(refusal_of("latency = 2026-01-01\n"), HasSubstr("latency is a date"));
  EXPECT_THAT(refusal_of("alarm = [\"over_heat\", [\"over_heat\"]]\n"), HasSubstr("alarm is a list"));
  EXPECT_THAT(refusal_of("echo = [\"on\"]\n"), AllOf(StartsWith("file:4:1: "), HasSubstr("must be one value")));
  EXPECT_THAT(refusal_of("fault = [\"drop=0.1\", \"echo=1\"]\n"), "accepted");
}

TEST(SettingsFile, UnknownSettings) {
  EXPECT_THAT(refusal_of("modle = \"23-bit\"\n"), AllOf(StartsWith("file:4:1: "), HasSubstr("did you mean model?")));
  EXPECT_THAT(refusal_of("single_turn_bits = 17\n"), HasSubstr("did you mean singleturn_bits?"));
  EXPECT_THAT(refusal_of("latnecy = 17\n"), HasSubstr("did you mean latency?"));
  EXPECT_THAT(refusal_of("[defaults]\nlatnecy = 17\n"), AllOf(StartsWith("file:5:1: "), HasSubstr("mean latency?")));
  EXPECT_THAT(refusal_of("[defaults]\nport = \"sim\"\n"), HasSubstr("[defaults] has no setting \"port\""));
  EXPECT_THAT(refusal_of("[bus.arm]\nport = \"sim\"\nstrict = false\n"),
              AllOf(StartsWith("file:6:1: "), HasSubstr("a bus has no setting \"strict\"")));
}

TEST(SettingsFile, Encoders) {
  EXPECT_THAT(refusal_of("[encoder.b]\nprotocol = \"tfromat\"\n"),
              AllOf(StartsWith("file:5:1: "), HasSubstr("did you mean tformat?")));
  EXPECT_THAT(refusal_of("[encoder.b]\nport = \"sim\"\n"), AllOf(StartsWith("file:4:10: "), HasSubstr("no protocol")));
  EXPECT_THAT(refusal_of("[encoder.b]\nprotocol = \"tformat\"\n"),
              AllOf(StartsWith("file:4:10: "), HasSubstr("neither a port nor a bus")));
  EXPECT_THAT(refusal_of("bus = \"arm\"\n[bus.arm]\nport = \"sim\"\n"),
              AllOf(StartsWith("file:4:1: "), HasSubstr("a port and a bus")));
  EXPECT_THAT(refusal_of("[bus.arm]\nbaud = 9600\n"), AllOf(StartsWith("file:4:6: "), HasSubstr("arm has no port")));
  EXPECT_THAT(refusal_of("[encoder.b]\nprotocol = \"tformat\"\nbus = \"amr\"\n[bus.arm]\nport = \"sim\"\n"),
              AllOf(StartsWith("file:6:1: "), HasSubstr("did you mean arm?")));
}

TEST(SettingsFile, NamesThatCouldNotBeUsed) {
  for (const std::string name : {"tformat", "sim", "\"\"", "-x", "\"a:b\"", "\"a/b\"", "\"a?b\""}) {
    const std::string text = "[encoder." + name + "]\nprotocol = \"tformat\"\nport = \"sim\"\n";
    EXPECT_THAT(refusal(text), AllOf(StartsWith("file:1:10: "), HasSubstr("name"))) << name;
  }
}

TEST(NamedEncoder, TheNearestOverrides) {
  const NamedEncoders names = names_of(
      "[defaults]\nlatency = 1\nbaud = 1\necho = \"on\"\n"
      "[bus.arm]\nport = \"tcp:host:4001\"\nlatency = 2\nbaud = 2\n"
      "[encoder.elbow]\nprotocol = \"tformat\"\nbus = \"arm\"\nlatency = 3\n");
  const NamedEncoder named = names.require("elbow");
  EXPECT_EQ(named.address, "tformat:tcp:host:4001");
  EXPECT_EQ(named.place, "file:6:1");
  ASSERT_EQ(named.settings.size(), 2u);
  EXPECT_EQ(named.settings[0].name, "latency");
  EXPECT_THAT(named.settings[0].values, ElementsAre("3"));
  EXPECT_EQ(named.settings[1].name, "baud");
  EXPECT_THAT(named.settings[1].values, ElementsAre("2"));
  ASSERT_EQ(named.defaults.size(), 1u);
  EXPECT_EQ(named.defaults[0].name, "echo");
}

TEST(NamedEncoder, SimIsAPort) {
  const NamedEncoders names = names_of("[encoder.elbow]\nprotocol = \"tformat\"\nport = \"sim\"\n");
  EXPECT_EQ(names.require("elbow").address, "sim:tformat");
  EXPECT_THROW((void)names.require("elbwo"), UsageError);
}

class Environment : public testing::Test {
 protected:
  void TearDown() override {
    for (const char* name : {"ABSENC_CONFIG", "XDG_CONFIG_HOME"}) unsetenv(name);
    setenv("HOME", home_.c_str(), 1);
  }

  std::string home_ = std::getenv("HOME") != nullptr ? std::getenv("HOME") : "";
};

TEST_F(Environment, WhereTheFileIsLookedFor) {
  unsetenv("ABSENC_CONFIG");
  unsetenv("XDG_CONFIG_HOME");
  setenv("HOME", "/home/me", 1);
  EXPECT_THAT(settings_file_paths(), ElementsAre("absenc.toml", "/home/me/.config/absenc/absenc.toml"));
  setenv("XDG_CONFIG_HOME", "/xdg", 1);
  EXPECT_THAT(settings_file_paths(), ElementsAre("absenc.toml", "/xdg/absenc/absenc.toml"));
  setenv("XDG_CONFIG_HOME", "relative", 1);
  EXPECT_THAT(settings_file_paths(), ElementsAre("absenc.toml", "/home/me/.config/absenc/absenc.toml"));
  setenv("HOME", "", 1);
  EXPECT_THAT(settings_file_paths(), ElementsAre("absenc.toml"));
  setenv("ABSENC_CONFIG", "/mine.toml", 1);
  EXPECT_THAT(settings_file_paths(), ElementsAre("/mine.toml"));
  setenv("ABSENC_CONFIG", "", 1);
  EXPECT_THAT(settings_file_paths(), ElementsAre("absenc.toml"));
}

TEST(SettingsFile, MayStateItsVersion) {
  const std::string rest = "[encoder.elbow]\nprotocol = \"tformat\"\nport = \"sim\"\n";
  EXPECT_EQ(refusal("version = 1\n" + rest), "accepted");
  EXPECT_THAT(refusal("version = 2\n" + rest),
              AllOf(StartsWith("file:1:1: the file is of format 2"), HasSubstr("use a newer absenc")));
  EXPECT_THAT(refusal("version = \"x\"\n" + rest), HasSubstr("must be the whole number 1"));
}

}  // namespace
}  // namespace absenc::client
