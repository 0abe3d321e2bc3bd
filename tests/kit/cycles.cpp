// SPDX-License-Identifier: Apache-2.0
// Checks that commands run as services beside the position requests of a drive's cycles, and use up no cycle unless
// they may.
#include <algorithm>
#include <optional>

#include "absenc/sim/place.hpp"
#include "tests/kit/drives.hpp"
#include "tests/kit/kit.hpp"

namespace absenc::kit {
namespace {

/// Result of a run of cycles, with at most one command as service.
struct Ride {
  bool is_over = false;     // whether the command has ended or was refused
  bool is_refused = false;  // whether the command was refused, because its request does not fit between two positions
  // time in nanoseconds that the request of a refused command would need between two positions
  Time needs{};
  Error error = Error::none;
  ReportedFields seen{};
  unsigned fresh = 0;
  unsigned repeated = 0;
  unsigned unanswered = 0;  // number of cycles in which the encoder did not answer
  unsigned others = 0;      // number of answered cycles that neither gave a new position nor repeated the previous one
  std::string other{};      // kind or error of the first cycle counted in `others`
  unsigned wrong = 0;       // number of cycles whose new position was not that of the shaft
  std::uint32_t violations = 0;
  std::uint32_t changes = 0;  // number of changes of the encoder's memory
};

template <class Item>
class Rides {
 public:
  Rides(const Unit& unit, const Configuration& configuration, Findings& findings)
      : unit_(unit),
        configuration_(configuration),
        findings_(findings),
        read_(*find_command(unit, Verb::read)),
        plan_(plan_for(unit, configuration)) {}

  /// Runs cycles with each command. Returns false if the configuration is not one of a drive.
  bool run() {
    const std::optional<Time> longest = time_of_position<Item>(unit_, configuration_, read_);
    if (!longest) return false;
    position_time_ = *longest;
    ride_alone();
    for (const Command& command : unit_.commands) {
      if (is_service(command)) run_service(command);
    }
    return true;
  }

 private:
  [[nodiscard]] static bool is_service(const Command& command) {
    const bool other = command.verb == Verb::read || command.verb == Verb::scan;
    // A setting that changes an option changes the form of the positions, or the address, while the cycles run.
    return !other && command.changes_option.empty();
  }

  void ride_alone() {
    plan_.period = position_time_ + position_time_ / 4;
    World<Item> world(unit_, configuration_.options, 1);
    const Ride alone = ride(world, nullptr, false);
    is_right(read_, alone, configuration_.text + ", alone: ");
    findings_.require(alone.repeated == 0, [&] { return configuration_.text + ", alone: cycles are repeated"; });
  }

  void run_service(const Command& command) {
    const Values arguments = least_arguments(command);
    std::vector<std::byte> storage(unit_.host_storage);
    auto* const made = unit_.host(configuration_.options, command, arguments, storage).template of<Item>();
    if (made == nullptr || made->streams()) return;
    World<Item> alone(unit_, configuration_.options, 1);
    alone.move(standing_place);
    alone.run(read_, {});
    const ConversationResult wanted = alone.run(command, arguments);
    if (!wanted.made || !wanted.ended || alone.device().violation_count() != 0) return;
    const auto what = [&](const char* pace) {
      return configuration_.text + ", " + std::string(command.name) + " " + pace + ": ";
    };
    // If the request of a command does not fit between two positions, the period of the cycles is extended by the time
    // that the request needs. Requests that must be alone on the line (`Step::holds_line`) are refused at any period.
    plan_.period = 2 * position_time_;
    Ride wide = ride(command, arguments, false);
    for (int i = 0; i < 4 && wide.is_refused && wide.needs < std::chrono::hours(1); ++i) {
      plan_.period = position_time_ + position_time_ / 4 + wide.needs + plan_.rest;
      wide = ride(command, arguments, false);
    }
    costs_nothing(command, wide, what("with time"));
    findings_.require(wide.is_refused || wide.error == wanted.error, [&] {
      return what("with time") + "ends with " + std::string(text_of(wide.error).name) + " instead of " +
             std::string(text_of(wanted.error).name);
    });
    if (wide.is_refused) {
      findings_.require(wide.changes == 0, [&] { return what("with time") + "refused, but the encoder has changed"; });
    } else if (!command.changes_encoder && wanted.good()) {
      findings_.require(names_of(wide.seen) == names_of(wanted.seen),
                        [&] { return what("with time") + "reports " + to_text(wide.seen.fields); });
    }
    plan_.period = position_time_ + position_time_ / 4;
    costs_nothing(command, ride(command, arguments, false), what("without time"));
    const Ride tight = ride(command, arguments, true);
    is_right(command, tight, what("taking cycles"));
    findings_.require(tight.is_over && tight.error == wanted.error, [&] {
      return what("taking cycles") +
             (tight.is_over ? "ends with " + std::string(text_of(tight.error).name) : "does not end");
    });
    took_cycles += tight.repeated;
    ++services;
  }

  [[nodiscard]] static std::vector<std::string> names_of(const ReportedFields& seen) {
    std::vector<std::string> names;
    for (const auto& [name, value] : seen.fields) names.push_back(name);
    return names;
  }

