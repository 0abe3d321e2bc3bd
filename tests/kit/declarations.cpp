// SPDX-License-Identifier: Apache-2.0
// Checks what a unit declares, and the requests of its commands.
#include <algorithm>
#include <array>
#include <set>

#include "tests/kit/frames.hpp"
#include "tests/kit/kit.hpp"

namespace absenc::kit {
namespace {

bool takes(const Command* command, Role role, std::uint32_t least, std::uint32_t most) {
  if (command == nullptr) return false;
  const Argument* one = find_role(command->arguments, role);
  return one != nullptr && one->minimum <= least && one->maximum >= most;
}

void declared_memory(const Unit& unit, Findings& findings) {
  const Command* reads = find_command(unit, Verb::memory_read);
  const Command* writes = find_command(unit, Verb::memory_write);
  std::uint64_t previous_end = 0;  // end of the memory area before the current one
  for (const MemoryArea& area : unit.memory) {
    const auto require = [&](bool holds, const char* text) {
      findings.require(
          holds, [&] { return "memory " + std::to_string(area.page) + "/" + std::to_string(area.first) + " " + text; });
    };
    const std::uint32_t last = area.first + area.count - 1;
    const std::uint64_t begin = std::uint64_t{area.page} << 32 | area.first;
    require(begin >= previous_end, "overlaps, or is out of order");
    previous_end = begin + area.count;
    require(area.count > 0, "is empty");
    require(area.writable || area.write_life == 0, "has a life though it cannot be written");
    for (const Command* command : {reads, writes}) {
      if (command == writes && !area.writable) continue;
      require(takes(command, Role::address, area.first, last), "is not reached by an argument of the role address");
      require(area.page == 0 || takes(command, Role::page, area.page, area.page + area.pages - 1),
              "is not reached by an argument of the role page");
      require(command == reads || takes(command, Role::value, 0, 255),
              "is not written by an argument of the role value");
      require(command == reads || area.protection.empty() || takes(command, Role::force, 1, 1),
              "is not written by an argument of the role force");
    }
  }
}

void declared_registers(const Unit& unit, Findings& findings) {
  std::set<std::string_view> names;
  for (const RegisterInfo& one : unit.registers) {
    const auto require = [&](bool holds, const char* text) {
      findings.require(holds, [&] { return "register " + std::string(one.name) + " " + text; });
    };
    require(names.insert(one.name).second, "occurs twice");
    require(one.size > 0 && (one.readable || one.writable), "is neither readable nor writable");
    for (const Verb verb : {Verb::memory_read, Verb::memory_write}) {
      const Command* command = find_command(unit, verb);
      require(takes(command, Role::address, one.address, one.address),
              "is not reached by an argument of the role address");
      require(verb == Verb::memory_read || takes(command, Role::value, 0, 255),
              "is not written by an argument of the role value");
    }
  }
  findings.require(unit.registers.empty() || unit.memory.empty(), [] { return "has bytes or registers, not both"; });
}

void declared_settings(const Unit& unit, Findings& findings) {
  for (const Command& command : unit.commands) {
    const auto require = [&](bool holds, const char* text) {
      findings.require(holds, [&] { return std::string(command.name) + " " + text; });
    };
    require(find_command(unit, command.name) == &command, "occurs twice");
    if (command.verb != Verb::config_set) {
      require(command.reads_back.empty(), "sets nothing that could be read back");
      continue;
    }
    require(command.changes_encoder, "sets something, but does not change the encoder");
    require(!command.arguments.empty(), "sets nothing");
    if (command.reads_back.empty()) continue;
    const Command* getter = find_command(unit, command.reads_back);
    require(getter != nullptr && getter->verb == Verb::config_get, "is read back by nothing");
    const bool is_option = std::any_of(unit.options.begin(), unit.options.end(),
                                       [&](const Option& one) { return one.name == command.changes_option; });
    require(command.changes_option.empty() || is_option, "changes an option that does not exist");
  }
}

// Checks that no role but Role::other occurs twice: a search by role finds only the first.
template <class Named>
void declared_once(std::span<const Named> all, std::string_view whose, Findings& findings) {
  for (const Named& one : all) {
    findings.require(one.role == Role::other || find_role(all, one.role) == &one, [&] {
      return std::string(whose) + ": " + std::string(one.name) + " has a role that another has";
    });
  }
}

// Checks that the unit declares the roles that callers of its commands search for.
void declared_roles(const Unit& unit, Findings& findings) {
  declared_once(unit.options, unit.id, findings);
  const auto has_field = [&](Role role) { return find_role(unit.fields, role) != nullptr; };
  for (const Command& command : unit.commands) {
    declared_once(command.arguments, command.name, findings);
    const auto require = [&](bool holds, const char* text) {
      findings.require(holds, [&] { return std::string(command.name) + " needs " + text; });
    };
    const auto takes_role = [&](Role role) { return find_role(command.arguments, role) != nullptr; };
    switch (command.verb) {
      case Verb::read:
        require(has_field(Role::position), "a field of the role position");
        break;
      case Verb::scan:
        require(has_field(Role::encoder), "a field of the role encoder");
        require(has_field(Role::clash), "a field of the role clash");
        require(find_role(unit.options, Role::encoder) != nullptr, "an option of the role encoder");
        break;
      case Verb::memory_read:
        require(has_field(Role::data) || has_field(Role::value), "a field of the role data or value");
        require(takes_role(Role::address), "an argument of the role address");
        break;
      case Verb::memory_write:
        require(takes_role(Role::address), "an argument of the role address");
        require(takes_role(Role::value), "an argument of the role value");
        break;
      case Verb::reset_multiturn:
        require(has_field(Role::turns), "a field of the role turns");
        break;
      default:
        break;
    }
  }
}

void request_of(const Unit& unit, const Configuration& configuration, const Command& command, const Values& values,
                Findings& findings) {
  const auto what = [&] {
    return configuration.text + ", " + std::string(command.name) + to_text(Arguments(values)) + ": ";
  };
  const Result<Wire> request = encoded(unit, configuration.options, command, values);
  if (!request) {
    const bool is_expected_error = request.error() == Error::unsupported || request.error() == Error::invalid_argument;
    return findings.require(is_expected_error, [&] { return what() + std::string(text_of(request.error()).name); });
  }
  if (request->empty()) {  // a request without bytes is possible only on a clocked link
    return findings.require(unit.link == LinkKind::clocked, [&] { return what() + "is sent without a byte"; });
  }
  Wire small(request->size() - 1);
  findings.require(unit.encode(configuration.options, command, values, small).error() == Error::buffer_too_small,
                   [&] { return what() + "fits into a buffer that is too small"; });
  ReportedFields seen;
  const Error error = unit.decode(configuration.options, frame_of(unit, *request).frame(), {}, seen);
  if (error == Error::invalid_argument) return;  // no encoder has this combination of options
  findings.require(error == Error::none && !seen.fields.empty(),
                   [&] { return what() + "is " + std::string(text_of(error).name); });
  // Any field of the decoded request may have the argument's value: the field with the argument's name may have another
  // value.
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Argument& one = command.arguments[i];
    if (!seen.fields.contains(std::string(one.name)) || (!one.required && values[i] == one.default_value)) continue;
    const bool has = std::any_of(seen.fields.begin(), seen.fields.end(),
                                 [&](const auto& field) { return field.second.number == values[i]; });
    findings.require(has, [&] { return what() + "does not contain " + std::string(one.name); });
  }
}

void refused_arguments(const Unit& unit, const Configuration& configuration, const Command& command,
                       Findings& findings) {
  std::vector<std::byte> storage(unit.host_storage);
  const auto refused = [&](const Values& values) {
    const auto what = [&] { return std::string(command.name) + to_text(Arguments(values)) + ": "; };
    const Result<Wire> request = encoded(unit, configuration.options, command, values);
    findings.require(!request && (request.error() == Error::invalid_argument || request.error() == Error::unsupported),
                     [&] { return what() + "has a request"; });
    const Any<Conversation> host = unit.host(configuration.options, command, values, storage);
    const auto is_refused = [](const auto* made) {
      return made == nullptr || (made->error() == Error::invalid_argument || made->error() == Error::unsupported);
    };
    findings.require(is_refused(host.bytes) && is_refused(host.frames), [&] { return what() + "has a conversation"; });
  };
  const Values good = least_arguments(command);
  for (std::size_t i = 0; i < good.size(); ++i) {
    const Argument& one = command.arguments[i];
    Values values = good;
    for (const bool above : {false, true}) {
      if ((above ? one.maximum : one.minimum) == (above ? INT64_MAX : INT64_MIN)) continue;
      for (const std::int64_t outside : {above ? one.maximum + 1 : one.minimum - 1, above ? INT64_MAX : INT64_MIN}) {
        values[i] = outside;
        refused(values);
      }
    }
  }
  Values more = good;
  more.push_back(0);
  refused(more);
  if (!good.empty()) refused(Values(good.begin(), good.end() - 1));
}

}  // namespace

