// SPDX-License-Identifier: Apache-2.0
#include "tests/kit/frames.hpp"

#include <algorithm>
#include <array>

#include "absenc/protocol/vector_check.hpp"

namespace absenc::kit {

std::size_t OwnedFrame::elements() const {
  if (can) return can->size;
  return carries_bits(link) ? bits : bytes.size();
}

std::size_t OwnedFrame::bit_count() const {
  if (can) return std::size_t{8} * can->size;
  return carries_bits(link) ? bits : 8 * bytes.size();
}

OwnedFrame OwnedFrame::cut(std::size_t count) const {
  OwnedFrame shorter = *this;
  if (can) {
    shorter.can->size = static_cast<std::uint8_t>(count);
    std::fill(shorter.can->data.begin() + static_cast<std::ptrdiff_t>(count), shorter.can->data.end(), std::uint8_t{0});
  } else if (carries_bits(link)) {
    shorter.bits = count;
    shorter.bytes.resize((count + 7) / 8);
    if (count % 8 != 0) shorter.bytes.back() = static_cast<std::uint8_t>(shorter.bytes.back() & 0xFF00u >> count % 8);
  } else {
    shorter.bytes.resize(count);
  }
  return shorter;
}

OwnedFrame OwnedFrame::flipped(std::size_t bit) const {
  OwnedFrame other = *this;
  std::uint8_t& byte = can ? other.can->data[bit / 8] : other.bytes[bit / 8];
  byte = static_cast<std::uint8_t>(byte ^ (carries_bits(link) ? 0x80u >> bit % 8 : 1u << bit % 8));
  return other;
}

OwnedFrame OwnedFrame::between(Bytes before, Bytes after) const {
  OwnedFrame longer = *this;
  longer.bytes.insert(longer.bytes.begin(), before.begin(), before.end());
  longer.bytes.insert(longer.bytes.end(), after.begin(), after.end());
  return longer;
}

void OwnedFrame::append(BitView more) {
  for (std::size_t i = 0; i < more.size; ++i, ++bits) {
    if (bits % 8 == 0) bytes.push_back(0);
    if (more[i]) bytes.back() = static_cast<std::uint8_t>(bytes.back() | 0x80u >> bits % 8);
  }
}

OwnedFrame frame_of(const Unit& unit, Bytes text) {
  OwnedFrame frame{.link = unit.link};
  if (text.empty()) return frame;
  if (unit.link == LinkKind::can) {
    frame.can = can_frame_of_text(text);
  } else if (carries_bits(unit.link)) {
    frame.bits = text.size();
    frame.bytes.resize((text.size() + 7) / 8);
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '1') frame.bytes[i / 8] = static_cast<std::uint8_t>(frame.bytes[i / 8] | 0x80u >> i % 8);
    }
  } else {
    frame.bytes.assign(text.begin(), text.end());
  }
  return frame;
}

void ReportedFields::put(const FieldValue& value) {
  std::string name(value.info->name);
  for (unsigned number = 2; fields.contains(name); ++number) {
    name = std::string(value.info->name) + "#" + std::to_string(number);
  }
  fields[name] = {value.number, static_cast<float>(value.real), std::string(value.bytes.begin(), value.bytes.end()),
                  value.info->role};
}

bool ReportedFields::has_position() const { return !numbers(Role::position).empty() || !numbers(Role::turns).empty(); }

std::vector<std::int64_t> ReportedFields::numbers(Role role) const {
  std::vector<std::int64_t> found;
  for (const auto& [name, value] : fields) {
    if (value.role == role) found.push_back(value.number);
  }
  return found;
}

std::map<std::string, Value> expected_fields(const Vector& vector) {
  std::map<std::string, Value> fields;
  for (const Expected& one : vector.fields) {
    fields[std::string(one.field)] = {one.number, static_cast<float>(one.real), std::string(one.text)};
  }
  return fields;
}