  void is_right(const Command& command, const Ride& ride, const std::string& what) {
    findings_.require(ride.wrong == 0,
                      [&] { return what + std::to_string(ride.wrong) + " positions are not the shaft's"; });
    // After a command that changes the encoder, replies may have no valid position, for example if their fields have
    // changed.
    const bool may_end_positions = command.changes_encoder && command.verb == Verb::run;
    findings_.require(ride.others == 0 || may_end_positions, [&] {
      return what + std::to_string(ride.others) + " cycles have no valid position: " + ride.other;
    });
    // An encoder that the command restarts or switches off does not answer.
    findings_.require(ride.unanswered == 0 || command.changes_encoder,
                      [&] { return what + std::to_string(ride.unanswered) + " cycles are not answered"; });
    findings_.require(ride.violations == 0, [&] { return what + "the host broke a rule: " + rule_; });
    findings_.require(ride.fresh > 3 || command.changes_encoder, [&] { return what + "hardly any cycle is fresh"; });
  }
  void costs_nothing(const Command& command, const Ride& ride, const std::string& what) {
    is_right(command, ride, what);
    findings_.require(ride.repeated == 0,
                      [&] { return what + std::to_string(ride.repeated) + " cycles are repeated"; });
    findings_.require(ride.is_over, [&] { return what + "does not end"; });
  }

  // Runs cycles with a command as their service.
  Ride ride(const Command& command, const Values& arguments, bool takes_cycles) {
    World<Item> world(unit_, configuration_.options, 1);
    std::vector<std::byte> storage(unit_.host_storage);
    auto* const conversation = unit_.host(configuration_.options, command, arguments, storage).template of<Item>();
    host::Service<Item> service(*conversation, takes_cycles);
    Ride result = ride(world, &service, command.changes_encoder);
    result.is_over = service.is_over();
    result.is_refused = service.state() == host::Service<Item>::State::refused;
    result.needs = service.needs();
    result.error = conversation->error();
    if (result.error == Error::none && !result.is_refused) conversation->report(result.seen);
    return result;
  }

  // Runs cycles until five have ended after the service; without a service, five cycles. Ends after 200 s in any
  // case.
  Ride ride(World<Item>& world, host::Service<Item>* service, bool changes) {
    world.move(standing_place);
    world.run(read_, {});
    std::vector<std::byte> storage(unit_.host_storage);
    const auto read = [&]() -> Conversation<Item>& {
      return *unit_.host(configuration_.options, read_, {}, storage).template of<Item>();
    };
    host::CyclicHost<Item, decltype(read)> host(read, plan_, world.line().now() + plan_.period);
    Ride result;
    const std::uint32_t version = world.device().memory_version();
    const std::uint32_t violations = world.device().violation_count();
    unsigned cycles = 0;
    unsigned after = 0;
    const auto on_emit = [&] {
      using Kind = host::Cycle::Kind;
      const host::Cycle& cycle = host.cycle();
      const bool is_unanswered =
          cycle.kind == Kind::missing && (cycle.error == Error::timeout || cycle.error == Error::busy ||
                                          cycle.error == Error::line_stuck || cycle.error == Error::none);
      (cycle.kind == Kind::fresh      ? result.fresh
       : cycle.kind == Kind::repeated ? result.repeated
       : is_unanswered                ? result.unanswered
                                      : result.others) += 1;
      if (result.others == 1 && result.other.empty()) {
        result.other = cycle.kind == Kind::invalid ? "invalid" : std::string(text_of(cycle.error).name);
      }
      // A command that changes the encoder may also change its position, for example to zero.
      const bool is_known = !changes || service == nullptr || service->state() == host::Service<Item>::State::waiting;
      if (cycle.kind == Kind::fresh && is_known && !sim::is_at(cycle.reading, world.place())) ++result.wrong;
      if (++cycles == 2 && service != nullptr) host.add(*service);
      if (service == nullptr || service->is_over()) ++after;
      return after < 5;
    };
    world.run(host, std::chrono::seconds(200), on_emit);
    result.violations = world.device().violation_count() - violations;
    if (!world.device().violations().empty()) rule_ = world.device().violations().back().rule;
    result.changes = world.device().memory_version() - version;
    return result;
  }

  const Unit& unit_;
  const Configuration& configuration_;
  Findings& findings_;
  const Command& read_;
  host::CyclePlan plan_;
  Time position_time_{};
  std::string rule_;

 public:
  unsigned services = 0;
  unsigned took_cycles = 0;
};

}  // namespace

Findings check_cycles(const Unit& unit) {
  Findings findings;
  unsigned services = 0;
  unsigned took = 0;
  for_each_drive(unit, [&](const Configuration& configuration) {
    const auto run = [&](auto rides) {
      const bool is_run = rides.run();
      services += rides.services;
      took += rides.took_cycles;
      return is_run;
    };
    return unit.link == LinkKind::can ? run(Rides<CanFrame>(unit, configuration, findings))
                                      : run(Rides<std::uint8_t>(unit, configuration, findings));
  });
  findings.note(std::to_string(services) + " services, which took " + std::to_string(took) + " cycles");
  return findings;
}

}  // namespace absenc::kit
