// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <vector>

namespace absenc::tool {

namespace {

// Bash also splits words at : and = unless they are in quotes, and a completion replaces only the last part of a word.
constexpr std::string_view functions = R"bash(
_absenc_file() {
  compopt -o filenames
  mapfile -t COMPREPLY < <(compgen -f -- "$1")
}

_absenc_words() {
  mapfile -t COMPREPLY < <(compgen -W "$1" -- "$2")
}

# Lines of NAME ENCODER: those of absenc.toml.
_absenc_named() {
  local name address more
  absenc list --names 2>/dev/null | while read -r name address more; do
    [[ $name ]] || break
    [[ $name == NAME && $address == ENCODER ]] || printf '%s %s\n' "$name" "$address"
  done
}

# _absenc_protocol_of <protocol, encoder or its name>: sets protocol, '' if there is none such.
_absenc_protocol_of() {
  local name address
  protocol=${1#[\"\']}
  protocol=${protocol#sim:}
  protocol=${protocol%%[:?\"\']*}
  [[ $protocol && " ${_absenc_protocols[*]} " == *" $protocol "* ]] && return
  while read -r name address; do
    [[ $name == "$protocol" ]] || continue
    address=${address#sim:}
    protocol=${address%%[:?]*}
    return
  done < <(_absenc_named)
  protocol=
}

# _absenc_of <models, commands or settings> <of whom> <what is there of it>
_absenc_of() {
  local protocol
  _absenc_protocol_of "$2"
  [[ $protocol ]] || return
  case $1 in
    models) _absenc_words "${_absenc_models[$protocol]-}" "$3" ;;
    commands) _absenc_words "${_absenc_commands[$protocol]-}" "$3" ;;
    settings) _absenc_words "${_absenc_settings[$protocol]-}" "$3" ;;
  esac
}

# _absenc_model_setting <of whom> <...model=what is there of it>
_absenc_model_setting() {
  _absenc_of models "$1" "${2##*model=}"
  COMPREPLY=("${COMPREPLY[@]/#/"${2%model=*}model="}")
}

# A port without a protocol, or a capture.
_absenc_where() {
  local prefixes='ftdi slcan: spi: tcp:'
  case $1 in
    tcp:* | ftdi*) ;;
    spi:* | slcan:*)
      _absenc_file "${1#*:}"
      COMPREPLY=("${COMPREPLY[@]/#/"${1%%:*}:"}")
      ;;
    *)
      _absenc_words "$prefixes" "$1"
      if [[ $1 && ${#COMPREPLY[@]} -gt 0 ]]; then
        compopt -o nospace
      else
        prefixes=("${COMPREPLY[@]}")
        _absenc_file "$1"
        COMPREPLY+=("${prefixes[@]}")
      fi
      ;;
  esac
}

_absenc_encoder() {
  local place=${1#*:} names
  case $1 in
    *[?\&]model=*) _absenc_model_setting "$1" "$1" ;;
    sim:*) _absenc_words "${_absenc_protocols[*]/#/sim:}" "$1" ;;
    *:*)
      if [[ $place == [./]* ]]; then
        _absenc_file "$place"
      else
        compopt -o nospace
        _absenc_words '/ ftdi slcan: spi: tcp:' "$place"
      fi
      COMPREPLY=("${COMPREPLY[@]/#/"${1%%:*}:"}")
      ;;
    *)
      names=$(_absenc_named | cut -d ' ' -f 1)
      _absenc_words "${_absenc_protocols[*]/%/:} ${_absenc_protocols[*]/#/sim:} ${names//[\$\`\\]/}" "$1"
      [[ ${COMPREPLY[*]} == *: ]] && compopt -o nospace
      ;;
  esac
}

# _absenc_value <FILE, PATH, a|b or another name> <what is there of it> <the first argument>
_absenc_value() {
  case $1 in
    FILE | PATH | file) _absenc_file "$2" ;;
    *'|'*) _absenc_words "${1//|/ }" "$2" ;;
    encoder) _absenc_encoder "$2" ;;
    where) _absenc_where "$2" ;;
    model) _absenc_of models "$3" "$2" ;;
    command) _absenc_of commands "$3" "$2" ;;
    setting) _absenc_of settings "$3" "$2" ;;
    NAME=VALUE) [[ $2 == model=* ]] && _absenc_model_setting "$3" "$2" ;;
    protocol) _absenc_words "${_absenc_protocols[*]}" "$2" ;;
    name) _absenc_words "${_absenc_protocols[*]} ${_absenc_names[*]}" "$2" ;;
  esac
}

