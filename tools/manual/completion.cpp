// SPDX-License-Identifier: Apache-2.0
#include "tools/manual/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

namespace absenc::tool {

namespace {

// Bash splits words at : and = too. `word` is put together again as the user wrote it, and what stands before the last
// of these is taken from the replies: bash replaces only the rest. Between quotes it does not split.
constexpr std::string_view functions = R"bash(
_absenc_file() {
  compopt -o filenames
  mapfile -t COMPREPLY < <(compgen -f -- "$1")
}

_absenc_words() {
  mapfile -t COMPREPLY < <(compgen -W "$1" -- "$2")
}

_absenc_encoder() {
  local place=${1#*:}
  case $1 in
    sim:*) _absenc_words "${_absenc_protocols[*]/#/sim:}" "$1" ;;
    *:*)
      if [[ $place == [./]* ]]; then
        _absenc_file "$place"
      else
        compopt -o nospace
        _absenc_words '/ slcan: spi: tcp:' "$place"
      fi
      COMPREPLY=("${COMPREPLY[@]/#/"${1%%:*}:"}")
      ;;
    *)
      _absenc_words "${_absenc_protocols[*]/%/:} ${_absenc_protocols[*]/#/sim:}" "$1"
      [[ ${COMPREPLY[*]} == *: ]] && compopt -o nospace
      ;;
  esac
}

# _absenc_value <FILE, PATH, a|b or another name> <what is there of it>
_absenc_value() {
  case $1 in
    FILE | PATH | file) _absenc_file "$2" ;;
    *'|'*) _absenc_words "${1//|/ }" "$2" ;;
    encoder) _absenc_encoder "$2" ;;
    protocol) _absenc_words "${_absenc_protocols[*]}" "$2" ;;
  esac
}

# _absenc_parameter <words behind the verb>: completes the last.
_absenc_parameter() {
  local option position=0
  while (($# > 1)); do
    option=
    [[ $1 == -* ]] || ((++position))
    [[ $1 == --* && ${options[$1]+known} ]] && option=$1
    shift
    if [[ -n $option && -n ${options[$option]} ]]; then
      (($# == 1)) && { _absenc_value "${options[$option]}" "$1"; return; }
      shift
    fi
  done
  if [[ $1 == --*=* ]]; then
    option=${1%%=*}
    [[ ${options[$option]+known} ]] || return
    _absenc_value "${options[$option]}" "${1#*=}"
    COMPREPLY=("${COMPREPLY[@]/#/$option=}")
  elif [[ $1 == -* ]]; then
    _absenc_words "${!options[*]} --help" "$1"
  else
    ((position < ${#arguments[@]})) || position=$((repeats ? ${#arguments[@]} - 1 : -1))
    ((position < 0)) || _absenc_value "${arguments[position]}" "$1"
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

// What stands behind the first word: "read" of "memory read".
std::string_view second_word(std::string_view name) {
  return name.substr(std::min(first_word(name).size() + 1, name.size()));
}

std::string description(const Subcommand& subcommand) {
  std::vector<std::string> arguments;
  std::vector<std::string> options;
  bool repeats = false;
  for (const Parameter& parameter : subcommand.parameters) {
    if (parameter.is_option()) {
      options.push_back(fmt::format("[{}]='{}'", parameter.name, parameter.value));
    } else {
      arguments.push_back(fmt::format("'{}'", parameter.value.empty() ? parameter.name : parameter.value));
      repeats = repeats || parameter.repeatable;
    }
  }
  return fmt::format("    '{}')\n      arguments=({})\n      options=({})\n      repeats={:d}\n      ;;\n",
                     subcommand.name, fmt::join(arguments, " "), fmt::join(options, " "), repeats);
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
  text += fmt::format("_absenc_first_words='{}'\n\n", fmt::join(first_words, " "));
  text += fmt::format("_absenc_second_words() {{\n{}  return 0\n}}\n\n", second_words);
  text += "# _absenc_describe <verb>: sets what it takes.\n_absenc_describe() {\n  case $1 in\n";
  text += fmt::format("{}    *) return 1 ;;\n  esac\n}}\n", descriptions);
  return text + std::string(functions);
}

}  // namespace absenc::tool