Findings check_declarations(const Unit& unit) {
  Findings findings;
  findings.require(find_command(unit, Verb::read) != nullptr, [] { return "reads no position"; });
  const auto goes_over_spi = [](const Unit& one) { return host_clocks(one.link); };
  findings.require(unit.over_spi == nullptr || (!goes_over_spi(unit) && goes_over_spi(*unit.over_spi)),
                   [] { return "its unit over SPI has another link"; });
  for (const FieldInfo* field : {unit.alarms, unit.second_alarms}) {
    for (const FlagInfo& flag : field != nullptr ? field->flags : std::span<const FlagInfo>{}) {
      findings.require(flag.name.empty() || !(flag.meaning.empty() || flag.action.empty()),
                       [&] { return "alarm " + std::string(flag.name) + " lacks its meaning or its advice"; });
    }
  }
  declared_memory(unit, findings);
  declared_registers(unit, findings);
  declared_settings(unit, findings);
  declared_roles(unit, findings);
  return findings;
}

Findings check_requests(const Unit& unit, std::uint64_t seed) {
  Findings findings;
  sim::Random random(seed);
  for (const Configuration& configuration : configurations(unit)) {
    ReportedFields seen;
    findings.require(unit.decode(configuration.options, {}, {}, seen) != Error::none,
                     [&] { return configuration.text + ": an empty frame is accepted"; });
    for (const Command& command : unit.commands) {
      for (unsigned i = 0; i < (command.arguments.empty() ? 1 : 100); ++i) {
        request_of(unit, configuration, command, random_arguments(command, random), findings);
      }
      refused_arguments(unit, configuration, command, findings);
    }
  }
  return findings;
}

}  // namespace absenc::kit
