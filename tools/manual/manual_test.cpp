// SPDX-License-Identifier: Apache-2.0
// Tests the man page and the bash completion of a command that this test defines.
#include <gmock/gmock-more-matchers.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absenc/protocol/all.hpp"
#include "tools/manual/completion.hpp"
#include "tools/manual/man_page.hpp"

namespace absenc::tool {

namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;
using testing::UnorderedElementsAre;

int run_nothing(const Invocation&) { return 0; }

constexpr std::array<Parameter, 4> parameters{{
    {"encoder", "", "the first", "", true},
    {"protocol", "", "all that follow", "", false, true},
    {"--order", "little|big", ".which byte comes first", "little"},
    {"--quiet", "", "'nothing' is said"},
}};
constexpr std::array<Example, 1> examples{{{"absenc memory write 'a\\b' ~/-x ^", "what roff would take for its own"}}};

constexpr Subcommand make(std::string_view name, std::string_view description = "") {
  return {name, "do it", description, parameters, examples, run_nothing};
}

constexpr Subcommand read = make("read");
constexpr Subcommand memory = make("memory");
constexpr Subcommand memory_read = make("memory read", "One line,\n.another line.\n\nAnd `absenc list`.");
constexpr Subcommand memory_write = make("memory write");

constexpr std::array<Parameter, 2> of_encoder{{{"encoder", "", "who", "", true}, {"command", "", "what", "", true}}};
constexpr std::array<Parameter, 3> of_protocol{{{"protocol", "", "which", "", true},
                                                {"--model", "NAME", "of it"},
                                                {"--option", "NAME=VALUE", "of it", "", false, true}}};
constexpr std::array<Parameter, 2> of_setting{{{"encoder", "", "who", "", true}, {"name", "", "of a setting"}}};
constexpr std::array<Parameter, 1> of_place{{{"where", "", "a port or a capture"}}};
constexpr Subcommand run{"run", "do it", "", of_encoder, examples, run_nothing};
constexpr Subcommand emulate{"emulate", "do it", "", of_protocol, examples, run_nothing};
constexpr Subcommand identify{"identify", "do it", "", of_place, examples, run_nothing};
constexpr Subcommand config_get{"config get", "do it", "", of_setting, examples, run_nothing};
constexpr std::array<const Subcommand*, 8> subcommands{&read, &memory,  &memory_read, &memory_write,
                                                       &run,  &emulate, &identify,    &config_get};

std::string page() { return man_page("1.2-3", subcommands, all_units()); }

// Returns the completions that bash offers for the last of `words`; ':' and '=' are words of their own.
std::vector<std::string> complete(const std::string& words) {
  std::string folder = std::filesystem::temp_directory_path() / "absenc-manual-XXXXXX";
  if (::mkdtemp(folder.data()) == nullptr) return {"no folder"};
  const std::string script = folder + "/completion";
  std::ofstream(script) << bash_completion(subcommands, all_units()) << "compopt() { :; }\nCOMP_WORDBREAKS=' :='\n"
                        << "absenc() { [[ \"$*\" == 'list --names' ]] && printf '%s\\n' 'NAME   ENCODER   MODEL' "
                        << "'elbow  tformat:/dev/x  23-bit' 'desk   sim:esl' '' 'They are written in absenc.toml.'; }\n"
                        << "COMP_WORDS=(" << words << ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
                        << "_absenc absenc\n((${#COMPREPLY[@]})) && printf '%s\\n' \"${COMPREPLY[@]}\"\n";
  std::vector<std::string> replies;
  if (std::FILE* output = ::popen(("bash -u " + script + " 2>&1").c_str(), "r")) {
    std::array<char, 1000> line{};
    while (std::fgets(line.data(), line.size(), output) != nullptr) {
      replies.emplace_back(line.data());
      replies.back().pop_back();
    }
    ::pclose(output);
  }
  std::filesystem::remove_all(folder);
  return replies;
}

TEST(ToRoff, KeepsWhatRoffWouldTakeForItsOwn) {
  EXPECT_EQ(to_roff(".TH a\n'b'\n...c"), "\\&.TH a\n\\&\\(aqb\\(aq\n\\&...c");
  EXPECT_EQ(to_roff("a.b\\n -x ^~"), "a.b\\en \\-x \\(ha\\(ti");
}

TEST(ToRoff, IsBoldBetweenBackquotes) {
  EXPECT_EQ(to_roff("see `absenc list`, or"), "see \\fBabsenc list\\fR, or");
  EXPECT_EQ(to_roff("`open"), "\\fBopen\\fR");
}

TEST(ToRoff, ParagraphsAreNoEmptyLines) { EXPECT_EQ(to_roff("a\n\nb\n\n.c"), "a\n.PP\nb\n.PP\n\\&.c"); }

TEST(ManPage, HasTheVersionAndEveryProtocol) {
  EXPECT_THAT(page(), HasSubstr(".TH ABSENC 1 \"\" \"absenc 1.2\\-3\""));
  for (const Unit* unit : all_units()) EXPECT_THAT(page(), HasSubstr("\\fB" + to_roff(unit->id) + "\\fR\n"));
}

TEST(ManPage, HasASectionForAVerbOfTwoWords) {
  EXPECT_THAT(page(), HasSubstr(".SS memory read\n\\fBabsenc memory read <encoder> [<protocol>...] [options]\\fR\n"));
  EXPECT_THAT(page(), HasSubstr("One line,\n\\&.another line.\n.PP\nAnd \\fBabsenc list\\fR.\n"));
  EXPECT_THAT(page(), HasSubstr("\\fB\\-\\-order little|big\\fR\n\\&.which byte comes first (default: little)\n"));
  EXPECT_THAT(page(), HasSubstr("\nabsenc memory write \\(aqa\\eb\\(aq \\(ti/\\-x \\(ha\n"));
}

TEST(ManPage, HasNoEmptyLine) { EXPECT_THAT(page(), Not(HasSubstr("\n\n"))); }

TEST(Completion, OffersEachFirstWordOnce) {
  EXPECT_THAT(complete("absenc ''"),
              ElementsAre("read", "memory", "run", "emulate", "identify", "config", "--help", "--version"));
  EXPECT_THAT(complete("absenc me"), ElementsAre("memory"));
  EXPECT_THAT(complete("absenc --v"), ElementsAre("--version"));
}

TEST(Completion, OffersSecondWords) {
  EXPECT_THAT(complete("absenc memory r"), ElementsAre("read"));
  EXPECT_THAT(complete("absenc memory w"), ElementsAre("write"));
  EXPECT_THAT(complete("absenc read w"), IsEmpty());
}

TEST(Completion, OffersOptionsAndTheirValues) {
  EXPECT_THAT(complete("absenc memory write -"), UnorderedElementsAre("--order", "--quiet", "--help"));
  EXPECT_THAT(complete("absenc memory write --order ''"), ElementsAre("little", "big"));
  EXPECT_THAT(complete("absenc memory write --order = b"), ElementsAre("big"));
  EXPECT_THAT(complete("absenc read --order = ''"), ElementsAre("little", "big"));
  EXPECT_THAT(complete("absenc read --quiet sim"), Not(IsEmpty()));
  EXPECT_THAT(complete("absenc nothing -"), IsEmpty());
}

TEST(Completion, OffersArgumentsByTheirPlace) {
  const std::string id(all_units()[0]->id);
  EXPECT_THAT(complete("absenc memory write sim : " + id), ElementsAre(id));
  EXPECT_THAT(complete("absenc memory write --order big sim : " + id + " " + id), ElementsAre(id));
  EXPECT_THAT(complete("absenc memory write sim : " + id + " x y " + id), ElementsAre(id));
  EXPECT_THAT(complete("absenc memory write \\\"sim:" + id), ElementsAre("sim:" + id));
}

TEST(Completion, OffersTheNamesOfAbsencToml) {
  EXPECT_THAT(complete("absenc read ''"), IsSupersetOf({"elbow", "desk", "tformat:", "sim:tformat"}));
  EXPECT_THAT(complete("absenc read el"), ElementsAre("elbow"));
  EXPECT_THAT(complete("absenc read They"), IsEmpty());
  EXPECT_THAT(complete("absenc run desk position-"), ElementsAre("position-short"));
}

TEST(Completion, OffersModelsCommandsAndSettings) {
  EXPECT_THAT(complete("absenc emulate tformat --model ''"), ElementsAre("TS5700N8500", "23-bit"));
  EXPECT_THAT(complete("absenc emulate tformat --model = 2"), ElementsAre("23-bit"));
  EXPECT_THAT(complete("absenc emulate tformat --option model = 2"), ElementsAre("23-bit"));
  EXPECT_THAT(complete("absenc emulate nothing --model ''"), IsEmpty());
  EXPECT_THAT(complete("absenc run sim : tformat memory-"), ElementsAre("memory-read", "memory-write"));
  EXPECT_THAT(complete("absenc run \\\"sim:tformat?model=23-bit\\\" memory-r"), ElementsAre("memory-read"));
  EXPECT_THAT(complete("absenc run elbow memory-r"), ElementsAre("memory-read"));
  EXPECT_THAT(complete("absenc read sim : tformat?model = 2"), ElementsAre("23-bit"));
  EXPECT_THAT(complete("absenc config get elbow over"), ElementsAre("overheat-threshold"));
}

TEST(Completion, OffersWhereToIdentify) {
  EXPECT_THAT(complete("absenc identify t"), ElementsAre("tcp:"));
  EXPECT_THAT(complete("absenc identify /de"), ElementsAre("/dev"));
  EXPECT_THAT(complete("absenc identify spi : /de"), ElementsAre("/dev"));
}

TEST(Completion, RunsNothingOfWhatIsWritten) {
  const std::vector<std::string> commands{"'$(echo x >&2)'",    "'$(echo x >&2):'",  "'sim:$(echo x >&2)'",
                                          "'x:/$(echo x >&2)'", "'--$(echo x >&2)'", "'--order=$(echo x >&2)'",
                                          "'--$(echo x >&2)=a'"};
  for (const std::string& word : commands) {
    EXPECT_THAT(complete("absenc " + word), Not(Contains("x")));
    EXPECT_THAT(complete("absenc read " + word), Not(Contains("x")));
    EXPECT_THAT(complete("absenc read " + word + " ?"), Not(Contains("x")));
    EXPECT_THAT(complete("absenc memory " + word + " ?"), Not(Contains("x")));
    EXPECT_THAT(complete("absenc identify " + word), Not(Contains("x")));
    EXPECT_THAT(complete("absenc run " + word + " ?"), Not(Contains("x")));
    EXPECT_THAT(complete("absenc emulate " + word + " --model ?"), Not(Contains("x")));
    EXPECT_THAT(complete("absenc emulate " + word + " --option model=?"), Not(Contains("x")));
  }
}

}  // namespace

}  // namespace absenc::tool
