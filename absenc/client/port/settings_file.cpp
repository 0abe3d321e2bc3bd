// SPDX-License-Identifier: Apache-2.0
// Reads absenc.toml. No other file includes toml++, which is slow to compile.
#include "absenc/client/port/settings_file.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>

#include "absenc/client/error.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/text_file.hpp"

namespace absenc::client {

namespace {

constexpr std::array<std::string_view, 4> text_only{"protocol", "model", "bus", "port"};

constexpr const char* variable = "ABSENC_CONFIG";

std::string_view type_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number with a fraction";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

// Returns the entries of the table in the order of the file, so that the first error is reported first; toml++ sorts
// them by name.
std::vector<std::pair<const toml::key*, const toml::node*>> in_file_order(const toml::table& table) {
  std::vector<std::pair<const toml::key*, const toml::node*>> entries;
  for (const auto& [key, node] : table) entries.emplace_back(&key, &node);
  std::sort(entries.begin(), entries.end(), [](const auto& left, const auto& right) {
    return left.first->source().begin < right.first->source().begin;
  });
  return entries;
}

/// Converts one parsed file to its sections, and reports errors with their position.
class SettingsFileReader {
 public:
  explicit SettingsFileReader(const std::string& path) : path_(path) {}

  [[nodiscard]] std::string place(const toml::source_position& position) const {
    return fmt::format("{}:{}:{}", path_, position.line, position.column);
  }

  [[nodiscard]] SettingsFile config(const toml::table& file) const {
    static constexpr std::array<std::string_view, 4> known{"defaults", "bus", "encoder", "serve"};
    SettingsFile config{.path = path_, .defaults = {}, .buses = {}, .encoders = {}, .services = {}};
    for (const auto& [key, node] : in_file_order(file)) {
      if (key->str() == known[0]) {
        config.defaults = section(*key, *node, "[defaults]");
      } else if (key->str() == known[1]) {
        config.buses = sections(*key, *node);
      } else if (key->str() == known[2]) {
        config.encoders = sections(*key, *node);
      } else if (key->str() == known[3]) {
        config.services = sections(*key, *node);
      } else {
        refuse(*key, fmt::format("there is no section \"{}\"{}", key->str(), suggestion(key->str(), known)));
      }
    }
    return config;
  }

 private:
  [[noreturn]] void refuse(const toml::key& key, const std::string& sentence) const {
    throw UsageError(fmt::format("{}: {}", place(key.source().begin), sentence));
  }

  [[nodiscard]] const toml::table& require_table(const toml::key& key, const toml::node& node,
                                                 std::string_view heading) const {
    if (const toml::table* table = node.as_table()) return *table;
    refuse(key, fmt::format("{} is {}, but must be a section: write {}", key.str(), type_of(node), heading));
  }

  [[nodiscard]] std::vector<FileSection> sections(const toml::key& kind, const toml::node& node) const {
    std::vector<FileSection> sections;
    const toml::table& table = require_table(kind, node, fmt::format("[{}.NAME]", kind.str()));
    for (const auto& [key, child] : in_file_order(table)) {
      sections.push_back(section(*key, *child, fmt::format("[{}.{}]", kind.str(), key->str())));
    }
    return sections;
  }

  [[nodiscard]] FileSection section(const toml::key& key, const toml::node& node, std::string_view heading) const {
    FileSection section{std::string(key.str()), {}, place(key.source().begin)};
    for (const auto& [name, value] : in_file_order(require_table(key, node, heading))) {
      section.settings.push_back(setting(*name, *value));
    }
    return section;
  }

  [[nodiscard]] FileSetting setting(const toml::key& key, const toml::node& node) const {
    FileSetting setting{std::string(key.str()), {}, place(key.source().begin), node.is_array()};
    if (const toml::array* list = node.as_array()) {
      for (const toml::node& element : *list) setting.values.push_back(value(key, element));
    } else {
      setting.values.push_back(value(key, node));
    }
    return setting;
  }

  [[nodiscard]] std::string value(const toml::key& key, const toml::node& node) const {
    const bool must_be_text = std::find(text_only.begin(), text_only.end(), key.str()) != text_only.end();
    if (const auto* text = node.as_string()) return text->get();
    if (must_be_text) refuse(key, fmt::format("{} is {}, but must be text in quotes", key.str(), type_of(node)));
    if (const auto* number = node.as_integer()) return fmt::format("{}", number->get());
    if (const auto* real = node.as_floating_point()) return fmt::format("{}", real->get());
    if (const auto* truth = node.as_boolean()) return truth->get() ? "true" : "false";
    refuse(key, fmt::format("{} is {}, but must be text in quotes, a number, true or false", key.str(), type_of(node)));
  }