std::optional<Options> options_of(const Unit& unit, std::string_view text) {
  std::vector<OptionText> settings;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), one.size() + 1));
    settings.push_back({one.substr(0, one.find('=')), one.substr(one.find('=') + 1)});
  }
  Options options;
  if (resolve_options(unit, {}, settings, options).kind != OptionError::Kind::none) return std::nullopt;
  return options;
}

std::vector<Configuration> configurations(const Unit& unit) {
  std::vector<Configuration> found;
  const auto add = [&](std::string text, const Options& options, bool is_model) {
    const bool known = std::any_of(found.begin(), found.end(),
                                   [&](const Configuration& one) { return one.options.values == options.values; });
    if (!known) found.push_back({std::move(text), options, is_model});
  };
  Options first;
  for (const Model& model : unit.models) {
    Options options;
    if (resolve_options(unit, model.name, {}, options).kind != OptionError::Kind::none) continue;
    if (found.empty()) first = options;
    add(std::string(model.name), options, true);
  }
  if (found.empty()) {
    (void)resolve_options(unit, {}, {}, first);
    add("defaults", first, true);
  }
  for (std::size_t i = 0; i < unit.options.size(); ++i) {
    const Option& option = unit.options[i];
    Options changed = first;
    const auto set = [&](std::int64_t value, std::string_view shown) {
      changed.values[i] = value;
      add(std::string(option.name) + "=" + std::string(shown), changed, false);
    };
    for (std::size_t k = 0; k < option.choices.size(); ++k) set(static_cast<std::int64_t>(k), option.choices[k]);
    if (!option.choices.empty()) continue;
    set(option.minimum, std::to_string(option.minimum));
    set(option.maximum, std::to_string(option.maximum));
  }
  return found;
}

Values least_arguments(const Command& command) {
  Values values;
  for (const Argument& one : command.arguments) values.push_back(one.required ? one.minimum : one.default_value);
  return values;
}

Values most_arguments(const Command& command) {
  Values values;
  for (const Argument& one : command.arguments) values.push_back(one.maximum);
  return values;
}

Values random_arguments(const Command& command, sim::Random& random) {
  Values values;
  for (const Argument& one : command.arguments) {
    const auto range = static_cast<std::uint64_t>(one.maximum) - static_cast<std::uint64_t>(one.minimum);
    const std::uint64_t where = random.below(8);
    const std::uint64_t above = range + 1 == 0 ? random.next() : random.below(range + 1);
    values.push_back(where == 0   ? one.minimum
                     : where == 1 ? one.maximum
                                  : static_cast<std::int64_t>(static_cast<std::uint64_t>(one.minimum) + above));
  }
  return values;
}

Result<Wire> encoded(const Unit& unit, const Options& options, const Command& command, Arguments values) {
  std::array<std::uint8_t, longest_encoded> request{};
  const Result<std::size_t> size = unit.encode(options, command, values, request);
  if (!size) return size.error();
  return Wire(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(*size));
}

std::string to_text(Bytes bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    for (const int nibble : {byte >> 4, byte & 15}) text += "0123456789ABCDEF"[nibble];
  }
  return text;
}

std::string to_text(const OwnedFrame& frame) {
  if (!frame.can) return to_text(Bytes(frame.bytes));
  return std::to_string(frame.can->id) + ":" + to_text(frame.can->bytes());
}

std::string to_text(const std::map<std::string, Value>& fields) {
  std::string text;
  for (const auto& [name, value] : fields) {
    text += (text.empty() ? "" : " ") + name + "=" + std::to_string(value.number);
    if (value.real != 0) text += "/" + std::to_string(value.real);
    if (!value.bytes.empty())
      text += "/" + to_text(Bytes(reinterpret_cast<const std::uint8_t*>(value.bytes.data()), value.bytes.size()));
  }
  return text.empty() ? "nothing" : text;
}

std::string to_text(Arguments values) {
  std::string text;
  for (const std::int64_t value : values) text += " " + std::to_string(value);
  return text;
}

}  // namespace absenc::kit
