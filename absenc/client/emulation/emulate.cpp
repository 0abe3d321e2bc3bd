// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/emulate.hpp"

#include <fmt/format.h>

#include <array>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "absenc/client/emulation/attended.hpp"
#include "absenc/client/emulation/request_watch.hpp"
#include "absenc/client/emulation/rule_counter.hpp"
#include "absenc/client/emulation/serve_forever.hpp"
#include "absenc/client/error.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/host/drive.hpp"
#include "absenc/os/emulator_port.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/os/slcan_port.hpp"
#include "absenc/os/socketcan.hpp"

namespace absenc::client {

namespace {

// period of the calls of `look` (which serves other threads) while the encoder waits for a lost CAN interface
constexpr Time between_tries_to_look = std::chrono::milliseconds(20);

EncoderAddress virtual_address(std::string_view text) {
  EncoderAddress address = parse_address("sim:" + std::string(text));
  const LinkKind link = address.unit->link;
  if (!host_clocks(link)) return address;
  throw UsageError(fmt::format("{} ({}) does not go over a pseudo-terminal: open it as sim:{}", address.unit->id,
                               line_of(*address.unit), address.unit->id));
}

void require_can_alone(const Unit& unit, const EmulateChoices& choices) {
  if (unit.link != LinkKind::can) {
    throw UsageError(fmt::format("{} ({}) does not go over a CAN bus", unit.id, line_of(unit)));
  }
  if (!choices.link.empty() || choices.tcp) {
    throw UsageError(fmt::format("the interface {} is a line of its own: not with a link or TCP", choices.can));
  }
}

DeviceSettings with_faults_to_come(DeviceSettings settings) {
  settings.faults_may_come = true;
  return settings;
}

}  // namespace

struct Emulation::Running {
  Running(std::string_view text, const EmulateChoices& choices)
      : address(virtual_address(text)),
        device(*address.unit, address.options, with_faults_to_come(address.device)),
        interface(choices.can) {
    if (interface.empty()) {
      port = std::make_shared<os::EmulatorPort>(choices.link, choices.tcp);
      port->set_send_slack(send_slack);
    } else {
      require_can_alone(*address.unit, choices);
      can = open_can();
    }
    device.watch_rules(&rules);
    device.power_on(os::now());
    thread = std::jthread([this] { serve(); });
  }

  ~Running() {
    const std::lock_guard lock(mutex);
    stopped = true;
  }