  std::string path_;
};

std::size_t end_of_string(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool lines = text.substr(at).starts_with(std::string(3, quote));
  for (std::size_t i = at + (lines ? 3 : 1); i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"') {
      ++i;
    } else if (!lines && (text[i] == quote || text[i] == '\n')) {
      return i;
    } else if (lines && text.substr(i).starts_with(std::string(3, quote))) {
      // up to two quotes directly before the three closing quotes belong to the string
      return std::min(text.find_first_not_of(quote, i), i + 5) - 1;
    }
  }
  return text.size();
}

// Refuses deeply nested tables and arrays, because toml++ calls itself once for each level.
void check_depth(std::string_view text, const SettingsFileReader& reader) {
  constexpr std::size_t deepest = 16;
  std::size_t brackets = 0;
  std::size_t dots = 0;  // number of dots in the name of a table or setting that is being read
  for (std::size_t at = 0; at < text.size(); ++at) {
    switch (text[at]) {
      case '#':
        at = std::min(text.find('\n', at), text.size()) - 1;
        break;
      case '"':
      case '\'':
        at = end_of_string(text, at);
        break;
      case '[':
      case '{':
        ++brackets;
        dots = 0;
        break;
      case ']':
      case '}':
        brackets -= std::min<std::size_t>(brackets, 1);
        break;
      case '.':
        ++dots;
        break;
      case '=':
      case ',':
      case '\n':
        dots = 0;
        break;
      default:
        break;
    }
    if (brackets <= deepest && dots <= deepest) continue;
    const std::string_view before = text.substr(0, at);
    const auto line = static_cast<toml::source_index>(std::count(before.begin(), before.end(), '\n') + 1);
    const auto column = static_cast<toml::source_index>(at - (before.rfind('\n') + 1) + 1);
    throw UsageError(fmt::format("{}: this is nested more than {} deep, which nothing in the file needs to be",
                                 reader.place({line, column}), deepest));
  }
}

// Returns the value of the environment variable; "" if it is not set.
std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

const FileSetting* FileSection::find(std::string_view setting) const {
  const auto found =
      std::find_if(settings.begin(), settings.end(), [&](const FileSetting& one) { return one.name == setting; });
  return found == settings.end() ? nullptr : &*found;
}

SettingsFile parse_settings_file(std::string_view text, const std::string& path) {
  const SettingsFileReader reader(path);
  check_depth(text, reader);
  try {
    return reader.config(toml::parse(text, path));
  } catch (const toml::parse_error& error) {
    throw UsageError(fmt::format("{}: this is no TOML: {}", reader.place(error.source().begin), error.description()));
  }
}

std::vector<std::string> settings_file_paths() {
  if (const std::string path = environment(variable); !path.empty()) return {path};
  std::vector<std::string> paths{"absenc.toml"};
  // Ignores a relative path, as the XDG Base Directory Specification requires.
  std::string folder = environment("XDG_CONFIG_HOME");
  if (!folder.starts_with('/')) {
    const std::string home = environment("HOME");
    folder = home.empty() ? "" : home + "/.config";
  }
  if (!folder.empty()) paths.push_back(folder + "/absenc/absenc.toml");
  return paths;
}

std::optional<SettingsFile> load_settings_file() {
  const bool must_exist = !environment(variable).empty();
  for (const std::string& path : settings_file_paths()) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::symlink_status(path, ignored).type() != fs::file_type::not_found) {
      const fs::file_type type = fs::status(path, ignored).type();
      // std::filesystem reports the file type `none` for a symbolic link that leads to itself
      if (type == fs::file_type::not_found || type == fs::file_type::none) {
        throw UsageError(fmt::format("{} is a link that leads to no file: correct it or remove it", path));
      }
      // reading a FIFO or a socket might wait forever for a writer
      if (type == fs::file_type::fifo || type == fs::file_type::socket) {
        throw UsageError(fmt::format("{} is no regular file: write the encoders' names into a file", path));
      }
      try {
        return parse_settings_file(read_text_file("the file of encoders' names", path), path);
      } catch (const Failure& failure) {
        throw UsageError(failure.what());
      }
    }
    if (must_exist) throw UsageError(fmt::format("{}, which {} names, is not there", path, variable));
  }
  return std::nullopt;
}

}  // namespace absenc::client
