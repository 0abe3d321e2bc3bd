// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/man_page.hpp"

#include <fmt/format.h>

#include <array>

#include "absenc/client/port/address.hpp"
#include "tools/absenc/help.hpp"

namespace absenc::tool {

using namespace client;

namespace {

// Names of the pages of docs/ for people who use the command.
constexpr std::array<std::string_view, 12> guide{"read",   "set-up",   "record",   "serve",
                                                 "mqtt",   "tap",      "decode",   "test-a-drive",
                                                 "doctor", "encoders", "firmware", "add-an-encoder"};

std::string tagged(std::string_view tag, std::string_view meaning) {
  return fmt::format(".TP\n\\fB{}\\fR\n{}\n", to_roff(tag), to_roff(meaning));
}

std::string parameters(const Subcommand& subcommand, bool options) {
  std::string text;
  for (const Parameter& parameter : subcommand.parameters) {
    if (parameter.is_option() == options) text += tagged(title(parameter), words(parameter));
  }
  return text;
}

std::string examples(std::span<const Example> examples) {
  std::string text;
  for (const Example& example : examples) {
    text +=
        fmt::format(".PP\n{}:\n.PP\n.RS 4\n.EX\n{}\n.EE\n.RE\n", to_roff(example.meaning), to_roff(example.command));
  }
  return text;
}

std::string verb(const Subcommand& subcommand) {
  std::string text = fmt::format(".SS {}\n\\fB{}\\fR\n", to_roff(subcommand.name), to_roff(usage(subcommand)));
  text += fmt::format(".PP\n{}\n", to_roff(subcommand.summary));
  if (!subcommand.description.empty()) text += fmt::format(".PP\n{}\n", to_roff(subcommand.description));
  text += parameters(subcommand, false) + parameters(subcommand, true) + tagged("--help", "explain this verb");
  return text + examples(subcommand.examples);
}

std::string encoders(std::span<const Unit* const> units) {
  std::string text = "An encoder is its protocol and where it is connected:\n";
  for (const Example& encoder : encoder_examples) text += tagged(encoder.command, encoder.meaning);
  text += ".PP\nThe protocols:\n";
  for (const Unit* unit : units) text += tagged(unit->id, unit->name);
  text += fmt::format(
      ".PP\nOptions stand behind it as \\fB?\\fINAME\\fB=\\fIVALUE\\fB&\\fINAME\\fB=\\fIVALUE\\fR, in quotes that keep "
      "? and & from the shell, or in \\fB\\-\\-option\\fR.\n{} shows those of a protocol. Those of the way to the "
      "encoder are:\n",
      to_roff("`absenc list <protocol>`"));
  for (const LinkParameter& parameter : link_parameters) {
    text += tagged(fmt::format("{}={}", parameter.name, parameter.value),
                   fmt::format("{} (for: {})", parameter.meaning, parameter.port_kinds));
  }
  return text;
}

}  // namespace

std::string to_roff(std::string_view text) {
  std::string roff;
  bool bold = false;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\''))
      roff += "\\&";  // escapes . and ' at the beginning of a line, where roff takes them for a request
    // an empty line becomes a paragraph, because roff would print it with more space
    if (line_begins && c == '\n') roff += ".PP";
    line_begins = c == '\n';
    switch (c) {
      case '\\':
        roff += "\\e";
        break;
      case '-':
        roff += "\\-";
        break;
      case '\'':
        roff += "\\(aq";
        break;
      case '^':
        roff += "\\(ha";
        break;
      case '~':
        roff += "\\(ti";
        break;
      case '`':
        bold = !bold;
        roff += bold ? "\\fB" : "\\fR";
        break;
      default:
        roff += c;
    }
  }
  return bold ? roff + "\\fR" : roff;
}

std::string man_page(std::string_view version, std::span<const Subcommand* const> subcommands,
                     std::span<const Unit* const> units) {
  std::string text = fmt::format(".TH ABSENC 1 \"\" \"absenc {}\" \"User Commands\"\n.ad l\n.nh\n", to_roff(version));
  text += fmt::format(".SH NAME\nabsenc \\- {}\n", to_roff(about));
  text +=
      ".SH SYNOPSIS\n"
      "\\fBabsenc\\fR \\fIverb\\fR ...\n.br\n"
      "\\fBabsenc\\fR [\\fIverb\\fR] \\fB\\-\\-help\\fR\n.br\n"
      "\\fBabsenc \\-\\-version\\fR\n"
      ".SH DESCRIPTION\nData goes to standard output, messages to standard error. The verbs are:\n";
  for (const Subcommand* subcommand : subcommands) text += tagged(subcommand->name, subcommand->summary);
  text += ".SH ENCODERS\n" + encoders(units);
  text += ".SH VERBS\n";
  for (const Subcommand* subcommand : subcommands) text += verb(*subcommand);
  text += ".SH EXAMPLES\n" + examples(general_examples);
  text += ".SH FILES\n";
  for (const Example& file : files) text += tagged(file.command, file.meaning);
  text += ".SH ENVIRONMENT\n";
  for (const Example& variable : environment) text += tagged(variable.command, variable.meaning);
  text += ".SH EXIT STATUS\n";
  for (std::size_t i = 0; i < exit_statuses.size(); ++i) text += tagged(fmt::format("{}", i), exit_statuses[i]);
  text += ".SH SEE ALSO\nThe guide:";
  for (std::string_view page : guide)
    text += fmt::format("\n.BR absenc\\-{} (7){}", page, page == guide.back() ? "" : ",");
  return text + "\n";
}

}  // namespace absenc::tool