  void serve() {
    try {
      if (!interface.empty()) {
        serve_on_can();
      } else if (device.frames() != nullptr) {
        os::SlcanAdapter adapter(port, address.line);
        serve_on(*device.frames(), adapter);
      } else {
        serve_on(*device.bytes(), *port);
      }
    } catch (const Cancelled&) {
    } catch (...) {
      thrown = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    stopped = true;
    changed.notify_all();
  }

  template <class Item>
  void serve_on(Machine<Item>& machine, Port<Item>& on) {
    RequestWatch<Item> watch(machine, address);
    count_requests = [&watch] { return watch.counts(); };
    Attended<Item> attended(watch, [this](Time now) { return look(now); });
    host::drive(attended, on, [] { return true; });
  }

  [[nodiscard]] std::unique_ptr<os::SocketCan> open_can() const {
    return std::make_unique<os::SocketCan>(interface, address.line);
  }

  [[noreturn]] void serve_on_can() {
    RequestWatch<CanFrame> watch(*device.frames(), address);
    count_requests = [&watch] { return watch.counts(); };
    Attended<CanFrame> attended(watch, [this](Time now) { return look(now); });
    const auto open = [this] { return can != nullptr ? std::move(can) : open_can(); };
    const auto wait = [this](Time time) {
      for (Time now = os::now(); now < time; now = os::now()) {
        look(now);
        os::sleep_until(std::min(time, now + between_tries_to_look));
      }
    };
    serve_forever(attended, open, wait, [](PortEvent, std::string_view) {});
  }

  // Executes a function that another thread has passed, if any. Throws Cancelled once `stopped` is set.
  bool look(Time now) {
    const std::lock_guard lock(mutex);
    if (stopped) throw Cancelled{};
    if (!wish) return true;
    wish(now);
    wish = nullptr;
    changed.notify_all();
    return true;
  }

  /// Runs `work` in the encoder's thread and waits for its end. Throws the exception that ended that thread, if any.
  void carry_out(const std::function<void(Time)>& work) {
    const std::lock_guard turn(wishes);
    std::unique_lock lock(mutex);
    wish = work;
    changed.wait(lock, [&] { return !wish || stopped; });
    if (!wish) return;
    if (thrown) std::rethrow_exception(thrown);
    throw Cancelled{};
  }

  template <class Ask>
  auto ask(const Ask& question) {
    decltype(question(*device.device().bytes)) answer{};
    carry_out([&](Time) {
      answer = device.device().bytes != nullptr ? question(*device.device().bytes) : question(*device.device().frames);
    });
    return answer;
  }

  EncoderAddress address;
  RuleCounter rules;
  VirtualDevice device;
  std::string interface;  // name of the CAN interface; "": the encoder is on `port` instead
  std::shared_ptr<os::EmulatorPort> port;
  std::unique_ptr<os::SocketCan> can;  // the opened CAN interface, until the encoder's thread takes it

  std::mutex wishes;  // allows only one thread at a time to pass a function to the encoder's thread
  // the mutex guards `wish` and `stopped`; `thrown` needs no guard, because it is set before `stopped`
  std::mutex mutex;
  std::condition_variable changed;
  std::function<void(Time)> wish;
  bool stopped = false;
  std::exception_ptr thrown;
  // returns the counts of requests so far; only the encoder's thread sets and calls it
  std::function<RequestCounts()> count_requests;

  std::jthread thread;  // declared last, because the thread uses all other members of this object
};

Emulation::Emulation(std::string_view text, const EmulateChoices& choices)
    : running_(std::make_unique<Running>(text, choices)) {}
Emulation::Emulation(Emulation&&) noexcept = default;
Emulation& Emulation::operator=(Emulation&&) noexcept = default;
Emulation::~Emulation() = default;

const std::string& Emulation::path() const {
  return running_->port != nullptr ? running_->port->path() : running_->interface;
}
std::uint16_t Emulation::tcp_port() const { return running_->port != nullptr ? running_->port->tcp_port() : 0; }
const Unit& Emulation::unit() const { return *running_->address.unit; }
const Options& Emulation::options() const { return running_->address.options; }

std::string Emulation::address() const {
  return fmt::format("{}:{}{}", unit().id, unit().link == LinkKind::can && running_->interface.empty() ? "slcan:" : "",
                     path());
}

void Emulation::power_off() {
  running_->carry_out([this](Time now) { running_->device.switch_off(now); });
}

void Emulation::power_on(bool real) {
  running_->carry_out([this, real](Time now) { running_->device.switch_on(now, real); });
}

void Emulation::raise_alarm(std::string_view name) {
  const std::uint32_t bits = require_alarms(unit(), running_->device.options(), std::array{std::string(name)});
  running_->carry_out([this, bits](Time) { running_->device.raise_alarms(bits); });
}

void Emulation::lower_alarm(std::string_view name) {
  const std::uint32_t bits = require_alarms(unit(), std::array{std::string(name)});
  running_->carry_out([this, bits](Time) { running_->device.lower_alarms(bits); });
}

void Emulation::set_condition(std::string_view name, std::int64_t value) {
  const Condition& condition = require_condition(unit(), name);
  static_cast<void>(require_value(condition, fmt::format("{}", value)));
  const auto index = static_cast<std::size_t>(&condition - unit().conditions.data());
  running_->carry_out([this, index, value](Time now) { running_->device.set_condition(index, value, now); });
}

void Emulation::set_fault(std::string_view kind, double rate) {
  const sim::FaultRate fault = require_fault(fmt::format("{}={}", kind, rate));
  running_->carry_out([this, fault](Time) {
    sim::FaultRates rates = running_->device.fault_rates();
    rates[fault.kind] = fault.rate;
    running_->device.set_faults(rates);
  });
}

void Emulation::clear_faults() {
  running_->carry_out([this](Time) { running_->device.set_faults({.delay = running_->device.fault_rates().delay}); });
}

std::uint64_t Emulation::fault_count(std::string_view kind) const {
  const sim::FaultKind wanted = require_fault(fmt::format("{}=0", kind)).kind;
  return running_->ask([this, wanted](const auto&) -> std::uint64_t {
    const sim::FaultCounts* const counts = running_->device.faults();
    return counts != nullptr ? (*counts)[static_cast<std::size_t>(wanted)] : 0;
  });
}

std::uint64_t Emulation::answer_count() const {
  return running_->ask([](const auto& device) { return device.answer_count(); });
}

std::uint32_t Emulation::violations() const {
  return running_->ask([](const auto& device) { return device.violation_count(); });
}

std::string Emulation::first_violation() const {
  return running_->ask([](const auto& device) {
    return std::string(device.violations().empty() ? std::string_view{} : device.violations()[0].rule);
  });
}

std::vector<RuleCount> Emulation::rule_counts() const {
  return running_->ask([this](const auto&) { return running_->rules.counts(); });
}

RequestCounts Emulation::request_counts() const {
  return running_->ask([this](const auto&) { return running_->count_requests(); });
}

}  // namespace absenc::client