# _absenc_parameter <words behind the verb>: completes the last.
_absenc_parameter() {
  local option position=0 first=
  while (($# > 1)); do
    option=
    [[ $1 == -* ]] || { ((++position)); first=${first:-$1}; }
    [[ $1 == --* && ${options[$1]+known} ]] && option=$1
    shift
    if [[ -n $option && -n ${options[$option]} ]]; then
      (($# == 1)) && { _absenc_value "${options[$option]}" "$1" "$first"; return; }
      shift
    fi
  done
  if [[ $1 == --*=* ]]; then
    option=${1%%=*}
    [[ ${options[$option]+known} ]] || return
    _absenc_value "${options[$option]}" "${1#*=}" "$first"
    COMPREPLY=("${COMPREPLY[@]/#/$option=}")
  elif [[ $1 == -* ]]; then
    _absenc_words "${!options[*]} --help" "$1"
  else
    ((position < ${#arguments[@]})) || position=$((repeats ? ${#arguments[@]} - 1 : -1))
    ((position < 0)) || _absenc_value "${arguments[position]}" "$1" "$first"
  fi
}

_absenc() {
  local IFS=$' \t\n' words=() word i glued=
  for ((i = 0; i <= COMP_CWORD; ++i)); do
    word=${COMP_WORDS[i]}
    if [[ $word == [:=]* && i -gt 0 ]]; then
      words[-1]+=$word
      glued=yes
    elif [[ $glued ]]; then
      words[-1]+=$word
      glued=
    else
      words+=("$word")
    fi
  done
  word=${words[-1]}
  local quoted=
  [[ $word == [\"\']* ]] && quoted=yes word=${word:1}
  words[-1]=$word

  local arguments=() repeats=0
  local -A options=()
  COMPREPLY=()
  if ((${#words[@]} == 2)); then
    _absenc_words "$_absenc_first_words --help --version" "$word"
  elif ((${#words[@]} > 3)) && _absenc_describe "${words[1]} ${words[2]}"; then
    _absenc_parameter "${words[@]:3}"
  else
    _absenc_describe "${words[1]}" && _absenc_parameter "${words[@]:2}"
    local second_words=
    ((${#words[@]} == 3)) && second_words=$(_absenc_second_words "${words[1]}")
    [[ $second_words ]] && _absenc_words "$second_words" "$word"
  fi

  local breaks=${COMP_WORDBREAKS//[^:=]/}
  [[ $quoted || -z $breaks ]] || COMPREPLY=("${COMPREPLY[@]#"${word%"${word##*["$breaks"]}"}"}")
}

complete -F _absenc absenc
)bash";

std::string_view first_word(std::string_view name) { return name.substr(0, name.find(' ')); }

// Returns the second word of a verb, "read" of "memory read"; "" for a verb of one word.
std::string_view second_word(std::string_view name) {
  return name.substr(std::min(first_word(name).size() + 1, name.size()));
}

// Returns the kind of value that is completed for a parameter, such as "model" or "setting".
std::string_view kind_of(const Subcommand& subcommand, const Parameter& parameter) {
  if (parameter.name == "--model") return "model";
  if (parameter.name == "name" && first_word(subcommand.name) == "config") return "setting";
  return parameter.value.empty() && !parameter.is_option() ? parameter.name : parameter.value;
}

std::string description(const Subcommand& subcommand) {
  std::vector<std::string> arguments;
  std::vector<std::string> options;
  bool repeats = false;
  for (const Parameter& parameter : subcommand.parameters) {
    if (parameter.is_option()) {
      options.push_back(fmt::format("[{}]='{}'", parameter.name, kind_of(subcommand, parameter)));
    } else {
      arguments.push_back(fmt::format("'{}'", kind_of(subcommand, parameter)));
      repeats = repeats || parameter.repeatable;
    }
  }
  return fmt::format("    '{}')\n      arguments=({})\n      options=({})\n      repeats={:d}\n      ;;\n",
                     subcommand.name, fmt::join(arguments, " "), fmt::join(options, " "), repeats);
}

// Returns the declaration of a bash array with an entry for each protocol. It uses -g, because a function may source
// the script.
template <class Names>
std::string by_protocol(std::string_view name, std::span<const Unit* const> units, const Names& names) {
  std::string text = fmt::format("declare -gA _absenc_{}=(\n", name);
  for (const Unit* unit : units) text += fmt::format("  ['{}']='{}'\n", unit->id, fmt::join(names(*unit), " "));
  return text + ")\n";
}

std::vector<std::string_view> model_names(const Unit& unit) {
  std::vector<std::string_view> names;
  for (const Model& model : unit.models) names.push_back(model.name);
  return names;
}

std::vector<std::string_view> command_names(const Unit& unit) {
  std::vector<std::string_view> names;
  for (const Command& command : unit.commands) names.push_back(command.name);
  return names;
}

// Names of several words are left out, because bash would split them.
std::set<std::string_view> known_names(std::span<const Unit* const> units) {
  std::set<std::string_view> names;
  for (const Unit* unit : units) {
    names.insert(unit->known_as.begin(), unit->known_as.end());
    const std::vector<std::string_view> models = model_names(*unit);
    names.insert(models.begin(), models.end());
  }
  std::erase_if(names, [](std::string_view name) { return name.find(' ') != std::string_view::npos; });
  return names;
}

std::vector<std::string_view> setting_names(const Unit& unit) {
  std::vector<std::string_view> names;
  for (const Command& command : unit.commands) {
    const bool alone = command.verb == Verb::config_set && command.reads_back.empty();
    if (command.verb == Verb::config_get || alone) names.push_back(command.name);
  }
  return names;
}

}  // namespace

std::string bash_completion(std::span<const Subcommand* const> subcommands, std::span<const Unit* const> units) {
  std::vector<std::string_view> protocols;
  for (const Unit* unit : units) protocols.push_back(unit->id);
  std::vector<std::string_view> first_words;
  std::string second_words;
  std::string descriptions;
  for (const Subcommand* subcommand : subcommands) {
    const std::string_view first = first_word(subcommand->name);
    const std::string_view second = second_word(subcommand->name);
    if (first_words.empty() || first_words.back() != first) first_words.push_back(first);
    if (!second.empty()) second_words += fmt::format("  [[ $1 == '{}' ]] && echo '{}'\n", first, second);
    descriptions += description(*subcommand);
  }
  std::string text = "# Completion of absenc in bash, made from the tables of its help.\n\n";
  text += fmt::format("_absenc_protocols=({})\n", fmt::join(protocols, " "));
  text += fmt::format("_absenc_names=({})\n", fmt::join(known_names(units), " "));
  text += by_protocol("models", units, model_names) + by_protocol("commands", units, command_names) +
          by_protocol("settings", units, setting_names);
  text += fmt::format("_absenc_first_words='{}'\n\n", fmt::join(first_words, " "));
  text += fmt::format("_absenc_second_words() {{\n{}  return 0\n}}\n\n", second_words);
  text += "# _absenc_describe <verb>: sets what it takes.\n_absenc_describe() {\n  case $1 in\n";
  text += fmt::format("{}    *) return 1 ;;\n  esac\n}}\n", descriptions);
  return text + std::string(functions);
}

}  // namespace absenc::tool
